"""Whether a program does what it declares: each difference is told, and only once."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.bus.names import ActionNames, data_key
from rbxcompose.domains.programs.watch import PATIENCE, DeclaredKey, EndKind, KeyOnBus, ProgramWatch

TWIST, ODOMETRY = "geometry_msgs::msg::dds_::Twist_", "nav_msgs::msg::dds_::Odometry_"
ENDS = get_args(EndKind)
ODOM = KeyOnBus("publishes", "/odom", ODOMETRY, "RIHS01_1")
CMD_VEL = KeyOnBus("subscribes", "/cmd_vel", TWIST, "RIHS01_2")
RESET = KeyOnBus("serves", "/reset", "std_srvs::srv::dds_::Trigger_", "RIHS01_3")
ASK = KeyOnBus("calls", "/ask", "std_srvs::srv::dds_::Trigger_", "RIHS01_3")
GOAL = KeyOnBus("serves", "/wave/_action/send_goal", "a_msgs::action::dds_::Wave_SendGoal_", "RIHS01_4")
DECLARED = [
    DeclaredKey("odom", ODOM, rate=50.0),
    DeclaredKey("cmd_vel", CMD_VEL),
    DeclaredKey("reset", RESET),
    DeclaredKey("ask", ASK),
    DeclaredKey("wave", GOAL),
]
ALL = {end.key for end in DECLARED}
LATER = PATIENCE + 1.0


def watching() -> ProgramWatch:
    watch = ProgramWatch(DECLARED, {"/wave", "/dance"}, 0.0)
    watch.arrived("odom")
    return watch


def told(watch: ProgramWatch, session: set[KeyOnBus], now: float = 0.0) -> list[str]:
    return list(watch.news(watch.look(session, now)))


def test_who_does_what_he_declares_is_fine_and_its_messages_are_counted() -> None:
    status = watching().look(ALL, LATER)
    assert (status.level, status.message) == (Level.OK, "does what it declares")
    assert status.values == {"messages on odom": "1"}


@pytest.mark.parametrize(
    ("key", "words"),
    [
        (ODOM, "publishes '/other', which 'publishes' does not declare"),
        (CMD_VEL, "subscribes to '/other', which 'subscribes' does not declare"),
        (RESET, "serves '/other', which 'serves' does not declare"),
        (ASK, "calls '/other', which 'calls' does not declare"),
    ],
)
def test_what_is_not_declared_is_told_at_once_and_only_once(key: KeyOnBus, words: str) -> None:
    watch, session = watching(), {*ALL, replace(key, name="/other")}
    assert told(watch, session) == [words]
    assert watch.look(session, 1.0).level is Level.WARN
    assert told(watch, session, 1.0) == []


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("serves", "serves the action '/bow', which 'serves_actions' does not declare"),
        ("calls", "calls the action '/bow', which 'calls_actions' does not declare"),
    ],
)
def test_the_five_ends_of_an_action_are_one_thing(kind: EndKind, words: str) -> None:
    names = ActionNames.of("/bow")
    ends = {KeyOnBus(kind, getattr(names, part), "a::b::dds_::C_", "") for part in ActionNames.__slots__}
    assert told(watching(), ALL | ends) == [words]


def test_the_ends_of_an_action_that_it_calls_are_declared_with_it() -> None:
    assert told(watching(), {*ALL, replace(GOAL, kind="calls", name="/dance/_action/send_goal")}) == []


def test_another_type_and_another_version_of_it_are_told_apart() -> None:
    other = (ALL - {CMD_VEL}) | {replace(CMD_VEL, type=ODOMETRY)}
    assert told(watching(), other) == [
        "subscribes to '/cmd_vel' as nav_msgs/msg/Odometry, declared as geometry_msgs/msg/Twist"
    ]
    older = (ALL - {CMD_VEL}) | {replace(CMD_VEL, hash="RIHS01_0")}
    assert told(watching(), older) == [
        "subscribes to '/cmd_vel' with another version of geometry_msgs/msg/Twist than this robot's"
    ]


@pytest.mark.parametrize(
    ("key", "words"),
    [
        (CMD_VEL, "declares '/cmd_vel', but never subscribes to it"),
        (RESET, "declares '/reset', but never serves it"),
        (GOAL, "declares '/wave', but never serves it"),
    ],
)
def test_what_it_declares_and_does_not_have_is_told_once_it_has_had_its_time(key: KeyOnBus, words: str) -> None:
    watch = watching()
    assert told(watch, ALL - {key}, PATIENCE - 0.1) == []
    assert told(watch, ALL - {key}, LATER) == [words]
    assert told(watch, ALL - {key}, LATER + 1.0) == []
    watch.began(LATER)
    assert watch.look(ALL - {key}, LATER + 1.0).level is Level.OK


def test_a_service_is_called_when_it_is_needed() -> None:
    assert told(watching(), ALL - {ASK}, LATER) == []


def test_a_topic_with_a_rate_must_have_messages_and_one_without_a_publisher() -> None:
    silent = ProgramWatch(DECLARED, {"/wave"}, 0.0)
    assert told(silent, ALL, LATER) == ["has published nothing on '/odom' for 10 s"]
    assert told(ProgramWatch(DECLARED, {"/wave"}, 0.0), ALL - {ODOM}, LATER) == [
        "declares '/odom', but never publishes it"
    ]
    assert told(watching(), ALL - {ODOM}, LATER) == []  # what arrives needs no declared publisher
    rare = ProgramWatch([DeclaredKey("odom", ODOM)], (), 0.0)
    assert told(rare, {ODOM}, LATER) == []


def test_of_a_session_that_cannot_be_seen_only_silence_is_told() -> None:
    assert told(watching(), set(), LATER) == []
    assert told(ProgramWatch(DECLARED, (), 0.0), set(), LATER) == ["has published nothing on '/odom' for 10 s"]


@pytest.mark.parametrize(
    "name", ["/rosout", "/parameter_events", "/camera/get_parameters", "/camera/set_parameters_atomically", "/_buf/x"]
)
def test_what_every_node_of_ros_has_needs_no_declaration(name: str) -> None:
    assert told(watching(), {*ALL, replace(RESET, name=name)}) == []


@given(
    domain=st.integers(0, 200),
    name=st.from_regex(r"/[a-z][a-z0-9_]{0,8}(/[a-z][a-z0-9_]{0,8}){0,3}", fullmatch=True),
    kind=st.sampled_from(ENDS),
)
def test_a_key_is_read_as_it_is_written(domain: int, name: str, kind: EndKind) -> None:
    key = data_key(domain, name, "nav_msgs/msg/Odometry", "RIHS01_1")
    assert KeyOnBus.of(kind, key, domain) == KeyOnBus(kind, name, ODOMETRY, "RIHS01_1")
    assert KeyOnBus.of(kind, key, domain + 1) is None


@given(st.text(alphabet="ab0:/@*_", max_size=40), st.sampled_from(ENDS))
def test_any_other_key_is_none_of_its_ends(key: str, kind: EndKind) -> None:
    found = KeyOnBus.of(kind, key, 0)
    assert found is None or "::" in found.type


@given(st.lists(st.sampled_from(sorted(ALL, key=str))), st.floats(0.0, 100.0))
def test_nothing_is_ever_told_twice(parts: list[KeyOnBus], now: float) -> None:
    watch, texts = watching(), list[str]()
    for number in range(len(parts)):
        texts += told(watch, set(parts[:number]), now + number)
    assert len(texts) == len(set(texts))

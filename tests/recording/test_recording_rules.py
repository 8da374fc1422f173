"""Which topics are chosen, what they are on the bus, and when each message is due."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer
from mcap_ros2._dynamic import generate_dynamic

from rbxcompose.bus.tokens import EndpointToken, EntityKind, NodeToken
from rbxcompose.bus.wire import WIRE_PROFILES, ros_qos
from rbxcompose.msgs import cdr, registry
from rbxcompose.msgs.definitions import Structures, interface_names, type_hash
from rbxcompose.msgs.std_msgs import String
from rbxcompose.runtime.recording.reader import RecordingReader, playlist, summary_of
from rbxcompose.runtime.recording.topics import (
    Recorded,
    RecordedTopic,
    Selection,
    definition_of,
    hash_of,
    qos_of_metadata,
    qos_of_token,
    topic_of,
    why_not_replayable,
)
from rbxcompose.sdk.ports import Qos
from tests.loops import for_all
from tests.recording.samples import MAP, ODOM, SECOND, TWIST, recorded, some

HASH = "RIHS01_" + "0" * 64


def token(name: str = "/odom", dds: str = "nav_msgs::msg::dds_::Odometry_", type_hash: str = HASH) -> EndpointToken:
    return EndpointToken(NodeToken(0, "abc", 1, "base"), 2, EntityKind.PUBLISHER, name, dds, type_hash, "::,10:,:,:,,")


@pytest.mark.parametrize("qos", Qos)
def test_the_class_of_our_publishers_is_read_from_their_tokens_and_from_recordings(qos: Qos) -> None:
    assert qos_of_token(WIRE_PROFILES["jazzy"].qos_text(ros_qos(qos))) is qos
    assert qos_of_metadata(RecordedTopic("/a", "a/msg/A", "", qos).metadata()) is qos


@pytest.mark.parametrize("written", ["- durability: 1\n", "- history: 1\n  durability: transient_local\n"])
def test_recordings_of_others_tell_whether_a_topic_is_latched(written: str) -> None:
    assert qos_of_metadata({"offered_qos_profiles": written}) is Qos.LATCHED
    assert qos_of_metadata({}) is Qos.STATE


def test_a_publisher_is_a_topic() -> None:
    assert topic_of(token()) == RecordedTopic("/odom", "nav_msgs/msg/Odometry", HASH, Qos.STATE)


@given(st.text(max_size=20), st.text(max_size=40), st.text(max_size=20))
def test_tokens_of_strangers_give_a_topic_fit_for_a_key_or_none(name: str, dds: str, type_hash: str) -> None:
    found = topic_of(token(f"/{name}", dds, type_hash))
    assert found is None or not why_not_replayable(found)


@pytest.mark.parametrize("bad", [token(name="/a/*"), token(dds="nav_msgs/Odometry"), token(type_hash="**")])
def test_wildcards_and_other_names_are_no_topics(bad: EndpointToken) -> None:
    assert topic_of(bad) is None


@pytest.mark.parametrize(
    ("patterns", "classes", "taken"),
    [
        ((), (), {MAP, ODOM, TWIST}),
        (("odom",), (), {ODOM}),
        (("/odom", "m*"), (), {ODOM, MAP}),
        ((), (Qos.COMMAND,), {TWIST}),
        (("odom", "cmd_vel"), (Qos.COMMAND, Qos.LATCHED), {TWIST}),
        (("od",), (), set()),
    ],
)
def test_topics_are_chosen_by_name_and_by_class(
    patterns: tuple[str, ...], classes: tuple[Qos, ...], taken: set[RecordedTopic]
) -> None:
    selection = Selection(patterns, classes)
    assert {one for one in (MAP, ODOM, TWIST) if selection.takes(one)} == taken


@for_all("name", registry.names("msg"))
def test_every_definition_is_whole_for_an_independent_decoder(name: str) -> None:
    short = name.replace("/msg/", "/")
    decoder = generate_dynamic(short, definition_of(name))[short]
    decoded = decoder(cdr.encode(registry.message(name)()))
    fields = registry.message(name).FIELDS
    assert [field for field in fields if not hasattr(decoded, field)] == []


@for_all("name", interface_names("msg"))
def test_the_hash_of_a_type_follows_from_its_definition_alone(name: str) -> None:
    with registry.choosing({}):
        assert hash_of(name, definition_of(name)) == hash_of(name, "") == registry.message(name).HASH


def foreign(type_: str, definition: str) -> RecordedTopic:
    """A topic as a recorder of others writes it: without the hash of its type."""
    file = io.BytesIO()
    writer = Writer(file)
    writer.start(profile="ros2")
    schema = writer.register_schema(type_, "ros2msg", definition.encode())
    channel = writer.register_channel("/chatter", "cdr", schema, {"offered_qos_profiles": ""})
    writer.add_message(channel, 0, b"\0\1\0\0", 0)
    writer.finish()  # type: ignore[no-untyped-call]
    (found,) = RecordingReader(io.BytesIO(file.getvalue())).messages()
    return found.topic


def test_recordings_of_others_are_replayed_with_the_hash_of_the_definition_in_them() -> None:
    for type_ in ("std_msgs/msg/String", "std_msgs/String"):
        found = foreign(type_, "# Text.\r\nstring data\r\n")
        assert (found.type, found.hash, why_not_replayable(found)) == (String.TYPE, String.HASH, "")
    inner = f"{'=' * 80}\nMSG: odd_msgs/In\nstring<=9 text\n"
    own = {"odd_msgs/msg/Odd": "In[] in\nstd_msgs/String more\n", "odd_msgs/msg/In": "string<=9 text\n"}
    odd = foreign("odd_msgs/msg/Odd", f"{own['odd_msgs/msg/Odd']}{inner}")
    assert odd.hash == type_hash("odd_msgs/msg/Odd", Structures(own))


@pytest.mark.parametrize(
    ("type_", "definition", "why"),
    [
        ("odd_msgs/msg/Odd", "", "no definition of 'odd_msgs/msg/Odd'"),
        ("odd_msgs/msg/Odd", "In in\n", "no definition of 'odd_msgs/msg/In'"),
        ("odd_msgs/msg/Odd", "int8 a\nwstring b\n", "line 2: 'wstring' is not supported"),
        ("Odd", "int8 a\n", "'Odd' is no type of ROS 2"),
    ],
)
def test_a_recorded_type_without_a_hash_is_refused_with_the_reason(type_: str, definition: str, why: str) -> None:
    assert why in why_not_replayable(foreign(type_, definition))


def test_a_type_of_which_nothing_is_known_has_no_definition() -> None:
    assert definition_of("odd_msgs/msg/Odd") == ""
    assert definition_of("nonsense") == ""


def test_messages_come_at_their_intervals_and_faster_or_slower_if_wanted() -> None:
    messages = some(20)
    usual = [due for due, _ in playlist(messages)]
    assert usual[:4] == pytest.approx([0.0, 0.0, 0.01, 0.1])
    assert [due for due, _ in playlist(messages, rate=2.0)] == pytest.approx([due / 2 for due in usual])
    assert [message for _, message in playlist(messages)] == messages


def test_a_replay_from_the_middle_begins_with_what_is_latched() -> None:
    messages = [recorded(MAP, String(data="older"), 0.0), *some(20)]
    played = list(playlist(messages, start=1.0))
    assert played[0] == (0.0, messages[1])
    assert [due for due, _ in played[1:4]] == pytest.approx([0.0, 0.01, 0.1])
    assert all(message.topic is not MAP for _, message in played[1:])


@given(st.lists(st.integers(0, 10**12), max_size=30), st.floats(0.01, 100), st.floats(0, 100))
def test_a_schedule_never_runs_backwards(times: list[int], rate: float, start: float) -> None:
    messages = [Recorded(ODOM, time, time, 0, b"") for time in times]
    due = [due for due, _ in playlist(messages, rate=rate, start=start)]
    assert due == sorted(due)
    assert all(one >= 0 for one in due)


def test_a_summary_tells_counts_and_duration() -> None:
    summary = summary_of(some(20))
    assert summary.counts == {MAP: 1, ODOM: 20, TWIST: 20}
    assert summary.messages == 41
    assert summary.end - summary.start == round(1.91 * SECOND)
    assert summary.duration == pytest.approx(1.91)

"""Files of muxes become muxes that follow the rules of their program."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.compiler.plan.model import Instance
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.std_msgs import Bool
from rbxcompose.testing import Bench, check_text
from rbxcompose.testing.golden import Golden
from tests.importing.imports import EXAMPLES, Imported, import_files, import_texts
from tests.loops import for_all

GOLDEN = {"lists": ["topics", "locks"], "maps": ["ros2"], "yocs": ["yocs"]}


def mux(folder: Path, *texts: str) -> Imported:
    return import_texts(folder, *texts, program="mux")


def files(name: str) -> Imported:
    return import_files([EXAMPLES / f"mux/{text}.yaml" for text in GOLDEN[name]], name, "mux")


@pytest.mark.parametrize("name", GOLDEN)
def test_what_is_written_and_what_is_told(name: str, repository: Path, golden: Golden, tmp_path: Path) -> None:
    found = files(name)
    golden.check(f"mux_{name}.yaml", found.text)
    golden.check(f"mux_{name}.txt", found.words)
    assert check_text(found.text, tmp_path).plan.robot == name


class TwistMux:
    """The rules of twist_mux, as its source has them: what passes when a message comes in."""

    def __init__(self, topics: Mapping[str, Any], locks: Mapping[str, Any]) -> None:
        self.topics, self.locks = topics, locks
        self.heard: dict[str, float] = {}
        self.flags: dict[str, bool] = {}

    def is_over(self, entry: Mapping[str, Any], now: float) -> bool:
        timeout = float(entry["timeout"])
        return timeout > 0 and now - self.heard.get(entry["topic"], -math.inf) > timeout

    def passes(self, topic: str, now: float) -> bool:
        locked = [
            lock["priority"]
            for lock in self.locks.values()
            if self.is_over(lock, now) or self.flags.get(lock["topic"], False)
        ]
        best, who = 0, ""
        for entry in self.topics.values():
            if (
                not self.is_over(entry, now)
                and entry["priority"] >= max(locked, default=0)
                and best < entry["priority"]
            ):
                best, who = entry["priority"], entry["topic"]
        return who == topic


TOPICS = {
    "web": {"topic": "web_vel", "timeout": 0.4, "priority": 20},
    "joy": {"topic": "joy_vel", "timeout": 0.5, "priority": 100},
    "plan": {"topic": "plan_vel", "timeout": 0.7, "priority": 10},
    "never": {"topic": "zero_vel", "timeout": 0.5, "priority": 0},
    "dock": {"topic": "dock_vel", "timeout": 0.5, "priority": 20},
}
LOCKS = {
    "pause": {"topic": "pause", "timeout": 0.0, "priority": 50},
    "stop": {"topic": "stop", "timeout": 0.3, "priority": 255},
}
SENDERS = [topic["topic"] for topic in (*TOPICS.values(), *LOCKS.values())]


@pytest.fixture(scope="module")
def imported_mux(tmp_path_factory: pytest.TempPathFactory) -> Instance:
    folder = tmp_path_factory.mktemp("mux")
    found = mux(folder, *(_listed(key, ones) for key, ones in (("topics", TOPICS), ("locks", LOCKS))))
    [made] = [instance for instance in check_text(found.text, folder).plan.instances if instance.type == "mux"]
    return made


def _listed(key: str, ones: Mapping[str, Any]) -> str:
    return f"{key}:\n" + "".join(f"- {{name: {name}, {str(entry)[1:-1]}}}\n" for name, entry in ones.items())


STORY = st.lists(st.tuples(st.sampled_from(SENDERS), st.integers(0, 5), st.booleans()), max_size=30)


@given(STORY)
def test_what_passes_is_what_passed_before(imported_mux: Instance, story: list[tuple[str, int, bool]]) -> None:
    bench, before = Bench(imported_mux), TwistMux(TOPICS, LOCKS)
    out = bench.collect("/cmd_vel", Twist)
    expected = []
    for number, (topic, tenths, is_on) in enumerate(story, 1):
        bench.advance(tenths / 10 + 0.003)  # never just at a timeout
        now = bench.clock.now()
        before.heard[topic] = now
        if topic in ("pause", "stop"):
            before.flags[topic] = is_on
            bench.publish(f"/{topic}", Bool(data=is_on))
            continue
        message = Twist(linear=Vector3(x=float(number)))
        bench.publish(f"/{topic}", message)
        expected += [message] if before.passes(topic, now) else []
    assert out == expected


def test_topics_and_locks_in_two_files_are_one_mux_and_two_nodes_are_two(tmp_path: Path) -> None:
    text = "topics: [{name: a, topic: a, timeout: 1, priority: 1}]\n"
    assert list(mux(tmp_path, text, "locks: [{name: b, topic: b, timeout: 1, priority: 2}]\n").data["muxes"]) == [
        "cmd_vel"
    ]
    two = "front: {ros__parameters: {topics: {a: {topic: a, timeout: 1, priority: 1}}}}\n"
    found = mux(tmp_path, two, two.replace("front", "back"))
    assert list(found.data["muxes"]) == ["cmd_vel", "cmd_vel_2"]


@pytest.mark.parametrize(
    ("text", "profile"),
    [
        ("twist_mux:\n  topics: [{name: a, topic: b, timeout: 1, priority: 2}]\n", "twist_mux"),
        ("lab: {mux: {topics: [{name: a, topic: b, timeout: 1, priority: 2}]}}\n", "twist_mux"),
        ("/lab/mux: {ros__parameters: {topics: {a: {topic: b, timeout: 1, priority: 2}}}}\n", "twist_mux"),
        ("m: {ros__parameters: {topics.a.topic: b, topics.a.timeout: 1, topics.a.priority: 2}}\n", "twist_mux"),
        ("cmd_vel_mux: {subscribers: [{name: a, topic: b, timeout: 1, priority: 2}]}\n", "yocs"),
        ("m: {ros__parameters: {subscribers: {a: {topic: b, timeout: 1, priority: 2}}}}\n", "yocs"),
    ],
)
def test_muxes_are_found_wherever_ros_keeps_them(text: str, profile: str, tmp_path: Path) -> None:
    found = mux(tmp_path, text)
    [made] = found.data["muxes"].values()
    assert made == {"profile": profile, "inputs": {"a": {"topic": "b", "timeout": "1 s", "priority": 2}}}
    assert [code for code, _ in found.told] == ["RBX2295"]


ENTRY = "topics:\n- {name: b, topic: b, timeout: 1, priority: 1}\n"
WRONG = {
    "a list": ("[1, 2]\n", "RBX2231", 1),
    "another program": ("pub_rate: 1\n", "RBX2231", 1),
    "nothing": ("locks: []\n", "RBX2238", 0),
    "no topic": (f"{ENTRY}- {{name: a, timeout: 1, priority: 1}}\n", "RBX1002", 3),
    "no name": (f"{ENTRY}- {{topic: a, timeout: 1, priority: 1}}\n", "RBX1002", 3),
    "a word": (f"{ENTRY}- joystick\n", "RBX1003", 3),
    "misspelt": (f"{ENTRY}- {{name: a, topic: a, timeout: 1, priorty: 1, priority: 2}}\n", "RBX1001", 3),
    "a priority in words": (f"{ENTRY}- {{name: a, topic: a, timeout: 1, priority: high}}\n", "RBX1003", 3),
    "twice": (f"{ENTRY}- {{name: b, topic: a, timeout: 1, priority: 3}}\n", "RBX2232", 3),
    "another key": (f"{ENTRY}topcs: 1\n", "RBX1001", 3),
    "a topic that cannot be": (f"{ENTRY}- {{name: a, topic: Joy-Vel, timeout: 1, priority: 3}}\n", "RBX2294", 3),
    "less than no time": ("subscribers:\n- {name: a, topic: a, timeout: -1, priority: 3}\n", "RBX1005", 2),
    "stamped": ("use_stamped: true\n" + ENTRY, "RBX2230", 1),
    "another node": ("a: {ros__parameters: {b: 1}}\nm:\n  ros__parameters: {topics: {}}\n", "RBX2230", 1),
}


@for_all("name", WRONG)
def test_what_is_wrong_is_told_at_its_place(name: str, tmp_path: Path) -> None:
    text, code, line = WRONG[name]
    assert (code, line) in mux(tmp_path, text).told


WORDS = st.sampled_from(["a", "A b", "cmd_vel", "active", "lock_a", "~x", "/é/y", "", "9", "$x"])
ENTRIES = st.lists(
    st.fixed_dictionaries(
        {"name": WORDS, "topic": WORDS, "timeout": st.floats(-1, 5), "priority": st.integers(-3, 300)},
        optional={"more": st.none()},
    ),
    max_size=4,
)


@given(ENTRIES, ENTRIES, st.booleans())
def test_whatever_a_file_says_what_is_written_can_be_read(
    tmp_path_factory: pytest.TempPathFactory, inputs: list[Any], locks: list[Any], is_yocs: bool
) -> None:
    folder = tmp_path_factory.mktemp("any")
    texts = [f"subscribers: {inputs}\n"] if is_yocs else [f"topics: {inputs}\n", f"locks: {locks}\n"]
    found = mux(folder, *(text.replace("None", "null") for text in texts))
    if found.text:
        told = set(check_text(found.text, folder).codes)
        assert not told & {"RBX1001", "RBX1002", "RBX1003", "RBX1004", "RBX1005", "RBX1102", "RBX3130", "RBX3138"}


def test_two_topics_stay_two_also_if_one_cannot_keep_its_name(tmp_path: Path) -> None:
    topics = {"a": "joy-vel", "b": "joy_vel", "c": "/Joy_Vel", "d": "/joy-vel"}
    entries = [f"{{name: {name}, topic: {topic}, timeout: 0.5, priority: 1}}" for name, topic in topics.items()]
    found = mux(tmp_path, f"topics: [{', '.join(entries)}]\n")
    [made] = found.data["muxes"].values()
    assert [one["topic"] for one in made["inputs"].values()] == ["joy_vel_2", "joy_vel", "/joy_vel_3", "/joy_vel_2"]
    assert "the topic 'joy-vel' becomes 'joy_vel_2'" in found.words

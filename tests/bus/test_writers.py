from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus.graph import SILENCE, TopicReader, Writers
from rbxcompose.bus.names import dds_type
from rbxcompose.bus.tokens import EntityKind, NodeToken
from rbxcompose.msgs.std_msgs import Float32, String

HERE, THERE = "a1", "b2"
READER = TopicReader("charger", ("/level", Float32.TYPE), Float32.HASH, -math.inf, expects_speech=True)


def token(
    name: str = "battery",
    type_: str = Float32.TYPE,
    type_hash: str = Float32.HASH,
    session: str = THERE,
    kind: EntityKind = EntityKind.PUBLISHER,
) -> str:
    return NodeToken(0, session, 1, name).endpoint_key(kind, 2, "/level", dds_type(type_), type_hash, "::,10:,:,:,,")


def told(key: str, reader: TopicReader = READER, now: float = 2 * SILENCE, started: float = 0.0) -> str:
    writers = Writers(HERE)
    writers.apply(key, 1.0, is_there=True)
    return writers.trouble(reader, now, started)


def test_a_publisher_that_is_there_and_silent_is_named_with_who_waits_for_it() -> None:
    assert told(token()) == "'charger' has received nothing on /level for 9 s, though 'battery' publishes it"


def test_another_version_of_the_type_is_told_at_once() -> None:
    text = told(token(type_hash="RIHS01_0"), now=1.0)
    assert text == f"'battery' publishes another version of {Float32.TYPE} on /level than 'charger' reads"


def test_another_type_is_told_at_once() -> None:
    text = told(token(type_=String.TYPE, type_hash=String.HASH), now=1.0)
    assert text == f"'battery' publishes {String.TYPE} on /level, 'charger' reads {Float32.TYPE}"


@pytest.mark.parametrize(
    "reader",
    [
        TopicReader("charger", READER.route, Float32.HASH, 1.0, expects_speech=True),
        TopicReader("charger", READER.route, Float32.HASH, -math.inf, expects_speech=False),
        TopicReader("charger", ("/other", Float32.TYPE), Float32.HASH, -math.inf, expects_speech=True),
    ],
    ids=["heard", "nothing is expected", "another topic"],
)
def test_who_has_no_reason_to_complain_says_nothing(reader: TopicReader) -> None:
    assert told(token(), reader) == ""


@pytest.mark.parametrize("key", [token(session=HERE), token(kind=EntityKind.SUBSCRIPTION), "@ros2_lv/nonsense"])
def test_only_publishers_of_other_processes_count(key: str) -> None:
    assert told(key) == ""


def test_silence_counts_from_when_both_are_there_and_the_robot_has_started() -> None:
    assert told(token(), now=1.0 + SILENCE) == ""
    assert told(token(), now=1.1 + SILENCE)
    assert told(token(), now=3.0 + SILENCE, started=3.0) == ""
    assert told(token(), replace(READER, begun=3.0), now=3.0 + SILENCE) == ""
    assert told(token(), replace(READER, begun=3.0), now=3.1 + SILENCE)


def test_a_publisher_that_comes_back_must_be_heard_again() -> None:
    writers, spoken = Writers(HERE), TopicReader("charger", READER.route, Float32.HASH, 2.0, expects_speech=True)
    writers.apply(token(), 1.0, is_there=True)
    assert writers.trouble(spoken, 50.0, 0.0) == ""
    writers.apply(token(), 50.0, is_there=False)
    assert writers.trouble(spoken, 60.0, 0.0) == ""
    writers.apply(token(), 60.0, is_there=True)
    assert writers.trouble(spoken, 61.0 + SILENCE, 0.0)


def test_the_only_message_of_a_latched_topic_may_come_while_the_robot_starts() -> None:
    for arrived, is_told in ((0.9, False), (-math.inf, True), (-10.0, True)):
        writers = Writers(HERE)
        reader = TopicReader("charger", READER.route, Float32.HASH, arrived, expects_speech=True, is_latched=True)
        writers.apply(token(), 1.0, is_there=True)
        assert bool(writers.trouble(reader, 60.0, 3.0)) is is_told


def test_the_only_message_of_a_latched_topic_counts_when_a_cut_link_brings_its_publisher_back() -> None:
    reader = TopicReader("charger", READER.route, Float32.HASH, 1.0, expects_speech=True, is_latched=True)
    writers = Writers(HERE)
    for time, is_there in ((1.0, True), (50.0, False), (60.0, True)):
        writers.apply(token(), time, is_there=is_there)
    assert writers.trouble(reader, 100.0, 0.0) == ""
    writers.apply(token(), 100.0, is_there=False)
    writers.apply(token(session="c3"), 101.0, is_there=True)
    assert writers.trouble(reader, 200.0, 0.0), "another process, whose message has not come"


@given(st.text() | st.sampled_from([token(), "@ros2_lv/0/b2/1/2/MP/%/%/x/%level/a/b/c"]), st.booleans())
def test_no_token_breaks_it(key: str, is_there: bool) -> None:
    writers = Writers(HERE)
    writers.apply(key, 0.0, is_there=True)
    writers.apply(key, 0.0, is_there=is_there)
    assert isinstance(writers.trouble(READER, 100.0, 0.0), str)

from __future__ import annotations

import socket

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.runtime import channel as say
from rbxcompose.runtime.channel import MESSAGES, Channel
from rbxcompose.sdk.component import MissionOver

NAMES = st.lists(st.text(), max_size=4)
SOME: st.SearchStrategy[say.ChannelMessage] = st.one_of(
    st.builds(say.Configure, st.none() | st.text()),
    st.builds(say.Activate, NAMES),
    st.just(say.Start()),
    st.builds(say.Lost, NAMES, st.text()),
    st.builds(say.Ask, st.integers(), st.text(), st.dictionaries(st.text(), st.text() | st.integers())),
    st.builds(say.States, st.dictionaries(st.text(), st.tuples(st.text(), st.integers()))),
    st.builds(MissionOver, st.text(), st.text(), st.text()),
    st.builds(say.Summary, st.floats(0, 1e9), st.dictionaries(st.text(), st.dictionaries(st.text(), st.text()))),
    st.builds(say.Alive, st.floats(0, 1e9)),
)


def pair() -> tuple[Channel, Channel]:
    ours, theirs = socket.socketpair()
    return Channel(ours), Channel(theirs)


@given(SOME)
def test_a_message_is_one_line_and_comes_back_as_it_was(message: say.ChannelMessage) -> None:
    line = MESSAGES.to_line(message)
    assert line.count(b"\n") == 1
    assert MESSAGES.from_line(line) == message


def test_messages_come_in_order_however_they_are_bundled() -> None:
    ours, theirs = pair()
    for number in range(100):
        ours.send(say.Alive(float(number)))
    assert theirs.receive() == [say.Alive(float(number)) for number in range(100)]
    ours.close()
    theirs.close()


def test_a_peer_that_does_not_read_blocks_nobody_and_hears_all_later() -> None:
    ours, theirs = pair()
    words = ["x" * 10_000] * 60
    for _ in range(1 + len(words)):
        ours.send(say.Activate(words[:1]))
    heard: list[say.ChannelMessage] = []
    while len(heard) < 1 + len(words):
        heard += theirs.receive()
        ours.flush()
    assert set(map(str, heard)) == {str(say.Activate(words[:1]))}
    ours.close()
    theirs.close()


def test_last_words_are_heard_before_the_end() -> None:
    ours, theirs = pair()
    ours.send(say.Start())
    ours.close()
    assert theirs.receive() == [say.Start()]
    assert not theirs.is_open
    theirs.close()


def test_sending_to_one_who_has_gone_is_no_mistake() -> None:
    ours, theirs = pair()
    theirs.close()
    ours.send(say.Start())
    ours.send(say.Start())
    assert not ours.is_open
    ours.close()

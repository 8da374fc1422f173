"""Whom to ask: a silent servo is skipped, probed now and then, and never delays the others for long."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.dynamixel_bus import Attention

IDS = [1, 2, 3, 4]
PERIOD = 0.01  # [s] of a cycle


@given(st.lists(st.sets(st.sampled_from(IDS)), max_size=200))
def test_who_answers_is_always_asked_and_at_most_one_probe_is(cycles: list[set[int]]) -> None:
    attention = Attention()
    for number, mute in enumerate(cycles):
        now = number * PERIOD
        asked = attention.due(IDS, now)
        talking = [one for one in IDS if not attention.is_silent(one)]
        assert sorted(asked[: len(talking)]) == talking
        assert len(asked) - len(talking) <= 1
        for one in asked:
            if one in mute:
                attention.missed(one, now, is_corrupt=False)
            else:
                attention.answered(one, now)


def test_a_mute_servo_is_asked_thrice_then_ten_times_a_second_and_again_when_it_answers() -> None:
    attention = Attention()
    asked = 0
    for number in range(200):
        if 2 in attention.due(IDS, number * PERIOD):
            attention.missed(2, number * PERIOD, is_corrupt=False)
            asked += 1
    assert asked == 21
    attention.answered(2, 2.0)
    assert attention.due(IDS, 2.01) == IDS
    known = attention.statistics[2]
    assert (known.timeouts, known.reads, known.last_seen) == (21, 1, 2.0)


def test_a_doubtful_servo_is_asked_after_the_others() -> None:
    attention = Attention()
    attention.missed(1, 0.0, is_corrupt=True)
    assert attention.due(IDS, 0.01) == [2, 3, 4, 1]
    assert attention.statistics[1].errors == 1


def test_each_silent_servo_has_its_turn_to_be_probed() -> None:
    attention = Attention(patience=1)
    for number in IDS:
        attention.missed(number, 0.0, is_corrupt=False)
    probed = [one for number in range(1, 400) for one in attention.due(IDS, number * PERIOD)]
    assert set(probed) == set(IDS)
    attention.forgive()
    assert attention.due(IDS, 5.0) == IDS

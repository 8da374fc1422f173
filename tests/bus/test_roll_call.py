"""A process that others reach and this one does not is missed after a while, and by one of the two only."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.runtime.process_group.connection import CALLS, MOST_CALLS, PeerCheck, roll_key

NAMES = ("mission", "robot", "router", "world")
Reaches = Callable[[str, str, int], bool]


def rounds(reaches: Reaches, count: int, names: tuple[str, ...] = NAMES) -> dict[str, list[int]]:
    """Return by process at which calls its session is opened again; `reaches(one, other, call)` says who hears whom."""
    rolls, opened = {name: PeerCheck(name) for name in names}, {name: list[int]() for name in names}
    for call in range(count):
        for name in names:
            heard = [rolls[other].answer for other in names if other == name or reaches(name, other, call)]
            if rolls[name].judge(heard):
                opened[name].append(call)
    return {name: calls for name, calls in opened.items() if calls}


def without(*pair: str) -> Reaches:
    return lambda one, other, call: {one, other} != {*pair}


def test_processes_that_reach_each_other_are_left_alone() -> None:
    assert rounds(lambda *_: True, 50) == {}


@given(st.sampled_from(NAMES), st.integers(0, 20), st.integers(1, 30))
def test_so_are_those_one_of_which_dies_and_comes_back(name: str, died: int, length: int) -> None:
    assert rounds(lambda one, other, call: name not in (one, other) or not died <= call < died + length, 60) == {}


@given(st.permutations(NAMES), st.integers(0, 9))
def test_of_two_that_have_lost_their_link_the_first_by_name_opens_its_session_again(
    names: list[str], lost: int
) -> None:
    first, second = sorted(names[:2])
    opened = rounds(lambda one, other, call: call < lost or {one, other} != {first, second}, lost + CALLS + 2)
    assert [*opened] == [first]


def test_the_other_does_if_that_does_not_help() -> None:
    assert [*rounds(without("robot", "world"), 2 * CALLS + 2)] == ["robot", "world"]


def test_what_does_not_help_is_tried_ever_more_seldom() -> None:
    calls = rounds(without("robot", "world"), 1000)["robot"]
    pauses = [after - before for before, after in pairwise(calls)]
    assert pauses == sorted(pauses)
    assert pauses[-1] == MOST_CALLS


@given(st.binary(max_size=40))
def test_answers_of_other_versions_do_not_count(answer: bytes) -> None:
    roll = PeerCheck("robot")
    assert not any(roll.judge([answer, roll.answer]) for _ in range(2 * CALLS))


@pytest.mark.parametrize("answer", [b'["world", 1]', b'["world", [1, {}]]', b"[]", b"[" * 100_000, b""])
def test_nor_do_malformed_ones(answer: bytes) -> None:
    assert not any(PeerCheck("robot").judge([answer]) for _ in range(2 * CALLS))


def test_hosts_call_the_roll_apart() -> None:
    assert len({roll_key("scout", ""), roll_key("scout", "r"), roll_key("scout", "d")}) == 3

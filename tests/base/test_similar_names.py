"""What was probably meant is found among few names, and among thousands within no time."""

from __future__ import annotations

import difflib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import MOST_COMPARED, nearest, one_compile, suggest

MANY = [f"battery_{number}" for number in range(50 * MOST_COMPARED)]


@pytest.mark.parametrize("slip", ["chargr", "chharger", "chasger", "hcarger", "charger"])
def test_one_slip_is_found_among_thousands_as_among_few(slip: str) -> None:
    assert nearest(slip, ["charger", "base", "go_to"]) == nearest(slip, ["charger", *MANY]) == ["charger"]


def test_among_thousands_what_is_far_away_is_listed_only() -> None:
    listed = ", ".join(f"battery_{number}" for number in range(7))
    assert suggest("carger_two", ["charger", *MANY], "components") == f"components: charger, {listed} and 4993 more"


KEYS = ("model", "serial", "baud", "watchdog", "noise", "seed", "twin", "rate", "turn_rate", "max_turn_rate")


@pytest.mark.parametrize(
    ("name", "first"),
    [
        ("turn_velocity", ["turn_rate", "max_turn_rate"]),  # they share a word with it
        ("baudrate_of_the_line", ["baud"]),
        ("quick", ["model", "serial", "baud"]),  # nothing is like it: they keep their order
    ],
)
def test_valid_names_are_listed_by_likeness_and_then_as_they_were_given(name: str, first: list[str]) -> None:
    listed = suggest(name, KEYS, "keys").removeprefix("keys: ").removesuffix(" and 2 more").split(", ")
    assert listed[: len(first)] == first


def test_a_set_has_no_order_so_its_names_are_listed_by_the_alphabet() -> None:
    assert suggest("xyz", frozenset({"dock", "base", "arm"})) == "valid names: arm, base, dock"


@given(st.text(max_size=100), st.lists(st.text(max_size=20), max_size=5))
def test_a_name_that_is_there_is_nearest_to_itself(name: str, others: list[str]) -> None:
    if name:
        assert nearest(name, [name, *others]) == nearest(name, [name, *others, *MANY[:200]]) == [name]


def test_a_compile_stops_guessing_after_much_work_and_the_next_starts_anew() -> None:
    others = [f"battery_{number:02}_{'a' * 40}" for number in range(MOST_COMPARED)]
    for _ in range(2):
        with one_compile():
            helps = [suggest(f"batery_{number}_{'a' * 40}", others) for number in range(1000)]
        assert helps[0].startswith("did you mean")
        assert helps[-1] == ""
    assert suggest(f"batery_1_{'a' * 40}", others) == suggest(f"batery_1_{'a' * 40}", others) == helps[1]


@given(st.text("abc_", max_size=12), st.sets(st.text("abc_", max_size=12), max_size=8), st.integers(1, 3))
def test_what_is_near_is_what_difflib_tells(name: str, others: set[str], most: int) -> None:
    assert nearest(name, others, most=most) == difflib.get_close_matches(name, sorted(others), n=most)


def test_of_equally_similar_names_the_one_that_looks_the_same_comes_first() -> None:
    assert suggest("corner_l", ["corner_1", "corner_2", "corner_4"]) == "did you mean 'corner_1'?"


@pytest.mark.parametrize(("name", "other"), [("gripper", "upper"), ("hand", "head"), ("arm", "aim_2"), ("tip", "lift")])
def test_a_name_that_differs_in_more_than_a_slip_is_no_guess(name: str, other: str) -> None:
    assert suggest(name, [other, "base"], "links") == f"links: {other}, base"


@pytest.mark.parametrize(
    ("name", "other"),
    [
        *[("griper", "gripper"), ("haed", "head"), ("hands", "hand"), ("uper", "upper"), ("baudrate", "baud")],
        *[("GO_TO", "go_to"), ("Wrist", "wrist")],
    ],
)
def test_one_slip_a_common_word_or_letters_of_another_case_are_one(name: str, other: str) -> None:
    assert suggest(name, [other, "base"], "links") == f"did you mean '{other}'?"

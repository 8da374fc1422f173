"""Slips of people who never wrote a program: each is told once, with what to do in plain words."""

from __future__ import annotations

import re

import pytest

from rbxcompose.commands.formats.text import render_text
from rbxcompose.missions.slips.values import NUMBERS
from rbxcompose.testing.golden import Golden
from tests.loops import for_all
from tests.missions.test_slips import FILE, cured, report_of

DRIVE = "        do:\n          go_to: dock\n"
MACHINE = f"  machine:\n    start: away\n    states:\n      away:\n{DRIVE}        next:\n          success: lost\n"
LOST = f"do:\n{MACHINE}          failure: failed\n"
ROUND = "do:\n  for: room\n  in: {}\n  do:\n    go_to: $room\n"
LOW = "interrupts:\n  low:\n    when: $battery < 20 %\n    do: recharge\n    afterwards: {}\n"
SET = "data:\n  reached: 0\ndo:\n  - set:\n      {}\n"
HOOK = "data:\n  reached: 0\ndo:\n  go_to: dock\n  {}:\n    {}\n"
PARALLEL = "do:\n  parallel:\n    drive:\n      go_to: dock\n    talk:\n      say: hello\n    {}\n"
HOME = (
    "machine:\n  start: away\n  states:\n    away:\n      do: recharge\n      next:\n        success: {0}\n"
    "        failure: {0}\n    go home:\n      do: recharge\n      next:\n        success: finished\n"
    "        failure: {0}\n"
)
SLIPS = {
    "a list without brackets": ROUND.format("dock, corner_1, kitchen"),
    "a list in round brackets": ROUND.format("(dock, kitchen)"),
    "restart and its name in one line": LOW.format("restart room") + ROUND.format("[dock, kitchen]"),
    "an outcome in the line of next": f"do:\n{MACHINE}".replace(
        "next:\n          success: lost", "next: success: finished"
    ),
    "a step without a dash": "do:\n  - go_to: dock\n  recharge\n  - go_to: kitchen\n",
    "a step without dash and colon": "do:\n  - go_to: dock\n  say hello\n",
    "a dash below a hook": HOOK.format("on_success", "- set:\n        reached: $reached + 1"),
    "a list below a hook": HOOK.format("on_success", "- log: one\n    - log: two"),
    "set with an equals sign": SET.format("reached = $reached + 1"),
    "set with a colon and no space": SET.format("reached:$reached + 1"),
    "set in one line": SET.format("").replace(":\n      \n", ": reached = 3\n"),
    "set with two equals signs": SET.format("reached = 1\n      rounds = 2"),
    "ends two columns too far left": f"{LOST}  ends:\n    lost: failure\n",
    "ends at the very left": f"{LOST}ends:\n  lost: failure\n",
    "ends_with among the branches": PARALLEL.format("ends_with: drive"),
    "a sequence without dashes": "do:\n  sequence:\n    go_to: dock\n    say: hello\n    recharge:\n",
    "a sequence of words": "do:\n  sequence:\n    recharge\n    talk\n",
    "a key too far left": ROUND.format("[dock, kitchen]").replace("  in:", "in:"),
    "a key too far left in a list": "do:\n  - for: room\n  in: [dock, kitchen]\n    do:\n      go_to: $room\n",
    "a key in the column of a dash": "do:\n  - for: room\n  in: [dock, kitchen]\n  do:\n    go_to: $room\n",
    "a state of two words": HOME.format("home"),
    "a number in words": "do:\n  go_to: dock\n  attempts: two\n",
    "a number with a word behind it": "do:\n  repeat: 3 times\n  do:\n    go_to: dock\n",
    "a question in next": (
        "machine:\n  start: rest\n  states:\n    rest:\n      do:\n        wait: 1 s\n      next:\n"
        "        if: $battery > 50 %\n        then: rest\n        else: finished\n"
    ),
    "a step below a hook": HOOK.format("on_failure", "say: I cannot get there"),
    "a step in the line of a hook": HOOK.format("on_start", "recharge"),
}


def test_every_slip_is_told_with_what_to_do(golden: Golden) -> None:
    told = (f"## {name}\n{render_text(report_of(text), {FILE: text})}" for name, text in SLIPS.items())
    golden.check("beginner_slips.txt", "".join(told))


@for_all("name", [name for name in SLIPS if name != "a list below a hook"])
def test_a_slip_has_no_consequences_that_are_told_as_well(name: str) -> None:
    assert len(report_of(SLIPS[name]).findings) == 1


@for_all("name", SLIPS)
def test_what_to_do_is_said_without_words_of_programmers(name: str) -> None:
    for finding in report_of(SLIPS[name]):
        assert finding.help
        assert not re.search(r"\b(map|mapping|node|datum|expression)\b", f"{finding.message} {finding.help}")


@for_all(
    "name, wrong, right",
    [
        ("a list without brackets", "dock, corner_1, kitchen", "[dock, corner_1, kitchen]"),
        ("a list in round brackets", "(dock, kitchen)", "[dock, kitchen]"),
        ("restart and its name in one line", "afterwards: restart room", "afterwards:\n      restart: room"),
        ("a step without a dash", "  recharge", "  - recharge"),
        ("a dash below a hook", "    - set", "      set"),
        ("set with an equals sign", "reached = $", "reached: $"),
        ("set with a colon and no space", "reached:$", "reached: $"),
        ("ends_with among the branches", "    ends_with", "  ends_with"),
        ("a number in words", "two", "2"),
    ],
)
def test_a_slip_that_can_mean_one_thing_only_is_cured(name: str, wrong: str, right: str) -> None:
    assert cured(SLIPS[name]) == SLIPS[name].replace(wrong, right)
    assert not report_of(cured(SLIPS[name])).has_errors


def test_each_step_of_a_sequence_gets_its_dash() -> None:
    steps = "do:\n  sequence:\n    - go_to: dock\n    - say: hello\n    - recharge:\n"
    assert cured(SLIPS["a sequence without dashes"]) == steps
    assert not report_of(steps).has_errors


def test_a_state_is_renamed_wherever_its_machine_names_it() -> None:
    assert cured(HOME.format("go home")) == HOME.format("go home").replace("go home", "go_home")
    assert not report_of(cured(HOME.format("go home"))).has_errors


@for_all(
    "unclear",
    [
        "do:\n  sequence:\n    go_to: dock\n    go_to: kitchen\n",  # the second one is not known of
        "do:\n  sequence:\n    go_to: dock\n    timeout: 5 s\n",
        "do:\n  sequence: {go_to: dock, say: hello}\n",
        "do:\n  sequence:\n    go_to:\n      place: dock\n",
        SLIPS["set in one line"],
        SLIPS["set with two equals signs"],
        SLIPS["a list below a hook"],
        SLIPS["a step without dash and colon"],
        PARALLEL.format("ends_with: drive\n    third: recharge"),
        HOME.format("finished").replace("    away:", "    go_home:").replace("start: away", "start: go_home"),
    ],
)
def test_what_may_mean_several_things_is_left_alone(unclear: str) -> None:
    assert cured(unclear) == unclear
    assert report_of(unclear).has_errors


def test_one_line_that_may_be_a_text_gets_no_quotes_and_no_second_line() -> None:
    text = SLIPS["an outcome in the line of next"]
    assert cured(text) == text
    more = text.replace("success: finished\n", "success: finished\n          failure: failed\n")
    assert "next:\n          success: finished\n          failure: failed\n" in cured(more)


@pytest.mark.parametrize("place", ["  ends:\n    lost: failure\n", "ends:\n  lost: failure\n"])
def test_ends_beside_a_machine_are_ends_of_it(place: str) -> None:
    (finding,) = report_of(LOST + place)
    assert finding.help == "move it right, below 'machine:', into the column of 'states'"
    (wrong, _) = report_of((LOST + place).replace("success: lost", "success: lots"))
    assert wrong.help == "did you mean 'lost'?"


def test_ends_at_the_left_of_two_machines_belong_to_one_of_them() -> None:
    one = LOST.removeprefix("do:\n").replace("  machine", "  - machine").replace("\n", "\n  ").rstrip(" ")
    text = f"do:\n{one}{one}ends:\n  lost: failure\n"
    assert [found.message for found in report_of(text)][-1] == "'ends' belongs to the machine"


def test_steps_without_dashes_are_looked_at_all_the_same() -> None:
    text = SLIPS["a sequence without dashes"].replace("dock", "docc")
    assert "RBX4103" in {found.code for found in report_of(text)}


@pytest.mark.parametrize(
    ("written", "meant"), [("reached += 2", "$reached + 2"), ("reached -= 1 + 1", "$reached - (1 + 1)")]
)
def test_a_sum_in_place_is_written_out(written: str, meant: str) -> None:
    assert cured(SET.format(written)) == SET.format(f"reached: {meant}")


def test_a_comparison_below_set_is_no_assignment() -> None:
    (finding,) = report_of(SET.format("reached == 1"))
    assert finding.fix is None
    assert "write 'name: value'" in finding.help


@pytest.mark.parametrize("hook", ["on_start", "on_success", "on_failure", "on_halt"])
def test_every_hook_says_where_a_step_belongs(hook: str) -> None:
    (finding,) = report_of(HOOK.format(hook, "recharge:"))
    assert finding.message == f"'{hook}' cannot do steps such as 'recharge'"
    assert finding.help


@pytest.mark.parametrize("hook", ["on_enter", "on_exit"])
def test_every_hook_of_a_state_says_where_a_step_belongs(hook: str) -> None:
    text = f"{LOST}    ends:\n      lost: success\n".replace(DRIVE, f"{DRIVE}        {hook}:\n          say: hi\n")
    (finding,) = report_of(text)
    assert "the state's 'do'" in finding.help


def test_a_misspelt_deed_is_no_step() -> None:
    (finding,) = report_of(HOOK.format("on_failure", "lgo: hello"))
    assert finding.help == "did you mean 'log'?"


def test_numbers_in_words_are_numbers() -> None:
    assert all(digits.isdigit() for digits in NUMBERS.values())
    assert not NUMBERS.keys() & {"forever", "all", "any"}

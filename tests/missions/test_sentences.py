"""Missions read aloud: each node says what it does, once, with a number that stays."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.text import condition_in_words, in_words
from rbxcompose.base.findings import Report
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.program.registry import kinds, modifiers
from rbxcompose.missions.view.picture import MissionPicture, picture_of
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.inspection.mission_text import mission_sentences
from tests.loops import for_all
from tests.missions.random_missions import CASES, Case
from tests.missions.random_missions import ROBOT as RANDOM
from tests.missions.simulated import ROBOT, program_of, tree
from tests.shipped import ROOT, compiled


def lines(text: str) -> list[str]:
    return mission_sentences(picture_of(program_of(text), ROBOT)).splitlines()[1:]


@pytest.mark.timeout(200)
def test_all_missions_that_ship_are_read_aloud(golden: Golden, subtests: pytest.Subtests) -> None:
    known: dict[str, tuple[Program, RobotNames]] = {}
    for home in sorted(path.parent for path in (ROOT / "robots").glob("*/robot.yaml")):
        robot = compiled(str(home), environment={}).robot
        for mission in robot.missions.values() if robot else ():
            known.setdefault(Path(mission.program.file).name, (mission.program, robot.names if robot else ROBOT))
    for path in sorted((ROOT / "missions").glob("*.yaml")):
        with subtests.test(path.stem):
            program, names = known.get(path.name) or (alone(path), RobotNames())
            golden.check(f"sentences/{path.stem}.txt", mission_sentences(picture_of(program, names)))


def alone(path: Path) -> Program:
    """Return a mission of which no robot's own file makes use; its skills are not known."""
    program = read_program(tree(path.read_text(encoding="utf-8")), Report())
    assert program is not None
    return program


@for_all(
    "text, words",
    [
        ("$battery < 20 %", "the battery is below 20 %"),
        ("not $battery < 20 %", "the battery is at least 20 %"),
        ("$battery >= $low and $door", "the battery is at least the low and the door is true"),
        ("($a or $b) and not $c", "(the a is true or the b is true) and the c is not true"),
        ("distance($pose, dock) < 15 cm", "the distance from the pose to dock is below 15 cm"),
        ("age($battery) > 5 s", "the age of the battery is above 5 s"),
        ("new($button)", "the button is new"),
        ("$room in [living_room, kitchen]", "the room is living room or kitchen"),
        ("$room not in $done", "it is not so that the room is in the done"),
        ("count($left) == 0", "the number of the left is 0"),
        ("($a + 1) * 2 != -3", "(the a plus 1) times 2 is not -3"),
        ("$tour.failed[0] == 'x'", "item 0 of failed of the tour is 'x'"),
        ("min($a, $b, 3) > 1", "the smallest of the a, the b and 3 is above 1"),
    ],
)
def test_conditions_are_said_in_words_with_units_as_written(text: str, words: str) -> None:
    assert condition_in_words(parse(text)) == words


def test_a_value_is_said_as_a_value() -> None:
    assert in_words(parse("$speed * 2 - 0.1 m/s")) == "(the speed times 2) minus 0.1 m/s"


def test_leaves_say_what_they_do() -> None:
    assert lines("do: [{go_to: dock}, {say: hello}, {wait: 5 s}, {log: At $battery, level: warn}]") == [
        "1 Do in order:",
        "  1.1 Go to dock",
        "  1.2 Say 'hello'",
        "  1.3 Wait 5 s",
        "  1.4 Log 'At $battery' as a warning",
    ]


def test_groups_introduce_their_children() -> None:
    text = """
    do:
      repeat: 3
      do:
        if: $battery < 20 %
        then: {go_to: dock}
        else:
          parallel: {drive: {go_to: dock}, talk: {say: hello}}
          succeed_when: any
    """
    assert lines(text) == [
        "1 Repeat 3 times:",
        "  1.1 If the battery is below 20 %:",
        "    1.1.1 Go to dock",
        "    1.1.2 Otherwise: At the same time, until one succeeds:",
        "      1.1.2.1 drive: Go to dock",
        "      1.1.2.2 talk: Say 'hello'",
    ]


def test_modifiers_follow_from_the_inside_out() -> None:
    text = "do: {go_to: dock, attempts: 3, timeout: 1 min, optional: true, skip_if: $battery > 90 %, name: home}"
    sentence = "Go to dock; tried 3 times at most; for at most 1 min; a failure does not matter"
    assert lines(text) == [f"1 home: {sentence}; not if the battery is above 90 %"]


def test_interrupts_come_after_the_mission() -> None:
    text = "interrupts: {low: {when: $battery < 20 %, do: {go_to: dock}}}\ndo: {wait: 1 s}"
    assert lines(text) == [
        "1 Wait 1 s",
        "2 low: Whenever the battery is below 20 %, do this, then go on:",
        "  2.1 Go to dock",
    ]


def places(picture: MissionPicture) -> dict[str, int | None]:
    return {one.place: one.number for root in picture.roots for one in root.all()}


@given(CASES)
def test_every_node_is_said_once_below_the_one_that_contains_it(case: Case) -> None:
    program = case.program()
    picture = picture_of(program, RANDOM)
    linked = link(program, RANDOM.missions)
    drawn = [one for root in picture.roots for one in root.all()]
    assert sorted(one.number for one in drawn if one.number is not None) == [node.number for node in linked.nodes]
    assert all(one.sentence and one.place for one in drawn)
    assert len(places(picture)) == len(drawn)
    assert picture_of(linked, RANDOM) == picture  # as a running mission has it
    assert all(child.place == f"{one.place}.{at}" for one in drawn for at, child in enumerate(one.children, 1))
    assert len(mission_sentences(picture).splitlines()) == len(drawn) + 1


@given(st.sampled_from(sorted(kinds())))
def test_every_kind_has_a_sentence_of_its_own(name: str) -> None:
    assert "sentence" not in kinds()[name].__abstractmethods__


@given(st.sampled_from(sorted(modifiers())))
def test_every_modifier_has_a_clause(name: str) -> None:
    assert "clause" not in modifiers()[name].__abstractmethods__

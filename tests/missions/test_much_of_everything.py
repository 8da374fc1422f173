"""Large missions: what many steps ask for is found once, and what is too much is told before it is read."""

from __future__ import annotations

import pytest

from rbxcompose.base.findings import Report, Span
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis import examined as claims
from rbxcompose.missions.analysis.examined import Ending, check_program
from rbxcompose.missions.analysis.facts import Constants, constants_of
from rbxcompose.missions.language import reader
from rbxcompose.missions.language.reader import MOST_HELD, MOST_WRITTEN, Budget, operators, read_program
from rbxcompose.missions.program.linker import TOO_MUCH
from rbxcompose.missions.program.outcomes import ALWAYS_FAILS, Outcomes
from rbxcompose.missions.program.program import Program, RobotNames
from tests.missions.simulated import PLACES, SKILLS, VALUES, program_of, tree

COUNT = 12
NOWHERE = Span("mission.yaml", 1, 1, 1, 1)


def read(text: str, budget: Budget | None = None) -> tuple[Program | None, Report]:
    report = Report()
    return read_program(tree(text), report, budget=budget), report


def written(text: str) -> Program:
    program, _ = read(text)
    assert program
    return program


def each_uses_all_later_ones() -> RobotNames:
    """Return missions that use each other in 2^10 ways; the last one always fails."""
    missions = {
        f"m{n}": written("do:\n  parallel:\n" + "".join(f"    - use: m{m}\n" for m in range(n + 1, COUNT)))
        for n in range(COUNT - 1)
    }
    return RobotNames(VALUES, PLACES, SKILLS, {**missions, f"m{COUNT - 1}": written("do: {end: failure}")})


def test_how_a_mission_ends_is_found_once_for_all_that_use_it(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, examined = each_uses_all_later_ones(), list[str]()
    mission = Ending.mission

    def counted(ending: Ending) -> Outcomes:
        examined.append(ending.program.name)
        return mission(ending)

    monkeypatch.setattr(Ending, "mission", counted)
    for name, program in robot.missions.items():
        assert Ending(program, robot).of_mission(name) == ALWAYS_FAILS
    assert len(examined) == COUNT


def test_what_a_mission_claims_is_found_once_for_all_that_use_it(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, examined = each_uses_all_later_ones(), list[str]()
    claims_of = claims.claims_of

    def counted(program: Program, names: RobotNames, within: tuple[str, ...] = ()) -> frozenset[str]:
        examined.append(program.name)
        return claims_of(program, names, within)

    monkeypatch.setattr(claims, "claims_of", counted)
    for program in robot.missions.values():
        check_program(program, robot)
    assert len(examined) <= COUNT


def test_what_never_changes_is_found_once_for_all_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    program = program_of("data: {l: [corner, dock]}\ndo:\n" + "  - {for: at, in: $l, do: {go_to: $at}}\n" * 20)
    found = list[Program]()

    def counted(one: Program, inputs: Constants) -> dict[str, object]:
        found.append(one)
        return constants_of(one, inputs)

    monkeypatch.setattr("rbxcompose.missions.analysis.examined.constants_of", counted)
    check_program(program, RobotNames(VALUES, PLACES, SKILLS))
    assert len(found) == 1


def test_interrupts_that_restart_the_same_share_what_they_restart() -> None:
    loops = "  - {for: at, in: [dock], do: {go_to: $at}}\n" * 3
    rows = "".join(f"  i{n}: {{when: $battery < {n} %, afterwards: {{restart: at}}}}\n" for n in range(3))
    first, *others = program_of(f"do:\n{loops}interrupts:\n{rows}").interrupts
    assert [target.is_round for target in first.targets] == [True, True, True]
    assert all(other.targets is first.targets for other in others)


def test_the_nodes_that_each_run_may_get_are_limited_and_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "data:\n  l:\n" + "    - wait: 1 s\n" * 100 + "do:\n" + "  - {for: at, in: $l, do: {run: $at}}\n" * 100
    program, report = read(text)
    assert [finding.code for finding in report] == [TOO_MUCH.code]
    assert program
    assert len(program.nodes) < MOST_HELD


def test_stored_nodes_that_run_themselves_end() -> None:
    program, report = read("data:\n  l:\n" + "    - {for: d, in: $l, do: {run: $d}}\n" * 60 + "do: {run: '$l[0]'}\n")
    assert program
    assert len([finding for finding in report if finding.code == TOO_MUCH.code]) == 1
    assert len(program.nodes) < 2 * MOST_HELD


def test_missions_of_a_robot_share_what_may_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(text: str) -> None:
        raise AssertionError(text)

    budget = Budget(written=100)
    text = "do:\n" + "  - check: $battery < 20 % or $battery > 30 %\n" * 15
    assert read(text, budget)[0]
    monkeypatch.setattr(reader, "Repairs", refuse)  # nothing of the others is read
    (second, told), (third, silent) = read(text, budget), read(text, budget)
    assert [second, third] == [None, None]
    assert [(finding.code, finding.span is not None) for finding in told] == [(TOO_MUCH.code, True)]
    assert not list(silent)


@pytest.mark.parametrize(("text", "least"), [("$a " * 50, 50), ("1 > 0 or " * 50, 100), ("$a.b[0] + $c * 2", 6)])
def test_names_and_operators_count(text: str, least: int) -> None:
    assert operators(ScalarNode(text, NOWHERE)) >= least


def test_a_text_without_names_costs_little() -> None:
    assert operators(ScalarNode("I have been to all rooms, and found nobody there.", NOWHERE)) <= 4
    assert MOST_WRITTEN > 20_000

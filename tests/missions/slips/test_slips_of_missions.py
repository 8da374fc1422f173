"""Each slip of missions has an example beside this file, in which it is recognised, told and read as it was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.findings import Report
from rbxcompose.commands.formats.text import render_text
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import TreeNode
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.slips import slip
from rbxcompose.testing.golden import Golden
from tests.loops import for_all
from tests.missions.simulated import ROBOT, tree
from tests.missions.test_slips import FILE, cured, report_of

EXAMPLES = {path.stem: path.read_text(encoding="utf-8") for path in (Path(__file__).parent / "golden").glob("*.yaml")}
SLIPS = {find.__name__: find for place in Takes for find in slip.at(place)}


def paths_of(text: str) -> set[str]:
    program = read_program(tree(text), Report(), ROBOT.skills)
    assert program
    return {node.path for node in program.nodes if node.step.word}


def test_every_slip_has_an_example() -> None:
    assert set(EXAMPLES) == set(SLIPS)


@for_all("name", sorted(EXAMPLES))
def test_what_is_said_of_a_slip(name: str, golden: Golden) -> None:
    golden.check(f"{name}.txt", render_text(report_of(EXAMPLES[name]), {FILE: EXAMPLES[name]}))


@for_all("name", sorted(EXAMPLES))
def test_all_that_is_said_of_an_example_is_said_by_its_slip(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    said: set[str] = set()

    def noting(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
        repair = SLIPS[name](place, node)
        said.update(finding.message for finding in (repair.findings if repair else ()))
        return repair

    takes = {place: [noting if find is SLIPS[name] else find for find in slip.at(place)] for place in Takes}
    monkeypatch.setattr(slip, "_by_place", takes)
    assert said == {finding.message for finding in report_of(EXAMPLES[name])} != set()


@for_all("name", sorted(EXAMPLES))
def test_what_is_read_of_a_slip_is_in_the_text_that_its_fix_writes(name: str) -> None:
    assert paths_of(EXAMPLES[name]) <= paths_of(cured(EXAMPLES[name]))

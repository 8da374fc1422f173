"""Each kind of finding about missions has a golden pair: a mission with its mistakes, and what `check` says of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.units import ANGLE, LENGTH
from rbxcompose.commands.finding_pages import all_kinds
from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.check_runner import all_checks
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.missions.analysis.examined import mission_checks
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.sdk import ArrayEntries, Component, Config, ServesAction, component, skill
from rbxcompose.testing.golden import Golden

HERE = Path(__file__).parent
SHORT = tuple(f"missions.{name}=used/tour.yaml" for name in ("hundred", "thousands"))
"""In place of missions with thousands of nodes, which only one of the pairs is about."""


def codes() -> list[str]:
    """Return the codes about missions but for those of the robot's checks, which lie beside these."""
    return sorted({code for code in all_kinds() if code.startswith("RBX41")} - {check.code for check in all_checks()})


@skill("pour", restartable=False)
def pour() -> None:
    """Pour; twice would be too much."""


@component("toy_neck")
class Neck(Component[Config]):
    """Turns and lifts a head.

    Example:
        neck: {type: toy_neck}
    """

    entries = ArrayEntries("joints", "positions", {"pan_joint": ANGLE, "lift_joint": LENGTH})
    move = ServesAction(MoveJoints, "neck/move", skill="neck", entries=entries)


@pytest.mark.timeout(200)
def test_what_is_said_of_a_mistake_is_its_golden_text(
    golden: Golden, monkeypatch: pytest.MonkeyPatch, subtests: pytest.Subtests
) -> None:
    monkeypatch.chdir(HERE)
    for code in codes():
        with subtests.test(code):
            is_long = "thousands" in Path(f"golden/{code}.yaml").read_text(encoding="utf-8")
            out = compile_robot("robot.yaml", environment={"CODE": code}, sets=() if is_long else SHORT)
            assert {finding.code for finding in out.report} == {code}
            golden.check(f"{code}.txt", render_text(out.report, out.sources))


def test_every_golden_mission_belongs_to_a_kind_and_every_rule_has_one() -> None:
    assert {path.stem for path in (HERE / "golden").glob("*.*")} == set(codes())
    assert {rule.code for rule in mission_checks()} <= set(codes())

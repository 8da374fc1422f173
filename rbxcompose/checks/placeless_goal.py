"""Poses in missions that say nowhere where the tip should be."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.arm_goals import word_of, written_reaches
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING

_AXES = ("x", "y", "z")


@check("RBX2359", Severity.ERROR, closed=(WIRING,))
def placeless_goal(robot: Robot) -> Iterator[Finding]:
    """A step does not say where the tip of an arm should be."""
    for reach in written_reaches(robot):
        any_position = "any_position" in reach.arguments and word_of(reach, "any_position")[0] != "false"
        if not any_position and not reach.arguments.keys() & set(_AXES):
            message = f"'{reach.node.skill}' is not told where the tip should be"
            help_text = "give 'x', 'y' and 'z', or 'any_position: true' if only the orientation counts"
            yield placeless_goal.at(reach.node.span, message, help=help_text)

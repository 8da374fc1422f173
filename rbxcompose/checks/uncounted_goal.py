"""Poses in missions of which a part is asked for that does not count."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.arm_goals import WrittenReach, word_of, written_reaches
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING

_COUNTS = {"any_position": ("x", "y", "z", "tolerance"), "any_orientation": ("roll", "pitch", "yaw", "angle_tolerance")}


@check("RBX2358", Severity.WARNING, closed=(WIRING,))
def uncounted_goal(robot: Robot) -> Iterator[Finding]:
    """A step says where the tip should be, and that this does not count."""
    for reach in written_reaches(robot):
        said = [one for one in _COUNTS if word_of(reach, one)[0] == "true"]
        if len(said) > 1:
            span, message = reach.arguments[said[1]].value.span, "neither the position nor the orientation counts"
            yield uncounted_goal.at(span, message, help=f"leave out '{said[0]}' or '{said[1]}'")
        else:
            yield from (one for word in said for one in _uncounted(reach, word))


def _uncounted(reach: WrittenReach, word: str) -> Iterator[Finding]:
    related = [Related(reach.arguments[word].value.span, "because of this")]
    for name in _COUNTS[word]:
        if name in reach.arguments:
            message = f"'{name}' does nothing beside '{word}: true'"
            yield uncounted_goal.at(
                reach.arguments[name].value.span, message, help=f"leave out '{name}' or '{word}'", related=related
            )

"""Grasps of an object that there is not."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import DID_YOU_MEAN, Finding, Severity, suggest
from rbxcompose.model.arm_goals import word_of, written_reaches
from rbxcompose.model.robot import Robot
from rbxcompose.msgs.moveit_msgs import CollisionObject
from rbxcompose.rules import MISSIONS, WIRING
from rbxcompose.sdk.ports import Out
from rbxcompose.sections.arms import arms
from rbxcompose.sections.scene import scene


@check("RBX2376", Severity.WARNING, closed=(WIRING, MISSIONS, "scene"))
def idle_grasps(robot: Robot) -> Iterator[Finding]:
    """Grasps are those of an object that there is not."""
    contents = robot.manifest.contents
    objects = [one.name for one in contents.of(scene).objects]
    if not objects or any(isinstance(end.port, Out) and end.port.interface is CollisionObject for end in robot.ends):
        return
    picks = list(written_reaches(robot, "pick"))
    for name, arm in contents.of(arms).items():
        picked = [word_of(one, "object")[0] for one in picks if one.name == name]
        if not picked or not all(picked):
            continue  # what it picks is known only later
        for one in (each for each in arm.model.grasps if each not in (*objects, *picked)):
            others = [each for each in dict.fromkeys(picked) if each not in arm.model.grasps]
            meant = f"{DID_YOU_MEAN} '{others[0]}'?" if len(others) == 1 else suggest(one, objects, "objects")
            yield idle_grasps.at(
                robot.key("arms", name, "grasps", one), f"no object of the scene is named '{one}'", help=meant
            )

"""A frame between the fingers of a gripper that does not move with the arm's tip."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.body.model import BodyJoint
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.sections.arms import arms
from rbxcompose.sections.body import body


@check("RBX2340")
def grasp_frame(robot: Robot) -> Iterator[Finding]:
    """The frame between the fingers of an arm does not move with its tip."""
    description = robot.manifest.contents.of(body)
    for name, arm in robot.manifest.contents.of(arms).items():
        link = arm.model.grasp
        if description is None or link is None or link not in description.body.links:
            continue
        above, way = description.body.joint_above, list[BodyJoint]()
        while link != arm.group.tip and link in above:
            way.append(above[link])
            link = above[link].parent
        moving = next((joint for joint in way if joint.moves), None)
        if link != arm.group.tip or moving is not None:
            words = f"'{moving.name}' moves between them" if moving and link == arm.group.tip else "it is not below it"
            message = f"'{arm.model.grasp}' does not move with '{arm.group.tip}', the tip of the arm: {words}"
            yield grasp_frame.at(robot.value("arms", name, "grasp"), message)

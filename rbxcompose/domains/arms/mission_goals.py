"""Goals of arms in missions: poses for their tips, as far as the text shows them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.geometry import Vector3
from rbxcompose.compiler.model.robot import Robot, RobotMission
from rbxcompose.domains.arms.sections.arms import ArmOfRobot, arms
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.servos.sections.joints import limits_in
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.asked import WrittenArgument
from rbxcompose.missions.program.answers import NodeFlow
from rbxcompose.missions.program.program import MissionNode


@dataclass(frozen=True, slots=True)
class WrittenReach:
    """A step of a mission that brings the tip of an arm to a pose, or to a thing."""

    mission: RobotMission
    node: MissionNode
    name: str
    arm: ArmOfRobot
    arguments: Mapping[str, WrittenArgument]

    @property
    def may_fail(self) -> bool:
        """Return whether something else follows a failure, so that it may be meant."""
        node: MissionNode | None = self.node
        while node is not None:
            above = None if node.parent is None else self.mission.program.nodes[node.parent]
            if node.is_forgiven or (above is not None and above.step.flow in (NodeFlow.ONE_OF, NodeFlow.OPEN)):
                return True
            node = above
        return False


def written_reaches(robot: Robot, verb: str = "reach") -> Iterator[WrittenReach]:
    """Yield the steps of all missions that bring the tip of an arm to a pose; or that `pick`, or `place`."""
    skills = {f"{verb}_{name}": (name, arm) for name, arm in robot.manifest.contents.of(arms).items()}
    for mission in robot.missions.values() if skills else ():
        for node in mission.program.nodes:
            if node.skill in skills and node.skill in robot.skills:
                main = robot.skills[node.skill].skill.main
                arguments = {argument.name or main: argument for argument in node.step.arguments}
                yield WrittenReach(mission, node, *skills[node.skill], arguments)


def word_of(reach: WrittenReach, argument: str) -> tuple[str, Span]:
    """Return the word that an argument is, and its place; nothing if it is not there or known only later."""
    written = reach.arguments.get(argument)
    if written is None or not isinstance(written.value, ScalarNode) or "$" in written.value.text:
        return "", reach.node.span
    return written.value.text, written.value.span


def length_of(robot: Robot, body: Body, arm: ArmOfRobot) -> float:
    """Return how far a tip can be from the first joint of its arm [m]: all links stretched out; infinite if unlimited.

    No place farther away can be reached, whatever the directions of the joints are.
    """
    total, link = 0.0, arm.group.tip
    while True:
        joint = body.joint_above[link]
        if joint.slides:
            limits = limits_in(robot.manifest.contents, joint)
            ends = (limits.lower, limits.upper)
            total += max(math.inf if end is None else abs(end) for end in ends)
        if joint.name == arm.group.joints[0]:
            return total
        total += math.hypot(*joint.origin.translation)
        link = joint.parent


def first_joint_in(body: Body, arm: ArmOfRobot, frame: str) -> Vector3 | None:
    """Return where the first joint of an arm is in the frame of a link [m]; None if other joints move one of them."""
    first = body.joints[arm.group.joints[0]]
    if _movers(body, first.parent) != _movers(body, frame):
        return None
    poses = body.poses({})
    return poses[frame].inverse().apply(poses[first.parent].apply(first.origin.translation))


def _movers(body: Body, link: str) -> set[str]:
    """Return the joints that move a link in the frame of the root."""
    return {joint.name for joint in body.joints_above(link) if joint.kind != "fixed"}

"""Motions of joints in a mission that are too fast for them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from rbxcompose.check_runner import check
from rbxcompose.checks.goal_beyond_limits import known_value
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.facts import Constants
from rbxcompose.missions.language.asked import WrittenArgument
from rbxcompose.missions.program.answers import NodeFlow
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.model.charge import constants, is_served
from rbxcompose.model.driven_joints import ROUNDED, DrivenJoint, driven_joints
from rbxcompose.model.robot import Robot, RobotMission
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import BoundsGoals
from rbxcompose.units import TIME, format_quantity

Positions = Mapping[str, tuple[float, WrittenArgument]]  # of joints [rad or m], with what has brought them there


@dataclass(frozen=True, slots=True)
class JointMover:
    """The skill of a controller: its joints by argument, and the argument with the time that a motion takes."""

    joints: Mapping[str, DrivenJoint]
    duration: str

    def goal(self, argument: WrittenArgument, known: Constants) -> float | None:
        """Return where an argument brings a joint, if that is known and within its limits."""
        to = known_value(argument, known)
        limits = self.joints[argument.name].joint.limits
        has_ends = math.isfinite(limits.least) and math.isfinite(limits.greatest)  # else there may be a shorter way
        return to if to is not None and has_ends and limits.least <= to <= limits.greatest else None


@check("RBX4166", Severity.WARNING, closed=(WIRING,))
def hasty_motion(robot: Robot) -> Iterator[Finding]:
    """A motion is too fast for a joint."""
    movers = _movers(robot)
    for mission in robot.missions.values() if movers else ():
        for node in mission.program.nodes:
            if node.step.flow is NodeFlow.IN_TURN:
                yield from _in_turn(mission, node, movers)


def _movers(robot: Robot) -> dict[str, JointMover]:
    declared = [(one, bounds) for one, bounds in robot.declared(BoundsGoals) if bounds.duration and bounds.joints]
    led = {one.name: one for one in driven_joints(robot)} if declared else {}
    found = dict[str, JointMover]()
    for component, bounds in declared:
        skill = next((name for name in robot.skills if is_served(robot, name, component, bounds.goals)), "")
        if bounds.joints and bounds.duration and skill:
            own = {name: led[joint] for name, joint in bounds.joints.value.items() if joint in led}
            found[skill] = JointMover(own, bounds.duration.value)
    return found


def _in_turn(mission: RobotMission, node: MissionNode, movers: Mapping[str, JointMover]) -> Iterator[Finding]:
    known = constants(mission)
    before: Positions = {}
    for child in (mission.program.nodes[number] for number in node.children):
        mover = movers.get(child.skill)
        if mover is None:
            before = before if _leaves_joints(child) else {}
            continue
        yield from _too_fast(child, mover, known, before)
        before = {} if child.may_be_left_out or child.is_forgiven else _after(child, mover, known, before)


def _leaves_joints(node: MissionNode) -> bool:
    """Return whether a step surely moves no joint."""
    effects = node.step.effects
    return not (node.skill or node.children or node.step.uses or node.inner or effects.published or effects.called)


def _after(node: MissionNode, mover: JointMover, known: Constants, before: Positions) -> Positions:
    """Return where the joints are after a step, as far as that is known."""
    given = {one.name: (mover.goal(one, known), one) for one in node.step.arguments if one.name in mover.joints}
    stay = {name: one for name, one in before.items() if name not in given}
    return stay | {name: (value, one) for name, (value, one) in given.items() if value is not None}


def _too_fast(node: MissionNode, mover: JointMover, known: Constants, before: Positions) -> Iterator[Finding]:
    written = {one.name: one for one in node.step.arguments}
    given = written.get(mover.duration)
    seconds = known_value(given, known) if given else None
    for name, one in written.items() if given and seconds else ():
        if name not in before or not given or not seconds:
            continue
        to, most = mover.goal(one, known), mover.joints[name].joint.limits.velocity
        if to is None or not most:
            continue
        needs = abs(to - before[name][0]) / most
        if needs > seconds * (1.0 + ROUNDED):
            way, speed = mover.joints[name].position(abs(to - before[name][0])), mover.joints[name].speed(most)
            takes = format_quantity(round(needs, 2), TIME)
            yield hasty_motion.at(
                given.value.span,
                f"'{name}' moves by {way}, which takes {takes} at its limit of {speed}",
                help=f"give it about twice that, '{format_quantity(round(2.0 * needs, 1), TIME)}'",
                related=[Related(before[name][1].value.span, "where it is before")],
            )

"""The section `arms`: joints that move together to poses, on ways that are planned."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field, WithJsonSchema, model_validator

from rbxcompose.body.model import Body, BodyJoint
from rbxcompose.config import Config, JointName, LinkName, Name, Time
from rbxcompose.control.limits import MotionLimits
from rbxcompose.controller_interface import ControllerConfig, controller_type
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Related, kind
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.manifest.tree import at, key_span, value_span
from rbxcompose.manifest.validate import not_a_choice
from rbxcompose.manifest.wanted_components import WantedComponent, Wiring
from rbxcompose.motion.groups import ArmGroup, chain, group_of
from rbxcompose.motion.planner_types import PLANNERS
from rbxcompose.msgs.control_msgs import FollowJointTrajectory, GripperCommand
from rbxcompose.references import ARM, CONTROLLER, Refers
from rbxcompose.sdk.ports import ServesAction
from rbxcompose.sections.body import body
from rbxcompose.sections.controllers import controllers
from rbxcompose.sections.joints import JointPosition, held_limits, joints
from rbxcompose.units import ANGLE, LENGTH, Quantity, format_quantity

NO_CHAIN = kind(
    "RBX2301",
    """The chain of an arm is none

A chain leads from a link that carries the arm to a link at its end, by joints of which at least one moves. So the end
is below the beginning in the tree of links: `rbxcompose body tree` shows it.

Bad: `chain: {from: arm_tip, to: torso_link}`
Good: `chain: {from: torso_link, to: arm_tip}`
""",
)
NOT_LED = kind(
    "RBX2302",
    """The controller of an arm does not lead all of its joints

An arm moves along trajectories, which its controller follows: it has the action `FollowJointTrajectory` of ROS, as
those of the type `joint_trajectory` do, and leads each joint of the arm.

Bad: `arm: {joints: [lift_joint, elbow_joint], controller: lift}`, where `lift` leads `lift_joint` alone.
Good: `lift: {type: joint_trajectory, joints: [lift_joint, elbow_joint]}` under `controllers:`.
""",
)
NOT_OF_ARM = kind(
    "RBX2303",
    """A pose of an arm names a joint that the arm does not have

The joints of an arm are those that move between both ends of its chain, or those under `joints`. A joint that mimics
another one is not among them.

Bad: `poses: {resting: {head_pan_joint: 0 deg}}` of an arm.
Good: `poses: {resting: {arm_lift_joint: 0 deg}}`
""",
)
BEYOND = kind(
    "RBX2304",
    """An arm cannot take one of its poses

A position is beyond the limits of its joint: those of the body, or the tighter ones under `joints:`. Or it is a length
for a joint that turns, or an angle for one that slides.

Bad: `poses: {up: {arm_lift_joint: -200 deg}}`, where the joint goes from -150 to 150 deg.
Good: `poses: {up: {arm_lift_joint: -145 deg}}`
""",
)
NO_GRIPPER = kind(
    "RBX2305",
    """The gripper of an arm is none

A gripper is a controller that opens and closes something: it has the action `GripperCommand` of ROS, as those of the
type `gripper` do.

Bad: `arm: {..., gripper: arm_controller}`
Good: `arm: {..., gripper: hand}`, where `controllers:` has `hand: {type: gripper, ...}`.
""",
)
_ROUNDING = 1e-6  # [rad or m]
PlannerName = Annotated[str, WithJsonSchema({"type": "string", "enum": list(PLANNERS)})]


class ChainModel(Config):
    """From the link that carries an arm to the link at its end."""

    from_: LinkName = Field(alias="from")
    """The link that carries it."""
    to: LinkName
    """The link at its end, whose frame its goals are for."""


class PlannerModel(Config):
    """How motions are planned."""

    type: PlannerName = "rrt_connect"
    """The planner of OMPL."""
    time: Time = Field(5.0, gt=0, le=60)
    """How long it may search."""
    attempts: int = Field(5, ge=1, le=100)
    """How many paths it may find that collide when they are examined finely, before it gives up."""
    seed: int = Field(1, ge=0)
    """The same seed gives the same path."""


class ArmModel(Config):
    """Joints that move together."""

    chain: ChainModel | None = None
    """Its joints are those between these links."""
    joints: list[JointName] = []
    """Its joints, instead of a chain."""
    controller: Annotated[Name, Refers(CONTROLLER)]
    """The controller that leads its joints."""
    gripper: Annotated[Name, Refers(CONTROLLER)] | None = None
    """The controller of its gripper, if it has one."""
    poses: dict[Name, dict[JointName, JointPosition]] = {}
    """Positions of joints by the name of the pose; a joint that a pose leaves out stays where it is."""
    planner: PlannerModel = PlannerModel()
    """How its motions are planned."""

    @model_validator(mode="after")
    def _one_of_both(self) -> ArmModel:
        if (self.chain is None) == (not self.joints):
            raise ValueError("an arm has either 'chain' or 'joints'")
        return self


@dataclass(frozen=True, slots=True)
class ArmOfRobot:
    """An arm as it is written, and its joints; with mistakes it is not `is_sound`."""

    model: ArmModel
    group: ArmGroup
    is_sound: bool


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that moves each arm."""
    description = contents.of(body)
    if description is None:
        return
    for name, arm in contents.of(arms).items():
        one = arm.model
        config = {
            "name": name,
            "urdf": description.text,
            "meshes": {mesh: str(path) for mesh, path in description.meshes.items()},
            "base": arm.group.base,
            "tip": arm.group.tip,
            "joints": {joint: _joint(contents, description.body.joints[joint]) for joint in arm.group.joints},
            "poses": {pose: _positions(arm.group, written) for pose, written in one.poses.items()},
            "controller": one.controller,
            "follow": follow_topic(contents, one.controller),
            "planner": one.planner.model_dump(),
        }
        yield WantedComponent(name, "arm", config, ("arms", name), is_sound=arm.is_sound)


def _joint(contents: Contents, joint: BodyJoint) -> dict[str, object]:
    limits = limits_in(contents, joint)
    return {
        "lower": limits.lower,
        "upper": limits.upper,
        "velocity": limits.velocity,
        "acceleration": limits.acceleration,
        "is_continuous": joint.kind == "continuous",
        "slides": joint.slides,
    }


def _positions(group: ArmGroup, written: Mapping[str, Quantity]) -> dict[str, float]:
    return {joint: one.value for joint, one in written.items() if joint in group.joints}


def limits_in(contents: Contents, joint: BodyJoint) -> MotionLimits:
    """Return the limits of a joint: those of the body, and the tighter ones of the joint if it is driven."""
    driven = contents.of(joints).get(joint.name)
    if driven is not None:
        return held_limits(driven, joint)
    outer = joint.limits
    if outer is None or joint.kind == "continuous":
        return MotionLimits()
    return MotionLimits(outer.lower, outer.upper)


def served_topic(name: str, one: ControllerConfig, action: type[Any]) -> str:
    """Return the topic at which a controller serves an action; nothing if it does not."""
    ports = controller_type(one.type).ports(name, one).values()
    return next((port.topic for port in ports if isinstance(port, ServesAction) and port.interface is action), "")


def follow_topic(contents: Contents, controller: str) -> str:
    """Return the topic at which a controller takes trajectories; nothing if it takes none."""
    there = contents.of(controllers).get(controller)
    return served_topic(controller, there, FollowJointTrajectory) if there is not None else ""


@section(
    "arms",
    ArmModel,
    order=36,
    names=ARM,
    runs=True,
    wires=True,
    entry="arm",
    repeats=False,
    needs="controller",
    components=_components,
)
def arms(reading: Reading[ArmModel]) -> dict[str, ArmOfRobot]:
    """Arms by name: joints that move together, and poses by name. `move_NAME: POSE` is a skill of missions.

    Example:
        body:
          urdf: robot.urdf
        buses:
          servos:
            type: dynamixel
        actuators:
          pan_servo: {bus: servos, model: AX-12, id: 1}
        joints:
          pan_joint: {actuator: pan_servo}
        controllers:
          head:
            type: joint_trajectory
            joints: [pan_joint]
        arms:
          neck:
            joints: [pan_joint]
            controller: head
            poses:
              forwards: {pan_joint: 0 deg}
              aside: {pan_joint: 60 deg}
    """
    description, found = reading.contents.of(body), dict[str, ArmOfRobot]()
    for name, one in reading.entries().items():
        if one.planner.type not in PLANNERS:
            path = ("arms", name, "planner", "type")
            node = at(reading.contents.root, path)
            reading.report.add(not_a_choice(value_span(reading.contents.root, path), "type", node, list(PLANNERS)))
        if description is None:
            continue  # it is missing or has a mistake, which is told
        group = _group(reading, name, one, description.body)
        if group is None:
            continue
        wrong = list(_mistakes(reading, name, one, group, description.body))
        reading.report.extend(wrong)
        found[name] = ArmOfRobot(one, group, not wrong and one.planner.type in PLANNERS)
    return found


def _group(reading: Reading[ArmModel], name: str, one: ArmModel, known: Body) -> ArmGroup | None:
    """Return the joints of an arm; None after a finding."""
    root = reading.contents.root
    if one.chain is None:
        for index, joint in enumerate(one.joints):
            if not known.joints[joint].moves or known.joints[joint].mimic is not None:
                span = value_span(root, ("arms", name, "joints", index))
                words = "follows another joint" if known.joints[joint].mimic else f"is {known.joints[joint].kind}"
                reading.report.add(NO_CHAIN.at(span, f"'{joint}' {words}, so the arm '{name}' cannot move it"))
                return None
        return group_of(known, one.joints)
    found = chain(known, one.chain.from_, one.chain.to)
    if found is not None and found.joints:
        return found
    span = value_span(root, ("arms", name, "chain", "to"))
    if found is not None:
        message = f"nothing moves between '{one.chain.from_}' and '{one.chain.to}'"
        reading.report.add(NO_CHAIN.at(span, message))
        return None
    message = f"'{one.chain.to}' is not below '{one.chain.from_}', which carries the arm '{name}'"
    is_turned = chain(known, one.chain.to, one.chain.from_) is not None
    help_text = f"write 'chain: {{from: {one.chain.to}, to: {one.chain.from_}}}'" if is_turned else ""
    related = [Related(value_span(root, ("arms", name, "chain", "from")), "its base")]
    reading.report.add(NO_CHAIN.at(span, message, help=help_text, related=related))
    return None


def _mistakes(reading: Reading[ArmModel], name: str, one: ArmModel, group: ArmGroup, known: Body) -> Iterator[Finding]:
    yield from _unled(reading, name, one, group)
    there = reading.contents.of(controllers).get(one.gripper or "")
    if one.gripper is not None and there is not None and not served_topic(one.gripper, there, GripperCommand):
        span = value_span(reading.contents.root, ("arms", name, "gripper"))
        yield NO_GRIPPER.at(span, f"'{one.gripper}' does not open and close anything, and is no gripper")
    for pose, written in one.poses.items():
        for joint, position in written.items():
            yield from _unfit(reading, (name, pose, joint), position, group, known)


def _unled(reading: Reading[ArmModel], name: str, one: ArmModel, group: ArmGroup) -> Iterator[Finding]:
    there = reading.contents.of(controllers).get(one.controller)
    span = value_span(reading.contents.root, ("arms", name, "controller"))
    if there is None:
        return  # it has a mistake, which is told
    if not served_topic(one.controller, there, FollowJointTrajectory):
        yield NOT_LED.at(span, f"the controller '{one.controller}' follows no trajectories")
    elif left := [joint for joint in group.joints if joint not in there.claimed]:
        words = ", ".join(f"'{joint}'" for joint in left)
        related = [Related(key_span(reading.contents.root, ("controllers", one.controller)), "the controller")]
        yield NOT_LED.at(span, f"the controller '{one.controller}' does not lead {words}", related=related)


def _unfit(
    reading: Reading[ArmModel], where: tuple[str, str, str], position: Quantity, group: ArmGroup, known: Body
) -> Iterator[Finding]:
    """Yield what is wrong with the position of a joint in a pose."""
    (name, pose, joint), root = where, reading.contents.root
    if joint not in group.joints:
        message = f"the pose '{pose}' names '{joint}', which is no joint of the arm '{name}'"
        key = key_span(root, ("arms", name, "poses", pose, joint))
        yield NOT_OF_ARM.misspelt(key, message, joint, group.joints, "its joints")
        return
    span, slides = value_span(root, ("arms", name, "poses", pose, joint)), known.joints[joint].slides
    if position.dimension != (LENGTH if slides else ANGLE):
        words, wanted = ("slides", "a length") if slides else ("turns", "an angle")
        message = f"'{joint}' {words}, and this is {position.dimension.phrase}"
        yield BEYOND.at(span, message, help=f"write {wanted}")
        return
    limits = limits_in(reading.contents, known.joints[joint])
    nearest = limits.clamped(position.value)
    if known.joints[joint].kind != "continuous" and abs(nearest - position.value) > _ROUNDING:
        shown = [format_quantity(value, position.dimension) for value in (position.value, nearest)]
        message = f"in the pose '{pose}', '{joint}' is at {shown[0]}, beyond its limits"
        yield BEYOND.at(span, message, help=f"the nearest that it reaches is {shown[1]}")

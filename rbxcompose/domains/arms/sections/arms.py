"""The section `arms`: joints that move together to poses, on ways that are planned."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated

from pydantic import Field, model_validator

from rbxcompose.base.config import ARM, CONTROLLER, Config, JointName, Length, LinkName, Name, Refers
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Related, Span, kind
from rbxcompose.base.units import ANGLE, LENGTH, Quantity, format_quantity
from rbxcompose.domains.arms import section_models
from rbxcompose.domains.arms.motion.groups import ArmGroup, carrying, chain, group_of, moved_links, together, way_up
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import LinkPair, PairReason
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.controller import ControllerConfig, controller_type
from rbxcompose.domains.servos.sections.controllers import controllers, follow_topic, served_topic, stream_topic
from rbxcompose.domains.servos.sections.joints import JointPosition, limits_in
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring
from rbxcompose.manifest.tree import at, value_span
from rbxcompose.manifest.validate import NOT_A_CHOICE, not_a_choice
from rbxcompose.msgs.control_msgs import FollowJointTrajectory, GripperCommand
from rbxcompose.sdk.capabilities import BoundsGoals

NO_CHAIN = kind("RBX2301")
NOT_LED = kind("RBX2302")
NOT_OF_ARM = kind("RBX2303")
BEYOND = kind("RBX2304")
NO_GRIPPER = kind("RBX2305")
GRIPPER_ELSEWHERE = kind("RBX2308")
NO_POSE = kind("RBX2357")


MOVE_GROUP = "move_group"
"""The component that passes goals of programs for MoveIt on to arms."""
_ROUNDING = 1e-6  # [rad or m]


class ArmModel(Config):
    """Joints that move together."""

    chain: section_models.ChainModel | None = None
    """Its joints are those between these links."""
    joints: list[JointName] = []
    """Its joints, instead of a chain."""
    links: list[LinkName] = []
    """Links whose joints are its own, instead of a chain; the last one is the tip."""
    groups: list[Annotated[Name, Refers(ARM)]] = []
    """Arms whose joints are its own, instead of a chain; the last one has the tip."""
    passive: list[JointName] = []
    """Joints of the chain that nothing drives: motions take them as they are."""
    controller: Annotated[Name, Refers(CONTROLLER, is_reported=True)]
    """The controller that leads its joints."""
    gripper: Annotated[Name, Refers(CONTROLLER, is_reported=True)] | None = None
    """The controller of its gripper, if it has one."""
    grasp: LinkName | None = None
    """The frame between the fingers of the gripper: x ahead, y across; without it, the tip."""
    squeeze: Length = Field(0.0, ge=0)
    """By how much the gripper is asked to close farther than an object is wide; simulated fingers feel no objects."""
    grasps: dict[Name, list[section_models.GraspModel]] = {}
    """How objects may be held, by their names; grasps of others follow from their shapes."""
    pictures: str | None = Field(None, min_length=1)
    """A folder, relative to this file, into which each failure of picking and placing draws the scene; 20 are kept."""
    spots: dict[Name, section_models.SpotModel] = {}
    """Where the arm may put things, by name."""
    poses: dict[Name, dict[JointName, JointPosition]] = {}
    """Positions of joints by the name of the pose; a joint that a pose leaves out stays where it is."""
    planner: section_models.PlannerModel = section_models.PlannerModel()
    """How its motions are planned."""
    kinematics: section_models.SolverModel = section_models.SolverModel()
    """How positions of joints are searched for a pose of the tip."""

    @model_validator(mode="after")
    def _one_of_them(self) -> ArmModel:
        if [self.chain is not None, bool(self.joints), bool(self.links), bool(self.groups)].count(True) != 1:
            raise ValueError("an arm has either 'chain' or 'joints' or 'links' or 'groups'")
        if self.passive and self.chain is None:
            raise ValueError("'passive' is for joints of a chain")
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
            "joints": {joint: joint_limits(contents, description.body.joints[joint]) for joint in arm.group.joints},
            "poses": {pose: _positions(arm.group, written) for pose, written in one.poses.items()},
            "controller": one.controller,
            "follow": follow_topic(contents, one.controller),
            "stream": stream_topic(contents, one.controller),
            "planner": one.planner.model_dump(),
            "kinematics": one.kinematics.model_dump(),
            "pairs": _pairs(description, arm.group),
            "hand": hand_in(contents, arm),
        }
        yield WantedComponent(name, "arm", config, ("arms", name), is_sound=arm.is_sound)
    if found := contents.of(arms):
        groups = {name: {"joints": one.group.joints} for name, one in found.items()}
        yield WantedComponent(MOVE_GROUP, MOVE_GROUP, {"arms": groups}, ("arms",))


def joint_limits(contents: Contents, joint: BodyJoint) -> dict[str, object]:
    """Return the limits of a joint as an `ArmJointConfig` has them."""
    limits = limits_in(contents, joint)
    found = {name: getattr(limits, name) for name in ("lower", "upper", "velocity", "acceleration", "jerk")}
    return {**found, "is_continuous": joint.kind == "continuous" and limits.are_endless, "slides": joint.slides}


def _pairs(description: Description, group: ArmGroup) -> dict[str, list[LinkPair]] | None:
    """Return the pairs that an arm moves relative to each other and need not watch; None if they are not known."""
    if (matrix := description.matrix) is None:
        return None
    moved = moved_links(description.body, group.joints)
    chosen: dict[str, tuple[PairReason, ...]] = {
        "adjacent": ("adjacent",),
        "ignored": ("always", "user"),
        "unlikely": ("never",),
    }
    return {
        key: [(name, other) for name, other in matrix.having(*reasons) if moved[name] != moved[other]]
        for key, reasons in chosen.items()
    }


def hand_in(contents: Contents, arm: ArmOfRobot) -> section_models.HandConfig | None:
    """Return the gripper of an arm, if it has one."""
    model, there = arm.model, contents.of(controllers).get(arm.model.gripper or "")
    if model.gripper is None or there is None:
        return None
    name = model.gripper
    bounds = (each for each in controller_type(there.type).capabilities(name, there) if isinstance(each, BoundsGoals))
    ranges = [pair for each in bounds if each.ranges is not None for pair in each.ranges.value.values()]
    return section_models.HandConfig(
        controller=name,
        command=served_topic(name, there, GripperCommand),
        opening=ranges[0] if ranges else None,
        grasp=model.grasp or arm.group.tip,
        squeeze=model.squeeze,
        grasps=model.grasps,
        spots=model.spots,
        pictures=_folder(contents, arm),
    )


def _folder(contents: Contents, arm: ArmOfRobot) -> str:
    """Return the folder of its pictures, which need not be there yet; nothing if none is written."""
    if arm.model.pictures is None:
        return ""
    name = next(key for key, candidate in contents.of(arms).items() if candidate is arm)
    file = contents.documents.writer(value_span(contents.root, ("arms", name, "pictures")), contents.file)
    return str((file.parent / arm.model.pictures).resolve())


def _positions(group: ArmGroup, written: Mapping[str, Quantity]) -> dict[str, float]:
    return {joint: quantity.value for joint, quantity in written.items() if joint in group.joints}


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
    description, entries, found = reading.contents.of(body), reading.entries(), dict[str, ArmOfRobot]()
    groups: dict[str, ArmGroup | None] = {}
    for name, entry in entries.items():
        if entry.planner.type not in section_models.PLANNERS:
            path = ("arms", name, "planner", "type")
            node = at(reading.contents.root, path)
            reading.report.add(not_a_choice(reading.value(*path), "type", node, list(section_models.PLANNERS)))
        unknown = list(_unknown_controllers(reading, name, entry))
        reading.report.extend(unknown)
        if description is None:
            continue  # it is missing or has a mistake, which is reported
        group = _group_of(reading, name, entries, groups, description.body)
        if group is None:
            continue
        wrong = list(_mistakes(reading, name, entry, group, description.body))
        reading.report.extend(wrong)
        is_sound = not wrong and not unknown and entry.planner.type in section_models.PLANNERS
        found[name] = ArmOfRobot(entry, group, is_sound)
    return found


def _group_of(
    reading: Reading[ArmModel],
    name: str,
    entries: Mapping[str, ArmModel],
    groups: dict[str, ArmGroup | None],
    known: Body,
) -> ArmGroup | None:
    """Return the joints of an arm, and note them in `groups`; None after a finding."""
    model = entries.get(name)
    if name in groups or model is None:
        return groups.get(name)
    if not model.groups:
        groups[name] = _group(reading, name, model, known)
        return groups[name]
    groups[name] = None  # meanwhile
    parts = []
    for index, each in enumerate(model.groups):
        if _leads_to(each, name, entries):
            span = reading.value("arms", name, "groups", index)
            reading.report.add(NO_CHAIN.at(span, f"the arm '{name}' would be a part of itself"))
            return None
        parts.append(_group_of(reading, each, entries, groups, known))
    there = [part for part in parts if part is not None]
    groups[name] = together(known, there) if len(there) == len(parts) else None
    return groups[name]


def _leads_to(name: str, wanted: str, entries: Mapping[str, ArmModel]) -> bool:
    """Return whether an arm is another one, or made of it."""
    seen, waiting = set[str](), [name]
    while waiting:
        if (text := waiting.pop()) == wanted:
            return True
        if text not in seen and text in entries:
            seen.add(text)
            waiting += entries[text].groups
    return False


def _group(reading: Reading[ArmModel], name: str, model: ArmModel, known: Body) -> ArmGroup | None:
    """Return the joints of an arm; None after a finding."""

    def refuse(message: str, *path: str | int, help_text: str = "", related: Sequence[Related] = ()) -> None:
        span = reading.value("arms", name, *path)
        reading.report.add(NO_CHAIN.at(span, message, help=help_text, related=related))

    if model.links:
        if (found := carrying(known, model.links)) is None:
            message = f"no joint of these links carries '{model.links[-1]}', which would be the tip of the arm '{name}'"
            refuse(message, "links", len(model.links) - 1)
        return found
    if model.chain is None:
        for index, joint in enumerate(model.joints):
            if not known.joints[joint].moves or known.joints[joint].mimic is not None:
                words = "follows another joint" if known.joints[joint].mimic else f"is {known.joints[joint].kind}"
                refuse(f"'{joint}' {words}, so the arm '{name}' cannot move it", "joints", index)
                return None
        return group_of(known, model.joints)
    base, tip = model.chain.from_, model.chain.to
    if tip not in known.links:
        reading.report.add(_no_such_tip(reading.value("arms", name, "chain", "to"), model.chain, known))
        return None
    if (found := chain(known, base, tip)) is None:
        help_text = f"write 'chain: {{from: {tip}, to: {base}}}'" if chain(known, tip, base) is not None else ""
        related = [Related(reading.value("arms", name, "chain", "from"), "its base")]
        message = f"'{tip}' is not below '{base}', which carries the arm '{name}'"
        refuse(message, "chain", "to", help_text=help_text, related=related)
        return None
    for index, joint in enumerate(model.passive):
        if joint not in found.joints:
            refuse(f"'{joint}' is not on the chain of the arm '{name}'", "passive", index)
            return None
    if left := [joint for joint in found.joints if joint not in model.passive]:
        return ArmGroup(tuple(left), found.base, found.tip)
    refuse(f"nothing moves between '{base}' and '{tip}'", "chain", "to")
    return None


def _no_such_tip(span: Span, written: section_models.ChainModel, known: Body) -> Finding:
    """Return the finding about an end that is no link, with the links that could be: the farthest come first."""
    below = reversed([joint.child for joint in known.joints_downwards])
    tips = [link for link in below if (found := chain(known, written.from_, link)) and found.joints]
    message, what = f"'to': there is no link '{written.to}'", f"links that move below '{written.from_}'"
    return NOT_A_CHOICE.misspelt(span, message, written.to, tips, what)


def _mistakes(
    reading: Reading[ArmModel], name: str, model: ArmModel, group: ArmGroup, known: Body
) -> Iterator[Finding]:
    yield from _unled(reading, name, model, group)
    if (prefer := model.kinematics.prefer) is not None and prefer not in model.poses:
        span = reading.value("arms", name, "kinematics", "prefer")
        yield NO_POSE.misspelt(span, f"the arm '{name}' has no pose '{prefer}'", prefer, model.poses, "its poses")
    there = reading.contents.of(controllers).get(model.gripper or "")
    if model.gripper is not None and there is not None and not served_topic(model.gripper, there, GripperCommand):
        span = reading.value("arms", name, "gripper")
        yield NO_GRIPPER.at(span, f"'{model.gripper}' does not open and close anything, and is no gripper")
    elif there is not None:
        yield from _gripper_elsewhere(reading, name, model.gripper or "", there, group, known)
    for pose, written in model.poses.items():
        for joint, position in written.items():
            yield from _unfit(reading, (name, pose, joint), position, group, known)


def _unknown_controllers(reading: Reading[ArmModel], name: str, model: ArmModel) -> Iterator[Finding]:
    """Yield the findings about controllers that the robot does not have, with those that could be meant."""
    there, known = reading.contents.of(controllers), reading.contents.known.get(CONTROLLER, {})
    for key, written, type_, action in (
        ("controller", model.controller, "joint_trajectory", FollowJointTrajectory),
        ("gripper", model.gripper, "gripper", GripperCommand),
    ):
        if written is not None and written not in known:
            fitting = [other for other, config in there.items() if served_topic(other, config, action)]
            message, what = f"'{key}': there is no controller '{written}'", f"controllers of type {type_}"
            finding = NOT_A_CHOICE.misspelt(reading.value("arms", name, key), message, written, fitting, what)
            added = f"add '{written}: {{type: {type_}, ...}}' below 'controllers'"
            yield finding if fitting else replace(finding, help=added)


def _gripper_elsewhere(
    reading: Reading[ArmModel], name: str, gripper: str, there: ControllerConfig, group: ArmGroup, known: Body
) -> Iterator[Finding]:
    moved = moved_links(known, group.joints)
    last = next(joint.name for joint in way_up(known, group) if joint.name in group.joints)
    for joint in there.claimed:
        if joint not in known.joints:
            continue  # reported where the controller is
        is_own = joint in group.joints
        if is_own or last not in moved[known.joints[joint].parent]:
            words = "is one of the arm's own" if is_own else f"is not carried by '{last}'"
            message = f"'{gripper}' moves '{joint}', which {words}"
            related = [Related(reading.key("controllers", gripper), "the gripper")]
            yield GRIPPER_ELSEWHERE.at(reading.value("arms", name, "gripper"), message, related=related)
            return


def _unled(reading: Reading[ArmModel], name: str, model: ArmModel, group: ArmGroup) -> Iterator[Finding]:
    there = reading.contents.of(controllers).get(model.controller)
    span = reading.value("arms", name, "controller")
    if there is None:
        return  # it has a mistake, which is reported
    if not served_topic(model.controller, there, FollowJointTrajectory):
        yield NOT_LED.at(span, f"the controller '{model.controller}' follows no trajectories")
    elif left := [joint for joint in group.joints if joint not in there.claimed]:
        words = ", ".join(f"'{joint}'" for joint in left)
        related = [Related(reading.key("controllers", model.controller), "the controller")]
        yield NOT_LED.at(span, f"the controller '{model.controller}' does not lead {words}", related=related)


def _unfit(
    reading: Reading[ArmModel], where: tuple[str, str, str], position: Quantity, group: ArmGroup, known: Body
) -> Iterator[Finding]:
    """Yield what is wrong with the position of a joint in a pose."""
    name, pose, joint = where
    if joint not in group.joints:
        message = f"the pose '{pose}' names '{joint}', which is no joint of the arm '{name}'"
        key = reading.key("arms", name, "poses", pose, joint)
        yield NOT_OF_ARM.misspelt(key, message, joint, group.joints, "its joints")
        return
    span, slides = reading.value("arms", name, "poses", pose, joint), known.joints[joint].slides
    if position.dimension != (LENGTH if slides else ANGLE):
        words, wanted = ("slides", "a length") if slides else ("turns", "an angle")
        yield BEYOND.at(span, f"'{joint}' {words}, and this is {position.dimension.phrase}", help=f"write {wanted}")
        return
    limits = limits_in(reading.contents, known.joints[joint])
    nearest = limits.clamped(position.value)
    if abs(nearest - position.value) > _ROUNDING:
        shown = [format_quantity(value, position.dimension) for value in (position.value, nearest)]
        message = f"in the pose '{pose}', '{joint}' is at {shown[0]}, beyond its limits"
        yield BEYOND.at(span, message, help=f"the nearest that it reaches is {shown[1]}")

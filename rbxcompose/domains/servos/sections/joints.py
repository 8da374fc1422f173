"""The section `joints`: which servos turn which joint of the body."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from rbxcompose.base import units
from rbxcompose.base.config import ACTUATOR, Angle, Config, JointName, Length, Name, Refers
from rbxcompose.base.findings import Finding, kind
from rbxcompose.domains.body.model import BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.limits import MotionLimits, Tightened, tightened
from rbxcompose.domains.servos.models import joint_effort, model_named, steepest
from rbxcompose.domains.servos.sections.actuators import ActuatorModel, actuators
from rbxcompose.domains.servos.transmission import Calibration
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, at, key_span, value_span
from rbxcompose.manifest.validate import MISSING_KEY, WRONG_TYPE, validate

NOT_TOGETHER = kind("RBX2216")
DOES_NOT_MOVE = kind("RBX2217")
NOWHERE_TO_GO = kind("RBX2224")


def _either(turning: units.Dimension, sliding: units.Dimension) -> PlainValidator:
    """Return what reads a quantity of a joint that turns or slides."""

    def read(value: object) -> units.Quantity:
        read = units.parse_quantity(value) if isinstance(value, str) else value
        if not isinstance(read, units.Quantity) or read.dimension not in (turning, sliding):
            raise units.UnitError(f"must be {turning.phrase} or {sliding.phrase}, such as '{units.example(turning)}'")
        return read

    shape = {"anyOf": [{"x-dimension": turning.name}, {"x-dimension": sliding.name}]}
    return PlainValidator(read, json_schema_input_type=Annotated[Any, WithJsonSchema(shape)])


JointPosition = Annotated[units.Quantity, _either(units.ANGLE, units.LENGTH)]
JointSpeed = Annotated[units.Quantity, _either(units.ANGULAR_SPEED, units.SPEED)]
JointAcceleration = Annotated[units.Quantity, _either(units.ANGULAR_ACCELERATION, units.ACCELERATION)]
JointJerk = Annotated[units.Quantity, _either(units.ANGULAR_JERK, units.JERK)]
JointEffort = Annotated[units.Quantity, _either(units.TORQUE, units.FORCE)]


class DrivenLimitsModel(Config):
    """Limits of a joint; those of the body hold, too. Those of a joint that slides are lengths."""

    position: tuple[JointPosition, JointPosition] | None = None
    """Least and greatest position."""
    velocity: JointSpeed | None = None
    """Largest speed."""
    acceleration: JointAcceleration | None = None
    """Largest acceleration."""
    jerk: JointJerk | None = None
    """Largest change of the acceleration in motions that are planned for an arm; they take a little longer."""
    effort: JointEffort | None = None
    """Largest torque or force; that of the body holds, too, unless it is 0."""


class CalibrationPointModel(Config):
    """Where a joint is at an angle of its servo."""

    servo: Angle
    """Angle of the servo."""
    joint: JointPosition
    """Position of the joint."""


class JointModel(Config):
    """A joint that is driven."""

    actuator: Annotated[Name, Refers(ACTUATOR)] | None = None
    """The servo that turns it."""
    actuators: list[Annotated[Name, Refers(ACTUATOR)]] = []
    """Several servos that turn it together, instead of one."""
    ratio: float = 1.0
    """Turns of its servo for each turn of the joint."""
    offset: Angle = 0.0
    """Position of the joint when its servo is at the neutral tick."""
    travel: Length | None = None
    """How far a joint that slides goes for each turn of its servo."""
    calibration: list[CalibrationPointModel] = []
    """Measured angles of the servo and positions of the joint, instead of a ratio; straight lines between them."""
    limits: DrivenLimitsModel = DrivenLimitsModel()
    """Limits, tighter than those of the body."""

    @property
    def servos(self) -> list[str]:
        """Return the names of its servos."""
        return [*([self.actuator] if self.actuator else []), *self.actuators]


@section("joints", dict[JointName, JointModel], order=33, wires=True, shared=((),))
def joints(reading: Reading[dict[str, JointModel]]) -> dict[str, JointModel]:
    """Which joints of the body are driven, by their names in the URDF: the servos of each, and its limits.

    Example:
        body:
          urdf: robot.urdf
        buses:
          servos:
            type: dynamixel
        actuators:
          pan_servo: {bus: servos, model: AX-12, id: 1}
        joints:
          pan_joint:
            actuator: pan_servo
            limits:
              position: [-90 deg, 90 deg]
              velocity: 90 deg/s
    """
    found, known = _read(reading), reading.contents.of(body)
    there = known.body.joints if known else {}
    wrong: dict[str, Finding] = {}
    users: dict[str, str] = {}
    for name, model in found.items():
        own = there.get(name)
        mistakes = chain(_mistakes(reading, name, model, own, users), _follows(reading, found, name, own))
        if (finding := next(mistakes, None)) is not None:
            wrong[name] = finding
    reading.report.extend(wrong.values())
    return {name: joint for name, joint in found.items() if name not in wrong}


def _read(reading: Reading[dict[str, JointModel]]) -> dict[str, JointModel]:
    """Return the joints without mistakes: one by one, so that none hides another one."""
    node, found = reading.node, dict[str, JointModel]()
    if not isinstance(node, MappingNode):
        return reading.whole() or {}
    for name, entry in node.entries.items():
        alone = replace(node, entries={name: entry})
        read = validate(reading.section.model, alone, ("joints",), reading.report, reading.contents.known)
        found.update(read or {})
    return found


def unread_joints(contents: Contents) -> frozenset[str]:
    """Return the joints that are written and have mistakes."""
    node = contents.root.get(joints.name)
    written = node.entries.keys() if isinstance(node, MappingNode) else ()
    return frozenset(written - contents.of(joints).keys() if written else ())


def _is_written(reading: Reading[dict[str, JointModel]], joint: str) -> bool:
    node = reading.node
    return isinstance(node, MappingNode) and joint in node


def may_be_driven(contents: Contents, joint: str) -> bool:
    """Return whether a joint is among those with mistakes, or may be one of them under a misspelt name."""
    description, unread = contents.of(body), unread_joints(contents)
    return joint in unread or (description is not None and not unread <= description.body.joints.keys())


def _mistakes(
    reading: Reading[dict[str, JointModel]],
    name: str,
    model: JointModel,
    joint: BodyJoint | None,
    users: dict[str, str],
) -> Iterator[Finding]:
    root = reading.contents.root
    at = reading.key("joints", name)
    if not model.servos:
        yield MISSING_KEY.at(at, f"joint '{name}' needs the key 'actuator'")
    yield from _servos(reading, name, model, users)
    for key, value in (("ratio", model.ratio), ("travel", model.travel)):
        if value == 0.0:
            yield NOT_TOGETHER.at(reading.value("joints", name, key), f"with a {key} of 0, joint '{name}' never moves")
    if joint is not None:
        yield from _of_body(root, name, model, joint)
    if model.calibration and (reason := _no_table(model)):
        yield NOT_TOGETHER.at(reading.key("joints", name, "calibration"), reason)
    for key, reason, help_text in _no_motion(model, joint):
        yield NOWHERE_TO_GO.at(reading.value("joints", name, "limits", key), f"joint '{name}' {reason}", help=help_text)


def _of_body(root: MappingNode, name: str, model: JointModel, joint: BodyJoint) -> Iterator[Finding]:
    """Yield what does not fit to the joint of the body."""
    at = key_span(root, ("joints", name))
    if not joint.moves:
        yield DOES_NOT_MOVE.at(at, f"joint '{name}' is {joint.kind} in the body, so no servo can move it")
    slides = joint.slides
    if slides and model.travel is None and not model.calibration:
        yield NOT_TOGETHER.at(at, f"joint '{name}' slides: it needs 'travel' or 'calibration'")
    if not slides and model.travel is not None:
        span = value_span(root, ("joints", name, "travel"))
        yield NOT_TOGETHER.at(span, f"joint '{name}' turns: 'travel' is for joints that slide")
    for path, written in _quantities(model):
        if written.dimension not in (
            (units.LENGTH, units.SPEED, units.ACCELERATION, units.FORCE) if slides else _TURNING
        ):
            words = "slides" if slides else "turns"
            span = value_span(root, ("joints", name, *path))
            yield WRONG_TYPE.at(span, f"joint '{name}' {words}, and this is {written.dimension.phrase}")


def _follows(
    reading: Reading[dict[str, JointModel]], found: Mapping[str, JointModel], name: str, joint: BodyJoint | None
) -> Iterator[Finding]:
    """Yield why a joint cannot follow the one that it mimics in the body."""
    if joint is None or joint.mimic is None:
        return
    leader, known = joint.mimic.joint, reading.contents.of(actuators)
    at = reading.key("joints", name)
    if leader not in found:
        if _is_written(reading, leader):
            return  # it has a mistake, which is reported
        yield NOT_TOGETHER.at(at, f"joint '{name}' mimics '{leader}' in the body, which no servo drives")
        return
    servos = [known[servo] for text in (name, leader) for servo in found[text].servos if servo in known]
    if len({servo.bus for servo in servos}) > 1:
        yield NOT_TOGETHER.at(at, f"joint '{name}' mimics '{leader}' in the body, whose servo is on another bus")
    if any(servo.mode == "velocity" for servo in servos):
        yield NOT_TOGETHER.at(at, f"joint '{name}' mimics '{leader}' in the body, but servos with velocities do not")


_TURNING = (units.ANGLE, units.ANGULAR_SPEED, units.ANGULAR_ACCELERATION, units.ANGULAR_JERK, units.TORQUE)


def _no_motion(model: JointModel, joint: BodyJoint | None) -> Iterator[tuple[str, str, str]]:
    """Yield the limits under which it cannot move: the key, why not, and what helps."""
    limits, outer = model.limits, _body_limits(joint)
    for key in ("velocity", "acceleration", "jerk"):
        value: units.Quantity | None = getattr(limits, key)
        if value is not None and value.value <= 0.0:
            yield key, f"cannot move with a limit of {_shown(value)}", "a limit is above 0, for both directions"
    if limits.position is None:
        return
    least, greatest = limits.position
    if least.value > greatest.value:
        words = f"has its limits the wrong way round: {_shown(least)}, {_shown(greatest)}"
        yield "position", words, f"write '[{_shown(greatest)}, {_shown(least)}]'"
    elif least.value == greatest.value:
        yield "position", f"may only be at {_shown(least)}", "give it a range that has a length"
    elif greatest.value <= outer.least or least.value >= outer.greatest:
        dimension = least.dimension
        bounds = " to ".join(units.format_quantity(bound, dimension) for bound in (outer.least, outer.greatest))
        words = f"may go from {_shown(least)} to {_shown(greatest)}, but in the body from {bounds}"
        yield "position", words, "give it a range that lies within that of the body"


def _shown(quantity: units.Quantity) -> str:
    return units.format_quantity(quantity.value, quantity.dimension)


def _body_limits(joint: BodyJoint | None) -> MotionLimits:
    outer = joint.limits if joint else None
    if joint is None or outer is None:
        return MotionLimits()
    lower, upper = (None, None) if joint.kind == "continuous" else (outer.lower, outer.upper)
    return MotionLimits(lower, upper, None if outer.velocity is None else abs(outer.velocity))


def limits_of(model: JointModel, joint: BodyJoint | None) -> Tightened:
    """Return the limits of the body, tightened by those of the manifest."""
    own = model.limits
    least, greatest = [each.value for each in own.position] if own.position else (None, None)
    velocity = own.velocity.value if own.velocity else None
    acceleration, jerk = own.acceleration.value if own.acceleration else None, own.jerk.value if own.jerk else None
    return tightened(_body_limits(joint), MotionLimits(least, greatest, velocity, acceleration, jerk=jerk))


def held_limits(model: JointModel, joint: BodyJoint | None) -> MotionLimits:
    """Return the limits that hold; none for a joint whose limits are a mistake, which is reported."""
    return limits_of(model, joint).limits or MotionLimits()


def limits_in(contents: Contents, joint: BodyJoint) -> MotionLimits:
    """Return the limits of a joint: those of the body, and the tighter ones of the joint if it is driven."""
    driven = contents.of(joints).get(joint.name)
    if driven is not None:
        return held_limits(driven, joint)
    outer = joint.limits
    if outer is None or joint.kind == "continuous":
        return MotionLimits()
    return MotionLimits(outer.lower, outer.upper)


def _servos(
    reading: Reading[dict[str, JointModel]], name: str, model: JointModel, users: dict[str, str]
) -> Iterator[Finding]:
    known = reading.contents.of(actuators)
    at = reading.key("joints", name)
    there: Mapping[str, ActuatorModel] = {servo: known[servo] for servo in model.servos if servo in known}
    for servo in model.servos:
        if model.servos.count(servo) > 1:
            yield NOT_TOGETHER.at(at, f"the servo '{servo}' is named twice at joint '{name}'", help="name it once")
        if (other := users.setdefault(servo, name)) != name:
            free = ", ".join(f"'{actuator}'" for actuator in known if actuator not in _written_servos(reading.node))
            help_text = f"actuators without a joint: {free}" if free else ""
            yield NOT_TOGETHER.at(at, f"the servo '{servo}' drives '{other}' and '{name}'", help=help_text)
    for what in ("bus", "mode"):
        values = sorted({str(getattr(servo, what)) for servo in there.values()})
        if len(values) > 1:
            yield NOT_TOGETHER.at(at, f"the servos of joint '{name}' differ in their {what}: {', '.join(values)}")


def _written_servos(node: TreeNode | None) -> set[str]:
    """Return the servos that the joints name."""
    entries = node.entries.values() if isinstance(node, MappingNode) else ()
    named = [at(entry.value, (key,)) for entry in entries for key in ("actuator", "actuators")]
    items = [*named, *(item for one in named if isinstance(one, SequenceNode) for item in one.items)]
    return {item.text for item in items if isinstance(item, ScalarNode)}


def _quantities(model: JointModel) -> Iterator[tuple[KeyPath, units.Quantity]]:
    limits = model.limits
    for index, position in enumerate(limits.position or ()):
        yield ("limits", "position", index), position
    for name in ("velocity", "acceleration", "jerk", "effort"):
        if (value := getattr(limits, name)) is not None:
            yield ("limits", name), value
    for index, point in enumerate(model.calibration):
        yield ("calibration", index, "joint"), point.joint


def _no_table(model: JointModel) -> str:
    """Return why the calibration is none, or nothing."""
    try:
        Calibration(table_of(model))
    except ValueError as error:
        return str(error)
    return ""


def table_of(model: JointModel) -> tuple[tuple[float, float], ...]:
    """Return the calibration: angles of the servo and positions of the joint, in SI."""
    return tuple(sorted((point.servo, point.joint.value) for point in model.calibration))


def effort_of(joint: JointModel, servos: Iterable[ActuatorModel]) -> float | None:
    """Return the most that its servos exert on a joint [Nm or N], None if that is not known of one of them."""
    models = [model_named(servo.model) for servo in servos]
    known = [model for model in models if model is not None]
    if not known or len(known) < len(models):  # those of other types of buses
        return None
    gear = math.tau / joint.travel if joint.travel else joint.ratio
    return joint_effort(known, steepest(table_of(joint)) if joint.calibration else gear)

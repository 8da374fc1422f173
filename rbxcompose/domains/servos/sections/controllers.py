"""The section `controllers`: what leads joints."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from rbxcompose.base.config import CONTROLLER, Config
from rbxcompose.base.findings import DID_YOU_MEAN, Finding, Related, Span, kind
from rbxcompose.base.plugins import BROKEN, BrokenPluginError
from rbxcompose.domains.body.model import BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.controller import PLUGINS, ControllerConfig, controller_names, controller_type
from rbxcompose.domains.servos.models import OUTPUTS
from rbxcompose.domains.servos.sections.actuators import actuators, model_of
from rbxcompose.domains.servos.sections.joints import held_limits, joints, may_be_driven
from rbxcompose.manifest.arguments import decided_at
from rbxcompose.manifest.foreign_words import CONTROLLERS
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, at, key_span
from rbxcompose.manifest.validate import MISSING_KEY, not_a_choice
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.trajectory_msgs import JointTrajectory
from rbxcompose.sdk.ports import In, ServesAction

NOT_DRIVEN = kind("RBX2215")
CLAIMED_TWICE = kind("RBX2220")
NAME_OF_JOINT = kind("RBX2221")
CANNOT_WORK = kind("RBX2222")
NO_WHOLE_TURN = kind("RBX2280")
WRONG_KIND = kind("RBX2285")
BEYOND_LIMITS = kind("RBX2290")
NO_ITEM = kind("RBX2291", is_fixable=True)


def _models(node: TreeNode) -> Iterator[type[Config]]:
    """Yield the configuration of the type, if that is written down and known."""
    written = at(node, ("type",))
    name = written.text if isinstance(written, ScalarNode) else ""
    try:
        yield controller_type(name).config_type() if name in controller_names() else ControllerConfig
    except BrokenPluginError:  # reported where the section is read
        yield ControllerConfig


def _details(read: Mapping[str, ControllerConfig]) -> dict[str, str]:
    return {name: f"{config.type} of {', '.join(config.claimed)}" for name, config in read.items()}


@section(
    "controllers",
    ControllerConfig,
    order=34,
    names=CONTROLLER,
    wires=True,
    entry="controller",
    needs="type",
    models=_models,
    types=lambda: {name: controller_type(name) for name in controller_names()},
    details=_details,
)
def controllers(reading: Reading[ControllerConfig]) -> dict[str, ControllerConfig]:
    """What leads joints, by name: a `type`, and the settings of that type. A controller is a skill of missions.

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
    """
    found: dict[str, ControllerConfig] = {}
    owners: dict[str, tuple[str, Span]] = {}
    for name, entry in reading.named():
        config = _read(reading, name, entry)
        wrong = None if config is None else next(_mistakes(reading, name, config, owners), None)
        if wrong is not None:
            reading.report.add(wrong)
        elif config is not None:
            found[name] = config
    return found


def _read(reading: Reading[ControllerConfig], name: str, entry: Entry) -> ControllerConfig | None:
    """Return a controller's settings, None after findings."""
    written = at(entry.value, ("type",))
    names = controller_names()
    if not isinstance(entry.value, MappingNode) or not isinstance(written, ScalarNode):
        if isinstance(entry.value, MappingNode) and written is None:
            reading.report.add(MISSING_KEY.at(entry.key.span, f"controller '{name}' needs the key 'type'"))
        elif isinstance(entry.value, MappingNode):  # without a type nobody knows which other keys it has
            only = {"type": entry.value.entries["type"]}
            reading.valid(ControllerConfig, name, replace(entry.value, entries=only))
        else:
            reading.valid(ControllerConfig, name, entry.value)
        return None
    if written.text not in names:
        reading.report.add(_unknown_type(written, names))
        return None
    try:
        with PLUGINS.guarded(written.text):
            cls = controller_type(written.text)
            config = reading.valid(cls.config_type(), name, entry.value)
            if config is not None:
                cls.ports(name, config)  # asked for in many places: what it raises is reported here
            return config
    except BrokenPluginError as error:
        reading.report.add(BROKEN.at(written.span, str(error)))
        return None


def _unknown_type(written: ScalarNode, names: Sequence[str]) -> Finding:
    """Return the finding for a type of controller that does not exist; `package/Class` is that of ros2_control."""
    finding = not_a_choice(written.span, "type", written, [*names])
    package, _, cls = written.text.partition("/")
    if written.text.lower().endswith(_PUBLISHING):
        return replace(finding, help="what is measured is published without a controller: remove it", fix=None)
    ours = CONTROLLERS.get(cls) or CONTROLLERS.get(package)
    if ours in names:
        return replace(finding, help=f"{DID_YOU_MEAN} '{ours}'?", fix=None)
    return replace(finding, help="", fix=None) if cls else finding


_PUBLISHING = ("broadcaster", "joint_state_controller", "jointstatecontroller")
"""How the names of those end that only publish, in ros2_control and ros_control."""


def _mistakes(
    reading: Reading[ControllerConfig], name: str, config: ControllerConfig, owners: dict[str, tuple[str, Span]]
) -> Iterator[Finding]:
    root = reading.contents.root
    here, cls = reading.key("controllers", name), controller_type(config.type)
    yield from _undriven(reading, name, config)
    yield from _following(reading, name, config)
    yield from _unfit(reading, name, config)
    yield from _blind(reading, name, config)
    if name in reading.contents.of(joints):
        yield NAME_OF_JOINT.at(here, f"'{name}' is a joint and a controller")
    if (mistake := cls.mistake(config)) is not None:
        field, reason = mistake
        place = ("controllers", name, field)
        span = decided_at(root, place, key_span(root, place))
        yield CANNOT_WORK.at(span, f"controller '{name}': {reason}")
    elif twice := [joint for joint in config.claimed if config.claimed.count(joint) > 1]:
        yield CANNOT_WORK.at(_place(reading, name, twice[0]), f"controller '{name}': '{twice[0]}' is named twice")
    else:
        yield from _beyond(reading, name, config)
        yield from _unknown_items(reading, name, config)
    for joint in config.claimed if config.start == "active" else ():
        other, span = owners.setdefault(joint, (name, here))
        if other != name:
            message = f"controllers '{other}' and '{name}' both lead '{joint}' from the start"
            help_text = "give one of them 'start: inactive'"
            yield CLAIMED_TWICE.at(here, message, help=help_text, related=[Related(span, "the other one")])


def _undriven(reading: Reading[ControllerConfig], name: str, config: ControllerConfig) -> Iterator[Finding]:
    driven, servos = reading.contents.of(joints), reading.contents.of(actuators)
    if not driven and "joints" in reading.contents.root:
        return  # they have mistakes, which are reported
    wanted, buses = controller_type(config.type).interface, set[str]()
    for joint in config.claimed:
        span = _place(reading, name, joint)
        if joint not in driven:
            if may_be_driven(reading.contents, joint):
                return  # it has a mistake, which is reported
            message = f"the controller '{name}' leads '{joint}', which no servo drives"
            if (description := reading.contents.of(body)) and joint in description.body.joints:
                help_text = f"give it an actuator: '{joint}: {{actuator: ...}}' below 'joints', or leave it out here"
                yield NOT_DRIVEN.at(span, message, help=help_text, about=[joint])
            else:
                others = {each: entry for each, entry in driven.items() if each not in config.claimed}
                yield NOT_DRIVEN.misspelt(span, message, joint, others, "joints with a servo")
            return
        for each, servo in ((each, servos[each]) for each in driven[joint].servos if each in servos):
            buses.add(servo.bus)
            if servo.mode != wanted:
                given, taken = _PLURAL[wanted], _PLURAL[servo.mode]
                message = f"the controller '{name}' gives {given}, and the servos of '{joint}' take {taken}"
                there = reading.key("actuators", each)
                first, other = (there, span) if there.file == span.file else (span, there)
                related = [Related(other, "the controller" if first is there else "the actuator")]
                yield NOT_DRIVEN.at(first, message, help=f"give '{each}' 'mode: {wanted}'", related=related)
        if len(buses) > 1:
            yield NOT_DRIVEN.at(
                span, f"the joints of the controller '{name}' are on two buses: {', '.join(sorted(buses))}"
            )


def _following(reading: Reading[ControllerConfig], name: str, config: ControllerConfig) -> Iterator[Finding]:
    """Yield a finding for each joint that already follows another one."""
    description = reading.contents.of(body)
    known = description.body.joints if description else {}
    for joint in config.claimed:
        if joint in known and (mimic := known[joint].mimic) is not None:
            message = f"'{joint}' mimics '{mimic.joint}' in the body, so the controller '{name}' cannot lead it"
            related = [Related(known[joint].span, "the joint")]
            yield NOT_DRIVEN.at(_place(reading, name, joint), message, help=f"lead '{mimic.joint}'", related=related)


def _unfit(reading: Reading[ControllerConfig], name: str, config: ControllerConfig) -> Iterator[Finding]:
    """Yield a finding for each joint whose kind the controller cannot lead."""
    description, wanted = reading.contents.of(body), controller_type(config.type).kinds_for(config)
    known = description.body.joints if description else {}
    for joint in config.claimed if wanted else ():
        if joint in known and known[joint].kind not in wanted:
            kinds = " or ".join(sorted(wanted))
            message = f"'{joint}' is {known[joint].kind} in the body, and '{name}' leads joints that are {kinds}"
            related = [Related(known[joint].span, "the joint")]
            yield WRONG_KIND.at(_place(reading, name, joint), message, related=related)


def _blind(reading: Reading[ControllerConfig], name: str, config: ControllerConfig) -> Iterator[Finding]:
    """Yield a finding for each servo that cannot measure how far its joint turns."""
    driven, servos = reading.contents.of(joints), reading.contents.of(actuators)
    if controller_type(config.type).interface != "velocity":
        return
    for servo in (
        each for joint in config.claimed if joint in driven for each in driven[joint].servos if each in servos
    ):
        model = model_of(reading.contents, servos[servo])
        if model is not None and model.family.span < math.tau - model.per_tick:
            degrees = round(math.degrees(model.family.span))
            message = (
                f"'{name}' needs to know how far '{servo}' turns, and an {model.name} measures {degrees} of 360 deg"
            )
            span = reading.value("actuators", servo, "model")
            help_text = "take a model that sees the whole turn, such as XL430-W250 or MX-28"
            here = Related(reading.key("controllers", name), "the controller")
            yield NO_WHOLE_TURN.at(span, message, help=help_text, related=[here])


def _beyond(reading: Reading[ControllerConfig], name: str, config: ControllerConfig) -> Iterator[Finding]:
    """Yield findings on joints that the controller would move beyond their limits."""
    driven, description = reading.contents.of(joints), reading.contents.of(body)
    known = description.body.joints if description else {}
    for joint, (least, greatest) in controller_type(config.type).asks(config).items():
        if joint not in driven:
            continue
        limits = held_limits(driven[joint], known.get(joint))
        is_below = least < limits.least - _ROUNDING
        is_above = greatest > limits.greatest + _ROUNDING
        if is_below or is_above:
            show = _shown(known.get(joint))
            message = f"the controller '{name}' moves '{joint}' from {show(least)} to {show(greatest)}"
            bounds = " to ".join("any" if end is None else show(end) for end in (limits.lower, limits.upper))
            yield BEYOND_LIMITS.at(_place(reading, name, joint), f"{message}, beyond its limits: {bounds}")


def _unknown_items(reading: Reading[ControllerConfig], name: str, config: ControllerConfig) -> Iterator[Finding]:
    """Yield findings on items that the model of a servo lacks, or that may not be switched."""
    servos = reading.contents.of(actuators)
    for used in config.used:
        model = model_of(reading.contents, servos[used.actuator]) if used.actuator in servos else None
        valid = [item for item in model.items if item in OUTPUTS or not used.is_written] if model else []
        if model is not None and used.item not in valid:
            span = reading.value("controllers", name, used.field)
            is_there = used.item in model.items
            message = f"'{used.item}' cannot be switched" if is_there else f"{model.name} has no item '{used.item}'"
            what = "items that can be switched" if used.is_written else "its items"
            yield NO_ITEM.misspelt(span, message, used.item, valid, what)


def _shown(joint: BodyJoint | None) -> Callable[[float], str]:
    """Return how positions of a joint are written."""
    if joint is not None and joint.kind == "prismatic":
        return lambda position: f"{position:.4g} m"
    return lambda position: f"{math.degrees(position):.4g} deg"


_ROUNDING = 1e-4  # [rad or m], less than a tick
_PLURAL = {"position": "positions", "velocity": "velocities"}


def _place(reading: Reading[ControllerConfig], name: str, joint: str) -> Span:
    """Return where a controller names a joint."""
    node = at(reading.contents.root, ("controllers", name))
    for key, entry in node.entries.items() if isinstance(node, MappingNode) else ():
        items = [entry.value, *getattr(entry.value, "items", ())] if not isinstance(entry.value, MappingNode) else []
        for item in items:
            if isinstance(item, ScalarNode) and item.text == joint and key != "type":
                return item.span
    return reading.value("controllers", name)


def served_topic(name: str, config: ControllerConfig, action: type[Any]) -> str:
    """Return the topic at which a controller serves an action; nothing if it does not."""
    ports = controller_type(config.type).ports(name, config).values()
    return next((port.topic for port in ports if isinstance(port, ServesAction) and port.interface is action), "")


def follow_topic(contents: Contents, controller: str) -> str:
    """Return the topic at which a controller takes trajectories; nothing if it takes none."""
    there = contents.of(controllers).get(controller)
    return served_topic(controller, there, FollowJointTrajectory) if there is not None else ""


def stream_topic(contents: Contents, controller: str) -> str:
    """Return the topic on which a controller takes trajectories; nothing if it takes none."""
    there = contents.of(controllers).get(controller)
    ports = controller_type(there.type).ports(controller, there).values() if there is not None else ()
    return next((port.topic for port in ports if isinstance(port, In) and port.interface is JointTrajectory), "")

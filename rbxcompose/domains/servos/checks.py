"""Rules about servos, the joints that they drive, and the controllers that lead them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression, ExpressionError, ExpressionNode, Minus, Variable
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.findings import NAMES, WIRING, Finding, Related, Severity, Span
from rbxcompose.base.units import (
    ANGLE,
    ANGULAR_SPEED,
    BIT_RATE,
    FREQUENCY,
    LENGTH,
    SPEED,
    TIME,
    UNITS,
    Quantity,
    format_quantity,
)
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotMission
from rbxcompose.compiler.model.skills import constants, is_served
from rbxcompose.domains.body.model import BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.bus import DYNAMIXEL, FACTORY_DELAY
from rbxcompose.domains.servos.joint_drive import ServoJoint
from rbxcompose.domains.servos.models import COMMON_BAUDS, ServoModel, model_named, stall_torque
from rbxcompose.domains.servos.sections.actuators import actuators, model_of
from rbxcompose.domains.servos.sections.controllers import controllers
from rbxcompose.domains.servos.sections.joints import JointModel, effort_of, joints, limits_of
from rbxcompose.domains.servos.sections.safety import safety
from rbxcompose.domains.servos.transfers import BusLoad, cycle_load
from rbxcompose.manifest.tree import KeyPath, ScalarNode, at, value_span
from rbxcompose.missions.analysis.facts import Constants, number_in
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.program.parts import NodeFlow, WrittenArgument, expression_of
from rbxcompose.missions.program.program import MissionNode, Skill
from rbxcompose.sdk.capabilities import BoundsGoals, LocksInSilence
from rbxcompose.sdk.ports import In, ServesAction

BUSES = ("buses",)
ROUNDED = 0.002
"""Of a limit, by which two that mean the same may differ: 145 deg and 2.53 rad."""


@dataclass(frozen=True, slots=True)
class DrivenJoint:
    """A joint of a bus: as it is written, in the body (None without one), and as it is driven."""

    robot: Robot
    bus: str
    written: JointModel
    body: BodyJoint | None
    joint: ServoJoint
    mimics: str
    """The joint that it follows, empty if it takes commands."""

    @property
    def name(self) -> str:
        """Return its name."""
        return self.joint.name

    def key(self, *path: str | int) -> Span:
        """Return the place of a key of its entry, or of the nearest one above it."""
        return self.robot.key("joints", self.name, *path)

    def value(self, *path: str | int) -> Span:
        """Return the place of a value of its entry, or of the nearest one above it."""
        return self.robot.value("joints", self.name, *path)

    @property
    def slides(self) -> bool:
        """Return whether its positions are lengths."""
        return self.body is not None and self.body.slides

    def position(self, value: float) -> str:
        """Write a position for people."""
        return format_quantity(value, LENGTH, "cm") if self.slides else format_quantity(value, ANGLE)

    def speed(self, value: float) -> str:
        """Write a speed for people."""
        return format_quantity(value, SPEED) if self.slides else format_quantity(value, ANGULAR_SPEED)


@dataclass(frozen=True, slots=True)
class DrivenBus:
    """A bus of servos: their models and modes by id, its rates [bit/s, Hz] and the pause before a reply [s], if set."""

    name: str
    path: KeyPath
    baud: int
    rate: float
    delay: float | None
    servos: Mapping[int, tuple[ServoModel, str]]


def driven_buses(robot: Robot) -> Iterator[DrivenBus]:
    """Yield each bus of Dynamixel servos whose joints are driven."""
    for component in robot.components.values():
        bus: Any = component.config
        if component.path[:1] == BUSES and bus.kind == DYNAMIXEL:
            servos = {
                servo.id: (bus.model(servo.model), item.mode) for item in bus.joints.values() for servo in item.servos
            }
            yield DrivenBus(bus.name, component.path, bus.baud, bus.rate, bus.return_delay, servos)


def driven_joints(robot: Robot) -> Iterator[DrivenJoint]:
    """Yield all joints that servos drive."""
    written = robot.manifest.contents.of(joints)
    description = robot.manifest.contents.of(body)
    known = description.body.joints if description else {}
    for component in robot.components.values():
        if component.path[:1] == BUSES:
            from rbxcompose.domains.servos.bus_config import drives_of  # slow to import, and most robots need none

            bus: Any = component.config
            for name, drive in drives_of(bus).items():
                if name in written:
                    yield DrivenJoint(
                        robot, bus.name, written[name], known.get(name), drive.joint, bus.joints[name].mimic
                    )


def models_on(robot: Robot, bus: str) -> dict[str, ServoModel]:
    """Return the models of all actuators of a bus."""
    contents = robot.manifest.contents
    own = {name: entry for name, entry in contents.of(actuators).items() if entry.bus == bus}
    return {name: model for name, entry in own.items() if (model := model_of(contents, entry))}


@check("RBX2227")
def baud_of_servo(robot: Robot) -> Iterator[Finding]:
    """A servo does not have the rate of its bus."""
    for bus in driven_buses(robot):
        models = models_on(robot, bus.name)
        unfit = [name for name, model in models.items() if model.code_of(bus.baud) is None]
        if unfit:
            names = sorted({models[name].name for name in unfit})
            common = [baud for baud in COMMON_BAUDS if all(item.code_of(baud) is not None for item in models.values())]
            yield baud_of_servo.at(
                robot.value(*bus.path, "baud"),
                f"{' and '.join(names)} cannot listen at {format_quantity(bus.baud, BIT_RATE)}",
                help=f"rates that all servos of the bus have: {', '.join(map(str, common))}",
                related=[Related(robot.key("actuators", unfit[0]), f"'{unfit[0]}' is one of them")],
            )


@check("RBX2242", Severity.WARNING, closed=(WIRING,))
def supply_voltage(robot: Robot) -> Iterator[Finding]:
    """Servos on one bus need different voltages."""
    for bus in driven_buses(robot):
        models = models_on(robot, bus.name)
        if not models:
            continue
        strong = max(models, key=lambda name: models[name].volts[0])
        weak = min(models, key=lambda name: models[name].volts[1])
        (least, _), (_, most) = models[strong].volts, models[weak].volts
        if most < least:
            late = max(strong, weak, key=list(models).index)
            yield supply_voltage.at(
                robot.value("actuators", late, "model"),
                f"'{weak}' ({models[weak].name}) takes at most {most:g} V, and '{strong}' ({models[strong].name}) "
                f"at least {least:g} V, on the one cable of bus '{bus.name}'",
                help="put them on two buses, each with its own supply",
                related=[Related(robot.value("actuators", strong if late == weak else weak, "model"), "the other")],
            )


@check("RBX2226", Severity.WARNING, closed=(WIRING,))
def slow_bus(robot: Robot) -> Iterator[Finding]:
    """A cycle of a bus does not fit into its period."""
    for bus in driven_buses(robot):
        delay = FACTORY_DELAY if bus.delay is None else bus.delay
        load, period = cycle_load(bus.servos), 1.0 / bus.rate
        taken = load.time(bus.baud, delay)
        if taken <= period:
            continue
        written = next((key for key in ("rate", "baud") if at(robot.manifest.root, (*bus.path, key))), None)
        pauses = f"{load.replies} pauses of {format_quantity(delay, TIME, 'us')}" if delay else "no pauses"
        yield slow_bus.at(
            robot.value(*bus.path, written) if written else robot.key(*bus.path),
            f"a cycle of the bus '{bus.name}' takes {_ms(taken)} at {format_quantity(bus.baud, BIT_RATE)}, and "
            f"{format_quantity(bus.rate, FREQUENCY)} leave {_ms(period)}",
            label=f"{len(bus.servos)} servos: {load.length} B and {pauses}",
            help=f"what would fit: {', or '.join(_cures(bus, load, delay))}",
        )


def _ms(time: float) -> str:
    return format_quantity(round(time, 5), TIME, "ms")


def _cures(bus: DrivenBus, load: BusLoad, delay: float) -> Iterator[str]:
    """Yield single changes that make the cycle fit."""
    possible = 1.0 / load.time(bus.baud, delay)
    yield f"'rate: {math.floor(possible) if possible >= 1.0 else round(possible, 2)} Hz'"
    needed, without = (load.baud_for(1.0 / bus.rate, value) for value in (delay, 0.0))
    if delay and without <= bus.baud:
        yield "'return_delay: 0 s'"
    if faster := _least(bus, needed):
        yield f"'baud: {faster}'"
    elif without > bus.baud and (faster := _least(bus, without)):
        yield f"'baud: {faster}' with 'return_delay: 0 s'"


def _least(bus: DrivenBus, needed: float) -> int | None:
    """Return the least rate that all servos have and that is enough [bit/s]."""
    models = [model for model, _ in bus.servos.values()]
    enough = (baud for baud in COMMON_BAUDS if baud >= needed)
    return next((baud for baud in enough if all(model.code_of(baud) is not None for model in models)), None)


ROUNDING = 1e-3  # of an effort


@check("RBX2240", Severity.WARNING, closed=(WIRING,))
def effort_out_of_reach(robot: Robot) -> Iterator[Finding]:
    """A limit of the effort that servos do not reach."""
    contents = robot.manifest.contents
    servos = contents.of(actuators)
    for name, joint in contents.of(joints).items():
        limit, most = joint.limits.effort, effort_of(joint, [servos[each] for each in joint.servos if each in servos])
        if limit is not None and most is not None and limit.value > most * (1.0 + ROUNDING):
            wanted, can = format_quantity(limit.value, limit.dimension), format_quantity(most, limit.dimension)
            yield effort_out_of_reach.at(
                value_span(contents.root, ("joints", name, "limits", "effort")),
                f"joint '{name}' is limited to {wanted}, and its servos exert {can} at most",
            )


@check("RBX2241", Severity.WARNING, closed=(WIRING,))
def effort_without_effect(robot: Robot) -> Iterator[Finding]:
    """A limit of the effort that has no effect."""
    contents = robot.manifest.contents
    servos = contents.of(actuators)
    for name, joint in contents.of(joints).items():
        for each in joint.servos if joint.limits.effort is not None else ():
            model = model_named(servos[each].model) if each in servos else None
            if model is not None and stall_torque(model) is None:
                yield effort_without_effect.at(
                    value_span(contents.root, ("joints", name, "limits", "effort")),
                    f"joint '{name}' has no limit of its effort: the stall torque of a {model.name} is not known",
                    help=f"limit the servo '{each}' by its share: 'torque: 50 %'",
                )
                break


_SCALES = ("calibration", "travel", "ratio", "offset")
_TURNS = 4 * math.tau  # [rad] of a limit that no joint with a servo has
_TICK = 1.01  # ticks that a limit may lie outside: that of 150 deg is one beyond the last tick of an AX-12


@check("RBX2225", Severity.WARNING, closed=(WIRING,))
def out_of_reach(robot: Robot) -> Iterator[Finding]:
    """A joint may go where its servo cannot."""
    for driven in driven_joints(robot):
        if driven.joint.mode == "position":
            yield from _beyond_reach(driven)


def _beyond_reach(driven: DrivenJoint) -> Iterator[Finding]:
    joint, limits = driven.joint, driven.joint.limits
    (first, last), slack = joint.reach, _TICK * joint.per_tick
    is_below = limits.least < first - slack and (limits.lower is not None or joint.is_continuous)
    is_above = limits.greatest > last + slack and (limits.upper is not None or joint.is_continuous)
    if not (is_below or is_above):
        return
    bounds = f"{driven.position(limits.least)} to {driven.position(limits.greatest)}"
    wanted = "turns without end" if limits.are_endless else f"may go from {bounds}"
    servo = "its servo reaches" if len(joint.servos) == 1 else "its servos reach"
    body = driven.body.limits if driven.body else None
    message = f"'{driven.name}' {wanted}, but {servo} {driven.position(first)} to {driven.position(last)}"
    if body and not driven.slides and body.may_be_degrees:
        return  # reported as RBX2021
    if body and not limits.are_endless and (intended := _in_degrees(driven)):
        help_text = f"limits in a URDF are in radians: for degrees, write {intended}"
        yield out_of_reach.at(body.span, message, help=help_text)
        return
    yield out_of_reach.at(
        _place(driven, is_shifted=limits.least > last or limits.greatest < first),
        message,
        help=_remedy(driven, max(first, limits.least), min(last, limits.greatest)),
        related=[Related(body.span, "its limits in the body")] if body else [],
    )


def _in_degrees(joint: DrivenJoint) -> str:
    """Return what to write if the limits in the body are no angles in radians, but may be some in degrees."""
    body = joint.body.limits if joint.body else None
    own = at(joint.robot.manifest.root, ("joints", joint.name, "limits", "position"))
    if joint.slides or own is not None or body is None or max(abs(body.lower or 0.0), abs(body.upper or 0.0)) < _TURNS:
        return ""
    lower, upper = (math.radians(limit or 0.0) for limit in (body.lower, body.upper))
    return f'\'lower="{lower:.4g}" upper="{upper:.4g}"\''


def _place(joint: DrivenJoint, *, is_shifted: bool) -> Span:
    """Return where the range is written, else what shifts or scales it; if it `is_shifted` whole, what shifts it."""
    own = (("joints", joint.name, *path) for path in (("limits", "position"), *((key,) for key in _SCALES)))
    neutral = (("actuators", name, "neutral") for name in joint.written.servos)
    every = (*neutral, *own) if is_shifted else (*own, *neutral)
    paths = [path for path in every if at(joint.robot.manifest.root, path) is not None]
    return joint.robot.key(*paths[0]) if paths else joint.key()


def _remedy(joint: DrivenJoint, least: float, greatest: float) -> str:
    if least >= greatest:
        return _beyond_the_ticks(joint) or "check 'neutral', 'offset' and 'invert': no position is within both"
    unit, per = ("mm", 0.001) if joint.slides else ("deg", math.pi / 180)
    lower, upper = math.ceil(least / per - 1e-6), math.floor(greatest / per + 1e-6)
    return f"limit it: 'position: [{lower} {unit}, {upper} {unit}]' below its 'limits'"


def _beyond_the_ticks(driven: DrivenJoint) -> str:
    for servo in driven.joint.servos:
        first, last = servo.ends
        if not first <= servo.neutral <= last:
            middle = f"the middle, 'neutral: {servo.model.family.centre}', is the default"
            return f"the ticks of servo {servo.id}, {servo.model.name}, go from {first} to {last}: {middle}"
    return ""


_KEYS: dict[str, tuple[str | int, ...]] = {
    "lower": ("position", 0),
    "upper": ("position", 1),
    "velocity": ("velocity",),
}
_WORDS = {"lower": "least position", "upper": "greatest position", "velocity": "largest speed"}


@check("RBX2223", Severity.WARNING, closed=(WIRING,))
def wider_limit(robot: Robot) -> Iterator[Finding]:
    """A limit of a joint is wider than that of the body."""
    for joint in driven_joints(robot):
        for name in limits_of(joint.written, joint.body).wider:
            yield from _wider_than_body(joint, name)


def _wider_than_body(joint: DrivenJoint, name: str) -> Iterator[Finding]:
    limits, body = joint.written.limits, joint.body.limits if joint.body else None
    outer: float | None = getattr(body, name, None)
    wanted = limits.velocity if name == "velocity" else limits.position and limits.position[name == "upper"]
    if name == "velocity" and outer == 0.0:
        return  # the body's zero is the mistake, which is reported there
    if body is None or outer is None or not wanted or abs(wanted.value - outer) <= ROUNDED * abs(outer):
        return
    shown = joint.speed if name == "velocity" else joint.position
    yield wider_limit.at(
        joint.value("limits", *_KEYS[name]),
        f"the {_WORDS[name]} of '{joint.name}' is {shown(wanted.value)}, and the body's limit of {shown(outer)} holds",
        help="leave it out, or change the URDF if the joint can do more",
        related=[Related(body.span, "the limit of the body")],
    )


@check("RBX2229", Severity.WARNING, closed=(WIRING,))
def no_speed_limit(robot: Robot) -> Iterator[Finding]:
    """A joint has no limit of its speed."""
    for driven in driven_joints(robot):
        if driven.joint.mode == "position" and driven.joint.limits.velocity is None and not driven.mimics:
            yield no_speed_limit.at(
                driven.key(),
                f"'{driven.name}' has no limit of its speed: it moves as fast as its servo can",
                help=f"add one in {'m/s' if driven.slides else 'deg/s'}: 'limits: {{velocity: ...}}'",
            )


@check("RBX2245", Severity.WARNING, closed=(WIRING,))
def speed_of_joint(robot: Robot) -> Iterator[Finding]:
    """A controller is to be faster than its joint."""
    declared = [(item, bounds) for item, bounds in robot.declared(BoundsGoals) if bounds.speed and bounds.joints]
    led = {joint.name: joint for joint in driven_joints(robot)} if declared else {}
    for component, bounds in declared:
        for name in bounds.joints.value.values() if bounds.joints else ():
            most = led[name].joint.limits.velocity if name in led else None
            if bounds.speed and most and bounds.speed.value > most * (1.0 + ROUNDED):
                can = led[name].speed(most)
                yield speed_of_joint.at(
                    setting_span(robot, (component, bounds.speed.field)),
                    f"it is to reach {led[name].speed(bounds.speed.value)}, and '{name}' can do {can} at most",
                    help=f"make it at most {can}",
                    related=[Related(led[name].key(), "the joint")],
                )


@check("RBX2243", Severity.WARNING, closed=())
def no_watchdog(robot: Robot) -> Iterator[Finding]:
    """Servos that turn wheels have no watchdog."""
    for component in robot.components.values():
        bus: Any = component.config
        if component.path[:1] == BUSES and component.is_sound and not bus.watchdog:
            turned = [name for name, joint in bus.joints.items() if joint.mode == "velocity"]
            if turned:
                yield no_watchdog.at(
                    robot.value(*component.path, "watchdog"),
                    f"when this machine fails, the servo of '{turned[0]}' goes on turning: its bus has no watchdog",
                    help="write 'watchdog: 0.2 s', or leave it out",
                )


_HOTTEST = 85.0  # [degC]: no Dynamixel servo lets its own limit be higher; most shut down at 70 to 80
_LONGEST = 10.0  # [s]


@check("RBX2244", Severity.WARNING, closed=())
def late_safety(robot: Robot) -> Iterator[Finding]:
    """A limit of safety comes too late."""
    care = robot.manifest.contents.of(safety)
    if care.thermal.limit > _HOTTEST:
        yield late_safety.at(
            robot.value("safety", "thermal", "limit"),
            f"no joint rests before {care.thermal.limit:g} degC, but servos fail from 70 degC to {_HOTTEST:g} degC on",
            help="'limit: 60 degC' is usual",
        )
    if care.estop is not None and care.estop.deadline > _LONGEST:
        yield late_safety.at(
            robot.value("safety", "estop", "deadline"),
            f"the emergency stop may be silent for {format_quantity(care.estop.deadline, TIME)} until the robot stops",
            help="a few times the time between two of its messages is enough, such as '0.5 s'",
        )
    for mux, lock in robot.declared(LocksInSilence):
        if lock.timeout.value > _LONGEST:
            silence = format_quantity(lock.timeout.value, TIME)
            yield late_safety.at(
                robot.value(*mux.place(lock.timeout.field)),
                f"lock '{lock.name.value}' of mux '{mux.name}' engages after {silence} of silence only",
                help="a few times the time between two heartbeats is enough, such as '0.5 s'",
            )


@check("RBX2248", Severity.WARNING, closed=())
def never_parked(robot: Robot) -> Iterator[Finding]:
    """Joints have places to be parked at, and are never parked."""
    care = robot.manifest.contents.of(safety)
    if care.park and care.on_shutdown != "park":
        yield never_parked.at(
            robot.key("safety", "park"),
            f"nothing is parked there: on shutdown, joints {care.on_shutdown}",
            help="write 'on_shutdown: park', or remove 'park'",
        )


@check("RBX2228", closed=(WIRING,))
def parked_joint(robot: Robot) -> Iterator[Finding]:
    """A joint cannot be parked there."""
    driven = {joint.name: joint for joint in driven_joints(robot)}
    for name, position in robot.manifest.contents.of(safety).park.items():
        key = robot.key("safety", "park", name)
        if name not in driven:
            if name not in robot.manifest.contents.of(joints):
                message = f"'{name}' cannot be parked: no servo drives it"
                yield parked_joint.misspelt(key, message, name, driven, "joints with a servo")
        elif mistake := _mistake(driven[name], position):
            message, help_text = mistake
            yield parked_joint.at(robot.value("safety", "park", name), message, help=help_text)


def _mistake(one: DrivenJoint, position: Quantity) -> tuple[str, str] | None:
    """Return why it cannot be there, and what helps."""
    limits = one.joint.limits
    if position.dimension != (LENGTH if one.slides else ANGLE):
        needed, word = (LENGTH, "slides") if one.slides else (ANGLE, "turns")
        return f"'{one.name}' {word}, and this is {position.dimension.phrase}", f"write {needed.phrase}"
    if one.joint.mode != "position":
        return f"'{one.name}' cannot be parked: its servo takes velocities", "leave it out"
    if one.mimics:
        return f"'{one.name}' cannot be parked: it follows '{one.mimics}'", f"park '{one.mimics}'"
    nearest = limits.clamped(position.value)
    if abs(position.value - nearest) <= ROUNDED * abs(nearest):
        return None
    bounds = f"{one.position(limits.least)} to {one.position(limits.greatest)}"
    message = f"'{one.name}' is to be parked at {one.position(position.value)}, and goes from {bounds}"
    return message, f"the nearest that it reaches is {one.position(nearest)}"


@check("RBX2284", Severity.WARNING, closed=(WIRING, NAMES))
def waiting_controller(robot: Robot) -> Iterator[Finding]:
    """A controller is commanded, but waits."""
    known = robot.manifest.contents.of(controllers)
    led = {joint for config in known.values() if config.start == "active" for joint in config.claimed}
    for name, controller in known.items():
        if controller.start == "active" or led & {*controller.claimed}:
            continue
        if who := next((sender for end in _ends(robot, name) for sender in _senders(robot, end)), None):
            yield waiting_controller.at(
                robot.value("controllers", name, "start"),
                f"'{who}' commands the controller '{name}', which is not active from the start",
                help="remove 'start: inactive'",
                related=[Related(robot.entry_span(who), "it commands")] if who in robot.components else [],
            )


def _ends(robot: Robot, name: str) -> Iterator[PortEnd]:
    """Yield the ends of a controller."""
    for component in robot.components.values():
        yield from (end for end in component.ends if component.places.get(end.name, ())[:2] == ("controllers", name))


def _senders(robot: Robot, end: PortEnd) -> Iterator[str]:
    """Yield who commands at an end: components, and missions."""
    if isinstance(end.port, In):
        yield from (writer.instance for writer in robot.writers.get(end.topic, ()))
    if isinstance(end.port, ServesAction):
        skills = {skill for skill, source in robot.skills.items() if source.topic == end.topic}
        for name, mission in robot.missions.items():
            if any(node.skill in skills for node in mission.program.nodes):
                yield name


@dataclass(frozen=True, slots=True)
class GoalRange:
    """What an argument may be, in SI, whose limits those are, and where they are written."""

    least: float
    greatest: float
    whose: str
    place: Span
    unless: str = ""
    """The argument that permits what is beyond."""

    def nearest(self, value: float) -> float:
        """Return the nearest value within the range, or the value itself if it only differs by rounding."""
        found = max(self.least, min(self.greatest, value))
        return value if abs(found - value) <= ROUNDED * abs(found) + 1e-9 else found


@check("RBX4163", closed=(WIRING,))
def goal_beyond_limits(robot: Robot) -> Iterator[Finding]:
    """A skill is asked for what is beyond the limits."""
    bounded, reported = _bounded(robot), set[Span | None]()
    limited = bounded.keys() | {name for name, source in robot.skills.items() if source.skill.ranges}
    for mission in robot.missions.values() if limited else ():
        known = constants(mission)
        for node in mission.program.nodes:
            if node.skill not in limited or node.skill not in robot.skills:
                continue
            skill, ranges = robot.skills[node.skill].skill, bounded.get(node.skill, {})
            given = {argument.name or skill.main: argument for argument in node.step.arguments}
            for name, argument in given.items():
                allowed = ranges.get(name)
                if allowed is not None and allowed.unless in given:
                    allowed = None
                for finding in _beyond(mission, skill, name, argument, allowed, known):
                    if finding.span not in reported:  # a name that is used twice
                        yield finding
                    reported.add(finding.span)


def _bounded(robot: Robot) -> dict[str, dict[str, GoalRange]]:
    """Return the ranges of the arguments of each skill."""
    declared = robot.declared(BoundsGoals)
    joints = {driven.name: driven for driven in driven_joints(robot)} if declared else {}
    found: dict[str, dict[str, GoalRange]] = {}
    for component, bounds in declared:
        skill = next((name for name in robot.skills if is_served(robot, name, component, bounds.goals)), "")
        ranges = found.setdefault(skill, {})
        for argument, pair in bounds.ranges.value.items() if bounds.ranges else ():
            field = bounds.ranges.field if bounds.ranges else ""
            ranges[argument] = GoalRange(*pair, f"'{skill}'", setting_span(robot, (component, field)))
        unless = bounds.unless.value if bounds.unless else ""
        for argument, joint in bounds.joints.value.items() if bounds.joints else ():
            if led := joints.get(joint):
                limits = led.joint.limits
                ranges[argument] = GoalRange(limits.least, limits.greatest, f"'{joint}'", led.key(), unless)
    return found


def _beyond(
    mission: RobotMission,
    skill: Skill,
    name: str,
    argument: WrittenArgument,
    allowed: GoalRange | None,
    known: Constants,
) -> Iterator[Finding]:
    """Yield the finding about a goal whose value is known and that is refused."""
    expression, value = _expression(argument), known_value(argument, known)
    if expression is None or value is None or not isinstance(argument.value, ScalarNode):
        return
    declared = _declared(mission, expression)
    used = [Related(argument.value.span, "used here")] if declared else []
    if mistake := skill.mistake_in(name, value):
        yield goal_beyond_limits.at(declared or argument.value.span, mistake, related=used)
    elif allowed is not None and (nearest := allowed.nearest(value)) != value:
        wanted = skill.arguments[name]
        least, greatest = show(wanted, allowed.least), show(wanted, allowed.greatest)
        yield goal_beyond_limits.at(
            declared or argument.value.span,
            f"'{skill.name}' cannot bring '{name}' to {show(wanted, value)}:"
            f" {allowed.whose} is from {least} to {greatest}",
            help=_unit_hint(argument.value.text, wanted, allowed)
            or f"the nearest that it reaches is {show(wanted, nearest)}",
            related=[*used, Related(allowed.place, "its limits")],
        )


def _unit_hint(text: str, wanted: Type, allowed: GoalRange) -> str:
    """Return the unit that a bare length probably lacks; nothing if none would help."""
    try:
        number = float(text)
    except ValueError:
        return ""
    for unit in ("cm", "mm") if number and wanted.dimension == LENGTH else ():
        value = UNITS[unit].to_si(number)
        if allowed.nearest(value) == value:
            return f"did you mean '{text} {unit}'? A number without a unit counts in metres"
    return ""


def _expression(argument: WrittenArgument) -> Expression | None:
    try:
        return expression_of(argument.value) if isinstance(argument.value, ScalarNode) else None
    except ExpressionError:  # reported where arguments are checked
        return None


def _unsigned(tree: ExpressionNode) -> tuple[ExpressionNode, float]:
    sign = 1.0
    while isinstance(tree, Minus):
        tree, sign = tree.operand, -sign
    return tree, sign


def known_value(argument: WrittenArgument, known: Constants) -> float | None:
    """Return the number that an argument always is, if it is simple enough."""
    if (expression := _expression(argument)) is None:
        return None
    tree, sign = _unsigned(expression.tree)
    found = number_in(tree, known)
    return None if found is None else sign * found


def _declared(mission: RobotMission, expression: Expression) -> Span | None:
    """Return where the mission itself writes the value under a name."""
    tree, _ = _unsigned(expression.tree)
    if not isinstance(tree, Variable):
        return None
    given = mission.program.inputs.get(tree.name)
    datum = given.default if given else mission.program.data.get(tree.name)
    is_own = datum is not None and (given is None or mission.inputs.get(tree.name) == datum.value)
    return datum.span if datum and is_own else None


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
    declared = [(item, bounds) for item, bounds in robot.declared(BoundsGoals) if bounds.duration and bounds.joints]
    led = {joint.name: joint for joint in driven_joints(robot)} if declared else {}
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
    given = {item.name: (mover.goal(item, known), item) for item in node.step.arguments if item.name in mover.joints}
    stay = {name: pair for name, pair in before.items() if name not in given}
    return stay | {name: (value, argument) for name, (value, argument) in given.items() if value is not None}


def _too_fast(node: MissionNode, mover: JointMover, known: Constants, before: Positions) -> Iterator[Finding]:
    written = {written_argument.name: written_argument for written_argument in node.step.arguments}
    given = written.get(mover.duration)
    seconds = known_value(given, known) if given else None
    for name, argument in written.items() if given and seconds else ():
        if name not in before or not given or not seconds:
            continue
        to, most = mover.goal(argument, known), mover.joints[name].joint.limits.velocity
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

"""Rules about bases: speeds, wheels, brakes, and where the base is."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import NAMES, WIRING, Finding, FindingKind, Related, Severity
from rbxcompose.base.geometry import Vector3, rotate
from rbxcompose.base.units import ACCELERATION, ANGULAR_SPEED, LENGTH, SPEED, TIME, Dimension, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.flow import OTHER_TYPE, MessageFlow, is_written, period_of, setting_span
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent
from rbxcompose.compiler.model.skills import constants
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.missions.analysis.facts import number_of, published
from rbxcompose.missions.program.parts import TemplateShape, WrittenValue
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.sdk.capabilities import Drives, RollsOn, SeesEdges, Setting, WritesFrame
from rbxcompose.sdk.ports import Looks

TOLERANCE = 0.02  # of a length, within which two count as the same


@dataclass(frozen=True, slots=True)
class BodyWheel:
    """A wheel of the body: its middle [m] and its axis in the frame of the base, and its radius [m], if it has one."""

    joint: BodyJoint
    setting: Setting[str]
    centre: Vector3
    axis: Vector3
    radius: float | None


@dataclass(frozen=True, slots=True)
class RollingBase:
    """A base, and its wheels as the body has them."""

    component: RobotComponent
    rolls: RollsOn
    left: BodyWheel
    right: BodyWheel

    @property
    def wheels(self) -> tuple[BodyWheel, BodyWheel]:
        """Return both."""
        return self.left, self.right

    @property
    def wheel_distance(self) -> float:
        """Return how far the wheels are apart [m], to the left."""
        return self.left.centre[1] - self.right.centre[1]

    @property
    def has_other_radius(self) -> bool:
        """Return whether its wheels have another radius than those of the body."""
        radius = self.left.radius
        return self.rolls.wheel_radius is not None and radius is not None and differs(self.rolls.wheel_radius, radius)


def differs(setting: Setting[float], length: float) -> bool:
    """Return whether a length is another one than that of the body."""
    return abs(setting.value - length) > TOLERANCE * max(setting.value, length)


def rolling_bases(robot: Robot) -> Iterator[RollingBase]:
    """Yield the bases whose wheels are joints of the body."""
    description = robot.manifest.contents.of(body)
    shape = description.body if description else Body("")
    for component, rolls in robot.declared(RollsOn):
        link = rolls.link.value if rolls.link else ""
        found = [_wheel(shape, setting, link) for setting in (rolls.left, rolls.right) if setting.value in shape.joints]
        if len(found) == len((rolls.left, rolls.right)):
            yield RollingBase(component, rolls, *found)


def _wheel(body: Body, setting: Setting[str], link: str) -> BodyWheel:
    joint, poses = body.joints[setting.value], body.poses({})
    there = poses[joint.child] if link not in poses else poses[link].inverse().compose(poses[joint.child])
    child = body.links[joint.child]
    round_ones = [item for item in (*child.collisions, *child.visuals) if item.geometry.kind in ("cylinder", "sphere")]
    shape = next(iter(round_ones), None)
    centre = there.apply(shape.origin.translation) if shape else there.translation
    radius = shape.geometry.size[0] if shape else None
    return BodyWheel(joint, setting, centre, rotate(there.rotation, joint.axis), radius)


LONGEST = 10.0  # [s]: commands come many times a second
FARTHEST = 2.0  # [m] driven blind
USUAL = 0.5  # [s] until a base brakes: that far at 4 m/s only
ROUNDING = 1e-3  # of a speed
REACTION = 0.06  # [s] from an edge below a sensor to wheels that brake: two cycles of sensors and one of the base
STEEPEST = 60  # [deg] between the way of a base and straight over an edge; beyond that it drives along the edge
_FIELDS = {("linear", "x"): ("max_speed", SPEED, "m/s"), ("angular", "z"): ("max_turn_rate", ANGULAR_SPEED, "rad/s")}


@check("RBX3503", Severity.WARNING, closed=(WIRING, NAMES))
def clamped_speed(robot: Robot) -> Iterator[Finding]:
    """A component drives, or brakes, faster than its base can."""
    yield from _excesses(robot, clamped_speed, is_absurd=False)


def _excesses(robot: Robot, kind: FindingKind, *, is_absurd: bool) -> Iterator[Finding]:
    """Yield what exceeds the limits of the base that it drives: what that drops as absurd, or what it cuts."""
    for drive in MessageFlow(robot).drives():
        driver, base, wants, has = drive.driver, drive.base, drive.commands, drive.drives
        factor = has.drops_above.value if has.drops_above else math.inf
        limits = (
            (wants.max_speed, has.max_speed, SPEED, factor, "drives at"),
            (wants.max_turn_rate, has.max_turn_rate, ANGULAR_SPEED, factor, "drives at"),
            (wants.acceleration, has.acceleration, ACCELERATION, math.inf, "accelerates and brakes by"),
        )
        for wanted, limit, dimension, dropped, does in limits:
            if not (wanted and limit and wanted.value > limit.value):
                continue
            if (wanted.value > dropped * limit.value) is not is_absurd:
                continue
            fast, most = format_quantity(wanted.value, dimension), format_quantity(limit.value, dimension)
            times = "twice" if factor == 2.0 else f"{factor:g} times"
            reacts = f"drops commands above {times} its limit of {most}" if is_absurd else f"can do {most} at most"
            remedy = f"make '{limit.field}' of '{base.name}' at least {fast}" if limit.field else OTHER_TYPE
            if wanted.field:
                remedy = f"make '{wanted.field}' of '{driver.name}' at most {most}"
            there = (base, limit.field)
            span, at_base = setting_span(robot, (driver, wanted.field), there), setting_span(robot, there)
            related = Related(at_base, f"'{limit.field}' of the base" if limit.field else "the base")
            yield kind.at(
                span,
                f"'{driver.name}' {does} {fast}, but its base '{base.name}' {reacts}",
                help=remedy,
                related=[related] if at_base != span else [],
            )


@check("RBX3501")
def command_timeout(robot: Robot) -> Iterator[Finding]:
    """A base brakes between two commands."""
    flow = MessageFlow(robot)
    for base, drives in robot.declared(Drives):
        allowed = drives.stops_after
        for source in flow.fed_by(base, drives.commands) if allowed else ():
            period = period_of(robot.components[source.instance])
            if allowed and period is not None and allowed.value <= period:
                yield command_timeout.at(
                    setting_span(robot, (base, allowed.field)),
                    f"'{base.name}' brakes before '{source.instance}' sends its next command",
                    label=f"it sends every {format_quantity(period, TIME)}",
                    help=f"make it several times as long: '{format_quantity(10 * period, TIME)}'"
                    if allowed.field
                    else OTHER_TYPE,
                    related=[Related(robot.component_span(source.instance), "sends the commands")],
                )


@check("RBX3509", Severity.WARNING, closed=())
def late_brake(robot: Robot) -> Iterator[Finding]:
    """A base goes on long after the last command."""
    for base, drives in robot.declared(Drives):
        allowed = drives.stops_after
        is_chosen = allowed is not None and is_written(robot, base, allowed.field)
        blind = allowed.value * drives.max_speed.value if allowed and drives.max_speed and is_chosen else 0.0
        if allowed and (allowed.value > LONGEST or blind > FARTHEST):
            shown = "without end" if math.isinf(allowed.value) else f"for {format_quantity(allowed.value, TIME)}"
            if 0.0 < blind < math.inf:
                shown += f", {format_quantity(blind, LENGTH)} at full speed,"
            cause, cures = allowed, [f"a few times the time between two commands is enough, such as '{USUAL:g} s'"]
            if drives.max_speed and blind > FARTHEST and drives.max_speed.value * USUAL > FARTHEST:
                most = math.floor(100 * FARTHEST / min(allowed.value, USUAL)) / 100
                slower = f"drive at {format_quantity(most, SPEED)} at most"
                cause, cures = (drives.max_speed, [slower]) if allowed.value <= USUAL else (cause, [*cures, slower])
            span, brakes = (setting_span(robot, (base, setting.field)) for setting in (cause, allowed))
            yield late_brake.at(
                span,
                f"'{base.name}' goes on {shown} after its last command",
                help=", and ".join(cures) if cause.field else OTHER_TYPE,
                related=[Related(brakes, "until it brakes")] if cause is not allowed else [],
            )


@check("RBX3516", Severity.WARNING)
def past_the_edge(robot: Robot) -> Iterator[Finding]:
    """A base is too fast to stop at the edges that it sees."""
    for sensors, sees in robot.declared(SeesEdges):
        for base, drives in robot.declared(Drives):
            apart = drives.wheel_distance or next((rolls.wheel_distance for rolls in base.declared(RollsOn)), None)
            if not (apart and drives.max_speed and drives.acceleration):
                continue
            lead = lead_of(sees.points.value.values(), apart.value)
            most = speed_within(lead, drives.acceleration.value)
            if drives.max_speed.value > most:
                cures = ["move the sensors forwards"]
                if drives.acceleration.field:
                    cures.append(f"brake harder by '{drives.acceleration.field}'")
                if most >= 0.01:
                    cures.append(f"drive at {format_quantity(math.floor(100 * most) / 100, SPEED)} at most")
                yield past_the_edge.at(
                    setting_span(robot, (base, drives.max_speed.field)),
                    f"'{base.name}' cannot stop in time at an edge that '{sensors.name}' sees: "
                    f"its wheels are {max(round(100 * lead), 0)} cm behind",
                    label=f"up to {format_quantity(drives.max_speed.value, SPEED)}",
                    help=", or ".join(cures),
                    related=[Related(setting_span(robot, (sensors, sees.points.field)), "the sensors")],
                )


def lead_of(points: Collection[tuple[float, float]], wheel_distance: float) -> float:
    """Return how far a base drives at least from where a sensor passes a straight edge to where a wheel does [m].

    `points` are those of the sensors, x (ahead) and y; the wheels are beside the origin.
    """

    def lead(angle: float) -> float:
        cos, sin = math.cos(angle), math.sin(angle)
        return (max(x * cos + y * sin for x, y in points) - abs(sin) * wheel_distance / 2) / cos

    return min(lead(math.radians(degrees)) for degrees in range(-STEEPEST, STEEPEST + 1))


def speed_within(way: float, acceleration: float) -> float:
    """Return from which speed a base comes to rest within a way [m], its reaction included [m/s]."""
    return acceleration * (math.sqrt(REACTION**2 + 2.0 * max(way, 0.0) / acceleration) - REACTION)


@check("RBX2282", Severity.WARNING, closed=(WIRING,))
def wheel_sides(robot: Robot) -> Iterator[Finding]:
    """A wheel is on the other side, or turns backwards."""
    for base in rolling_bases(robot):
        component, left = base.component, base.left
        if base.wheel_distance < 0.0:
            yield wheel_sides.at(
                setting_span(robot, (component, left.setting.field)),
                f"in the body, the left wheel '{left.joint.name}' is to the right of '{base.right.joint.name}'",
                help="exchange 'left' and 'right'",
                related=[Related(left.joint.span, "the wheel")],
            )
        for wheel in base.wheels:
            if wheel.axis[1] < 0.0:
                yield wheel_sides.at(
                    setting_span(robot, (component, wheel.setting.field)),
                    f"the axis of '{wheel.joint.name}' points to the right: its positive direction is backwards",
                    help="turn the axis round in the URDF; if it runs backwards then, change 'invert' of its actuator",
                    related=[Related(wheel.joint.axis_span or wheel.joint.span, "the axis")],
                )


@check("RBX2283", Severity.WARNING, closed=(WIRING,))
def wheel_speed(robot: Robot) -> Iterator[Finding]:
    """A base is to be faster than its wheels can turn."""
    for base in rolling_bases(robot):
        rolls, slowest = base.rolls, min(base.wheels, key=lambda wheel: _limit(robot, wheel))
        limit = _limit(robot, slowest)
        if rolls.wheel_radius is None or math.isinf(limit) or base.has_other_radius:
            continue  # with the right radius, which RBX2281 asks for, the speeds are others, too
        fastest = limit * rolls.wheel_radius.value
        for drives in base.component.declared(Drives):
            rate = fastest / (rolls.wheel_distance.value / 2.0)
            speeds: list[tuple[Setting[float] | None, float, Dimension]] = [
                (drives.max_speed, fastest, SPEED),
                (drives.max_turn_rate, rate, ANGULAR_SPEED),
            ]
            for setting, most, dimension in speeds:
                if setting and setting.value > most * (1.0 + ROUNDING):
                    wanted, can = format_quantity(setting.value, dimension), format_quantity(most, dimension)
                    turning = format_quantity(limit, ANGULAR_SPEED)
                    yield wheel_speed.at(
                        setting_span(robot, (base.component, setting.field)),
                        f"it is to reach {wanted}, and its wheels, which turn at {turning} at most, reach {can}",
                        help=f"make it at most {can}",
                        related=[Related(slowest.joint.span, "the wheel")],
                    )


def _limit(robot: Robot, wheel: BodyWheel) -> float:
    """Return how fast a wheel may turn [rad/s], infinite if nothing limits it."""
    from rbxcompose.domains.servos.sections.joints import joints  # few robots have bases whose wheels are joints

    driven, limits = robot.manifest.contents.of(joints).get(wheel.joint.name), wheel.joint.limits
    own = driven.limits.velocity.value if driven and driven.limits.velocity else math.inf
    return min(own, limits.velocity if limits and limits.velocity is not None else math.inf)


@check("RBX2281", Severity.WARNING, closed=(WIRING,))
def wheels_of_body(robot: Robot) -> Iterator[Finding]:
    """The wheels of a base differ from those of its body."""
    for base in rolling_bases(robot):
        rolls, left = base.rolls, base.left
        lengths = [("wheels are %s apart", rolls.wheel_distance, abs(base.wheel_distance))]
        if rolls.wheel_radius and left.radius is not None:
            lengths.append(("wheels have a radius of %s", rolls.wheel_radius, left.radius))
        for words, setting, length in lengths:
            if differs(setting, length):
                wanted, there = format_quantity(setting.value, LENGTH), format_quantity(length, LENGTH)
                yield wheels_of_body.at(
                    setting_span(robot, (base.component, setting.field)),
                    f"the {words % wanted}, in the body {there}",
                    help="measure them, and correct the one that is wrong",
                    related=[Related(left.joint.span, "the left wheel")],
                )


@check("RBX3013", closed=(WIRING,))
def two_bases(robot: Robot) -> Iterator[Finding]:
    """Two bases follow the same commands."""
    for topic, ends in robot.readers.items():
        bases = [end for end in ends if _moves(robot, end)]
        for other in bases[1:]:
            yield two_bases.at(
                robot.entry_span(other.instance, other.name),
                f"'{other.instance}' and '{bases[0].instance}' are both bases that follow '{topic}'",
                label="this one",
                help="a robot has one base: remove one of them",
                related=[Related(robot.entry_span(bases[0].instance, bases[0].name), "and this one")],
            )


def _moves(robot: Robot, end: PortEnd) -> bool:
    """Return whether commands received at this end move the robot."""
    return any(end.name == drives.commands for drives in robot.components[end.instance].declared(Drives))


@check("RBX2286", Severity.WARNING, closed=(WIRING, NAMES))
def unplaced_base(robot: Robot) -> Iterator[Finding]:
    """A component looks up where the robot is, and nothing publishes it."""
    description, bases = robot.manifest.contents.of(body), robot.declared(Drives)
    if description is None or not description.body.links or not bases:
        return
    links, root = description.body.links, description.body.root
    placed = {frame.child.value for _, frame in robot.declared(WritesFrame)}
    if root in placed or any(base.declared(WritesFrame) for base, _ in bases):
        return  # a base that moves another frame is reported as RBX2019
    base, drives = bases[0]
    for component in robot.components.values():
        for port in (end.port for end in component.ends):
            if isinstance(port, Looks) and port.source in links and port.target not in links:
                yield unplaced_base.at(
                    robot.entry_span(base.name, drives.commands),
                    f"no component publishes the transform from '{port.target}' to '{port.source}', "
                    f"which '{component.name}' looks up",
                    help="let the base publish its frame, or add what localises the robot",
                    related=[Related(robot.entry_span(component.name), "it looks it up")],
                    about=(port.source, port.target, component.name),
                )
                return


@check("RBX2352", Severity.WARNING, closed=(WIRING, NAMES))
def frame_without_publisher(robot: Robot) -> Iterator[Finding]:
    """No component publishes the transform of a virtual joint."""
    description = robot.manifest.contents.of(body)
    if description is None or description.virtual is None or description.virtual.kind == "fixed":
        return
    joint, root = description.virtual, description.body.root
    above = {frame.child.value: frame.parent.value for _, frame in robot.declared(WritesFrame)}
    frames, link = dict[str, None](), root
    while (link := above.get(link, "")) and link not in frames:
        frames[link] = None
    if joint.frame not in frames:
        names = " or ".join(f"'frame: {name}'" for name in frames)
        yield frame_without_publisher.at(
            joint.frame_span,
            f"no component publishes the transform from '{joint.frame}' to '{root}'",
            help=f"write {names}" if frames else "write 'type: fixed' if it stands still, or add what localises it",
            related=[Related(description.body.links[root].span, "the root of the body")],
            about=(root, joint.frame),
        )


@check("RBX4172", closed=(WIRING, NAMES))
def dropped_message(robot: Robot) -> Iterator[Finding]:
    """A mission publishes a velocity that the base ignores."""
    limits = {key: _dropped_above(robot, name) for key, (name, _, _) in _FIELDS.items()}
    for mission in robot.missions.values() if not all(map(math.isinf, limits.values())) else ():
        sent = (message for node in mission.program.nodes for message in published(node))
        for message in sent:
            topic = robot.topics.get(message.target.text)
            for (outer, inner), limit in limits.items() if topic and topic.message == Twist.TYPE else ():
                written = _at(_at(message.body, outer), inner)
                value = number_of(written.expression, constants(mission)) if isinstance(written, WrittenValue) else None
                if isinstance(written, WrittenValue) and value is not None and abs(value) > limit:
                    _, dimension, unit = _FIELDS[outer, inner]
                    most, is_turn = format_quantity(limit, dimension, unit), dimension is ANGULAR_SPEED
                    yield dropped_message.at(
                        written.scalar.span,
                        f"the base ignores commands above {most}, and this is {value:g} {unit}",
                        help=f"for {value:g} deg/s, write {math.radians(value):.3g}" if is_turn else "",
                    )


def _dropped_above(robot: Robot, name: str) -> float:
    """Return above which velocity every base ignores a command, infinite if one does not."""
    found = [math.inf]
    for _, drives in robot.declared(Drives):
        limit: Setting[float] | None = getattr(drives, name)
        found.append(limit.value * drives.drops_above.value if limit and drives.drops_above else math.inf)
    return max(found[1:], default=math.inf)


def _at(shape: TemplateShape | None, key: str) -> TemplateShape | None:
    return shape.get(key) if isinstance(shape, Mapping) else None


@check("RBX3504")
def absurd_speed(robot: Robot) -> Iterator[Finding]:
    """A component drives so fast that its base drops the commands."""
    yield from _excesses(robot, absurd_speed, is_absurd=True)

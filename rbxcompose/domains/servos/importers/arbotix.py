"""`arbotix`: files of `arbotix_python`, the ROS driver of the ArbotiX board and of Dynamixel servos.

They are read, joined to one robot, and that is written as a manifest.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import PurePath
from typing import TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Related, Report, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.importing import manifest_text as out
from rbxcompose.commands.importing.foreign_files import ForeignFile, ForeignMap, FreeNames, Given
from rbxcompose.commands.importing.importer import DISAGREES, NOT_CARRIED_OVER, OTHER_PROGRAM, importer
from rbxcompose.commands.importing.manifest_text import key as yaml_key
from rbxcompose.compiler.composition.robot_file import is_own_name
from rbxcompose.domains.servos.models import ServoModel, servo_models
from rbxcompose.domains.servos.sections.actuators import ONE_ID
from rbxcompose.domains.servos.sections.controllers import NOT_DRIVEN
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.manifest.validate import OUT_OF_RANGE

SIMULATED_BASE = kind("RBX2236", Severity.WARNING)

FOLLOW, DIFF = "follow_controller", "diff_controller"
ACTION = "follow_joint_trajectory"
_LINEAR = ("linear_controller", "linear_controller_i")
_WHY_NOT_LINEAR = "the ArbotiX board drives the motor of a linear joint, and only Dynamixel servos are driven here"
_FRAMES = {"base_frame_id": "base_footprint", "odom_frame_id": "odom"}  # of the simulated base
_OF_THE_BOARD = ("base_width", "ticks_meter", "Kp", "Kd", "Ki", "Ko", "rate")


@dataclass(frozen=True, slots=True)
class FollowController:
    """Follows trajectories of joints."""

    name: str
    span: Span = field(compare=False)
    joints: tuple[Given[str], ...]


@dataclass(frozen=True, slots=True)
class DiffController:
    """A base on two wheels; `kept` are the figures that only its board needs, by key."""

    name: str
    span: Span = field(compare=False)
    acceleration: Given[float] | None
    timeout: Given[float] | None
    kept: Mapping[str, Given[float]]


def read_controller(name: str, entry: ForeignMap) -> FollowController | DiffController | None:
    """Return a controller, or None after the finding that says why it is left out."""
    type_ = entry.needs("type", entry.choice("type", (FOLLOW, DIFF, *_LINEAR)))
    if type_ is None:
        return None
    if type_.value in _LINEAR:
        entry.add(NOT_CARRIED_OVER.at(type_.span, f"{entry.what} is not carried over: {_WHY_NOT_LINEAR}"))
        return None
    found = _follow(name, entry) if type_.value == FOLLOW else _diff(name, entry)
    entry.report_unknown_keys()
    return found


def _follow(name: str, entry: ForeignMap) -> FollowController | None:
    joints = entry.needs("joints", entry.texts("joints"))
    for key, span in entry.places("rate", "index").items():
        why = "that of the bus counts" if key == "rate" else "controllers have names here"
        entry.add(NOT_CARRIED_OVER.at(span, f"'{key}' of {entry.what} is not carried over: {why}"))
    if entry.is_set("onboard"):
        words = f"'onboard' of {entry.what} is not carried over: trajectories are interpolated here, not on a board"
        entry.add(NOT_CARRIED_OVER.at(entry.places("onboard")["onboard"], words))
    _report_action(name, entry)
    return FollowController(name, entry.span, tuple(joints)) if joints else None


def _report_action(name: str, entry: ForeignMap) -> None:
    """Report if clients know the action by another name than it has now."""
    given, ours = entry.text("action_name"), f"{name}/{ACTION}"
    old = given.value if given else ACTION
    if old.strip("/") != ours:
        words = f"the name '{old}' of the action of {entry.what} is not carried over: it is '{ours}' here"
        span = given.span if given else entry.span
        entry.add(NOT_CARRIED_OVER.at(span, words, help="send goals to that name"))


def _diff(name: str, entry: ForeignMap) -> DiffController:
    for key, ours in _FRAMES.items():
        frame = entry.text(key)
        if frame is not None and frame.value.strip("/") != ours:
            words = f"'{key}' of {entry.what} is not carried over: the frame is '{ours}' here"
            entry.add(NOT_CARRIED_OVER.at(frame.span, words))
    kept = {key: found for key in _OF_THE_BOARD if (found := entry.number(key)) is not None}
    base = DiffController(name, entry.span, entry.above_zero("accel_limit"), entry.above_zero("timeout"), kept)
    words = f"{entry.what} becomes a simulated base: the ArbotiX board drives the real one by its own firmware"
    entry.add(SIMULATED_BASE.at(entry.span, words, help=_figures(base)))
    return base


def _figures(base: DiffController) -> str:
    known = [f"{key} {out.number(base.kept[key].value)}" for key in ("base_width", "ticks_meter") if key in base.kept]
    return f"the real one has {' and '.join(known)}; a comment keeps that" if known else ""


NO_OPENING = kind("RBX2237", Severity.WARNING)

MODELS = {"singlesided": "one_sided", "dualservo": "dual", "parallel": "parallel"}
PAD_WIDTH, FINGER_LENGTH, MIN_OPENING, MAX_OPENING = 0.01, 0.02, 0.0, 0.09  # defaults of the controller [m]
_JOINTS = {
    "one_sided": {"joint": "gripper_joint"},
    "dual": {"joint_left": "l_gripper_joint", "joint_right": "r_gripper_joint"},
    "parallel": {"joint": "gripper_joint"},
}
_SIDES = {  # keys of angles with parallel fingers, and of which servos turn the other way
    "one_sided": (("center",), ("invert",)),
    "dual": (("center_left", "center_right"), ("invert_left", "invert_right")),
    "parallel": (("center",), ()),
}
_DRIVER = "a default of the controller"

Lines = dict[str, tuple[str, str]]
"""Lines below the name of a controller: key -> value and comment."""


@dataclass(frozen=True, slots=True)
class ArbotixGripper:
    """A gripper: its joints, and the lines of a manifest."""

    name: str
    span: Span = field(compare=False)
    joints: tuple[Given[str], ...]
    lines: Mapping[str, tuple[str, str]] = field(compare=False)
    values: tuple[str, ...]


def read_gripper(name: str, entry: ForeignMap) -> ArbotixGripper | None:
    """Return a gripper, or None after the finding that says why it is left out."""
    model = entry.choice("model", MODELS)
    if model is None:
        return None
    kind_of = MODELS[model.value]
    joints = tuple(entry.text(key) or Given(usual, entry.span) for key, usual in _JOINTS[kind_of].items())
    lines: Lines = {"type": ("gripper", ""), "model": (kind_of, out.place(model.span))}
    keys = ("left", "right") if len(joints) > 1 else ("joint",)
    lines |= {key: (out.word(joint.value), out.place(joint.span)) for key, joint in zip(keys, joints, strict=True)}
    lines |= _scale(entry) if kind_of == "parallel" else _geometry(entry)
    lines |= _sides(entry, *_SIDES[kind_of])
    entry.report_unknown_keys()
    return ArbotixGripper(name, entry.span, joints, lines, tuple(value for value, _ in lines.values()))


def _geometry(entry: ForeignMap) -> Lines:
    """Return the lengths of the fingers and how far they open: opening = pad_width + 2 finger_length sin(angle)."""
    pad, finger = entry.number("pad_width"), entry.above_zero("finger_length")
    lines = {"pad_width": _length(pad, PAD_WIDTH), "finger_length": _length(finger, FINGER_LENGTH)}
    furthest = (pad.value if pad else PAD_WIDTH) + 2 * (finger.value if finger else FINGER_LENGTH)
    return lines | _opening(entry, furthest)


def _length(found: Given[float] | None, usual: float) -> tuple[str, str]:
    return (out.length(found.value), out.place(found.span)) if found else (out.length(usual), _DRIVER)


def _opening(entry: ForeignMap, furthest: float) -> Lines:
    least, greatest = entry.number("min_opening"), entry.number("max_opening")
    low = least.value if least else MIN_OPENING
    high = greatest.value if greatest else min(MAX_OPENING, furthest)
    if 0 <= low < high <= furthest:
        given = [out.place(one.span) for one in (least, greatest) if one]
        return {
            "opening": (out.flow_list([out.length(low), out.length(high)]), ", ".join(dict.fromkeys(given)) or _DRIVER)
        }
    given_at = least if least and low < 0 else greatest or least
    reason = "the least is below 0" if low < 0 else f"the fingers open from 0 m to {out.number(round(furthest, 6))} m"
    words = f"{entry.what} cannot open from {out.number(low)} m to {out.number(high)} m, so that is left out: {reason}"
    help_text = "openings are distances between the pads in metres; these look like angles of the joint in radians"
    entry.add(NO_OPENING.at(given_at.span if given_at else entry.span, words, help=help_text))
    return {}


def _scale(entry: ForeignMap) -> Lines:
    scale = entry.number("scale")
    if scale is not None and not scale.value:
        entry.add(OUT_OF_RANGE.at(scale.span, f"'scale' of {entry.what} must not be 0", help="it is left out"))
        scale = None
    value = scale.value if scale else 1.0
    where = out.place(scale.span) if scale else _DRIVER
    words = f"{where}: {out.number(value)} rad/m; how far it opens is not in the file: write 'opening'"
    lines = {"travel": (out.length(round(math.tau / abs(value), 7)), words)}
    return lines if value > 0 else lines | {"invert": (out.flag(True), where)}


def _sides(entry: ForeignMap, centers: Iterable[str], inverts: Iterable[str]) -> Lines:
    """Return the angles with parallel fingers, and which servos turn the other way."""
    lines: Lines = {}
    for key in centers:
        if (center := entry.number(key)) is not None:
            lines[key] = (out.angle(center.value), out.place(center.span))
    for key in inverts:
        if (invert := entry.flag(key)) is not None and invert.value:
            lines[key] = (out.flag(True), out.place(invert.span))
    return lines


NO_SUCH_SERVO = kind("RBX2233")
GUESSED = kind("RBX2234", Severity.WARNING)
UNREACHABLE = kind("RBX2235", Severity.WARNING)

DYNAMIXEL = "dynamixel"
OTHER_TYPES = {
    "hobby_servo": "the ArbotiX board makes its pulses, and only Dynamixel servos are driven here",
    "calibrated_linear": "the ArbotiX board drives its motor, and only Dynamixel servos are driven here",
}
GUESSES = ("AX-12", "MX-28", "EX-106+")
_FULL_RANGE = {4096: 360.0}  # [deg], which the driver takes for this many ticks
_OTHER_RANGE = 300.0
_CLOSE = 0.5  # [deg]
_LAST_ID = 252
_FAR = 1 << 16  # [ticks], beyond all servos with a range


@dataclass(frozen=True, slots=True)
class ArbotixJoint:
    """A joint with its servo; angles in degrees, as the file gives them."""

    name: str
    span: Span = field(compare=False)
    id: Given[int]
    model: ServoModel
    turn: float
    """The range of its ticks that the file means [deg]."""
    neutral: Given[int] | None
    is_inverted: bool
    least: Given[float] | None
    greatest: Given[float] | None
    speed: Given[float] | None

    @property
    def reach(self) -> tuple[float, float]:
        """Return the positions of its first and its last tick, the lesser first [rad]."""
        family = self.model.family
        neutral = family.centre if self.neutral is None else self.neutral.value
        ends = [(tick - neutral) * self.model.per_tick for tick in (0, family.ticks - 1)]
        return (-ends[1], -ends[0]) if self.is_inverted else (ends[0], ends[1])

    @property
    def limits(self) -> tuple[float, float] | None:
        """Return its limits if the file gives any; the driver takes half the range for one that is not there [deg]."""
        if self.least is None and self.greatest is None:
            return None
        half = self.turn / 2
        return self.least.value if self.least else -half, self.greatest.value if self.greatest else half


def read_joint(name: str, entry: ForeignMap) -> ArbotixJoint | None:
    """Return a joint, or None after the finding that says why it is left out."""
    type_ = entry.choice("type", (DYNAMIXEL, *OTHER_TYPES))
    if type_ is not None and type_.value in OTHER_TYPES:
        entry.add(NOT_CARRIED_OVER.at(type_.span, f"{entry.what} is not carried over: {OTHER_TYPES[type_.value]}"))
        return None
    id_ = entry.needs("id", entry.whole("id", 0, _LAST_ID))
    found = _model(entry)
    neutral = entry.whole("neutral", -_FAR, _FAR)
    is_inverted = entry.is_set("invert")
    least, greatest = _limits(entry, found[1] / 2 if found else math.inf)
    speed = entry.above_zero("max_speed")
    readable = entry.flag("readable")
    if readable is not None and not readable.value:
        words = f"'readable' of {entry.what} is not carried over: all servos of a bus are read"
        entry.add(NOT_CARRIED_OVER.at(readable.span, words))
    entry.report_unknown_keys()
    if id_ is None or found is None or (type_ is None and "type" in entry):
        return None
    model, turn = found
    joint = ArbotixJoint(name, entry.span, id_, model, turn, neutral, is_inverted, least, greatest, speed)
    for finding in _unreachable(joint, entry.what):
        entry.add(finding)
    return joint


def _model(entry: ForeignMap) -> tuple[ServoModel, float] | None:
    """Return the model that has the ticks and the range of a joint, and that range."""
    ticks, given = entry.whole("ticks", 1, _FAR), entry.above_zero("range")
    if ticks is None and "ticks" in entry:
        return None
    count = ticks.value if ticks else 1024
    turn = given.value if given else _FULL_RANGE.get(count, _OTHER_RANGE)
    for name in GUESSES:
        family = servo_models()[name].family
        if family.ticks == count and abs(math.degrees(family.span) - turn) <= _CLOSE:
            return servo_models()[name], turn
    span = given.span if given else ticks.span if ticks else entry.span
    known = ", ".join(f"{guess}: {_ticks(guess)}" for guess in GUESSES)
    words = f"no servo has {count} ticks over {out.number(turn)} degrees, so {entry.what} is left out"
    entry.add(NO_SUCH_SERVO.at(span, words, help=known))
    return None


def _ticks(name: str) -> str:
    family = servo_models()[name].family
    return f"{family.ticks} ticks over {round(math.degrees(family.span), 2):g} degrees"


def _limits(entry: ForeignMap, half: float) -> tuple[Given[float] | None, Given[float] | None]:
    least, greatest = entry.number("min_angle"), entry.number("max_angle")
    given = greatest or least
    if given and (least.value if least else -half) >= (greatest.value if greatest else half):
        words = f"'max_angle' of {entry.what} must be greater than its 'min_angle'"
        entry.add(OUT_OF_RANGE.at(given.span, words, help="both are left out"))
        return None, None
    return least, greatest


def _unreachable(joint: ArbotixJoint, what: str) -> Iterable[Finding]:
    low, high = joint.reach
    slack = joint.model.per_tick
    for limit, outwards, end in ((joint.least, -1, low), (joint.greatest, 1, high)):
        if limit is not None and outwards * (math.radians(limit.value) - end) > slack:
            words = f"{what} never gets to {out.number(limit.value)} deg: {turns(joint)}"
            yield UNREACHABLE.at(limit.span, words, help="'neutral' is the tick at which it is at 0")


def turns(joint: ArbotixJoint) -> str:
    """Return how far the servo of a joint turns, in words."""
    low, high = joint.reach
    return f"its servo turns from {out.degrees_shown(low)} to {out.degrees_shown(high)}"


def guesses(joints: Iterable[ArbotixJoint], span: Span) -> Iterable[Finding]:
    """Yield a finding for each model that was guessed for joints of one file."""
    for name, count in sorted(Counter(joint.model.name for joint in joints).items()):
        which = "1 joint" if count == 1 else f"{count} joints"
        words = f"the file names no models; the servos of {which} are taken for {name}, by {_ticks(name)}"
        yield GUESSED.at(span, words, help="'rbxcompose servo scan' shows the models of real servos")


USUAL_RATE = 10.0  # [Hz], of reading and of writing, if a file does not say
_FASTEST = 1000.0  # [Hz], of a bus
_MOST_BAUD = 10_000_000
_MAIN = frozenset({"joints", "controllers", "port", "baud"})
_OTHERS = frozenset({"rate", "read_rate", "write_rate", "sync_read", "sync_write", "diagnostic_rate", "timeout", "sim"})
_DRIVER_OF_THE_BOARD = ("digital_servos", "digital_sensors", "analog_sensors")
_KEYS = _MAIN | _OTHERS | frozenset(_DRIVER_OF_THE_BOARD)


@dataclass(slots=True)
class ArbotixDriver:
    """A driver: its line, and what is on it. `idle` are keys that need nothing here; `left_out` names lost joints."""

    port: Given[str] | None = None
    baud: Given[int] | None = None
    rate: Given[float] | None = None
    idle: dict[str, Span] = field(default_factory=dict)
    joints: dict[str, ArbotixJoint] = field(default_factory=dict)
    left_out: set[str] = field(default_factory=set)
    controllers: list[FollowController | DiffController] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class ArbotixFile:
    """What one file has."""

    drivers: list[ArbotixDriver] = field(default_factory=list)
    grippers: list[ArbotixGripper] = field(default_factory=list)


def read_arbotix(file: ForeignFile, report: Report) -> ArbotixFile:
    """Return what a file has, also below the names of programs, as ROS keeps parameters."""
    found = ArbotixFile()
    for name, entry, is_gripper in _parts(file, report):
        if not is_gripper:
            found.drivers.append(_driver(entry))
        elif (gripper := read_gripper(name, entry)) is not None:
            found.grippers.append(gripper)
    return found


def _parts(file: ForeignFile, report: Report) -> Iterator[tuple[str, ForeignMap, bool]]:
    """Yield each driver and gripper of a file by its name, and whether it is a gripper."""
    root = file.root
    if not isinstance(root, MappingNode):
        report.add(OTHER_PROGRAM.at(root.span, f"'{file.name}' is not a file of ArbotiX: it is no map of keys"))
    elif _is_gripper(root):
        yield PurePath(file.name).stem, ForeignMap(root, "the gripper", root.span, report), True
    else:
        yield from _below(file, root, report)


def _below(file: ForeignFile, root: MappingNode, report: Report) -> Iterator[tuple[str, ForeignMap, bool]]:
    named = {name: one for name, one in root.entries.items() if name not in _KEYS and _is_program(one.value)}
    own = replace(root, entries={name: one for name, one in root.entries.items() if name not in named})
    if not named and not _KEYS & own.entries.keys():
        words = f"'{file.name}' is not a file of ArbotiX: it has neither joints nor controllers nor a gripper's model"
        report.add(OTHER_PROGRAM.at(root.span, words))
        return
    if own.entries:
        yield "", ForeignMap(own, "this file", root.span, report), False
    for name, entry in named.items():
        if isinstance(entry.value, MappingNode):
            yield name, ForeignMap(entry.value, f"'{name}'", entry.key.span, report), _is_gripper(entry.value)


def _is_program(node: TreeNode) -> bool:
    return isinstance(node, MappingNode) and (_is_gripper(node) or bool(_MAIN & node.entries.keys()))


def _is_gripper(node: MappingNode) -> bool:
    return "model" in node and not _MAIN & node.entries.keys()


def _driver(entry: ForeignMap) -> ArbotixDriver:
    joints, left_out = _joints(entry)
    driver = ArbotixDriver(
        port=entry.text("port"),
        baud=entry.whole("baud", 1, _MOST_BAUD),
        rate=_rate(entry),
        idle=_idle(entry),
        joints=joints,
        left_out=left_out,
        controllers=[
            controller
            for name, each in entry.maps("controllers", "controller")
            if (controller := read_controller(name, each))
        ],
    )
    for key, span in entry.places(*_DRIVER_OF_THE_BOARD).items():
        words = f"'{key}' are not carried over: they are pins of the ArbotiX board, which is not spoken to here"
        entry.add(NOT_CARRIED_OVER.at(span, words))
    entry.report_unknown_keys()
    return driver


def _joints(entry: ForeignMap) -> tuple[dict[str, ArbotixJoint], set[str]]:
    read = {name: read_joint(name, entry) for name, entry in entry.maps("joints", "joint")}
    joints = {name: joint for name, joint in read.items() if joint is not None}
    for span in entry.places("joints").values():
        entry.report.extend(guesses(joints.values(), span))
    return joints, read.keys() - joints.keys()


def _rate(entry: ForeignMap) -> Given[float] | None:
    """Return the larger one of the rates of reading and writing if the file gives one: a bus has one for both."""
    given = [one for key in ("read_rate", "write_rate") if (one := entry.above_zero(key)) is not None]
    if not given:
        return None
    rate = max(given, key=lambda one: one.value)
    if rate.value > _FASTEST:
        entry.add(OUT_OF_RANGE.at(rate.span, f"a bus has at most {_FASTEST:g} Hz", help="the rate is left out"))
        return None
    return rate if len(given) == 2 or rate.value >= USUAL_RATE else replace(rate, value=USUAL_RATE)


def _idle(entry: ForeignMap) -> dict[str, Span]:
    """Return the places of keys that need nothing here, after checking that they are what they should be."""
    for key in ("rate", "diagnostic_rate", "timeout"):
        entry.number(key)
    for key in ("sync_read", "sync_write", "sim"):
        entry.flag(key)
    return entry.places("rate", "timeout", "sync_write", "sync_read", "diagnostic_rate", "sim")


NO_URDF = kind("RBX2239", Severity.WARNING)

USUAL_PORT = "/dev/ttyUSB0"


P = TypeVar("P", ArbotixJoint, FollowController | DiffController | ArbotixGripper)


@dataclass(slots=True)
class ArbotixRobot:
    """All joints and controllers by their names, and the lines by their ports."""

    lines: dict[str, ArbotixDriver] = field(default_factory=dict)
    joints: dict[str, ArbotixJoint] = field(default_factory=dict)
    left_out: set[str] = field(default_factory=set)
    controllers: dict[str, FollowController | DiffController | ArbotixGripper] = field(default_factory=dict)

    def missing(self, controller: FollowController | ArbotixGripper) -> list[str]:
        """Return the joints of a controller that are not there."""
        return [joint.value for joint in controller.joints if joint.value not in self.joints]


def merged(files: Sequence[ArbotixFile], report: Report) -> ArbotixRobot:
    """Return the robot that the files make together; of two things of one name, the first."""
    robot = ArbotixRobot()
    drivers = [driver for file in files for driver in file.drivers]
    first_port = next((item.port.value for item in drivers if item.port), USUAL_PORT)
    for driver in drivers:
        line = robot.lines.setdefault(driver.port.value if driver.port else first_port, ArbotixDriver())
        _join(line, driver, report)
        for joint in driver.joints.values():
            if _first(robot.joints, joint, "joint", report):
                _add(line, joint, report)
        robot.left_out |= driver.left_out
    controllers = (one for driver in drivers for one in driver.controllers)
    for controller in (*controllers, *(gripper for file in files for gripper in file.grippers)):
        _first(robot.controllers, controller, "controller", report)
    _drop_lost(robot, report)
    if first := next(iter(robot.joints.values()), None):
        words = "the joints need the robot's URDF, which these files do not name"
        report.add(NO_URDF.at(first.span, words, help="name it in the manifest: 'body: {urdf: FILE}'"))
    return robot


def _first(known: dict[str, P], one: P, what: str, report: Report) -> bool:
    """Add a thing under its name and return True, unless there is one; tell if that is another one."""
    other = known.setdefault(one.name, one)
    if other != one:
        words = f"the {what} '{plain(one.name, 60)}' was something else before; the first one counts"
        report.add(DISAGREES.at(one.span, words, related=[Related(other.span, "the first one")]))
    return other is one


def _join(line: ArbotixDriver, driver: ArbotixDriver, report: Report) -> None:
    line.port = line.port or driver.port
    if line.baud and driver.baud and line.baud != driver.baud:
        words = f"one line has two rates: {line.baud.value} and {driver.baud.value} bit/s; the first one counts"
        report.add(DISAGREES.at(driver.baud.span, words, related=[Related(line.baud.span, "the first one")]))
    line.baud = line.baud or driver.baud
    rates = [one for one in (line.rate, driver.rate) if one]
    line.rate = max(rates, key=lambda rate: rate.value) if rates else None
    line.idle = {**driver.idle, **line.idle}


def _add(line: ArbotixDriver, joint: ArbotixJoint, report: Report) -> None:
    other = next((item for item in line.joints.values() if item.id == joint.id), None)
    if other is not None:
        words = (
            f"the servos of '{plain(other.name, 60)}' and '{plain(joint.name, 60)}' have the same id {joint.id.value}"
        )
        report.add(ONE_ID.at(joint.id.span, words, related=[Related(other.id.span, "the other one")]))
    line.joints[joint.name] = joint


def _drop_lost(robot: ArbotixRobot, report: Report) -> None:
    """Drop controllers whose joints are not there; joints that were left out have been reported."""
    for name, controller in list(robot.controllers.items()):
        if isinstance(controller, DiffController):
            continue
        unknown = [joint for joint in controller.joints if joint.value not in robot.joints.keys() | robot.left_out]
        for joint in unknown:
            words = f"the controller '{plain(name, 60)}' leads '{plain(joint.value, 60)}', which no file has"
            report.add(NOT_DRIVEN.misspelt(joint.span, words, joint.value, robot.joints, "joints"))
        gone = robot.missing(controller)
        if len(gone) == len(controller.joints) or (gone and isinstance(controller, ArbotixGripper)):
            del robot.controllers[name]
            if not unknown:
                words = f"controller '{plain(name, 60)}' is not carried over: its joints are left out"
                report.add(NOT_CARRIED_OVER.at(controller.span, words))


_UNITS = {"base_width": " m", "rate": " Hz"}


class ArbotixManifest:
    """Writes the sections of a robot; names that manifests cannot have are changed."""

    def __init__(self, robot: ArbotixRobot) -> None:
        self._robot = robot
        self._names, actuators = FreeNames(is_own_name), FreeNames()
        self._buses = {port: self._names.take("servos", "") for port, line in robot.lines.items() if line.joints}
        self._actuators = {
            name: actuators.take(f"{name.removesuffix('_joint')}_servo", "servo") for name in robot.joints
        }

    def text(self) -> str:
        """Return the sections, an empty line between two of them."""
        parts = (self._bus_rows, self._actuator_rows, self._joint_rows, self._controller_rows, self._base_rows)
        return "\n".join(text for part in parts if (text := out.section(part())))

    def _bus_rows(self) -> Iterator[out.Row]:
        if self._buses:
            yield out.row(0, "buses:")
        for port, name in self._buses.items():
            yield from _bus(name, self._robot.lines[port])

    def _actuator_rows(self) -> Iterator[out.Row]:
        if self._buses:
            yield out.row(0, "actuators:")
            yield out.row(1, "", "the files name no models: these are guesses by the ticks of the servos")
        for port, name in self._buses.items():
            for joint in self._robot.lines[port].joints.values():
                yield out.row(1, f"{self._actuators[joint.name]}: {_servo(name, joint)}", _origin(joint))

    def _joint_rows(self) -> Iterator[out.Row]:
        if self._buses:
            yield out.Row("", "the joints below are those of the robot's URDF; name that file here:")
            yield out.Row("", "body: {urdf: robot.urdf}")
            yield out.row(0, "joints:")
        for joint in self._robot.joints.values():
            yield out.row(1, f"{yaml_key(joint.name)}:", out.place(joint.span))
            yield out.row(
                2, f"actuator: {self._actuators[joint.name]}", "" if joint.limits else f"no limits: {turns(joint)}"
            )
            if limits := _manifest_limits(joint):
                yield out.row(2, f"limits: {out.flow(limits)}", _half_given(joint))

    def _controller_rows(self) -> Iterator[out.Row]:
        controllers = [one for one in self._robot.controllers.values() if not isinstance(one, DiffController)]
        if controllers:
            yield out.row(0, "controllers:")
        for controller in controllers:
            yield self._head(controller.name, controller)
            yield from self._follow(controller) if isinstance(controller, FollowController) else _gripper(controller)

    def _head(self, wanted: str, one: FollowController | DiffController | ArbotixGripper) -> out.Row:
        name = self._names.take(wanted, "controller")
        was = f"; its name was '{plain(one.name, 60)}'" if name != one.name else ""
        return out.row(1, f"{name}:", f"{out.place(one.span)}{was}")

    def _follow(self, controller: FollowController) -> Iterator[out.Row]:
        yield out.row(2, "type: joint_trajectory")
        gone = self._robot.missing(controller)
        names = [out.word(joint.value) for joint in controller.joints if joint.value not in gone]
        without = f"without {', '.join(plain(name, 60) for name in gone)}" if gone else ""
        line = out.row(2, f"joints: {out.flow_list(names)}", without)
        if len(line.text) <= out.WIDEST:
            yield line
            return
        yield out.row(2, "joints:", without)
        for name in names:
            yield out.row(3, f"- {name}")

    def _base_rows(self) -> Iterator[out.Row]:
        bases = [item for item in self._robot.controllers.values() if isinstance(item, DiffController)]
        if bases:
            yield out.row(0, "components:")
        for base in bases:
            yield self._head(base.name.removesuffix("_controller"), base)
            yield from _base(base)


def _bus(name: str, line: ArbotixDriver) -> Iterator[out.Row]:
    yield out.row(1, f"{name}:")
    yield out.row(2, "type: dynamixel")
    port = line.port
    yield out.row(
        2,
        f"port: {out.word(port.value if port else USUAL_PORT)}",
        out.place(port.span) if port else "the driver's default",
    )
    if line.baud:
        yield out.row(2, f"baud: {line.baud.value}", out.place(line.baud.span))
    if line.rate:
        why = "the larger of read_rate and write_rate"
        yield out.row(2, f"rate: {out.quantity(line.rate.value, 'Hz')}", f"{out.place(line.rate.span)}: {why}")
    if line.idle:
        yield out.row(2, "", f"not needed here: {out.places(line.idle)}")


def _servo(bus: str, joint: ArbotixJoint) -> str:
    entries = {"bus": bus, "model": joint.model.name, "id": str(joint.id.value)}
    if joint.neutral:
        entries["neutral"] = str(joint.neutral.value)
    if joint.is_inverted:
        entries["invert"] = out.flag(True)
    return out.flow(entries)


def _origin(joint: ArbotixJoint) -> str:
    return f"{out.place(joint.id.span)}: {joint.model.family.ticks} ticks over {out.number(joint.turn)} deg"


def _manifest_limits(joint: ArbotixJoint) -> dict[str, str]:
    found = {}
    if joint.limits:
        found["position"] = out.flow_list([out.quantity(limit, "deg") for limit in joint.limits])
    if joint.speed:
        found["velocity"] = out.quantity(joint.speed.value, "deg/s")
    return found


def _half_given(joint: ArbotixJoint) -> str:
    if joint.limits is None or (joint.least and joint.greatest):
        return ""
    return f"{'max' if joint.least else 'min'}_angle is the driver's default"


def _gripper(gripper: ArbotixGripper) -> Iterator[out.Row]:
    for name, (value, origin) in gripper.lines.items():
        yield out.row(2, f"{name}: {value}", origin)


def _base(controller: DiffController) -> Iterator[out.Row]:
    yield out.row(2, "type: diff_drive_sim", "the ArbotiX board drives the real base by its own firmware")
    if controller.acceleration:
        text = out.quantity(controller.acceleration.value, "m/s^2")
        yield out.row(2, f"acceleration: {text}", f"{out.place(controller.acceleration.span)}: accel_limit")
    if controller.timeout:
        yield out.row(
            2,
            f"command_timeout: {out.quantity(controller.timeout.value, 's')}",
            f"{out.place(controller.timeout.span)}: timeout",
        )
    if controller.kept:
        known = (f"{name} {out.number(found.value)}{_UNITS.get(name, '')}" for name, found in controller.kept.items())
        yield out.row(2, "", f"of the real one: {', '.join(known)}")


@importer("arbotix", "driver files of arbotix_python, and parameters of its gripper controller")
def arbotix(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the servos, joints and controllers of the files."""
    read = {file.name: read_arbotix(file, report) for file in files}
    found = {file: item for file, item in read.items() if item.drivers or item.grippers}
    sections = ArbotixManifest(merged(list(found.values()), report)).text()
    return f"{out.header('arbotix', found, 'Robot', name)}\n{sections}" if sections else ""

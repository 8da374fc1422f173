"""Joints in a file of ArbotiX: which servo turns each, where it is at 0, and how far and fast it may turn."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import field

from rbxcompose.actuation.servo_models import ServoModel, servo_models
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Severity, Span, kind
from rbxcompose.importing.foreign_files import ForeignMap, Given
from rbxcompose.importing.importer import NOT_CARRIED_OVER
from rbxcompose.importing.manifest_text import degrees_shown, number
from rbxcompose.manifest.validate import OUT_OF_RANGE

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


def read_joint(name: str, told: ForeignMap) -> ArbotixJoint | None:
    """Return a joint, or None after the finding that says why it is left out."""
    type_ = told.choice("type", (DYNAMIXEL, *OTHER_TYPES))
    if type_ is not None and type_.value in OTHER_TYPES:
        told.tell(NOT_CARRIED_OVER.at(type_.span, f"{told.what} is not carried over: {OTHER_TYPES[type_.value]}"))
        return None
    id_ = told.needs("id", told.whole("id", 0, _LAST_ID))
    found = _model(told)
    neutral = told.whole("neutral", -_FAR, _FAR)
    is_inverted = told.is_set("invert")
    least, greatest = _limits(told, found[1] / 2 if found else math.inf)
    speed = told.above_zero("max_speed")
    readable = told.flag("readable")
    if readable is not None and not readable.value:
        words = f"'readable' of {told.what} is not carried over: all servos of a bus are read"
        told.tell(NOT_CARRIED_OVER.at(readable.span, words))
    told.tell_others()
    if id_ is None or found is None or (type_ is None and "type" in told):
        return None
    model, turn = found
    joint = ArbotixJoint(name, told.span, id_, model, turn, neutral, is_inverted, least, greatest, speed)
    for finding in _unreachable(joint, told.what):
        told.tell(finding)
    return joint


def _model(told: ForeignMap) -> tuple[ServoModel, float] | None:
    """Return the model that has the ticks and the range of a joint, and that range."""
    ticks, given = told.whole("ticks", 1, _FAR), told.above_zero("range")
    if ticks is None and "ticks" in told:
        return None
    count = ticks.value if ticks else 1024
    turn = given.value if given else _FULL_RANGE.get(count, _OTHER_RANGE)
    for name in GUESSES:
        family = servo_models()[name].family
        if family.ticks == count and abs(math.degrees(family.span) - turn) <= _CLOSE:
            return servo_models()[name], turn
    span = given.span if given else ticks.span if ticks else told.span
    known = ", ".join(f"{one}: {_ticks(one)}" for one in GUESSES)
    words = f"no servo has {count} ticks over {number(turn)} degrees, so {told.what} is left out"
    told.tell(NO_SUCH_SERVO.at(span, words, help=known))
    return None


def _ticks(name: str) -> str:
    family = servo_models()[name].family
    return f"{family.ticks} ticks over {round(math.degrees(family.span), 2):g} degrees"


def _limits(told: ForeignMap, half: float) -> tuple[Given[float] | None, Given[float] | None]:
    least, greatest = told.number("min_angle"), told.number("max_angle")
    given = greatest or least
    if given and (least.value if least else -half) >= (greatest.value if greatest else half):
        words = f"'max_angle' of {told.what} must be greater than its 'min_angle'"
        told.tell(OUT_OF_RANGE.at(given.span, words, help="both are left out"))
        return None, None
    return least, greatest


def _unreachable(joint: ArbotixJoint, what: str) -> Iterable[Finding]:
    low, high = joint.reach
    slack = joint.model.per_tick
    for limit, outwards, end in ((joint.least, -1, low), (joint.greatest, 1, high)):
        if limit is not None and outwards * (math.radians(limit.value) - end) > slack:
            words = f"{what} never gets to {number(limit.value)} deg: {turns(joint)}"
            yield UNREACHABLE.at(limit.span, words, help="'neutral' is the tick at which it is at 0")


def turns(joint: ArbotixJoint) -> str:
    """Return how far the servo of a joint turns, in words."""
    low, high = joint.reach
    return f"its servo turns from {degrees_shown(low)} to {degrees_shown(high)}"


def guesses(joints: Iterable[ArbotixJoint], span: Span) -> Iterable[Finding]:
    """Yield a finding for each model that was guessed for joints of one file."""
    for name, count in sorted(Counter(one.model.name for one in joints).items()):
        which = "1 joint" if count == 1 else f"{count} joints"
        words = f"the file names no models; the servos of {which} are taken for {name}, by {_ticks(name)}"
        yield GUESSED.at(span, words, help="'rbxcompose servo scan' tells the models of real servos")

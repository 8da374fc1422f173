"""The cycle of a bus of servos: prepare, read, decide, lead, write. It uses no thread and no messages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import zip_longest
from typing import Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.bus import FAST, SELDOM, ServoBus, slow_items
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.joint_drive import JointDrive, JointServo, ServoJoint, Writes
from rbxcompose.domains.servos.models import EXTENDED, ServoModel, model_of_number

PERIOD = 0.1  # [s] between two uses of one item


@dataclass(slots=True)
class ServoItem:
    """One item of a servo, which a controller reads or writes; `setup` is written before, without torque."""

    id: int
    model: ServoModel
    name: str
    is_read: bool = False
    setup: Mapping[str, int] = field(default_factory=dict)
    value: float = math.nan
    """The last reading, in the unit of the item."""
    problem: str = ""
    """Why it was not read or written; empty if it was."""
    wanted: int | None = None
    """Raw value that is not written yet."""
    written: int | None = None
    """Raw value that was written last."""
    due: float = -math.inf
    """When it may be used again [s]."""

    def write(self, raw: int) -> None:
        """Write a raw value in one of the next cycles; a newer one replaces it."""
        self.wanted = raw

    def use(self, bus: ServoBus, now: float) -> None:
        """Write what is wanted, or read it.

        Raises:
            PortError: if the bus has gone.
        """
        self.due = now + PERIOD
        if self.wanted is not None:
            failed = bus.write({self.id: {self.name: self.wanted}}, is_confirmed=True)
            self.problem = f"servo {self.id} did not take '{self.name}'" if failed else ""
            if not failed:
                self.written, self.wanted = self.wanted, None
        elif self.is_read:
            reading = bus.read([self.id], [self.name]).get(self.id)
            self.problem = "" if reading else f"servo {self.id} does not answer"
            self.value = self.model.to_si(self.name, reading.values[self.name]) if reading else math.nan


def use_next(items: Sequence[ServoItem], bus: ServoBus, now: float) -> None:
    """Use the item that has waited longest, if one is due.

    Raises:
        PortError: if the bus has gone.
    """
    due = [item for item in items if item.due <= now + 1e-9 and (item.is_read or item.wanted is not None)]
    if due:
        min(due, key=lambda servo_item: servo_item.due).use(bus, now)


def set_up(items: Sequence[ServoItem], bus: ServoBus) -> Iterator[str]:
    """Write what items need before they are used, and again what they had; yield sentences on lasting changes.

    Raises:
        PortError: if the bus has gone.
    """
    for item in items:
        if item.wanted is None:
            item.wanted = item.written  # a servo that had no supply has forgotten it
        reading = bus.read([item.id], list(item.setup)).get(item.id) if item.setup else None
        changed = {name: raw for name, raw in item.setup.items() if reading and reading.values[name] != raw}
        if changed:
            bus.write({item.id: {"torque_enable": 0}}, is_confirmed=True)
            failed = bus.write({item.id: changed}, is_confirmed=True)
            yield f"servo {item.id} {'did not take' if failed else 'now has'} {_shown(changed)}"


LIMIT = "velocity_limit"


def keep_speeds(bus: ServoBus, drive: JointDrive) -> Iterator[str]:
    """Limit a joint that is given velocities to those that its servos take; yield sentences on what is slower now.

    Raises:
        PortError: if the bus has gone.
    """
    joint = drive.joint
    for servo in joint.servos if joint.mode == "velocity" else ():
        reading = bus.read([servo.id], [LIMIT]).get(servo.id) if LIMIT in servo.model.items else None
        if reading is None:
            continue
        most = servo.model.to_si(LIMIT, reading.values[LIMIT])
        if drive.slow_down(most * abs(joint.transmission.slope(0.0))):
            yield f"servo {servo.id} of joint '{joint.name}' turns at most {most:.3g} rad/s"


def strangeness(bus: ServoBus, servo: JointServo) -> Iterator[str]:
    """Yield in words that a servo is of another model than it was said to be.

    Raises:
        PortError: if the bus has gone.
    """
    reading = bus.read([servo.id], [NUMBER]).get(servo.id)
    if reading is not None and (number := reading.values[NUMBER]) != servo.model.number:
        model = model_of_number(number)
        yield f"servo {servo.id} is {model.name if model else f'of model number {number}'}, not {servo.model.name}"


NUMBER = "model_number"
RANGE = ("min_position", "max_position")


def keep_ranges(bus: ServoBus, drive: JointDrive) -> Iterator[str]:
    """Limit a joint that is given positions to those that its servos take; yield sentences on what is narrower now.

    Raises:
        PortError: if the bus has gone.
    """
    joint = drive.joint
    for servo in joint.servos if joint.mode == "position" else ():
        is_endless = joint.is_continuous and servo.model.family.is_endless
        if is_endless or (reading := bus.read([servo.id], RANGE).get(servo.id)) is None:
            continue
        ticks = [reading.values[end] for end in RANGE]
        if ticks[0] <= servo.ends[0] and ticks[1] >= servo.ends[1]:
            continue
        lower, upper = sorted(joint.transmission.position(servo.angle(tick)) for tick in ticks)
        if drive.narrow(lower, upper):
            names = " and ".join(f"{end} {tick}" for end, tick in zip(RANGE, ticks, strict=True))
            yield f"joint '{joint.name}' goes from {lower:.3g} to {upper:.3g} only: servo {servo.id} has {names}"


TORQUE, TORQUE_LIMIT, MOST = "torque_enable", "torque_limit", "max_torque"


class TorqueLimits:
    """Keeps the limits of the servos of a bus."""

    def __init__(self) -> None:
        self._wanted: dict[int, int] = {}  # raw limits, by id
        self._reported: set[int] = set()

    def write(self, bus: ServoBus, servo: JointServo) -> None:
        """Write the limit of a servo, if it answers.

        Raises:
            PortError: if the bus has gone.
        """
        if (reading := bus.read([servo.id], [TORQUE_LIMIT, MOST]).get(servo.id)) is not None:
            wanted = self._wanted[servo.id] = raw_limit(servo, reading.values[MOST])
            if reading.values[TORQUE_LIMIT] != wanted:
                bus.write({servo.id: {TORQUE_LIMIT: wanted}}, is_confirmed=True)

    def keep(self, bus: ServoBus, servo: JointServo, values: Mapping[str, int]) -> str:
        """Write the limit again if a servo reports another one; return a note for people, or nothing.

        Raises:
            PortError: if the bus has gone.
        """
        wanted = self._wanted.get(servo.id)
        if wanted is None:
            self.write(bus, servo)
        elif values.get(TORQUE_LIMIT, wanted) == wanted:
            self._reported.discard(servo.id)
        else:
            bus.write({servo.id: {TORQUE_LIMIT: wanted}}, is_confirmed=True)
            if servo.id not in self._reported:
                self._reported.add(servo.id)
                return f"servo {servo.id} had lost its torque limit: it is written again"
        return ""


def raw_limit(servo: JointServo, most: int) -> int:
    """Return the limit that leaves a servo its share of the torque; `most` is what its owner allows it."""
    return most if servo.torque >= 1.0 else min(most, servo.model.to_raw(TORQUE_LIMIT, servo.torque))


WATCHDOG = "bus_watchdog"
MODE = "operating_mode"
DELAY = "return_delay"
_KEPT = (MODE, DELAY, *RANGE)  # outlive the supply, and change without torque only
_PROFILE = ("goal_speed", "profile_acceleration")  # of its way to a position; 0 is as fast as it can
_FIRED = -1  # what `bus_watchdog` reads after it has stopped a servo


def prepare(bus: ServoBus, joints: Iterable[ServoJoint], watchdog: float, delay: float | None = None) -> Iterator[str]:
    """Set the modes of all servos that answer, and arm watchdogs [s]; yield sentences on what has changed for good.

    With a `delay`, they pause so long before each reply [s].

    Raises:
        PortError: if the bus has gone.
    """
    for joint in joints:
        for servo in joint.servos:
            names = [name for name in (*_KEPT, *_PROFILE) if name in servo.model.items]
            if (reading := bus.read([servo.id], names).get(servo.id)) is None:
                continue
            changed = _changes(joint, servo, reading.values)
            if delay is not None and (raw := servo.model.to_raw(DELAY, delay)) != reading.values[DELAY]:
                changed[DELAY] = raw
            if changed:
                bus.write({servo.id: {"torque_enable": 0}}, is_confirmed=True)
                bus.write({servo.id: changed}, is_confirmed=True)
                yield f"servo {servo.id} of joint '{joint.name}' now has {_shown(changed)}"
            profile = {name: 0 for name in _PROFILE if joint.mode == "position" and reading.values.get(name)}
            if profile:
                bus.write({servo.id: profile}, is_confirmed=True)
                yield f"servo {servo.id} of joint '{joint.name}' was slower than it can be: {_shown(profile)} now"
            arm(bus, servo, watchdog)


def with_torque(bus: ServoBus, joints: Iterable[ServoJoint]) -> dict[str, bool]:
    """Return whether all servos of a joint have torque now, of the joints whose servos have all answered."""
    joints = list(joints)
    found = bus.read([id_ for joint in joints for id_ in joint.ids], ["torque_enable"])
    held = {id_ for id_, reading in found.items() if reading.values["torque_enable"]}
    return {joint.name: held.issuperset(joint.ids) for joint in joints if found.keys() >= set(joint.ids)}


def arm(bus: ServoBus, servo: JointServo, watchdog: float) -> None:
    """Let a servo stop after a silence of the bus [s], 0 is never, if its model can; one that has done so goes on."""
    if (item := servo.model.items.get(WATCHDOG)) is None:
        return
    bus.write({servo.id: {WATCHDOG: 0}}, is_confirmed=True)
    if watchdog > 0:
        raw = max(1, min(item.most, item.to_raw(watchdog)))
        bus.write({servo.id: {WATCHDOG: raw}}, is_confirmed=True)


def has_fired(values: Mapping[str, int]) -> bool:
    """Return whether a servo has been stopped by its watchdog."""
    return values.get(WATCHDOG) == _FIRED


def _changes(joint: ServoJoint, servo: JointServo, values: Mapping[str, int]) -> dict[str, int]:
    """Return what differs from what the joint needs; ranges of positions that somebody has set are kept."""
    if modes := servo.model.family.modes:
        is_endless = joint.is_continuous and servo.model.family.is_endless
        wanted = EXTENDED if joint.mode == "position" and is_endless else joint.mode
        return {} if values.get(MODE) == modes[wanted] else {MODE: modes[wanted]}
    is_wheel = values.get("min_position") == values.get("max_position") == 0
    if joint.mode == "velocity":
        return {} if is_wheel else {"min_position": 0, "max_position": 0}
    return {"min_position": 0, "max_position": servo.model.family.ticks - 1} if is_wheel else {}


def _shown(changed: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {raw}" for name, raw in changed.items())


class Leader(Protocol):
    """What leads joints in each cycle: a controller."""

    def cycle(self, now: float, dt: float) -> None:
        """Ask joints for what they shall do up to `now + dt` [s]."""


@dataclass(frozen=True, slots=True)
class JointMimic:
    """A joint that follows another one: at `multiplier` times its position plus `offset`."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(slots=True)
class ServoCycle:
    """The joints of a bus by name, and those of them that mimic others."""

    bus: ServoBus
    drives: Mapping[str, JointDrive]
    mimics: Mapping[str, JointMimic] = field(default_factory=dict)
    watchdog: float = 0.0
    """Silence after which servos stop by themselves, if they can [s]; 0 is never."""
    shares_heat: bool = False
    """Whether all joints rest when one is too hot."""
    items: list[ServoItem] = field(default_factory=list)
    """Items of servos that controllers use themselves."""
    torques: TorqueLimits = field(default_factory=TorqueLimits)
    """The torque limits of the servos."""
    notes: list[str] = field(default_factory=list)
    """What has happened to servos, for people; whoever shows it clears it."""
    _count: int = 0  # of cycles
    _turn: int = 0  # whose slow items are read next
    _keep: int = 0  # whose torque limit is read next

    @property
    def ids(self) -> list[int]:
        """Return the ids of all servos."""
        return [id_ for drive in self.drives.values() for id_ in drive.joint.ids]

    def run(self, now: float, dt: float, leaders: Sequence[Leader] = ()) -> None:
        """Do what is due at `now` [s], `dt` [s] before the next cycle.

        Raises:
            PortError: if the bus has gone.
        """
        self._read()
        for leader in leaders:
            leader.cycle(now, dt)
        self._mimic()
        if self.shares_heat:
            warmest = max(
                (each.temperature for each in self.drives.values() if each.temperature is not None), default=None
            )
            for drive in self.drives.values():
                drive.warmest = warmest
        self._write([drive.step(now, dt) for drive in self.drives.values()])
        use_next(self.items, self.bus, now)

    def limit(self, drives: Iterable[JointDrive]) -> Iterator[str]:
        """Write the torque limits of servos, and keep to their speeds and ranges; yield what is less now.

        Raises:
            PortError: if the bus has gone.
        """
        for drive in drives:
            strangers: list[str] = []
            for servo in drive.joint.servos:
                self.torques.write(self.bus, servo)
                strangers += strangeness(self.bus, servo)
            drive.stranger = "; ".join(strangers)
            yield from keep_speeds(self.bus, drive)
            yield from keep_ranges(self.bus, drive)

    def end(self, *, is_kept: bool = False) -> list[int]:
        """Switch all torque off, or stop what turns if it is kept; return the ids of servos that do not confirm it.

        It is written twice, since nobody confirms a group write.

        Raises:
            PortError: if the bus has gone.
        """
        wheels = [id_ for drive in self.drives.values() if drive.joint.mode == "velocity" for id_ in drive.joint.ids]
        ids, item = (wheels, "goal_velocity") if is_kept else (self.ids, "torque_enable")
        for _ in range(2):
            self.bus.write({id_: {item: 0} for id_ in ids})
        left = self.bus.read(ids, [item]) if ids else {}
        return [id_ for id_ in ids if id_ not in left or left[id_].values[item]]

    def _write(self, stages: list[list[Writes]]) -> None:
        for stage in zip_longest(*stages):
            if writes := {id_: raw for item in stage if item for id_, raw in item.items()}:
                self.bus.write(writes)

    def _read(self) -> None:
        drives = {id_: drive for drive in self.drives.values() for id_ in drive.joint.ids}
        if not drives:
            return
        for id_, reading in self.bus.read(list(drives), FAST).items():
            drives[id_].take(id_, reading)
        ids, self._count = list(drives), self._count + 1
        if self._count % SELDOM == 0:  # turns of their own: no number of servos keeps one of them from its turn
            turn, number = divmod(self._keep, len(ids))  # each is read by itself: no cycle has room for both
            self._keep_torque(ids[number], drives, (TORQUE, TORQUE_LIMIT)[turn % 2])
            self._keep += 1
            return
        id_ = ids[self._turn % len(ids)]
        self._turn += 1
        items = slow_items(drives[id_].joint.servo(id_).model)
        if (slow := self.bus.read([id_], items).get(id_)) is not None:
            drives[id_].take(id_, slow)
            self._care(id_, drives, slow.values)

    def _keep_torque(self, id: int, drives: Mapping[int, JointDrive], *names: str) -> None:
        """See whether a servo has lost its torque without its supply; write its limit again, if it has forgotten it."""
        drive, servo = drives[id], drives[id].joint.servo(id)
        known = [name for name in names if name in servo.model.items]
        if not known or drive.hindrance or drive.error or (reading := self.bus.read([id], known).get(id)) is None:
            return
        if drive.has_torque and not reading.values.get(TORQUE, 1) and not reading.alert:  # else its error says why
            drive.lost_torque()
            self.notes.append(f"servo {id} of joint '{drive.joint.name}' has lost its torque: was it without supply?")
        if TORQUE_LIMIT in known and (note := self.torques.keep(self.bus, servo, reading.values)):
            self.notes.append(note)

    def _care(self, id: int, drives: Mapping[int, JointDrive], values: Mapping[str, int]) -> None:
        """Arm a watchdog that has stopped a servo, or that it has forgotten without its supply."""
        drive, has_forgotten = drives[id], values.get(WATCHDOG) == 0 and self.watchdog > 0
        if has_fired(values):
            drive.was_cut()
        if has_fired(values) or has_forgotten:
            arm(self.bus, drive.joint.servo(id), self.watchdog)
        if has_forgotten:
            self._keep_torque(id, drives, TORQUE, TORQUE_LIMIT)

    def _mimic(self) -> None:
        """Let joints follow those which they mimic, with and without torque."""
        for name, mimic in self.mimics.items():
            drive, leader = self.drives[name], self.drives[mimic.joint]
            if leader.has_torque:
                at = leader.commanded
                drive.follow(JointSample(mimic.multiplier * at.position + mimic.offset, mimic.multiplier * at.velocity))
            elif drive.has_torque:
                drive.relax()

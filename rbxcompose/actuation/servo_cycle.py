"""The cycle of a bus of servos: read, decide, lead, write. It uses no thread and no messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import zip_longest
from typing import Protocol

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.cycle_items import FAST, SELDOM, slow_items
from rbxcompose.actuation.joint_drive import JointDrive, Writes
from rbxcompose.actuation.preparation import arm, has_fired, is_unarmed
from rbxcompose.actuation.servo_items import ServoItem, use_next
from rbxcompose.actuation.servo_joint import JointServo
from rbxcompose.actuation.speed_limits import keep_speeds
from rbxcompose.actuation.torque_limits import LIMIT, TorqueLimits
from rbxcompose.control.curves import JointSample
from rbxcompose.control.joint_states import Relax
from rbxcompose.dataclass import dataclass


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
    """What has happened to servos, for people; whoever tells it clears it."""
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
                (one.temperature for one in self.drives.values() if one.temperature is not None), default=None
            )
            for drive in self.drives.values():
                drive.warmest = warmest
        self._write([drive.step(now, dt) for drive in self.drives.values()])
        use_next(self.items, self.bus, now)

    def limit(self, drives: Iterable[JointDrive]) -> Iterator[str]:
        """Write the torque limits of servos, and keep to the speeds that they take; yield what is slower now.

        Raises:
            PortError: if the bus has gone.
        """
        for drive in drives:
            for servo in drive.joint.servos:
                self.torques.write(self.bus, servo)
            yield from keep_speeds(self.bus, drive)

    def relax(self, now: float, dt: float) -> None:
        """Switch all torque off, twice, since nobody confirms a group write."""
        for drive in self.drives.values():
            drive.ask(Relax())
            drive.step(now, dt)
        for _ in range(2):
            self.bus.write({id_: {"torque_enable": 0} for id_ in self.ids})

    def _write(self, stages: list[list[Writes]]) -> None:
        for stage in zip_longest(*stages):
            if writes := {id_: raw for one in stage if one for id_, raw in one.items()}:
                self.bus.write(writes)

    def _read(self) -> None:
        drives = {id_: drive for drive in self.drives.values() for id_ in drive.joint.ids}
        if not drives:
            return
        for id_, reading in self.bus.read(list(drives), FAST).items():
            drives[id_].take(id_, reading)
        ids, self._count = list(drives), self._count + 1
        if self._count % SELDOM == 0:  # turns of their own: no number of servos keeps one of them from its turn
            self._keep_torque(ids[self._keep % len(ids)], drives)
            self._keep += 1
            return
        id_ = ids[self._turn % len(ids)]
        self._turn += 1
        items = slow_items(drives[id_].joint.servo(id_).model)
        if (slow := self.bus.read([id_], items).get(id_)) is not None:
            drives[id_].take(id_, slow)
            self._care(drives[id_], drives[id_].joint.servo(id_), slow.values)

    def _keep_torque(self, id: int, drives: Mapping[int, JointDrive]) -> None:
        """Write the torque limit of a servo again, if it has forgotten it without its supply."""
        drive, servo = drives[id], drives[id].joint.servo(id)
        if LIMIT not in servo.model.items or drive.hindrance or drive.error:
            return
        reading = self.bus.read([id], [LIMIT]).get(id)
        if reading is not None and (note := self.torques.keep(self.bus, servo, reading.values)):
            self.notes.append(note)

    def _care(self, drive: JointDrive, servo: JointServo, values: Mapping[str, int]) -> None:
        """Arm a watchdog that has stopped a servo, or that it has forgotten without its supply."""
        if has_fired(values):
            drive.was_cut()
        if has_fired(values) or (is_unarmed(values) and self.watchdog > 0):
            arm(self.bus, servo, self.watchdog)

    def _mimic(self) -> None:
        """Let joints follow those which they mimic, with and without torque."""
        for name, mimic in self.mimics.items():
            drive, leader = self.drives[name], self.drives[mimic.joint]
            if leader.has_torque:
                at = leader.commanded
                drive.follow(JointSample(mimic.multiplier * at.position + mimic.offset, mimic.multiplier * at.velocity))
            elif drive.has_torque:
                drive.relax()

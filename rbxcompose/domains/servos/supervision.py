"""How a bus keeps its time, reports its joints and restarts their servos. Pure: times are arguments [s]."""

from __future__ import annotations

import gc
import math
import os
from collections import deque
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.domains.servos.bus import ServoBus
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.joint_drive import JointDrive
from rbxcompose.domains.servos.joint_states import Enable, JointMode
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

REMEMBERED = 1000  # cycles, of which the lateness is known


class Periods:
    """Counts the periods of a cycle on a grid; those that no cycle began in were missed."""

    def __init__(self, period: float) -> None:
        self.period = period
        self.met = self.missed = 0
        self._last: int | None = None  # number of the last period
        self._late: deque[float] = deque(maxlen=REMEMBERED)

    def begin(self, now: float) -> None:
        """Note that a cycle begins."""
        number = math.floor(now / self.period + 1e-6)
        if self._last is not None:
            self.missed += max(0, number - self._last - 1)
        self._last = number
        self.met += 1
        self._late.append(now - number * self.period)

    def pause(self) -> None:
        """Do not count what comes until the next cycle."""
        self._last = None

    @property
    def share_met(self) -> float:
        """Return the share of periods in which a cycle began."""
        return self.met / (self.met + self.missed) if self.met else 1.0

    def late(self, share: float) -> float:
        """Return how late this share of the last cycles began, at most [s]."""
        ordered = sorted(self._late)
        return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0.0


_FIRST = 1  # the lowest real-time priority: above all ordinary programs, below what others have put there


def be_prompt() -> str:
    """Let this thread run before ordinary programs, and spare it searches for garbage; return why not, or nothing.

    Linux permits it to root and to users with the limit `rtprio`. Threads and processes begun later are ordinary ones.
    """
    gc.freeze()
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(_FIRST))
    except OSError as error:
        return error.strerror or str(error)
    return ""


PAUSE = 0.1  # [s] in which a servo may still answer from before
PATIENCE = 2.0  # [s] after which it must have answered
UNDER_WAY = "its servos start again"

WhenRebooted = Callable[[str], None]
"""Takes why it failed, or nothing."""


@dataclass(frozen=True, slots=True)
class _Reboot:
    drive: JointDrive
    begun: float
    done: WhenRebooted


class Reboots:
    """The joints whose servos are being started again; they have no torque, and commands are refused meanwhile.

    `prepare` is called for a joint whose servos answer again.
    """

    def __init__(self, bus: ServoBus, prepare: Callable[[JointDrive], None]) -> None:
        self._bus, self._prepare = bus, prepare
        self._open: list[_Reboot] = []

    def begin(self, drive: JointDrive, now: float, done: WhenRebooted) -> None:
        """Switch the torque of a joint off and start its servos again; `done` is called now or later.

        Raises:
            PortError: if the bus has gone.
        """
        if reason := objection(drive) or (UNDER_WAY if any(reboot.drive is drive for reboot in self._open) else ""):
            done(reason)
            return
        drive.relax()
        self._bus.write({id_: {"torque_enable": 0} for id_ in drive.joint.ids})
        if silent := [id_ for id_ in drive.joint.ids if not self._bus.reboot(id_)]:
            done(f"{_servo_names(silent)} did not confirm the reboot")
            return
        drive.hindrance = UNDER_WAY
        self._open.append(_Reboot(drive, now, done))

    def step(self, now: float) -> None:
        """Go on: prepare the joints whose servos answer again, and give up those that stay silent.

        Raises:
            PortError: if the bus has gone.
        """
        for reboot in list(self._open):
            if reboot.drive.measured_at >= reboot.begun + PAUSE:
                self._prepare(reboot.drive)
                self._end(reboot, self._enabled(reboot.drive))
            elif now - reboot.begun > PATIENCE:
                self._end(
                    reboot, f"{_servo_names(reboot.drive.joint.ids)} did not answer for {PATIENCE:g} s after the reboot"
                )

    def fail(self, reason: str) -> None:
        """End all of them."""
        for reboot in list(self._open):
            self._end(reboot, reason)

    def _end(self, reboot: _Reboot, reason: str) -> None:
        self._open.remove(reboot)
        reboot.drive.hindrance = ""
        reboot.done(reason)

    def _enabled(self, drive: JointDrive) -> str:
        """Let a joint move again unless somebody has disabled it; return why it may not, or nothing."""
        for id_, reading in self._bus.read(drive.joint.ids, ["present_position", "hardware_error"]).items():
            drive.take(id_, reading)
        if drive.error:
            return f"after the reboot, it still reports {drive.error}"
        if drive.condition.is_enabled:
            drive.ask(Enable(True))
        return ""


def objection(drive: JointDrive) -> str:
    """Return why the servos of a joint cannot be started again, and what to do, or nothing."""
    old = [servo for servo in drive.joint.servos if servo.model.protocol == 1]
    if not old:
        return ""
    return (
        f"servo {old[0].id} ({old[0].model.name}) speaks protocol 1.0, which has no reboot: "
        "enable the joint when its error is gone, or switch its supply off and on"
    )


def _servo_names(ids: Iterable[int]) -> str:
    found = [str(id_) for id_ in ids]
    return f"servo {found[0]}" if len(found) == 1 else f"servos {', '.join(found)}"


@dataclass(frozen=True, slots=True)
class ServoReport:
    """A status for diagnostics."""

    level: Level
    message: str
    values: Mapping[str, object]


def joint_state(drives: Iterable[JointDrive], stamp: int) -> JointState | None:
    """Return where the joints are, without those that are not measured now, None if none is; `stamp` is in ns."""
    return _joint_state([(drive, drive.measured) for drive in drives], stamp)


def joint_command(drives: Iterable[JointDrive], stamp: int) -> JointState | None:
    """Return where the joints are commanded to be, those without torque where they are; like `joint_state`."""
    return _joint_state([(each, each.commanded if each.has_torque else each.measured) for each in drives], stamp)


def _joint_state(samples: Iterable[tuple[JointDrive, JointSample]], stamp: int) -> JointState | None:
    known = [each for each in samples if math.isfinite(each[1].position) and not each[0].condition.is_lost]
    if not known:
        return None
    return JointState(
        header=Header(stamp=to_time(stamp)),
        name=tuple(drive.joint.name for drive, _ in known),
        position=np.array([sample.position for _, sample in known]),
        velocity=np.array([sample.velocity for _, sample in known]),
        effort=np.array([drive.effort for drive, _ in known]),
    )


def joint_report(
    drives: Mapping[str, JointDrive], controllers: Mapping[str, str], periods: Periods, *, is_lost: bool
) -> ServoReport:
    """Return how the joints are, with the notes of controllers."""
    own = {name: drive.condition.note or drive.refused or drive.clamped for name, drive in drives.items()}
    notes = {name: words for name, words in {**own, **controllers}.items() if words}
    bad = [name for name, drive in drives.items() if drive.mode in (JointMode.FAULT, JointMode.RESTING)]
    level = Level.ERROR if bad or is_lost else Level.WARN if notes else Level.OK
    message = "; ".join(f"{name}: {words}" for name, words in notes.items()) or f"{len(drives)} joints"
    kept = {"periods_met": f"{100 * periods.share_met:.2f} %", "late": f"{1e3 * periods.late(0.99):.1f} ms"}
    return ServoReport(level, message, {**{name: drive.mode for name, drive in drives.items()}, **kept})

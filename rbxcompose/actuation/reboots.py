"""Starting the servos of joints again, while the cycles of their bus go on. Pure: time is an argument [s]."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.joint_drive import JointDrive
from rbxcompose.control.joint_states import Enable
from rbxcompose.dataclass import dataclass

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
        if reason := objection(drive) or (UNDER_WAY if any(one.drive is drive for one in self._open) else ""):
            done(reason)
            return
        drive.relax()
        self._bus.write({id_: {"torque_enable": 0} for id_ in drive.joint.ids})
        if silent := [id_ for id_ in drive.joint.ids if not self._bus.reboot(id_)]:
            done(f"{_told(silent)} did not confirm the reboot")
            return
        drive.hindrance = UNDER_WAY
        self._open.append(_Reboot(drive, now, done))

    def step(self, now: float) -> None:
        """Go on: prepare the joints whose servos answer again, and give up those that stay silent.

        Raises:
            PortError: if the bus has gone.
        """
        for one in list(self._open):
            if one.drive.measured_at >= one.begun + PAUSE:
                self._prepare(one.drive)
                self._end(one, self._enabled(one.drive))
            elif now - one.begun > PATIENCE:
                self._end(one, f"{_told(one.drive.joint.ids)} did not answer for {PATIENCE:g} s after the reboot")

    def fail(self, reason: str) -> None:
        """End all of them."""
        for one in list(self._open):
            self._end(one, reason)

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
    old = [one for one in drive.joint.servos if one.model.protocol == 1]
    if not old:
        return ""
    return (
        f"servo {old[0].id} ({old[0].model.name}) speaks protocol 1.0, which has no reboot: "
        "enable the joint when its error is gone, or switch its supply off and on"
    )


def _told(ids: Iterable[int]) -> str:
    found = [str(id_) for id_ in ids]
    return f"servo {found[0]}" if len(found) == 1 else f"servos {', '.join(found)}"

"""The stop of the whole robot: it latches, and nobody releases it while a component needs the robot to stand still."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

from rbxcompose.robot_events import RobotHeld
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.supervision.members import ConductorEffects, Member


class StopLatch:
    """Tells processes to stop and to go on; `members` returns those that hold components."""

    def __init__(self, effects: ConductorEffects, members: Callable[[], Iterable[Member]]) -> None:
        self.is_stopped = False
        self.holds: dict[str, str] = {}  # why components need the robot to stand still
        self._effects, self._members = effects, members

    def set(self, is_stopped: bool, but: Member | None = None) -> None:
        """Stop the robot or release it; `but` has done so by itself."""
        self.is_stopped = is_stopped
        for member in self._members():
            if member is not but and member.is_configured:
                self.tell(member)

    def tell(self, member: Member) -> None:
        """Tell a process how it stands."""
        member.is_stopped = self.is_stopped
        self._effects.send(member.name, say.Stop() if self.is_stopped else say.Release())

    def heard(self, member: Member, held: RobotHeld) -> None:
        """Stop everything for a component; its process has stopped by itself, and has logged the reason."""
        if held.reason:
            self.holds[held.component] = held.reason
            member.is_stopped = True
            self.set(True, but=member)
        else:
            self.holds.pop(held.component, None)

    def forget(self, remaining: Collection[str]) -> None:
        """Forget the components that are no longer of the robot."""
        self.holds = {name: reason for name, reason in self.holds.items() if name in remaining}

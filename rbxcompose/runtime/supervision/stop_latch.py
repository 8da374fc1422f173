"""The stop of the whole robot: it latches, and nobody releases it while a component needs the robot to stand still."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

from rbxcompose.robot_events import RobotHeld
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.folder import StopState
from rbxcompose.runtime.supervision.members import ConductorEffects, Member


class StopLatch:
    """Tells processes to stop and to go on; `members` returns those that hold components, `now` the time [s]."""

    def __init__(
        self, effects: ConductorEffects, members: Callable[[], Iterable[Member]], now: Callable[[], float]
    ) -> None:
        self.holds: dict[str, str] = {}  # why components need the robot to stand still
        self._effects, self._members, self._now = effects, members, now
        self._latched: tuple[str, float] | None = None  # who latched it first, and when

    @property
    def is_stopped(self) -> bool:
        """Return whether the robot is stopped."""
        return self._latched is not None

    @property
    def state(self) -> StopState | None:
        """Return who stopped the robot, and who still needs it to stand still; None if it is not stopped."""
        return StopState(*self._latched, dict(self.holds)) if self._latched else None

    def set(self, by: str, but: Member | None = None) -> None:
        """Stop the robot; `by` tells people who does, `but` has stopped by itself. The first one counts."""
        self._latched = self._latched or (by, self._now())
        self._tell_all(but)

    def release(self) -> None:
        """Let the robot move again."""
        self._latched = None
        self._tell_all(None)

    def _tell_all(self, but: Member | None) -> None:
        for member in self._members():
            if member is not but and member.is_configured:
                self.tell(member)
        self._effects.states_changed()

    def tell(self, member: Member) -> None:
        """Tell a process how it stands."""
        member.is_stopped = self.is_stopped
        self._effects.send(member.name, say.Stop() if self.is_stopped else say.Release())

    def heard(self, member: Member, held: RobotHeld) -> None:
        """Stop everything for a component; its process has stopped by itself, and has logged the reason."""
        if held.reason:
            self.holds[held.component] = held.reason
            member.is_stopped = True
            self.set(f"'{held.component}': {held.reason}", but=member)
        else:
            self.holds.pop(held.component, None)
            self._effects.states_changed()

    def forget(self, remaining: Collection[str]) -> None:
        """Forget the components that are no longer of the robot."""
        self.holds = {name: reason for name, reason in self.holds.items() if name in remaining}

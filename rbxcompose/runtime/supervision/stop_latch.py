"""The stop of the whole robot: it latches, and nobody releases it while a component needs the robot to stand still.

On several hosts, each stop belongs to the host on which it was ordered, and holds all. A release is for the stops that
its host knows of: one that was ordered meanwhile on the other side of a cut link holds the robot when the link is back.
"""

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace

from rbxcompose.runtime.channel import HostReport, Release, SharedStop, Stop, StopMark
from rbxcompose.runtime.folder import StopState
from rbxcompose.runtime.supervision.members import ConductorEffects, Member
from rbxcompose.sdk.component import RobotHeld


class StopLatch:
    """Tells processes to stop and to go on; `members` returns those that hold components, `now` the time [s]."""

    def __init__(
        self, effects: ConductorEffects, members: Callable[[], Iterable[Member]], now: Callable[[], float]
    ) -> None:
        self._effects, self._members, self._now = effects, members, now
        self._latched: tuple[str, float] | None = None  # who latched it first, and when
        self._numbers = 0  # of stops that were ordered here
        self.shared = SharedStop()  # what the other hosts are told
        self._others: dict[str, SharedStop] = {}  # what they have told
        self._own_holds: dict[str, str] = {}

    @property
    def is_stopped(self) -> bool:
        """Return whether the robot is stopped."""
        return self._latched is not None

    @property
    def holds(self) -> dict[str, str]:
        """Return why components need the robot to stand still, on all hosts."""
        others = {name: why for stop in self._others.values() for name, why in stop.holds.items()}
        return {**others, **self._own_holds}

    @property
    def state(self) -> StopState | None:
        """Return who stopped the robot, and who still needs it to stand still; None if it is not stopped."""
        return StopState(*self._latched, self.holds) if self._latched else None

    def set(self, by: str, but: Member | None = None) -> None:
        """Stop the robot; `by` tells people who does, `but` has stopped by itself. The first one counts."""
        if self.shared.own is None:
            self._mark(by)
        self._latched = self._latched or (by, self._now())
        self._notify_all(but)

    def _mark(self, by: str) -> None:
        self._numbers += 1
        self.shared = replace(self.shared, own=StopMark(self._effects.run_id, self._numbers), by=by)

    def release(self) -> None:
        """Let the robot move again."""
        known = [stop.own for stop in self._others.values() if stop.own is not None]
        self.shared = SharedStop(None, "", known, self._own_holds)
        self._latched = None
        self._notify_all(None)

    def _notify_all(self, but: Member | None) -> None:
        for member in self._members():
            if member is not but and member.is_configured:
                self.notify(member)
        self._effects.states_changed()

    def notify(self, member: Member) -> None:
        """Tell a process how it stands."""
        member.is_stopped = self.is_stopped
        self._effects.send(member.name, Stop() if self.is_stopped else Release())

    def receive(self, member: Member, held: RobotHeld) -> None:
        """Stop everything for a component; its process has stopped by itself, and has logged the reason."""
        self._own_holds.pop(held.component, None)
        if held.reason:
            self._own_holds[held.component] = held.reason
            member.is_stopped = True
        self._share_holds()
        if held.reason:
            self.set(f"'{held.component}': {held.reason}", but=member)
        else:
            self._effects.states_changed()

    def forget(self, remaining: Collection[str]) -> None:
        """Forget the components that are no longer of the robot."""
        self._own_holds = {name: reason for name, reason in self._own_holds.items() if name in remaining}
        self._share_holds()

    def _share_holds(self) -> None:
        self.shared = replace(self.shared, holds=dict(self._own_holds))

    # Other hosts

    def heard_host(self, report: HostReport) -> None:
        """Follow the stops and releases of another host."""
        before, now = self._others.get(report.host, SharedStop()), report.stop
        self._others[report.host] = now
        if before.own is not None and before.own.run != report.run and before.own not in self.shared.released:
            self._mark(before.by)  # its host was started again, which releases nothing
        if self.shared.own is not None and self.shared.own in now.released:
            self._released_by(report.host)
        alive = [stop.own for stop in self._others.values()]
        released = [mark for mark in self.shared.released if mark in alive]
        self.shared = replace(self.shared, released=released)
        holding = [(host, stop) for host, stop in self._others.items() if stop.own and stop.own not in released]
        if holding and not self.is_stopped:
            host, stop = holding[0]
            self._latched = f"{stop.by} (host '{host}')", self._now()
            self._notify_all(None)
        elif self.is_stopped and not holding and self.shared.own is None:
            self._latched = None
            self._notify_all(None)

    def _released_by(self, host: str) -> None:
        """Take back the own stop, unless a component here needs the robot to stand still: then stop it again."""
        by = self.shared.by
        self.shared = replace(self.shared, own=None, by="")
        if self._own_holds:
            self._mark(by)

"""Decides when which trigger starts its mission, with time as an argument."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.triggers.trigger import INTERRUPT, QUEUE, Local, Trigger

LATE = 60.0  # [s] after a time of day, it counts as missed
CHECK = 30.0  # [s] between looks at the wall clock, which may be set
SLACK = 1.0  # [s] by which the wall clock may run ahead of robot time between two looks
PAUSE = 1.0  # [s] of robot time within which a trigger fires once, so that nothing floods
_ROUNDING = 1e-6  # [s]
_REMEMBERED = 1000  # times of day, by trigger: each of them counts once, also if the wall clock is set back


class Effects(Protocol):
    """What triggers need of the missions of a robot."""

    def in_the_way(self, mission: str, /) -> Sequence[str]:
        """Return the missions that run and keep this one from starting, itself included."""

    def begin(self, trigger: Trigger, /) -> str:
        """Start its mission; return why that is refused, or nothing."""

    def cancel(self, mission: str, trigger: Trigger, /) -> None:
        """End a mission for good."""

    def leave_out(self, trigger: Trigger, why: str, /) -> None:
        """Report that a trigger starts nothing this time."""

    def wait(self, trigger: Trigger, missions: Sequence[str], /) -> None:
        """Report that a trigger waits until these missions have ended."""


@dataclass(slots=True)
class _Fired:
    """A trigger that has fired, its place in the order, and whether it waits for its turn."""

    trigger: Trigger
    number: int
    waits: bool = False

    @property
    def order(self) -> tuple[int, int]:
        return -self.trigger.priority, self.number


class Triggers:
    """The triggers of a robot. Robot time and wall-clock time [s] are arguments; `local` is the wall clock's zone."""

    def __init__(self, triggers: Mapping[str, Trigger], local: Local) -> None:
        self._triggers, self._local = triggers, local
        self.is_stopped = False
        self.started: dict[str, float] = {}  # wall-clock time of the last start [s], by trigger
        self._looked: tuple[float, float] | None = None  # robot time and wall-clock time of the last look
        self._done: dict[str, deque[float]] = {name: deque(maxlen=_REMEMBERED) for name in triggers}
        self._next_due: dict[str, tuple[float, float | None]] = {}  # by trigger: a time, and what is due next after it
        self._held: dict[str, bool] = {}  # whether the condition of a trigger held
        self._holds_at_first = False  # whether a condition of which nothing is known counts as one that has held
        self._fired_at: dict[str, float] = {}  # robot time
        self._hasty: set[str] = set()  # those of which it was told that they fired too soon again
        self._open: dict[str, _Fired] = {}
        self._fired = 0
        self._priorities: dict[str, int] = {}  # of the missions that triggers have started

    @property
    def waiting(self) -> list[str]:
        """Return the triggers whose missions wait for their turn, in the order in which they get it."""
        return [one.trigger.name for one in sorted(self._open.values(), key=lambda one: one.order)]

    # When it takes the place of others

    @property
    def held(self) -> Mapping[str, bool]:
        """Return whether the conditions of triggers held, by name."""
        return self._held

    def recall(self, held: Mapping[str, bool], started: Mapping[str, float]) -> None:
        """Go on from what others knew, so that what they have answered to causes nothing again."""
        self._held.update(held)
        self.started.update(started)

    def begin_again(self) -> None:
        """Take a condition of which nothing is known for one that held before: better late than twice."""
        self._holds_at_first = True

    # What happens

    def at_start(self, now: float, effects: Effects) -> None:
        """Fire those of the start."""
        self._fire((one for one in self._triggers.values() if one.at_start), now, effects)

    def look_at_clock(self, now: float, wall: float, effects: Effects) -> None:
        """Fire those whose time of day has come since the last look.

        A time that has passed for longer than `LATE` is missed, as is one that the wall clock was set over.
        """
        before, self._looked = self._looked, (now, wall)
        if before is None:
            return
        passed = min(now - before[0], LATE)
        since = max(before[1], wall - passed - SLACK) if before[1] <= wall else wall - passed
        self._fire((one for one in self._triggers.values() if self._is_due(one, since, wall)), now, effects)

    def _is_due(self, trigger: Trigger, since: float, wall: float) -> bool:
        found, done = False, self._done[trigger.name]
        while (due := self.next_time(trigger.name, since)) is not None and due <= wall + _ROUNDING:
            if due not in done:
                done.append(due)
                found = True
            since = due
        return found

    def condition(self, name: str, holds: bool, now: float, effects: Effects, *, after: bool | None = None) -> None:
        """Fire a trigger whose condition has begun to hold; `after` is whether it still does, if that may differ."""
        before, self._held[name] = self._held.get(name, self._holds_at_first), holds if after is None else after
        if holds and not before:
            self._fire((self._triggers[name],), now, effects)

    def message(self, name: str, now: float, effects: Effects) -> None:
        """Fire a trigger whose message has arrived."""
        self._fire((self._triggers[name],), now, effects)

    def ended(self, mission: str, ends: frozenset[str], now: float, effects: Effects) -> None:
        """Fire those that wait for this end of a mission; `ends` are its result and its own name."""
        self._priorities.pop(mission, None)
        self._fire((one for one in self._triggers.values() if one.follows(mission, ends)), now, effects)

    def stop(self, effects: Effects) -> None:
        """Start nothing until the release; what has fired is forgotten."""
        self.is_stopped = True
        for one in self._open.values():
            effects.leave_out(one.trigger, "the robot is stopped")
        self._open.clear()

    def release(self) -> None:
        """Start missions again, from what happens from now on."""
        self.is_stopped = False

    def _fire(self, triggers: Iterable[Trigger], now: float, effects: Effects) -> None:
        for trigger in triggers:
            last = self._fired_at.get(trigger.name)
            if last is not None and now - last < PAUSE:
                if trigger.name not in self._hasty:
                    self._hasty.add(trigger.name)
                    effects.leave_out(trigger, f"it has fired within the last {PAUSE:g} s")
                continue
            self._fired_at[trigger.name] = now
            self._hasty.discard(trigger.name)
            if self.is_stopped:
                effects.leave_out(trigger, "the robot is stopped")
            elif trigger.name in self._open:
                effects.leave_out(trigger, "it waits already")
            else:
                self._fired += 1
                self._open[trigger.name] = _Fired(trigger, self._fired)

    # What follows

    def turn(self, wall: float, effects: Effects) -> None:
        """Start the missions that may start now, those of the highest priority first."""
        while (one := self._next(effects)) is not None:
            del self._open[one.trigger.name]
            self._begin(one.trigger, wall, effects)

    def _next(self, effects: Effects) -> _Fired | None:
        """Return the next one whose mission may start; those that may not are left out, or wait."""
        for one in sorted(self._open.values(), key=lambda one: one.order):
            trigger, others = one.trigger, effects.in_the_way(one.trigger.mission)
            if not others:
                return one
            if trigger.running == QUEUE:
                if not one.waits:
                    effects.wait(trigger, others)
                one.waits = True
            elif why := self._reason(trigger, others):
                del self._open[trigger.name]
                effects.leave_out(trigger, why)
            else:
                return one
        return None

    def _reason(self, trigger: Trigger, others: Sequence[str]) -> str:
        """Return why a trigger does not end the missions in its way; empty if it does."""
        if trigger.mission in others:
            return f"mission {trigger.mission} is running"
        if trigger.running != INTERRUPT:
            return f"{_words(others)} in the way"
        higher = [name for name in others if self._priorities.get(name, 0) > trigger.priority]
        return f"{_words(higher)} in the way, with a higher priority" if higher else ""

    def _begin(self, trigger: Trigger, wall: float, effects: Effects) -> None:
        for name in effects.in_the_way(trigger.mission):
            effects.cancel(name, trigger)
        if refusal := effects.begin(trigger):
            effects.leave_out(trigger, refusal)
            return
        self._priorities[trigger.mission] = trigger.priority
        self.started[trigger.name] = wall

    # When to look again

    def next_time(self, name: str, wall: float) -> float | None:
        """Return the wall-clock time at which a trigger is due next after `wall` [s]; None if it never is."""
        if (schedule := self._triggers[name].schedule) is None:
            return None
        after, due = self._next_due.get(name, (wall, wall))
        if due is not None and not after <= wall < due:  # nothing is due between the two
            due = schedule.next(wall, self._local)
            self._next_due[name] = (wall, due)
        return due

    def next_look(self, now: float, wall: float) -> float | None:
        """Return the robot time of the next look at the wall clock [s]; None if nothing depends on it."""
        times = [due - wall for name in self._triggers if (due := self.next_time(name, wall)) is not None]
        return now + min(CHECK, *times) if times else None


def _words(names: Sequence[str]) -> str:
    return f"{'mission' if len(names) == 1 else 'missions'} {' and '.join(names)} {'is' if len(names) == 1 else 'are'}"

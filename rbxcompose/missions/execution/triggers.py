"""The triggers of a running executive: what they see of the robot, and what they do to its missions."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Protocol

from rbxcompose.base.clock import NANOSECONDS, local_time, universal_time
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.base.expressions.tree import new_names
from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.expressions.values import NOT_ARRIVED, EvaluationError, NotArrived, Value
from rbxcompose.base.files import read_regular
from rbxcompose.base.requests import Refused, from_data, to_data
from rbxcompose.missions.engine.events import MissionEnded
from rbxcompose.missions.engine.world import RobotValues, RunScope, SinceScope
from rbxcompose.missions.execution.errands import Shell
from rbxcompose.missions.execution.mission_run import MissionRun
from rbxcompose.missions.execution.missions import RunningMissions
from rbxcompose.missions.execution.requests import ListedTrigger, RunMission
from rbxcompose.missions.execution.snapshots import replace_unflushed
from rbxcompose.missions.program.program import RobotNames
from rbxcompose.missions.triggers.core import Triggers
from rbxcompose.missions.triggers.trigger import Trigger
from rbxcompose.sdk.component import Context

POLL = 0.1  # [s] between two evaluations of a condition that may change without a message
_SHOWN = "%a %Y-%m-%d %H:%M"
_MOST = 1_000_000  # [B] of a file


@dataclass(frozen=True, slots=True)
class TriggerNotes:
    """What is known of triggers, by name: whether conditions held, and when they last started or fired [s]."""

    held: Mapping[str, bool] = field(default_factory=dict)
    started: Mapping[str, float] = field(default_factory=dict)
    came: Mapping[str, tuple[float, str]] = field(default_factory=dict)


class TriggerMemory:
    """Keeps those notes in a file for when the process of the missions fails; without a file, it knows nothing then."""

    def __init__(self, file: Path | None) -> None:
        self._file = file
        self._written: TriggerNotes | None = None  # at first, the file may be of an earlier run of the robot
        self.trouble = ""  # why they could not be written

    def read(self) -> TriggerNotes:
        """Return what is kept; nothing if that cannot be read."""
        try:
            content = read_regular(self._file, _MOST) if self._file else b"{}"
            notes: TriggerNotes = from_data(TriggerNotes, json.loads(content))
        except (OSError, ValueError):
            notes = TriggerNotes()
        return notes

    def write(self, notes: TriggerNotes) -> None:
        """Keep this, if it is new."""
        if self._file is None or notes == self._written:
            return
        self._written = notes
        try:
            replace_unflushed(self._file, json.dumps(to_data(notes)))  # after a loss of power, the robot starts anew
            self.trouble = ""
        except OSError as error:
            self.trouble = f"what triggers did cannot be kept: {error.strerror}"


class Executive(Shell, Protocol):
    """What triggers need of the component that runs missions."""

    context: Context
    missions: RunningMissions

    @property
    def stamp(self) -> int:
        """Return wall-clock time [ns]."""

    def run(self, request: RunMission) -> str:
        """Begin a mission; raise Refused if it cannot run."""

    def end(self, run: MissionRun) -> None:
        """End a mission that runs."""


class Triggering:
    """Tells the triggers what happens, and carries out what they decide."""

    def __init__(
        self,
        triggers: Mapping[str, Trigger],
        names: RobotNames,
        values: RobotValues,
        executive: Executive,
        kept: TriggerMemory,
    ) -> None:
        self._triggers, self._executive = triggers, executive
        self._local = local_time if executive.context.clock.is_real else universal_time
        self.core = Triggers(triggers, self._local)
        self._scopes = {name: _scope(one, names, values) for name, one in triggers.items() if one.when}
        self._reported: set[str] = set()  # triggers whose condition could not be evaluated
        self._is_begun = False
        self._names, self._values, self._kept = names, values, kept
        self._took_over = False
        self._unsure: set[str] = set()  # conditions that held for others; they count once their values have arrived
        self._came: dict[str, tuple[float, str]] = {}  # wall-clock time at which each last fired [s], what came of it

    @property
    def trouble(self) -> str:
        """Return why nothing can be kept for when this process fails; empty if it can."""
        return self._kept.trouble

    @property
    def _wall(self) -> float:
        return self._executive.stamp / NANOSECONDS

    def follow(self, names: RobotNames) -> None:
        """Let conditions see other places of the robot."""
        self._names = names
        for name, before in self._scopes.items():
            self._scopes[name] = _scope(self._triggers[name], names, self._values)
            self._scopes[name].seen = before.seen

    def start(self) -> None:
        """Begin: the whole robot is active, or was so already before this process."""
        if not self._triggers:
            return
        self._is_begun = True
        self._follow_stop()
        if not self._took_over:
            if self._executive.context.is_again:
                self._recall()
            elif self._executive.context.starts_mission:
                self.core.at_start(self._executive.now, self)
        self._executive.look_soon()

    def take_over(self, old: Triggering) -> None:
        """Go on from what the triggers before these knew: those that are the same do nothing again."""
        self._took_over = old._is_begun
        before = old._triggers
        same = {name for name, one in self._triggers.items() if name in before and before[name].cause == one.cause}
        self._came = {name: came for name, came in old._came.items() if name in same}
        self._go_on(
            {name: held for name, held in old.core.held.items() if name in same},
            {name: last for name, last in old.core.started.items() if name in same},
        )

    def _recall(self) -> None:
        """Go on from what is kept of a process that failed."""
        known = self._kept.read()
        self.core.begin_again()
        self._came = {name: (wall, text) for name, (wall, text) in known.came.items() if name in self._triggers}
        self._go_on({**dict.fromkeys(self._scopes, True), **known.held}, known.started)

    def _go_on(self, held: Mapping[str, bool], started: Mapping[str, float]) -> None:
        self._unsure = {name for name in self._scopes if held.get(name)}
        self.core.recall({name: is_held for name, is_held in held.items() if name in self._scopes}, started)

    def _keep(self) -> None:
        """Keep what is known, for when this process fails."""
        self._kept.write(TriggerNotes(dict(self.core.held), dict(self.core.started), dict(self._came)))

    def reads(self, name: str) -> bool:
        """Return whether a condition reads a value."""
        return any(name in one.reads for one in self._triggers.values())

    def message(self, name: str) -> None:
        """Take the message of a trigger."""
        if self._is_begun:
            self._follow_stop()
            self.core.message(name, self._executive.now, self)
            self._executive.look_soon()

    def ended(self, mission: str, end: MissionEnded) -> None:
        """Take the end of a mission."""
        if not self._triggers:
            return
        self._follow_stop()
        self.core.ended(mission, frozenset({end.result, end.outcome or end.result}), self._executive.now, self)
        self._executive.look_soon()

    def stop(self) -> None:
        """Forget what has fired."""
        self.core.stop(self)

    def turn(self) -> list[float]:
        """Do what is due; return the next wake [s], if any."""
        if not self._is_begun:
            return []
        now, wall = self._executive.now, self._wall
        self._follow_stop()
        self.core.look_at_clock(now, wall, self)
        for name, scope in self._scopes.items():
            self._evaluate(name, scope, now)
        self.core.turn(wall, self)
        self._keep()
        look = self.core.next_look(now, wall)
        is_polled = any(one.when and one.when.is_polled for one in self._triggers.values())
        return [*([look] if look is not None else []), *([now + POLL] if is_polled else [])]

    def _evaluate(self, name: str, scope: SinceScope, now: float) -> None:
        """Evaluate a condition; a message that counts as new does so once."""
        when = self._triggers[name].when
        if when is None or self._waits_for_values(name):
            return
        try:
            is_held = after = holds(when.condition, scope)
            if scope.is_needed:
                scope.mark()
                after = holds(when.condition, scope)
        except EvaluationError as error:
            if name not in self._reported:
                self._reported.add(name)
                self._executive.warn(f"trigger {name}: {error}")
            return
        self.core.condition(name, is_held, now, self, after=after)

    def _waits_for_values(self, name: str) -> bool:
        """Return whether a condition that held before cannot be judged yet: what has not arrived does not end it."""
        if name in self._unsure:
            reads = self._triggers[name].reads - self._names.events
            if any(self._values.value(read) is NOT_ARRIVED for read in reads):
                return True
            self._unsure.discard(name)
        return False

    def _follow_stop(self) -> None:
        if self.core.is_stopped and not self._executive.context.is_stopped:
            self.core.release()
        elif self._executive.context.is_stopped and not self.core.is_stopped:
            self.core.stop(self)

    def listed(self) -> tuple[ListedTrigger, ...]:
        """Return all triggers with their next time and their last start."""
        return tuple(map(self._listed, self._triggers.values()))

    def _listed(self, one: Trigger) -> ListedTrigger:
        due, last = self.core.next_time(one.name, self._wall), self.core.started.get(one.name)
        fired, came = self._came.get(one.name, (None, ""))
        return ListedTrigger(
            *(one.name, one.mission, one.cause, one.priority, one.running, self._shown(due), self._shown(last)),
            waits=one.name in self.core.waiting,
            fired=self._shown(fired),
            came=came,
            off="the robot is stopped" if self._executive.context.is_stopped else "",
        )

    def _shown(self, wall: float | None) -> str:
        return "" if wall is None else f"{self._local(wall):{_SHOWN}}"

    # The effects of triggers

    def in_the_way(self, mission: str, /) -> Sequence[str]:
        """Return the missions that keep one from starting."""
        return self._executive.missions.in_the_way(mission)

    def begin(self, trigger: Trigger, /) -> str:
        """Start the mission of a trigger as people do."""
        self._executive.info(f"trigger {trigger.name} ({trigger.cause}) starts mission {trigger.mission}")
        try:
            self._executive.run(RunMission(trigger.mission, trigger.inputs))
        except Refused as refusal:
            return str(refusal)
        self._came[trigger.name] = self._wall, f"mission {trigger.mission} started"
        return ""

    def cancel(self, mission: str, trigger: Trigger, /) -> None:
        """End a mission in the way."""
        self._executive.info(f"trigger {trigger.name} ends mission {mission}")
        self._executive.end(self._executive.missions.running(mission))

    def leave_out(self, trigger: Trigger, why: str, /) -> None:
        """Log why a trigger starts nothing."""
        self._came[trigger.name] = self._wall, f"not started: {why}"
        self._executive.info(f"trigger {trigger.name} does not start mission {trigger.mission}: {why}")

    def wait(self, trigger: Trigger, missions: Sequence[str], /) -> None:
        """Log what a trigger waits for."""
        words = f"waits for the end of {' and '.join(missions)}"
        self._came[trigger.name] = self._wall, words
        self._executive.info(f"trigger {trigger.name} {words}")


def _scope(trigger: Trigger, names: RobotNames, values: RobotValues) -> SinceScope:
    """Return the scope of a trigger's condition: an event counts for the next evaluation only."""
    fresh = new_names(trigger.when.condition) if trigger.when else frozenset[str]()
    quiet: dict[str, Value | NotArrived] = {
        name: False if names.values[name] == FLAG else NOT_ARRIVED for name in trigger.reads & names.events
    }
    return SinceScope(RunScope({}, {}, names.places, values), frozenset(fresh), quiet)

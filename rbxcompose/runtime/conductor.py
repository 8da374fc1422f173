"""What the supervisor decides, pure: which process is started, told or ended when, and how the robot ends.

The shell around it (`supervisor.py`) carries out the `Effects` and tells what happened; time comes from a scheduler.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from itertools import takewhile
from typing import Protocol

from rbxcompose.diagnostics.levels import Level
from rbxcompose.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.faults import RestartPolicy
from rbxcompose.runtime.options import RunOptions
from rbxcompose.scheduler import Scheduler

FINE, MISSION_FAILED, ROBOT_FAILED, INTERRUPTED = 0, 3, 4, 130

WORLD = "world"  # the process group of simulated truth, which cannot come back as it was
SILENT = 1.0  # [s] without a sign of life after which the others are told
DEAD = 2.0  # [s] without a sign of life after which a process is killed
REST_BOUND = 1.0  # [s] to come to rest
DOWN_BOUND = 1.9  # [s] for all of going down; what is left then is killed
LOOK = 0.25  # [s] between looks for signs of life

_OWNER = "supervisor"


class Effects(Protocol):
    """What the conductor can do to the world."""

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        """Start a process."""
        ...

    def send(self, process: str, message: say.Order) -> None:
        """Send a message to a process."""
        ...

    def end(self, process: str) -> None:
        """Ask a process that does not listen yet to end, by SIGTERM."""
        ...

    def kill(self, process: str) -> None:
        """End a process, by SIGKILL."""
        ...

    def log(self, level: Level, text: str, detail: str = "") -> None:
        """Write a record of the whole robot."""
        ...

    def is_up(self) -> None:
        """Tell who waits that all is active."""
        ...

    def answer(self, number: int, text: str, *, is_refused: bool) -> None:
        """Answer a command."""
        ...


class Phase(Enum):
    """Where the robot as a whole stands."""

    STARTING = auto()
    RUNNING = auto()
    BRAKING = auto()
    CLOSING = auto()
    ENDED = auto()


@dataclass
class Member:
    """What is known of one process."""

    name: str
    is_there: bool = False
    is_configured: bool = False
    is_started: bool = False
    is_at_rest: bool = False
    is_told_lost: bool = False
    is_closing: bool = False
    is_stopped: bool = False  # as it was told last
    is_given_up: bool = False  # it has gone, and nothing in it is ever restarted
    last_word: float = 0.0  # [s]
    restarts: int = 0
    requested: set[str] = field(default_factory=set)  # components that were told to become active
    policy: RestartPolicy = field(default_factory=RestartPolicy)

    def forked(self, now: float) -> None:
        """Begin a new life."""
        self.is_there, self.last_word = True, now
        self.is_configured = self.is_started = self.is_at_rest = self.is_told_lost = False
        self.requested.clear()


class Conductor:
    """Leads the processes of a robot from the first fork to the last exit."""

    def __init__(
        self, plan: Plan, options: RunOptions, scheduler: Scheduler, effects: Effects, *, router: str | None
    ) -> None:
        """Take `router`: the name of the router's process, or None if an existing router serves."""
        self.phase = Phase.STARTING
        self.is_stopped = False
        self.exit_code = FINE
        self.reason = ""  # why it went down
        self.endpoint = plan.bus.router
        self.facts: dict[str, dict[str, str]] = {}
        self.time = 0.0  # [s] of robot time, as far as known
        self.states: dict[str, tuple[str, int]] = {one.name: ("unconfigured", 0) for one in plan.instances}
        self._plan, self._options, self._router = plan, options, router
        self._scheduler, self._effects = scheduler, effects
        names = [*([router] if router else []), *plan.groups]
        self.members = {name: Member(name) for name in names}
        self._closing: list[str] = []  # processes still to be shut down, the next one last

    # The beginning

    def begin(self) -> None:
        """Start all processes."""
        for name in self.members:
            self._fork(name)
        if not self._options.is_stepped:
            self._scheduler.every(LOOK, _OWNER, lambda dt: self._look_for_silence())

    def _fork(self, name: str) -> None:
        member = self.members[name]
        is_restart = member.restarts > 0
        member.forked(self._scheduler.now)
        member.is_stopped = self.is_stopped
        self._effects.fork(name, is_restart=is_restart, is_stopped=self.is_stopped)
        if name == self._router or self.endpoint is not None:
            self._effects.send(name, say.Configure(self.endpoint))

    def _proceed(self) -> None:
        """Do the next step of starting, for the robot as a whole or for processes that came again."""
        if self.phase not in (Phase.STARTING, Phase.RUNNING) or not self._all_configured():
            return
        waiting = [one for one in self._plan.instances if self.states[one.name][0] not in ("active", "failed")]
        fresh = [one for one in waiting if one.name not in self.members[one.process].requested]
        if self.phase is Phase.STARTING and waiting[:1] != fresh[:1]:
            return  # the answer of the first is to come, or it is being restarted in place
        if fresh:
            group = fresh[0].process
            self._activate(group, [one.name for one in takewhile(lambda one: one.process == group, fresh)])
            return
        for group in self._plan.groups:
            self._start(self.members[group])
        if self.phase is Phase.STARTING:
            self.phase = Phase.RUNNING
            self._effects.is_up()
            if self._options.duration is not None and not self._options.is_stepped:
                self._scheduler.at(self._options.duration, _OWNER, lambda: self.go_down(FINE, "the time is up"))

    def _all_configured(self) -> bool:
        members = (self.members[group] for group in self._plan.groups)
        return all(member.is_configured or member.is_given_up for member in members)

    def _activate(self, group: str, names: list[str]) -> None:
        self.members[group].requested.update(names)
        self._effects.send(group, say.Activate(names))

    def _start(self, member: Member) -> None:
        if not member.is_started and not member.is_given_up:
            member.is_started = True
            self._effects.send(member.name, say.Start())

    # What processes say

    def heard(self, name: str, message: say.Word) -> None:
        """Take a message of a process."""
        member = self.members[name]
        member.last_word = self._scheduler.now
        match message:
            case say.Configured(endpoint):
                self._configured(member, endpoint)
            case say.States(states):
                self.states.update({one: (state, restarts) for one, (state, restarts) in states.items()})
                self._proceed()
            case say.Notify(event, data):
                self._notified(event, data)
            case say.AtRest():
                member.is_at_rest = True
                self._close_when_at_rest()
            case say.Answer(number, text, is_refused):
                self._effects.answer(number, text, is_refused=is_refused)
            case say.Summary(time, facts):
                self.time = max(self.time, time)
                self.facts.update(facts)
            case say.Alive(time):
                self.time = max(self.time, time)
                self._alive(member)

    def _configured(self, member: Member, endpoint: str | None) -> None:
        member.is_configured = True
        if member.is_stopped is not self.is_stopped:  # that changed after it was forked
            self._tell_stop(member)
        if member.name == self._router and self.endpoint is None:
            self.endpoint = endpoint
            for group in self._plan.groups:
                if self.members[group].is_there:
                    self._effects.send(group, say.Configure(endpoint))
        self._proceed()

    def _notified(self, event: str, data: Mapping[str, object]) -> None:
        match event:
            case "state":
                self.states[str(data["instance"])] = (str(data["state"]), int(str(data["restarts"])))
                self._proceed()
            case "failed":
                self.go_down(ROBOT_FAILED, str(data["message"]), Level.ERROR)
            case "mission_ended":
                self._mission_ended(str(data["mission"]), str(data["outcome"]), str(data["message"]))
            case "time_is_up":
                self.go_down(FINE, "the time is up")

    def _mission_ended(self, mission: str, outcome: str, message: str) -> None:
        if self._options.is_detached or mission != self._plan.start:
            return
        because = f": {message}" if message else ""
        self.go_down(FINE if outcome == "success" else MISSION_FAILED, f"mission {mission}: {outcome}{because}")

    # Faults

    def exited(self, name: str, how: str, detail: str = "") -> None:
        """Take the end of a process: `how` it ended in words, and what it printed."""
        member = self.members[name]
        member.is_there = member.is_configured = False
        if self.phase in (Phase.BRAKING, Phase.CLOSING):
            self._close_when_at_rest()
            self._close_next()
            return
        lost = self._plan.of_group(name)
        is_for_good = bool(lost) and all(one.restart.when == "never" for one in lost)
        self.states.update({one.name: ("failed" if is_for_good else "unconfigured", 0) for one in lost})
        delay = member.policy.after_failure(self._scheduler.now)
        if name == WORLD:
            self.go_down(ROBOT_FAILED, f"process '{name}' {how}, and simulated truth with it", Level.ERROR, detail)
        elif is_for_good:
            self._give_up(member, how, detail)
        elif delay is None:
            self.go_down(ROBOT_FAILED, f"process '{name}' {how}, too often to go on", Level.ERROR, detail)
        else:
            self._effects.log(Level.ERROR, f"process '{name}' {how}; it is started again", detail)
            self._tell_lost(member, how)
            member.restarts += 1
            self._scheduler.at(self._scheduler.now + delay, _OWNER, lambda: self._fork_again(name))

    def _give_up(self, member: Member, how: str, detail: str) -> None:
        member.is_given_up = True
        self._effects.log(Level.ERROR, f"process '{member.name}' {how}; nothing in it is ever restarted", detail)
        self._tell_lost(member, how)
        self._proceed()

    def _fork_again(self, name: str) -> None:
        if self.phase in (Phase.STARTING, Phase.RUNNING):
            self._fork(name)

    def _tell_lost(self, member: Member, cause: str) -> None:
        names = [one.name for one in self._plan.of_group(member.name)]
        if names and not member.is_told_lost:
            member.is_told_lost = True
            self._to_configured(say.Lost(names, f"process '{member.name}' {cause}"))

    def _look_for_silence(self) -> None:
        for member in self.members.values():
            silence = self._scheduler.now - member.last_word
            if not member.is_there or not member.is_configured or self.phase not in (Phase.STARTING, Phase.RUNNING):
                continue
            if silence > SILENT:
                self._tell_lost(member, "does not answer")
            if silence > DEAD:
                member.is_configured = False  # one kill is enough; its exit comes
                self._effects.kill(member.name)

    def _alive(self, member: Member) -> None:
        if member.is_told_lost and member.is_configured:
            member.is_told_lost = False
            self._effects.log(Level.WARN, f"process '{member.name}' answers again")

    # What people want

    def stop(self) -> None:
        """Hold everything that moves until `release`."""
        self._set_stopped(True)

    def release(self) -> None:
        """Allow motion again."""
        self._set_stopped(False)

    def _set_stopped(self, is_stopped: bool) -> None:
        self.is_stopped = is_stopped
        for group in self._plan.groups:
            if self.members[group].is_configured:
                self._tell_stop(self.members[group])

    def _tell_stop(self, member: Member) -> None:
        member.is_stopped = self.is_stopped
        self._effects.send(member.name, say.Stop() if self.is_stopped else say.Release())

    def _to_configured(self, message: say.Order) -> None:
        for group in self._plan.groups:
            if self.members[group].is_configured:
                self._effects.send(group, message)

    # Going down

    @property
    def is_going_down(self) -> bool:
        """Tell whether the end has begun."""
        return self.phase not in (Phase.STARTING, Phase.RUNNING)

    def go_down(self, exit_code: int, reason: str, level: Level = Level.OK, detail: str = "") -> None:
        """Brake, wait for rest, shut down in reverse order, end what is left; the first reason counts."""
        if self.is_going_down:
            return
        self.phase, self.exit_code, self.reason = Phase.BRAKING, exit_code, reason
        if level > Level.OK:
            self._effects.log(level, f"{reason}; the robot goes down", detail)
        for member in self._there():
            if member.is_configured and member.name != self._router:
                self._effects.send(member.name, say.Brake())
            elif member.name != self._router:
                self._effects.end(member.name)  # nothing of it can move yet
        self._after(REST_BOUND, self._close)
        self._after(DOWN_BOUND, self.hurry)
        self._close_when_at_rest()

    def hurry(self) -> None:
        """End at once everything that is left."""
        for member in self._there():
            self._effects.kill(member.name)

    def _there(self) -> list[Member]:
        return [member for member in self.members.values() if member.is_there]

    def _after(self, seconds: float, callback: Callable[[], None]) -> None:
        self._scheduler.at(self._scheduler.now + seconds, _OWNER, callback)

    def _close_when_at_rest(self) -> None:
        moving = [one for one in self._there() if one.name != self._router and not one.is_at_rest]
        if self.phase is Phase.BRAKING and not moving:
            self._close()

    def _close(self) -> None:
        if self.phase is Phase.BRAKING:
            self.phase = Phase.CLOSING
            self._closing = list(self.members)  # the router first, so that it ends last
            self._close_next()

    def _close_next(self) -> None:
        """Shut down the next process once the one before has ended."""
        if self.phase is not Phase.CLOSING:
            return
        if self._closing and self.members[self._closing[-1]].is_there is False:
            self._closing.pop()
            self._close_next()
        elif self._closing:
            self._shutdown_once(self._closing[-1])
        else:
            self.phase = Phase.ENDED

    def _shutdown_once(self, name: str) -> None:
        member = self.members[name]
        if member.is_closing:
            return
        member.is_closing = True
        if member.is_configured:
            self._effects.send(name, say.Shutdown())
        else:
            self._effects.end(name)

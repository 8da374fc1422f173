"""What the conductor knows about a robot's processes: members, dependents, who waits for whom, who is silent."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from enum import Enum, auto
from typing import Any, Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.compiler.plan.model import Instance, Plan, Wire
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.faults import RestartPolicy
from rbxcompose.runtime.processes import KILLED, longest_wait
from rbxcompose.sdk.component import ComponentNoted
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Qos, Serves, ServesAction
from rbxcompose.sdk.registry import component_type


class ConductorEffects(Protocol):
    """What the conductor can do to the world."""

    run_id: str  # tells this start of the robot from any other

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        """Start a process."""
        ...

    def send(self, process: str, message: messages.ChannelOrder) -> None:
        """Send a message to a process."""
        ...

    def to_hosts(self, report: messages.HostReport) -> None:
        """Tell the other hosts of the robot how this one is."""
        ...

    def end(self, process: str) -> None:
        """End a process that does not listen yet, by SIGTERM."""
        ...

    def kill(self, process: str) -> None:
        """End a process, by SIGKILL."""
        ...

    def is_suspended(self, process: str) -> bool:
        """Return whether a signal keeps a process from running."""
        ...

    def waits(self, process: str | None) -> Mapping[str, float]:
        """Return how long each thread of a process has waited for a processor [s]; None is the supervisor itself."""
        ...

    def log(self, level: Level, text: str, detail: str = "") -> None:
        """Write a record of the whole robot."""
        ...

    def is_up(self) -> None:
        """Notify those who wait that everything is active."""
        ...

    def states_changed(self) -> None:
        """Mark the state that `ps` shows as changed, to be saved later."""
        ...

    def answer(self, number: int, answer: object) -> None:
        """Answer a request, with data."""
        ...

    def refuse(self, number: int, reason: str) -> None:
        """Refuse a request."""
        ...


class Phase(Enum):
    """The phase of the whole robot."""

    STARTING = auto()
    RUNNING = auto()
    BRAKING = auto()
    CLOSING = auto()
    ENDED = auto()


@dataclass
class Member:
    """The state of one process."""

    name: str
    is_there: bool = False
    is_configured: bool = False
    is_started: bool = False
    was_started: bool = False  # before it was restarted, too
    is_at_rest: bool = False
    is_reported_lost: bool = False
    is_closing: bool = False
    is_stopped: bool = False  # as last sent to it
    is_given_up: bool = False  # it is gone, and nothing in it is ever restarted
    last_word: float = 0.0  # [s]
    killed_for: str = ""  # why it was killed, in words that follow its name
    restarts: int = 0
    moves: Sequence[str] = ()  # what moves the robot or is about to move it, in words
    runs: dict[str, str] = field(default_factory=dict)  # components whose work a restart would cut off -> that work
    requested: set[str] = field(default_factory=set)  # components that were ordered to become active
    policy: RestartPolicy = field(default_factory=RestartPolicy)

    def exited(self, how: str) -> str:
        """Note its end; return how it ended in words, with the reason if it was killed for one."""
        self.is_there = self.is_configured = False
        self.requested.clear()
        self.moves, self.runs = (), {}
        return self.killed_for if self.killed_for and how == KILLED else how

    def forked(self, now: float) -> None:
        """Reset the state for a newly forked process."""
        self.is_there, self.last_word = True, now
        self.policy.begin(now)
        self.is_configured = self.is_started = self.is_at_rest = self.is_reported_lost = False
        self.moves, self.runs, self.killed_for = (), {}, ""


BLOCKED = "blocked"  # the state of a component that starts after a failed one, or cannot do its work without it
DONE = ("active", "failed", BLOCKED)  # states in which nobody waits for a component to start

_FED_BY = {In.kind: Out.kind, Calls.kind: Serves.kind, CallsAction.kind: ServesAction.kind}


def down_by(waiting: Iterable[Instance], failed: Iterable[str]) -> dict[str, str]:
    """Return who is down, with who failed: the failed, and those waiting, in start order, that start after them."""
    down = {name: name for name in failed}
    for instance in waiting:
        if cause := _awaited(instance, down):
            down[instance.name] = down[cause]
    return down


def blocked_by(plan: Plan, down: Mapping[str, str]) -> dict[str, str]:
    """Return the components that cannot work because all that serve or feed a port are down: name -> one that failed.

    An input that is open to the outside waits for none. A component that starts after one that is down waits, too.
    """
    found: dict[str, str] = {}
    for instance in plan.instances if down else ():
        if down.get(instance.name) != instance.name and (cause := _cause(plan, instance, down)):
            found[instance.name] = down[cause]
    return found


def _awaited(instance: Instance, names: Collection[str]) -> str:
    return next((name for name in instance.starts_after if name in names), "")


def _cause(plan: Plan, instance: Instance, failed: Collection[str]) -> str:
    if late := _awaited(instance, failed):
        return late
    for wire in _needed(instance):
        feeding = [other.name for other in plan.everywhere if _feeds(other, wire)]
        if feeding and all(name in failed for name in feeding):
            return feeding[0]
    return ""


def _needed(instance: Instance) -> list[Wire]:
    ports = component_type(instance.type).ports(instance.config)
    wires = (wire for wire in instance.wires if wire.kind in _FED_BY)
    return [wire for wire in wires if not getattr(ports[wire.port], "is_open", False)]


def _feeds(other: Instance, wanted: Wire) -> bool:
    kind = _FED_BY[wanted.kind]
    return any(wire.kind == kind and wire.topic == wanted.topic and wire.type == wanted.type for wire in other.wires)


def is_commanding(instance: Instance) -> bool:
    """Return whether an instance sends, passes on or receives commands: a driver, a mux, a base."""
    ports = component_type(instance.type).ports(instance.config).values()
    return any(isinstance(port, In | Out) and port.qos is Qos.COMMAND for port in ports)


def blocked_text(causes: Mapping[str, str], name: str) -> str:
    """Return in words what a component waits for."""
    return f"waits for {causes[name]}, which failed"


class KeptValues:
    """By component: what it gets again after its process was restarted, and notes for people."""

    def __init__(self) -> None:
        self.notes: dict[str, str] = {}
        self.settings: dict[str, messages.SettingsKept] = {}
        self._requests: dict[str, list[dict[str, Any]]] = {}

    def receive(self, message: messages.KeptWord) -> None:
        """Keep this instead of what the component reported before."""
        match message:
            case messages.Repeated(instance, requests):
                self._requests[instance] = requests
            case messages.SettingsKept(instance, text):
                self.settings[instance] = message
                if not text:
                    del self.settings[instance]
            case ComponentNoted(component, text):
                self.notes[component] = text

    def repeated(self, instances: Iterable[Instance]) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield the requests for components, each with the name of its component."""
        for instance in instances:
            yield from ((instance.name, request) for request in self._requests.get(instance.name, ()))


class BlockedComponents:
    """Knows who is blocked; `causes` has for each blocked component the one that failed.

    Of these, those in `unstarted` must not start: they have not been active, and start after it.
    """

    def __init__(self, effects: ConductorEffects, *, is_stepped: bool) -> None:
        self.causes: dict[str, str] = {}
        self.unstarted: list[str] = []
        self._effects, self._is_stepped = effects, is_stepped

    def look(
        self, plan: Plan, states: Mapping[str, tuple[str, int]], others: Collection[str], members: Mapping[str, Member]
    ) -> None:
        """Find out who is blocked now, and tell those for whom this is news; `others` have failed on other hosts."""
        failed = {*others, *(name for name, (state, _) in states.items() if state == "failed")}
        waiting = [
            instance
            for instance in plan.instances
            if states[instance.name][0] not in DONE and instance.name not in members[instance.process].requested
        ]
        down = down_by(waiting, failed)
        self.unstarted = [name for name in down if name not in failed]
        before, self.causes = self.causes, blocked_by(plan, down)
        if self._is_stepped:  # there the processes would receive it at another instant in each run
            return
        for name in self.causes.keys() - before.keys():
            self._effects.log(Level.WARN, f"'{name}' {blocked_text(self.causes, name)}")
        touched = {name for name in {*before, *self.causes} if before.get(name) != self.causes.get(name)}
        for group in dict.fromkeys(instance.process for instance in plan.instances if instance.name in touched):
            if members[group].is_configured:
                self.notify(plan, members[group], is_news=True)

    def notify(self, plan: Plan, member: Member, *, is_news: bool = False) -> None:
        """Tell a process which of its components are blocked."""
        names = [instance.name for instance in plan.of_group(member.name) if instance.name in self.causes]
        if names or is_news:
            self._effects.send(member.name, messages.Blocked({name: blocked_text(self.causes, name) for name in names}))


SILENT_FOR = 1.0  # [s] without a sign of life after which the others are informed
DEAD = 2.0  # [s] without one, not counting waits for a processor, after which a process is killed
LOOK = 0.25  # [s] between checks for signs of life
_QUIET = 1.5 * LOOK  # [s] without a sign of life from which on waits for a processor are looked at
_STATE = {True: "suspended by a signal", False: "silent"}
_OVERLOADED = "this machine has too much to do"


class Silence:
    """Detects processes that are suspended or do not answer."""

    def __init__(self, effects: ConductorEffects, report_lost: Callable[[Member, str], None], now: float) -> None:
        """Take `report_lost`, which is called with a process that is no longer reliable, and why; and `now` [s]."""
        self._effects, self._report_lost = effects, report_lost
        self._looked, self._own_waits = now, effects.waits(None)
        self._waits: dict[str, Mapping[str, float]] = {}  # of processes that are quiet, at first

    def look_at_all(self, members: Iterable[Member], now: float, *, is_going_down: bool) -> bool:
        """Check all processes; return whether silence is nobody's fault this time."""
        held_up, starved = self._held_up(now)
        if held_up and not is_going_down:
            text = f"time stood still for {held_up:.1f} s: the machine slept, or the supervisor was suspended"
            if starved > held_up / 2:
                text = f"the supervisor waited {starved:.1f} s for a processor: {_OVERLOADED}"
            self._effects.log(Level.WARN, text)
        for member in members:
            if held_up:
                member.last_word = now
            elif member.is_there and not is_going_down:
                self._look(member, now)
        return bool(held_up)

    def _look(self, member: Member, now: float) -> None:
        """Check a process that exists."""
        silence, is_suspended = now - member.last_word, self._effects.is_suspended(member.name)
        starved = self._starved(member.name, silence)
        if not (member.is_configured or is_suspended):
            return  # getting ready may take long: meanwhile each process has a watchdog of its own
        if is_suspended:
            self._report_lost(member, "was suspended by a signal")
        elif silence > SILENT_FOR:
            waited = f"waited {starved:.1f} s for a processor: {_OVERLOADED}"
            self._report_lost(member, waited if starved > SILENT_FOR / 2 else "does not answer")
        if silence - starved > DEAD:
            member.is_configured, member.last_word = False, now  # one kill is enough
            member.killed_for = f"was {_STATE[is_suspended]} for {DEAD:g} s and was killed"
            self._effects.kill(member.name)

    def _starved(self, process: str, silence: float) -> float:
        """Return for how long a quiet process has waited for a processor [s]: a restart would make this worse."""
        if silence <= _QUIET:
            self._waits.pop(process, None)
            return 0.0
        waits = self._effects.waits(process)
        return longest_wait(self._waits.setdefault(process, waits), waits)

    def _held_up(self, now: float) -> tuple[float, float]:
        """Return for how long silence is nobody's fault [s], since the previous call, and the wait for a processor [s].

        In that time the supervisor itself was suspended or waited, or the whole machine slept; mostly it is 0.
        """
        looked, self._looked = self._looked, now
        before, self._own_waits = self._own_waits, self._effects.waits(None)
        return (now - looked if now - looked > SILENT_FOR else 0.0), longest_wait(before, self._own_waits)

"""Changes of live settings: one after the other, each in all of its components or in none. Pure.

Who wants a change need not live until it is over. The processes that it concerns are asked first whether their
components would accept it, then the judge whether it keeps the rules about the whole robot, then it is carried out. If
anything goes wrong in between, also the end of a process, the others go back.
"""

from collections import deque
from collections.abc import Callable, Collection, Iterable
from dataclasses import field
from enum import Enum, auto
from typing import Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.names import resolve
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime import channel as messages
from rbxcompose.sdk.parameters import ChangeRefusal, WantedChange

WhenJudged = Callable[[ChangeRefusal | None], None]


class SettingEffects(Protocol):
    """What changes of settings need of the supervisor."""

    def plan(self) -> Plan:
        """Return the plan in effect."""
        ...

    def reached(self) -> Collection[str]:
        """Return the processes that take orders."""
        ...

    def send(self, process: str, message: messages.ChannelOrder) -> None:
        """Send a message to a process."""
        ...

    def judge(self, now: list[str], new: list[str], then: WhenJudged) -> None:
        """Ask whether components may have the configurations `new`, where others have those of `now`."""
        ...


class _Step(Enum):
    PREPARING = auto()
    JUDGING = auto()
    COMMITTING = auto()
    GOING_BACK = auto()


@dataclass(slots=True)
class _Change:
    """The change that is being made; `waiting` are processes whose answer is due."""

    process: str  # where somebody wants it
    asked: messages.AskForChange
    number: int
    parts: dict[str, WantedChange]  # by process
    step: _Step = _Step.PREPARING
    waiting: set[str] = field(default_factory=set)
    prepared: list[str] = field(default_factory=list)
    done: list[str] = field(default_factory=list)
    now: list[str] = field(default_factory=list)
    new: list[str] = field(default_factory=list)
    refusal: ChangeRefusal | None = None
    stuck: list[str] = field(default_factory=list)

    @property
    def is_own(self) -> bool:
        """Return whether it concerns only the process where somebody wants it, which decides it by applying it."""
        return self.parts.keys() == {self.process}


class SettingChanges:
    """Makes the changes of settings that somebody wants anywhere."""

    def __init__(self, effects: SettingEffects) -> None:
        self._effects = effects
        self._queue: deque[tuple[str, messages.AskForChange]] = deque()
        self._change: _Change | None = None
        self._count = 0
        self._is_held = False
        self._changed = set[str]()  # the processes that were to apply a change: their settings may not be the plan's

    @property
    def is_busy(self) -> bool:
        """Return whether a change is being made."""
        return self._change is not None

    def hold(self) -> None:
        """Let further changes wait, while another plan is applied."""
        self._is_held = True

    def go_on(self) -> None:
        """Make the changes that wait."""
        self._is_held = False
        self._begin()

    def receive(self, process: str, message: messages.ChannelWord) -> None:
        """Take a message of a process; others than those about settings are ignored."""
        match message:
            case messages.AskForChange():
                if self._change is not None or self._queue or self._is_held:  # it may look different afterwards
                    message = messages.AskForChange(message.number, message.wanted)
                self._queue.append((process, message))
                self._begin()
            case messages.ChangePrepared(number=number) | messages.ChangeFollowed(number=number):
                change = self._change
                if change is not None and change.number == number and process in change.waiting:
                    self._answered(change, process, message)

    def gone(self, process: str) -> None:
        """Handle the end of a process: what it had applied is lost with it, since it comes back with its plan."""
        self._queue = deque(pair for pair in self._queue if pair[0] != process)
        self._changed.discard(process)
        change = self._change
        if change is None:
            return
        reason = f"process '{process}' has ended meanwhile"
        for each in (change.prepared, change.done):
            if process in each:
                each.remove(process)
        if process in change.parts and change.step is not _Step.GOING_BACK:
            change.refusal = change.refusal or ChangeRefusal(reason)
        change.waiting.discard(process)
        if change.step is not _Step.JUDGING:
            self._proceed(change)

    # One change

    def _begin(self) -> None:
        while self._queue and self._change is None and not self._is_held:
            process, asked = self._queue.popleft()
            parts, refusal = self._parts(asked.wanted)
            if refusal is not None:
                self._effects.send(process, messages.ChangeDecided(asked.number, refusal))
                continue
            self._count += 1
            change = self._change = _Change(process, asked, self._count, parts)
            # Those without a part of it tell the values that they have now; the others have more to do, so they begin.
            change.waiting = (parts.keys() | self._changed) & set(self._effects.reached())
            if asked.new:
                change.waiting.discard(process)
                change.prepared, change.now, change.new = [process], [asked.now] if asked.now else [], [asked.new]
            for name in sorted(change.waiting, key=lambda name: (name not in parts, name)):
                part = parts.get(name, WantedChange({}, asked.wanted.by))
                self._effects.send(name, messages.PrepareChange(change.number, part))
            self._proceed(change)

    def _parts(self, wanted: WantedChange) -> tuple[dict[str, WantedChange], ChangeRefusal | None]:
        """Return what is wanted of each process, or why that is impossible."""
        plan, reached = self._effects.plan(), self._effects.reached()
        names = {resolve(one.name, plan.bus.namespace): one for one in plan.instances}
        found: dict[str, dict[str, str]] = {}
        for node, part in wanted.parts.items():
            if (instance := names.get(node)) is None:
                return {}, ChangeRefusal(f"'{node}' is no component of this robot on this host: set it alone")
            if instance.process not in reached:
                return {}, ChangeRefusal(f"'{node}' is not active")
            found.setdefault(instance.process, {})[instance.name] = part
        together = wanted.together or ("together" if len(wanted.parts) > 1 else "")
        return {name: WantedChange(each, wanted.by, together) for name, each in found.items()}, None

    def _answered(
        self, change: _Change, process: str, message: messages.ChangePrepared | messages.ChangeFollowed
    ) -> None:
        change.waiting.remove(process)
        reason = message.refusal
        match message:
            case messages.ChangePrepared(now=now, new=new):
                change.prepared += [] if reason else [process]
                change.now += [now] if now else []
                change.new += [new] if new else []
            case messages.ChangeFollowed() if change.step is _Step.GOING_BACK:
                change.stuck += [reason] if reason else []
            case messages.ChangeFollowed():
                change.done += [] if reason else [process]
        if reason and change.step is not _Step.GOING_BACK:
            change.refusal = change.refusal or ChangeRefusal(reason)
        self._proceed(change)

    def _proceed(self, change: _Change) -> None:
        """Do the next step once all have answered."""
        if change.waiting:
            return
        match change.step:
            case _Step.PREPARING if change.refusal is None and change.new:
                change.step = _Step.JUDGING
                self._effects.judge(change.now, change.new, lambda refusal: self._judged(change, refusal))
            case _Step.PREPARING if change.refusal is None:
                self._commit(change)
            case _Step.COMMITTING if change.refusal is not None and change.done:
                self._order(change, _Step.GOING_BACK, change.done, messages.UndoChange(change.number))
            case _:
                self._end(change)

    def _judged(self, change: _Change, refusal: ChangeRefusal | None) -> None:
        change.refusal = change.refusal or refusal
        if change.refusal is not None:
            self._end(change)
        else:
            self._commit(change)

    def _commit(self, change: _Change) -> None:
        self._changed |= change.parts.keys()
        decides = change.asked.number if change.is_own else None
        self._order(change, _Step.COMMITTING, change.parts, messages.CommitChange(change.number, decides))

    def _order(self, change: _Change, step: _Step, processes: Iterable[str], order: messages.ChannelOrder) -> None:
        change.step, change.waiting = step, set(processes)
        for process in sorted(change.waiting):
            self._effects.send(process, order)

    def _end(self, change: _Change) -> None:
        refusal = change.refusal
        is_over = {change.process} if change.is_own and change.done and refusal is None else set[str]()
        for process in change.prepared:
            if process not in is_over:
                self._effects.send(process, messages.EndChange(change.number))
        if refusal is not None and change.stuck:
            reason = f"{refusal.reason}; not all are as before: {'; '.join(change.stuck)}"
            refusal = ChangeRefusal(reason, is_half_done=True)
        if not is_over:
            self._effects.send(change.process, messages.ChangeDecided(change.asked.number, refusal))
        self._change = None
        self._begin()

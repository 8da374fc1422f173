"""What a new plan changes in a running robot, decided before anything is touched, and how that is carried out.

It is pure: the conductor drives a change step by step and gets the result. Components are asked first how they would
take it. Those that stop are retired in reverse start order; empty processes end; then the new plan applies: new
processes are forked, new components configured and, as at the start of the robot, activated in start order.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from itertools import count, groupby

from rbxcompose.base.config import HIDDEN, Config, Secret, leaves, may_be_applied
from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.plan.diff import BOUNDS, WHOLE, Change, difference
from rbxcompose.compiler.plan.dump import dump
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.supervision.members import BLOCKED, DONE, ConductorEffects, Member, blocked_text, is_commanding
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.registry import component_type

WORLD = "world"  # the process group of simulated truth, whose state a restart would lose
DOWN_AND_UP = "needs 'down' and 'up'"

_TAKEN_OVER = ("starts_after", "restart", "log")  # options that can change without a restart
_OPTIONS = ("type", "process", *_TAKEN_OVER)


class Fate(StrEnum):
    """What a change does to a component."""

    KEPT = "kept"
    LIVE = "changed live"
    RESTARTED = "restarted"
    ADDED = "added"
    REMOVED = "removed"


@dataclass(frozen=True, slots=True)
class Fated:
    """A component, what the change does to it, and why."""

    instance: Instance  # as it will be; if removed, as it was
    fate: Fate
    reasons: tuple[Change, ...] = ()

    @property
    def stops(self) -> bool:
        """Return whether it is stopped."""
        return self.fate in (Fate.RESTARTED, Fate.REMOVED)

    @property
    def starts(self) -> bool:
        """Return whether it is started."""
        return self.fate in (Fate.RESTARTED, Fate.ADDED)


@dataclass(frozen=True, slots=True)
class Changes:
    """The changes from one plan to another; `fated` is in start order, with the removed ones last."""

    before: Plan
    after: Plan
    fated: tuple[Fated, ...]
    impossible: tuple[str, ...] = ()  # why this cannot be done while the robot is up, in words

    @property
    def is_empty(self) -> bool:
        """Return whether the plans are equivalent."""
        return not (self.impossible or self.shares_change) and all(one.fate is Fate.KEPT for one in self.fated)

    @property
    def shares_change(self) -> bool:
        """Return whether anything changes that is known of other hosts, or carried to other robots."""
        return (self.before.share, self.before.exchange) != (self.after.share, self.after.exchange)

    @property
    def links_change(self) -> bool:
        """Return whether the router has to open its links again."""
        before, after = map(_links, (self.before, self.after))
        return before != after

    @property
    def links_text(self) -> str:
        """Return what changes of the links if the router opens them again, else nothing."""
        if not self.links_change:
            return ""
        pairs = zip(*map(_link_words, (self.before, self.after)), strict=True)
        found = ", ".join(f"{before} -> {after}" for before, after in pairs if before != after)
        return f"links: {found or 'other data may cross'}; they open again, and what moves across them brakes meanwhile"

    def names(self, fate: Fate) -> list[str]:
        """Return the components that share a fate."""
        return [one.instance.name for one in self.fated if one.fate is fate]

    @property
    def starting(self) -> frozenset[str]:
        """Return the components that are started, again or for the first time."""
        return frozenset(one.instance.name for one in self.fated if one.starts)

    @property
    def stopping(self) -> frozenset[str]:
        """Return the components that are stopped, for good or to be started again."""
        return frozenset(one.instance.name for one in self.fated if one.stops)

    def unsafe(self, moves: Collection[str], runs: Mapping[str, str]) -> str:
        """Return why the changes cannot be made now, or nothing if they can.

        `moves` says in words what moves the robot or is about to, `runs` which work of components would be cut off.
        `Live` settings are made to be changed while the robot moves.
        """
        cut = next((name for name in runs if name in self.stopping), None)
        if cut is not None:
            return f"{runs[cut]}, and '{cut}' would restart: run 'rbxcompose mission pause' first, or wait for its end"
        if not moves or not (commanding := self.commanding):
            return ""
        return (
            f"{next(iter(moves))}, and '{commanding[0]}' is on the path of its commands: "
            "'rbxcompose stop' first, or 'rbxcompose mission pause' and wait until the robot is at rest"
        )

    @property
    def commanding(self) -> list[str]:
        """Return the components on the path of commands that are stopped or started."""
        old = {instance.name: instance for instance in self.before.instances}
        touched = (one.instance for one in self.fated if one.stops or one.starts)
        return [
            instance.name
            for instance in touched
            if is_commanding(instance) or (instance.name in old and is_commanding(old[instance.name]))
        ]


def changes(before: Plan, after: Plan, failed: Collection[str] = ()) -> Changes:
    """Return the changes from `before`, which runs, to `after`; components that have `failed` are started again."""
    found = difference(before, after)
    old = {instance.name: instance for instance in before.instances}
    fated = [
        _fated(old.get(instance.name), instance, found.changed.get(instance.name, ()), failed)
        for instance in after.instances
    ]
    fated += [Fated(one, Fate.REMOVED) for one in found.removed]
    impossible = (*_impossible(old, fated, found.plan), *_moved(before, after))
    return Changes(before, after, tuple(fated), impossible)


def _links(plan: Plan) -> tuple[object, ...]:
    others = tuple(replace(other, instances=()) for other in plan.share.others) if plan.share else ()
    return plan.share and replace(plan.share, others=others, version=""), plan.exchange


def _link_words(plan: Plan) -> tuple[str, str]:
    """Return the `security` of the links with other hosts and robots, and their endpoints."""
    ends = [end for end in (plan.share, plan.exchange) if end]
    security = next((end.tls.security for end in ends if end.tls), "none")
    return security, ", ".join(endpoint for end in ends for endpoint in (*end.listen, *end.connect)) or "no endpoint"


def _moved(before: Plan, after: Plan) -> Iterator[str]:
    """Yield why the shares of a robot cannot change while it is up."""
    old, new = (plan.share.host if plan.share else "" for plan in (before, after))
    if old != new:
        here = [f"'{host}' beside others" if host else "one host alone" for host in (old, new)]
        yield f"it ran on {here[0]} and would run on {here[1]}: it {DOWN_AND_UP}"


def _fated(before: Instance | None, after: Instance, reasons: tuple[Change, ...], failed: Collection[str]) -> Fated:
    if before is None:
        return Fated(after, Fate.ADDED)
    hidden = dict(_secrets(before.config, "")), dict(_secrets(after.config, ""))
    reasons += tuple(Change(key, HIDDEN, HIDDEN) for key in hidden[1] if hidden[0].get(key) != hidden[1][key])
    if after.name in failed and before.process != WORLD:
        return Fated(after, Fate.RESTARTED, (*reasons, Change("state", "failed", "active")))
    if not reasons:
        return Fated(after, Fate.KEPT)
    is_live = all(_is_live(after, change.key) for change in reasons) and _has_same_ports(before, after)
    return Fated(after, Fate.LIVE if is_live else Fate.RESTARTED, reasons)


def _has_same_ports(before: Instance, after: Instance) -> bool:
    """Return whether a component has the same ends on the bus; what it runs may need others."""
    each = [component_type(instance.type).ports(instance.config) for instance in (before, after)]
    first, second = ({name: (type(port), vars(port)) for name, port in ports.items()} for ports in each)
    return first == second


def _is_live(instance: Instance, key: str) -> bool:
    head = key.partition(".")[0]
    if key.startswith(BOUNDS):
        return True
    if head in _OPTIONS:
        return head in _TAKEN_OVER
    found = (field for name, field in leaves(instance.config) if f"{key}.".startswith(f"{name}."))
    return any(may_be_applied(field) for field in found)


def _secrets(value: object, path: str) -> Iterator[tuple[str, Secret]]:
    match value:
        case Secret():
            yield path, value
        case Config():
            for name in type(value).model_fields:
                yield from _secrets(getattr(value, name), f"{path}.{name}" if path else name)
        case Mapping():
            for name, each in value.items():
                yield from _secrets(each, f"{path}.{name}")
        case tuple() | list():
            for index, each in enumerate(value):
                yield from _secrets(each, f"{path}.{index}")


def _impossible(old: Mapping[str, Instance], fated: list[Fated], plan: tuple[Change, ...]) -> Iterator[str]:
    for change in plan:
        if change.key.partition(".")[0] in WHOLE:
            yield f"{change} concerns the whole robot: it {DOWN_AND_UP}"
    for one in fated:
        name = one.instance.name
        processes = {one.instance.process, old[name].process} if name in old else set()
        if one.stops and WORLD in processes:
            because = f" ({one.reasons[0]})" if one.reasons else ""
            yield f"'{name}' holds simulated truth, which would be reset{because}: it {DOWN_AND_UP}"


LONGEST = 20.0  # [s] within which all new components must be active

WhenDone = Callable[[str, bool], None]  # a text, and whether the change was refused wholly or in part


def text_of(plan: Plan, instances: Iterable[Instance]) -> str:
    """Return the part of a plan that a process needs, as text: these instances, with their secrets."""
    return dump(replace(plan, instances=tuple(instances)), reveals_secrets=True)


class Changing:
    """Carries out changes; once everything that stops has stopped, `switch` is called to apply the new plan."""

    def __init__(
        self,
        changes: Changes,
        members: dict[str, Member],
        effects: ConductorEffects,
        switch: Callable[[Changes], None],
        fork: Callable[[str], None],
        done: WhenDone,
    ) -> None:
        self.changes = changes
        self.is_over = False
        self.failures: dict[str, str] = {}  # by component: why it does not run as it should
        self.refused: set[str] = set()  # components that did not take their new settings
        self._members, self._effects, self._switch, self._fork, self._done = members, effects, switch, fork, done
        old = changes.before.instances
        stopping = [instance for instance in reversed(old) if instance.name in changes.stopping]
        self._retiring = [
            (process, [item.name for item in run])
            for process, run in groupby(stopping, key=lambda instance: instance.process)
        ]
        self._ending = [group for group in reversed(changes.before.groups) if group not in changes.after.groups]
        self._waited_for = ""  # the process whose answer is pending
        self._has_switched = False
        self._setting: set[str] = set()  # processes that are changing live settings

    def proceed(self) -> None:
        """Do the next step."""
        while not self._has_switched and not self._waited_for:
            if self._retiring:
                process, names = self._retiring.pop(0)
                self._send(process, messages.Retire(names))
            elif self._ending:
                process = self._ending.pop(0)
                self._members[process].is_closing = True
                self._send(process, messages.Shutdown())
            else:
                self._has_switched = True
                self._switch(self.changes)
                self._prepare()
                self._set_live()

    def _send(self, process: str, order: messages.ChannelOrder) -> None:
        if self._members[process].is_there:
            self._waited_for = process
            self._effects.send(process, order)

    def _prepare(self) -> None:
        """Configure all new components, in existing processes or in new ones."""
        after, members = self.changes.after, self._members
        for group in self.changes.before.groups:
            if group not in after.groups:
                del members[group]
        for group in after.groups:
            mine = [instance for instance in after.of_group(group) if instance.name in self.changes.starting]
            member = members.pop(group) if group in members else Member(group)
            members[group] = member  # in start order, like the members of the first plan
            member.requested -= self.changes.starting
            if not member.is_there and (member.is_given_up or group not in self.changes.before.groups):
                member.is_given_up = member.is_given_up and not mine
                if not member.is_given_up:
                    self._fork(group)
            elif mine and member.is_there:
                member.is_configured = False  # until it has answered
                self._effects.send(group, messages.Prepare(text_of(after, mine)))

    def _set_live(self) -> None:
        live = [one for one in self.changes.fated if one.fate is Fate.LIVE]
        for process in dict.fromkeys(item.instance.process for item in live):
            mine = [item for item in live if item.instance.process == process]
            keys = {item.instance.name: [change.key for change in item.reasons] for item in mine}
            text = text_of(self.changes.after, (item.instance for item in mine))
            if self._members[process].is_there:
                self._setting.add(process)
                self._effects.send(process, messages.Reconfigure(text, keys))

    # What comes back

    def retired(self, process: str) -> None:
        """Continue: a process has retired its components, or is gone."""
        if self._waited_for == process:
            self._waited_for = ""
            self.proceed()

    def exited(self, process: str) -> None:
        """Continue without a process that has ended."""
        self._setting.discard(process)
        self.retired(process)

    def reconfigured(self, process: str, refused: Mapping[str, str]) -> None:
        """Record the result of a change of live settings."""
        self._setting.discard(process)
        self.refused |= refused.keys()
        self.failures.update(refused)

    def failed(self, name: str, message: str) -> bool:
        """Record the final failure of a component; return whether this change has started it."""
        if name in self.changes.starting:
            self.failures[name] = message
        return name in self.changes.starting

    # The end

    def look(self, states: Mapping[str, tuple[str, int]], blocked: Mapping[str, str]) -> None:
        """End the change once all components have reached their final states; `blocked` has the causes."""
        if self.is_over or not self._has_switched or self._setting:
            return
        if all(states[name][0] in DONE for name in self.changes.starting):
            for name in sorted(self.changes.starting):
                if states[name][0] == "failed":
                    self.failures.setdefault(name, f"'{name}' has failed and is never restarted, the log says why")
                elif states[name][0] == BLOCKED:
                    self.failures[name] = f"'{name}' {blocked_text(blocked, name)}"
            self._end("; ".join(self.failures.values()))

    def time_is_up(self, states: Mapping[str, tuple[str, int]]) -> None:
        """End the change, as far as it has got."""
        late = sorted(name for name in self.changes.starting if states.get(name, ("",))[0] != "active")
        self.cut_off(f"not active after {LONGEST:g} s: {', '.join(late)}")

    def cut_off(self, reason: str) -> None:
        """End the change early."""
        if not self.is_over:
            self._end(reason)

    def _end(self, trouble: str) -> None:
        self.is_over = True
        if trouble:
            self._done(f"only in part: {trouble}; 'rbxcompose ps' shows what runs", True)
        else:
            self._done(summary(self.changes), False)


def summary(changes: Changes) -> str:
    """Return one line that says what happens to which components, and to links."""
    named = ((fate, changes.names(fate)) for fate in Fate if fate is not Fate.KEPT)
    components = ", ".join(f"{' '.join(names)} {fate}" for fate, names in named if names)
    return "; ".join(filter(None, (components, changes.links_text))) or "nothing to do"


WhenConsidered = Callable[[Sequence[str], str], None]  # what components say, and why they refuse, which may be empty


@dataclass(slots=True)
class _Question:
    waiting: set[str]  # processes whose answers are due
    then: WhenConsidered
    said: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


class Consultations:
    """The questions that are open; a process that ends says nothing, since its components have nothing to lose."""

    def __init__(self, send: Callable[[str, messages.ChannelOrder], None]) -> None:
        self._send = send
        self._numbers = count(1)
        self._open: dict[int, _Question] = {}

    def ask(self, changes: Changes, reached: Collection[str], then: WhenConsidered) -> None:
        """Ask the components that are changed or restarted, in these processes; `then` is called now or later."""
        asked: dict[str, list[str]] = {}
        for one in changes.fated:
            is_asked = component_type(one.instance.type).consider is not Component.consider
            if one.fate in (Fate.LIVE, Fate.RESTARTED) and is_asked and one.instance.process in reached:
                asked.setdefault(one.instance.process, []).append(one.instance.name)
        if not asked:
            then((), "")
            return
        number = next(self._numbers)
        self._open[number] = _Question(set(asked), then)
        for process, names in asked.items():
            mine = [instance for instance in changes.after.instances if instance.name in names]
            self._send(process, messages.Consider(number, text_of(changes.after, mine)))

    def receive(self, process: str, message: messages.ChannelWord) -> None:
        """Take a message of a process; others than answers are ignored."""
        if isinstance(message, messages.Considered) and (question := self._open.get(message.number)) is not None:
            question.said += message.said
            question.refused += message.refused
            self._heard(message.number, process)

    def gone(self, process: str) -> None:
        """Expect nothing of a process any more."""
        for number in list(self._open):
            self._heard(number, process)

    def _heard(self, number: int, process: str) -> None:
        question = self._open[number]
        question.waiting.discard(process)
        if not question.waiting:
            del self._open[number]
            question.then(tuple(question.said), "; ".join(question.refused))

"""What a new plan changes in a running robot, decided before anything is touched. Pure."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from enum import StrEnum

from rbxcompose.base.config import HIDDEN, Config, Secret, leaves, may_be_applied
from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.plan.diff import BOUNDS, WHOLE, Change, difference
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.runtime.supervision.members import is_commanding
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

"""The difference between two plans, and which processes of a running robot it affects."""

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from rbxcompose.base.config import Bound, Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.levels import log_word
from rbxcompose.base.requests import to_data
from rbxcompose.base.units import Quantity, format_number, format_quantity, to_si
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.manifest.shapes import as_written, dimension_at, exact
from rbxcompose.manifest.validate import to_plain
from rbxcompose.missions.program.program import Program

EMPTY = "{}"
BOUNDS = "limits of "  # begins the keys of what bounds settings that may change while the robot runs
LONGEST = 1000  # characters of a text that a person would still read in a difference
WHOLE = ("robot", "bus", "is_simulated", "messages")  # keys whose change restarts every process


@dataclass(frozen=True, slots=True)
class Change:
    """A key with its text before and after; None where it does not exist."""

    key: str
    before: str | None
    after: str | None

    def __str__(self) -> str:
        match self:
            case Change(before=None):
                return f"{self.key}: {self.after} (new)"
            case Change(after=None):
                return f"{self.key}: {self.before} (gone)"
        return f"{self.key}: {self.before} -> {self.after}"


@dataclass(frozen=True, slots=True)
class Difference:
    """The changes from one plan to another. `restarts` are processes of both that contain a change."""

    plan: tuple[Change, ...]
    added: tuple[Instance, ...]
    removed: tuple[Instance, ...]
    changed: Mapping[str, tuple[Change, ...]]
    starts: tuple[str, ...]
    ends: tuple[str, ...]
    restarts: tuple[str, ...]

    @property
    def is_empty(self) -> bool:
        """Return whether the plans are equivalent."""
        return not (self.plan or self.added or self.removed or self.changed)

    def text(self) -> str:
        """Return the difference as text for people."""
        return "no difference" if self.is_empty else "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield from map(str, self.plan)
        yield from (f"+ {instance.name} ({instance.type}, process {instance.process})" for instance in self.added)
        yield from (f"- {instance.name} ({instance.type}, process {instance.process})" for instance in self.removed)
        for name, changes in self.changed.items():
            yield f"~ {name}"
            yield from (f"    {change}" for change in changes)
        for what, groups in (("start", self.starts), ("end", self.ends), ("restart", self.restarts)):
            if groups:
                yield f"processes that {what}: {', '.join(groups)}"

    def data(self) -> dict[str, Any]:
        """Return the difference as data for programs."""
        return {
            "plan": to_data(self.plan),
            "added": [instance.name for instance in self.added],
            "removed": [instance.name for instance in self.removed],
            "changed": {name: to_data(changes) for name, changes in self.changed.items()},
            "processes": {"start": list(self.starts), "end": list(self.ends), "restart": list(self.restarts)},
        }


def difference(before: Plan, after: Plan) -> Difference:
    """Return the changes from `before` to `after`."""
    old, new = ({instance.name: instance for instance in plan.instances} for plan in (before, after))
    changed = {name: _changes(old[name], instance) for name, instance in new.items() if name in old}
    changed = {name: changes for name, changes in changed.items() if changes}
    whole = tuple(_compared(_of_plan(before), _of_plan(after)))
    return Difference(
        plan=whole,
        added=tuple(instance for name, instance in new.items() if name not in old),
        removed=tuple(instance for name, instance in old.items() if name not in new),
        changed=changed,
        starts=tuple(group for group in after.groups if group not in before.groups),
        ends=tuple(group for group in before.groups if group not in after.groups),
        restarts=_restarts(before, after, {*changed, *(old.keys() ^ new.keys())}, whole),
    )


def _restarts(before: Plan, after: Plan, names: set[str], whole: tuple[Change, ...]) -> tuple[str, ...]:
    """Return the processes of both plans that contain one of these instances; all, if the plan itself has changed."""
    touched = {instance.process for plan in (before, after) for instance in plan.instances if instance.name in names}
    is_all = any(change.key.partition(".")[0] in WHOLE for change in whole)
    return tuple(group for group in after.groups if group in before.groups and (is_all or group in touched))


def _of_plan(plan: Plan) -> dict[str, str]:
    return {
        "robot": plan.robot,
        "start": plan.start or "no mission",
        "is_simulated": _text(plan.is_simulated),
        **dict(_flat(plan.bus, "bus")),
        **{f"messages.{name}": f"SHA-256 {_digest(text)}" for name, text in plan.messages.items()},
    }


def _changes(before: Instance, after: Instance) -> tuple[Change, ...]:
    return tuple(_compared(_of_instance(before), _of_instance(after)))


def _compared(before: Mapping[str, str], after: Mapping[str, str]) -> Iterator[Change]:
    for key in dict.fromkeys([*before, *after]):
        if before.get(key) != after.get(key) and not (_fills(key, before, after) or _fills(key, after, before)):
            yield Change(key, before.get(key), after.get(key))


def _fills(key: str, empty: Mapping[str, str], full: Mapping[str, str]) -> bool:
    """Return whether a map is empty on one side only: the entries of the other side show this already."""
    return empty.get(key) == EMPTY and any(name.startswith(f"{key}.") for name in full)


def _of_instance(instance: Instance) -> dict[str, str]:
    """Return the properties of an instance, by key; settings as a person writes them."""
    wires = {f"topic of {wire.port}": f"{wire.topic} ({wire.type})" for wire in instance.wires if wire.topic}

    bounds = {f"{BOUNDS}{name}": _bounds(instance.config, name, each) for name, each in instance.bounds.items()}
    return {
        "type": instance.type,
        "process": instance.process,
        "starts_after": ", ".join(instance.starts_after) or "nothing",
        "log": log_word(instance.log),
        **dict(_flat(instance.restart, "restart")),
        **dict(_flat(instance.config, "")),
        **wires,
        **bounds,
    }


def _bounds(config: Config, name: str, bounds: Iterable[Bound]) -> str:
    dimension = dimension_at(type(config), (name,))

    def shown(value: float) -> str:
        return _text(Quantity(value, dimension) if dimension else value)

    words = (("at least", "least"), ("at most", "most"))
    pairs = ((word, getattr(bound, key)) for bound in bounds for word, key in words)
    return ", ".join(f"{word} {shown(value)}" for word, value in pairs if value is not None)


def _flat(value: Any, path: str) -> Iterator[tuple[str, str]]:
    """Yield the leaves of a value by their dotted path."""
    match value:
        case Program():
            yield from _flat(to_plain(value.root), path)
        case Mapping() if value:
            for key, inner in value.items():
                yield from _flat(inner, _below(path, str(key)))
        case list() | tuple() if any(isinstance(item, Mapping | list | tuple) for item in value):
            for index, inner in enumerate(value):
                yield from _flat(inner, _below(path, str(index)))
        case Config():
            for name in type(value).model_fields:
                dimension = dimension_at(type(value), (name,))
                inner = getattr(value, name)
                is_quantity = dimension is not None and isinstance(inner, float)
                yield from _flat(Quantity(inner, dimension) if is_quantity and dimension else inner, _below(path, name))
        case _ if is_dataclass(value) and not isinstance(value, Quantity | Type):
            for field in fields(value):
                yield from _flat(getattr(value, field.name), _below(path, field.name))
        case _:
            yield path, _text(value)


def _below(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key


def _text(value: Any) -> str:
    match value:
        case None:
            return "nothing"
        case bool():
            return "true" if value else "false"
        case float():
            short = format_number(value)
            return short if float(short) == value else repr(value)
        case Quantity() if math.isinf(value.value):
            return "no limit"
        case Quantity():
            short = format_quantity(value.value, value.dimension)
            return short if to_si(short, value.dimension) == value.value else exact(value.value, value.dimension)
        case Type():
            return value.phrase
        case Config():
            return _text(as_written(value))
        case Mapping():
            return f"{{{', '.join(f'{key}: {_text(inner)}' for key, inner in value.items())}}}"
        case list() | tuple():
            return f"[{', '.join(map(_text, value))}]"
        case set() | frozenset():
            return f"[{', '.join(sorted(map(_text, value)))}]"
        case str() if len(value) > LONGEST:
            return f"{len(value):,} characters, SHA-256 {_digest(value)}"
    return str(value) or '""'


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]

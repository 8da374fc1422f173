"""A mission as a picture: rows of nodes with what stands in each, for text, diagrams and pages alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from typing import Any

from rbxcompose.expressions.tree import Expression
from rbxcompose.manifest.tree import Mapping as Tree
from rbxcompose.manifest.tree import Node as Located
from rbxcompose.manifest.tree import Scalar
from rbxcompose.manifest.tree import Sequence as Listed
from rbxcompose.missions.calling import UseOptions
from rbxcompose.missions.linking import link
from rbxcompose.missions.machines import MachineOptions, StateOptions
from rbxcompose.missions.messages import Message
from rbxcompose.missions.modifiers.registry import modifiers
from rbxcompose.missions.program import Asked, Assignment, Interrupt, Node, Program, RobotNames

LONGEST = 60  # characters of what stands in a node


@dataclass(frozen=True, slots=True)
class Arrow:
    """A transition of a machine: on this outcome (empty: on every one) to this state or end."""

    outcome: str
    to: str


@dataclass(frozen=True, slots=True)
class Drawn:
    """One node: its number in the linked program, what it is, what stands in it, and what is around it.

    `role` tells what it is to its parent (`then`, a branch); an interrupt is a node of its own, without a number.
    """

    number: int | None
    kind: str
    text: str = ""
    name: str = ""
    role: str = ""
    notes: tuple[str, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    is_start: bool = False
    children: tuple[Drawn, ...] = field(default_factory=tuple)

    @property
    def title(self) -> str:
        """Return the kind with what stands in it."""
        return f"{self.kind} {self.text}".strip()

    def all(self) -> Iterator[Drawn]:
        """Yield it and all below it."""
        yield self
        for child in self.children:
            yield from child.all()


@dataclass(frozen=True, slots=True)
class Picture:
    """A mission: its main node and its interrupts."""

    name: str
    about: str
    main: Drawn
    interrupts: tuple[Drawn, ...] = ()
    count: int = 0

    @property
    def roots(self) -> tuple[Drawn, ...]:
        """Return what is drawn at the top."""
        return (self.main, *self.interrupts)


def picture_to_data(picture: Picture) -> dict[str, Any]:
    """Return a picture as data for JSON."""
    return asdict(picture)


def picture_from_data(data: Mapping[str, Any]) -> Picture:
    """Return the picture that `picture_to_data` made data of."""
    interrupts = tuple(map(_drawn_from, data["interrupts"]))
    return Picture(data["name"], data["about"], _drawn_from(data["main"]), interrupts, data["count"])


def _drawn_from(data: Mapping[str, Any]) -> Drawn:
    more = {
        "notes": tuple(data["notes"]),
        "arrows": tuple(Arrow(**one) for one in data["arrows"]),
        "children": tuple(map(_drawn_from, data["children"])),
    }
    return Drawn(**{**data, **more})


def picture_of(program: Program, robot: RobotNames) -> Picture:
    """Return the picture of a mission with all that it uses."""
    linked = link(program, robot.missions)
    interrupts = tuple(_interrupt(linked, one) for one in linked.interrupts)
    return Picture(linked.name, linked.about, _drawn(linked, linked.main), interrupts, len(linked.nodes))


def _interrupt(linked: Program, one: Interrupt) -> Drawn:
    children = (_drawn(linked, one.root),) if one.root is not None else ()
    restarts = f" {one.restarts.text}" if one.restarts else ""
    notes = (f"afterwards {one.afterwards}{restarts}",)
    return Drawn(None, "interrupt", f"when {one.when.expression.text}", one.name, "", notes, children=children)


def _drawn(linked: Program, number: int, role: str = "", is_start: bool = False) -> Drawn:
    node = linked.nodes[number]
    options = node.options
    start = options.start if isinstance(options, MachineOptions) else ""
    roles = _roles(linked, node)
    children = tuple(
        _drawn(linked, child, one, bool(start) and linked.nodes[child].name == start)
        for child, one in zip(node.children, roles, strict=True)
    )
    if node.inner is not None:
        reactions = [one for one in node.inner.interrupts if one.root is not None]
        children = (children[0], *(_interrupt(linked, one) for one in reactions))
    arrows: tuple[Arrow, ...] = ()
    if isinstance(options, StateOptions) and options.next is not None:
        arrows = tuple(Arrow(outcome, to) for outcome, to in options.next.to.items())
    name = "" if role == node.name else node.name
    return Drawn(number, node.kind or node.skill, _text(node), name, role, _notes(node), arrows, is_start, children)


def _roles(linked: Program, node: Node) -> Sequence[str]:
    """Return what each child is to its node: the key under which it was written, where that says something."""
    written = [linked.nodes[child].path.removeprefix(node.path).strip(".").partition(".")[0] for child in node.children]
    says = node.kind in ("if", "choose", "parallel")
    return [one if says and not one.isdecimal() else "" for one in written]


def _text(node: Node) -> str:
    """Return what stands in a node, shortened."""
    if node.skill:
        return _short(", ".join(_argument(one.name, one.value) for one in node.arguments))
    match node.options:
        case UseOptions(mission=mission):
            return mission
        case Message(target=target):
            return target.text
        case StateOptions() | MachineOptions():
            return ""
    if isinstance(node.options, tuple) and node.options and isinstance(node.options[0], Assignment):
        return _short(", ".join(f"{one.name} = {one.asked.scalar.text}" for one in node.options))
    asked = _own(node)
    if node.item:
        items = ", ".join(one.scalar.text for one in asked)
        return _short(f"{node.item} in {items}" if items else node.item)
    return _short(", ".join(one.scalar.text for one in asked[:2]))


def _own(node: Node) -> list[Asked]:
    """Return the expressions of a node that belong to no modifier."""
    parts = [part for value in node.modifiers.values() for part in (value, *_parts(value))]
    return [one for one in node.asked if not any(one.expression is part for part in parts)]


def _parts(value: object) -> list[object]:
    return [getattr(value, one.name) for one in fields(value)] if is_dataclass(value) else []


def _argument(name: str, value: Located) -> str:
    return f"{name} {_written(value)}".strip()


def _written(value: Located) -> str:
    match value:
        case Scalar():
            return value.text
        case Listed():
            return ", ".join(_written(one) for one in value.items)
        case Tree():
            return ", ".join(f"{key} {_written(entry.value)}" for key, entry in value.entries.items())


def _notes(node: Node) -> tuple[str, ...]:
    """Return the modifiers of a node, from the outside in, in words."""
    found = []
    for key in modifiers():
        if key in node.modifiers:
            value = node.modifiers[key]
            text = value.text if isinstance(value, Scalar) else ""
            said = [part.text for part in (value, *_parts(value)) if isinstance(part, Expression)]
            told = ", ".join(said) or text
            found.append(_short(f"{key} {told}".strip().replace("_", " ")))
    return tuple(found)


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 3]}..."

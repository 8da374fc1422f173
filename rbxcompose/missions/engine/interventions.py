"""What a person may do to a mission that runs, as data, and how people name its nodes and transitions."""

import re
from collections.abc import Iterable, Iterator
from pathlib import PurePath
from typing import Any, NamedTuple

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span, clauses, suggest
from rbxcompose.base.requests import Family
from rbxcompose.missions.program.families import InTurn
from rbxcompose.missions.program.program import MissionNode, Program


class NotPossible(ValueError):  # noqa: N818 - it is the answer to whoever intervenes
    """Raised with the reason why a mission cannot do what a person wants."""


class OtherFileError(NotPossible):
    """Raised if there is nothing of any of some missions, whose `files` these are, in the `file` of a line."""

    def __init__(self, file: str, files: Iterable[str]) -> None:
        self.file, self.files = file, tuple(dict.fromkeys(files))
        super().__init__(f"there is no node of a mission in '{file}'; its files: {', '.join(self.files)}")


@dataclass(frozen=True, slots=True)
class SetBreakpoints:
    """Stop before these nodes start, and at these transitions: a state with an outcome; all others are cleared."""

    starts: tuple[int, ...] = ()
    ends: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, slots=True)
class TakeStep:
    """Go on to the start of the next leaf, or to the next transition of a machine."""


@dataclass(frozen=True, slots=True)
class ForceResult:
    """Halt a node that runs, and let it end in `success` or `failure`, perhaps with an outcome of its own."""

    node: int
    succeeds: bool
    outcome: str = ""


@dataclass(frozen=True, slots=True)
class ChangeData:
    """Set a datum of the mission."""

    name: str
    value: Any


@dataclass(frozen=True, slots=True)
class JumpToState:
    """Leave the state in which a machine is, and enter another one."""

    machine: int
    state: str


Intervention = SetBreakpoints | TakeStep | ForceResult | ChangeData | JumpToState
INTERVENTIONS: Family[Intervention] = Family((SetBreakpoints, TakeStep, ForceResult, ChangeData, JumpToState))


ARROW = "->"
_LINE = re.compile(r"(.+):([0-9]{1,9})")
_NUMBER = re.compile(r"[0-9]{1,9}")
_MOST = 3  # lines that are offered instead of one where nothing begins


class NodeAddress(NamedTuple):
    """A node, and the outcome by which a state is left, if the transition is meant and not the start."""

    node: int
    outcome: str | None
    span: Span


def is_line(where: str) -> bool:
    """Return whether something is named by file and line: this means all that begins there, in any mission."""
    return _LINE.fullmatch(where) is not None


def is_number(where: str) -> bool:
    """Return whether something is named by its number in the picture of a mission."""
    return _NUMBER.fullmatch(where) is not None


def find(program: Program, where: str) -> tuple[NodeAddress, ...]:
    """Return what a person means in a linked mission: several if a mission that it uses several times has it.

    Raises:
        NotPossible: if there is nothing, with what there is instead, or if several places have that name.
    """
    if match := _LINE.fullmatch(where):
        return _on_line(program, match[1], int(match[2]))
    if is_number(where):
        if int(where) >= len(program.nodes):
            raise NotPossible(f"there is no node {where}; the last one is {len(program.nodes) - 1}")
        return (NodeAddress(int(where), None, program.nodes[int(where)].span),)
    if ARROW in where:
        return _transition(program, *(part.strip() for part in where.split(ARROW, 1)))
    names = {node.name: None for node in program.nodes if node.name}
    return _only(
        where, [_start(node) for node in program.nodes if node.name and node.name == where], "names and states", names
    )


def _start(node: MissionNode) -> NodeAddress:
    return NodeAddress(node.number, None, node.span)


def _only(where: str, found: list[NodeAddress], what: str, valid: dict[str, None]) -> tuple[NodeAddress, ...]:
    """Return what was found if it is one place in the text."""
    places = dict.fromkeys(spot.span.place for spot in found)
    if not places:
        raise NotPossible(clauses(f"there is no '{where}'", suggest(where, valid, what)))
    if len(places) > 1:
        raise NotPossible(f"'{where}' may be {' or '.join(places)}; name one by its file and line")
    return tuple(found)


def _transition(program: Program, state: str, to: str) -> tuple[NodeAddress, ...]:
    every = [
        (
            f"{node.name}{ARROW}{target}",
            state in (node.name, str(node.number)) and target == to,
            _leaving(node, outcome),
        )
        for node in program.nodes
        if node.step.leads_to
        for outcome, target in node.step.leads_to.to.items()
    ]
    found = [spot for _, is_meant, spot in every if is_meant]
    machines = {program.nodes[spot.node].span: None for spot in found}
    if len(machines) > 1 or not found:
        _only(f"{state}{ARROW}{to}", found, "transitions", dict.fromkeys(text for text, _, _ in every))
    return tuple(found)


def _leaving(node: MissionNode, outcome: str) -> NodeAddress:
    keys = node.step.leads_to.keys if node.step.leads_to else {}
    return NodeAddress(node.number, outcome, keys.get(outcome, node.span))


def _on_line(program: Program, file: str, line: int) -> tuple[NodeAddress, ...]:
    spots = [spot for spot in _spots(program) if _is_file(spot.span.file, file)]
    if not spots:
        raise OtherFileError(file, (node.span.file for node in program.nodes))
    found = [spot for spot in spots if spot.span.line == line]
    starts = {spot.node for spot in found if spot.outcome is None}
    above = {spot.node: program.nodes[spot.node].parent for spot in found}
    found = [spot for spot in found if spot.outcome is not None or above[spot.node] not in starts]
    if not found:
        lines = sorted(sorted({spot.span.line for spot in spots}), key=lambda other: abs(other - line))[:_MOST]
        raise NotPossible(
            f"nothing begins in line {line} of '{file}'; lines near it are {', '.join(map(str, sorted(lines)))}"
        )
    return tuple(found)


def _spots(program: Program) -> Iterator[NodeAddress]:
    """Yield the start of each node and each transition; the line of a list's first item means the item."""
    for node in program.nodes:
        lines = [program.nodes[child].span.line for child in node.children] if isinstance(node.step, InTurn) else []
        is_list = bool(lines) and lines[0] == node.span.line and (len(lines) == 1 or lines[-1] != lines[0])
        if not is_list:
            yield _start(node)
        for outcome in node.step.leads_to.keys if node.step.leads_to else ():
            yield _leaving(node, outcome)


def _is_file(of_node: str, wanted: str) -> bool:
    """Return whether two paths have the same end, as far as the shorter one goes."""
    parts, others = PurePath(of_node).parts, PurePath(wanted).parts
    shorter = min(len(parts), len(others))
    return parts[-shorter:] == others[-shorter:]

"""Which ways of a mission the tests took: results of skills, branches, alternatives, interrupts, transitions."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from rbxcompose.findings import Span
from rbxcompose.missions.events import InterruptStarted, MissionEvent, SkillEnded, Transition
from rbxcompose.missions.kinds.choose import ChooseOptions
from rbxcompose.missions.machines import MachineOptions, StateOptions
from rbxcompose.missions.program import Node, Program, RobotNames
from rbxcompose.missions.statuses import SKIPPED
from rbxcompose.trials.mission_facts import missions_in
from rbxcompose.trials.model import FAILS, SUCCEEDS

Key = tuple[Hashable, ...]


@dataclass(frozen=True, slots=True, order=True)
class Way:
    """Something that a mission may do: the place of its node, and in words."""

    span: Span
    mission: str
    text: str


@dataclass(slots=True)
class Coverage:
    """The ways of all missions that were tested; the same node is one, however often a mission is used."""

    ways: set[Way] = field(default_factory=set)
    taken: set[Way] = field(default_factory=set)

    def add(self, linked: Program, robot: RobotNames, seen: set[Key]) -> None:
        """Add what one run of a mission saw."""
        for way, key in ways_of(linked, robot):
            self.ways.add(way)
            if key in seen:
                self.taken.add(way)

    @property
    def missing(self) -> list[Way]:
        """Return the ways that no test took, by place."""
        return sorted(self.ways - self.taken)


class Seen:
    """Watches one run of a mission, and keeps the keys of the ways that it took."""

    def __init__(self) -> None:
        self.keys: set[Key] = set()

    def started(self, number: int, /) -> None:
        """Hear that a node starts."""
        self.keys.add(("node", number))

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """Hear that a node ended."""
        if status == SKIPPED:
            self.keys.add(("skipped", number))

    def hear(self, event: MissionEvent, /) -> None:
        """Hear what the mission tells."""
        match event:
            case SkillEnded(leaf=leaf, result=result):
                self.keys.add(("skill", leaf, result))
            case InterruptStarted(name=name):
                self.keys.add(("interrupt", name))
            case Transition(machine=machine, state=state, outcome=outcome, to=to):
                self.keys.add(("transition", machine, state, to))
                self.keys.add(("transition", machine, state, to, outcome))


def ways_of(linked: Program, robot: RobotNames) -> Iterator[tuple[Way, Key]]:
    """Yield the ways of a linked mission, each with the key under which it is seen."""
    owners = _owners(linked)
    for node in linked.nodes:
        for span, text, key in _of_node(node, linked, robot):
            yield Way(span, owners[node.number], text), key
    for program in missions_in(linked):
        for interrupt in program.interrupts:
            root = interrupt.root
            seen: Key = ("interrupt", interrupt.name) if root is None else ("node", root)
            yield Way(interrupt.span, program.name, f"interrupt {interrupt.name}"), seen


def _owners(linked: Program) -> Mapping[int, str]:
    """Return the name of the mission of each node."""
    owners = dict.fromkeys(range(len(linked.nodes)), linked.name)
    for node in linked.nodes:
        if node.inner:
            owners.update(dict.fromkeys(range(node.number + 1, node.end), node.inner.name))
    return owners


def _of_node(node: Node, linked: Program, robot: RobotNames) -> Iterable[tuple[Span, str, Key]]:
    """Yield place, words and key of what one node may do."""
    if node.skill in robot.skills:
        for outcome in (SUCCEEDS, FAILS, *robot.skills[node.skill].outcomes):
            yield node.span, f"{node.path}: {outcome}", ("skill", node.number, outcome)
    elif node.kind == "if":
        yield from _branches(node, ["then", "else"])
    elif node.kind == "choose" and isinstance(node.options, ChooseOptions):
        yield from _branches(node, [*(f"case {case.expression.text}" for case in node.options.cases), "else"])
    elif node.kind == "fallback":
        for index, child in enumerate(node.children[1:], 2):
            yield linked.nodes[child].span, f"{node.path}: alternative {index}", ("node", child)
    elif node.kind == "machine" and isinstance(node.options, MachineOptions):
        for state in (linked.nodes[child] for child in node.children):
            yield from _transitions(node, state)


def _branches(node: Node, words: list[str]) -> Iterator[tuple[Span, str, Key]]:
    """Yield the branches in the order of the children; without an `else` nothing may be done."""
    for index, word in enumerate(words):
        is_there = index < len(node.children)
        key: Key = ("node", node.children[index]) if is_there else ("skipped", node.number)
        yield node.span, f"{node.path}: {word if is_there else 'nothing fits'}", key


def _transitions(machine: Node, state: Node) -> Iterator[tuple[Span, str, Key]]:
    options = state.options
    following = options.next if isinstance(options, StateOptions) else None
    for outcome, to in following.to.items() if following else ():
        key: Key = ("transition", machine.number, state.name, to)
        span = following.keys.get(outcome, state.span) if following else state.span
        words = f"{outcome}, on to {to}" if outcome else f"on to {to}"
        yield span, f"{state.path}: {words}", (*key, outcome) if outcome else key

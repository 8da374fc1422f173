"""Which paths of a mission the tests took: results of skills, branches, alternatives, interrupts, transitions."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.missions.engine.events import InterruptStarted, MissionEvent, SkillEnded, Transition
from rbxcompose.missions.program.outcomes import SKIPPED
from rbxcompose.missions.program.parts import StateKey, cut, ended, led, skipped, started
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.tools.mission_tests.model import missions_in


@dataclass(frozen=True, slots=True, order=True)
class CoveredWay:
    """A path that a mission may take: the place of its node, and a description."""

    span: Span
    mission: str
    text: str


@dataclass(slots=True)
class Coverage:
    """The paths of all tested missions; a node counts once, however often its mission is used."""

    ways: set[CoveredWay] = field(default_factory=set)
    taken: set[CoveredWay] = field(default_factory=set)
    _tests: Counter[tuple[str, str]] = field(default_factory=Counter)  # by robot and mission
    _nodes: dict[tuple[str, str], dict[CoveredWay, int]] = field(default_factory=dict)
    _counts: dict[tuple[str, str], int] = field(default_factory=dict)  # of nodes

    def add(self, linked: Program, robot: RobotNames, seen: set[StateKey], of: str = "") -> None:
        """Add the paths taken in one run of a mission of a robot, which has the name `of`."""
        run = of, linked.name
        self._tests[run] += 1
        self._counts[run] = len(linked.nodes)
        nodes = self._nodes.setdefault(run, {})
        for way, key, node in ways_of(linked, robot):
            self.ways.add(way)
            nodes.setdefault(way, node)
            if key in seen:
                self.taken.add(way)

    @property
    def missing(self) -> list[CoveredWay]:
        """Return the paths that no test took, by place."""
        return sorted(self.ways - self.taken)

    def by_robot(self, now: float) -> dict[str, dict[str, dict[str, Any]]]:
        """Return by robot and mission what `missions.view.tested` keeps; `now` is in seconds since 1970."""
        found: dict[str, dict[str, dict[str, Any]]] = {}
        for run, nodes in self._nodes.items():
            missing = [{"node": node, "text": way.text} for way, node in sorted(nodes.items()) if way not in self.taken]
            facts = {"at": now, "tests": self._tests[run], "ways": len(nodes), "count": self._counts[run]}
            robot, mission = run
            found.setdefault(robot, {})[mission] = {**facts, "missing": missing}
        return found


class SeenWays:
    """Observes one run of a mission, and keeps the keys of the paths that it took."""

    def __init__(self) -> None:
        self.keys: set[StateKey] = set()

    def started(self, number: int, /) -> None:
        """Handle the start of a node."""
        self.keys.add(started(number))

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """Handle the end of a node."""
        if status == SKIPPED:
            self.keys.add(skipped(number))

    def receive(self, event: MissionEvent, /) -> None:
        """Handle an event of the mission."""
        match event:
            case SkillEnded(leaf=leaf, result=result):
                self.keys.add(ended(leaf, result))
            case InterruptStarted(name=name):
                self.keys.add(cut(name))
            case Transition(machine=machine, state=state, outcome=outcome, to=to):
                self.keys.add(led(machine, state, to))
                self.keys.add(led(machine, state, to, outcome))


def ways_of(linked: Program, robot: RobotNames) -> Iterator[tuple[CoveredWay, StateKey, int]]:
    """Yield the paths of a linked mission, each with the key under which it is recorded and the number of its node.

    An interrupt without a reaction has the number -1.
    """
    owners = _owners(linked)
    for node in linked.nodes:
        for possible in node.step.possibilities(node, linked.nodes, robot):
            yield CoveredWay(possible.span, owners[node.number], possible.text), possible.key, node.number
    for program in missions_in(linked):
        for interrupt in program.interrupts:
            root = interrupt.root
            seen = cut(interrupt.name) if root is None else started(root)
            way = CoveredWay(interrupt.span, program.name, f"interrupt {interrupt.name}")
            yield way, seen, -1 if root is None else root


def _owners(linked: Program) -> Mapping[int, str]:
    """Return the name of each node's mission."""
    owners = dict.fromkeys(range(len(linked.nodes)), linked.name)
    for node in linked.nodes:
        if node.inner:
            owners.update(dict.fromkeys(range(node.number + 1, node.end), node.inner.name))
    return owners

"""Which paths of a mission the tests took: results of skills, branches, alternatives, interrupts, transitions."""

from collections.abc import Iterator, Mapping
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.missions.engine.events import InterruptStarted, MissionEvent, SkillEnded, Transition
from rbxcompose.missions.program.answers import StateKey, cut, ended, led, skipped, started
from rbxcompose.missions.program.outcomes import SKIPPED
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

    def add(self, linked: Program, robot: RobotNames, seen: set[StateKey]) -> None:
        """Add the paths taken in one run of a mission."""
        for way, key in ways_of(linked, robot):
            self.ways.add(way)
            if key in seen:
                self.taken.add(way)

    @property
    def missing(self) -> list[CoveredWay]:
        """Return the paths that no test took, by place."""
        return sorted(self.ways - self.taken)


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


def ways_of(linked: Program, robot: RobotNames) -> Iterator[tuple[CoveredWay, StateKey]]:
    """Yield the paths of a linked mission, each with the key under which it is recorded."""
    owners = _owners(linked)
    for node in linked.nodes:
        for possible in node.step.possibilities(node, linked.nodes, robot):
            yield CoveredWay(possible.span, owners[node.number], possible.text), possible.key
    for program in missions_in(linked):
        for interrupt in program.interrupts:
            root = interrupt.root
            seen = cut(interrupt.name) if root is None else started(root)
            yield CoveredWay(interrupt.span, program.name, f"interrupt {interrupt.name}"), seen


def _owners(linked: Program) -> Mapping[int, str]:
    """Return the name of each node's mission."""
    owners = dict.fromkeys(range(len(linked.nodes)), linked.name)
    for node in linked.nodes:
        if node.inner:
            owners.update(dict.fromkeys(range(node.number + 1, node.end), node.inner.name))
    return owners

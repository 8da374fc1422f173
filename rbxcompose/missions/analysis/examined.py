"""A mission on a robot as the checks see it: its nodes with their scopes, how each may end, what it claims."""

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from itertools import takewhile

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.missions.analysis.facts import Constants, constants_of
from rbxcompose.missions.analysis.scope_types import NodeScope, View, base_scope, views
from rbxcompose.missions.program.machines import MachineStates
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, ANY, FAILS, SUCCEEDS, Outcomes
from rbxcompose.missions.program.program import END, MissionNode, Program, RobotNames


def claims_of(program: Program, robot: RobotNames, within: tuple[str, ...] = ()) -> frozenset[str]:
    """Return everything that a mission claims, including what the missions it uses claim."""
    return frozenset(name for name, _ in claims_below(program.nodes, robot, within))


def claims_below(
    nodes: tuple[MissionNode, ...], robot: RobotNames, within: tuple[str, ...] = ()
) -> Iterator[tuple[str, Span]]:
    """Yield the claims of nodes, each with its span; `within` are missions that are already being examined."""
    for node in nodes:
        skill = robot.skills.get(node.skill)
        if skill and skill.claims:
            yield skill.claims, node.span
        name = node.step.uses.text if node.step.uses else ""
        if name in robot.missions and name not in within:
            if name not in robot.claims:
                robot.claims[name] = claims_of(robot.missions[name], robot, (*within, name))
            for claim in robot.claims[name]:
                yield claim, node.span


Leads = Mapping[str, frozenset[str]]  # the states and ends that each state leads to, by its name


def transitions(program: Program) -> Iterator[tuple[MachineStates, list[MissionNode], Leads]]:
    """Yield each machine, its states in the order of the text, and where each leads to."""
    for node in program.nodes:
        if node.step.states:
            states = [program.nodes[child] for child in node.children]
            yield node.step.states, states, {state.name: _targets(state) for state in states}


def reached(start: str, leads: Leads) -> frozenset[str]:
    """Return all states and ends that can be reached from a state, including the state itself."""
    found, open_ones = {start}, [start]
    while open_ones:
        new = leads.get(open_ones.pop(), frozenset()) - found
        found.update(new)
        open_ones.extend(new)
    return frozenset(found)


def leading_to(goals: Iterable[str], leads: Leads) -> frozenset[str]:
    """Return all states and ends from which one of `goals` can be reached, including the goals."""
    back: dict[str, set[str]] = {}
    for name, targets in leads.items():
        for target in targets:
            back.setdefault(target, set()).add(name)
    found = set(goals)
    open_ones = list(found)
    while open_ones:
        new = back.get(open_ones.pop(), set()) - found
        found |= new
        open_ones.extend(new)
    return frozenset(found)


def _targets(state: MissionNode) -> frozenset[str]:
    return frozenset(state.step.leads_to.to.values() if state.step.leads_to else ())


class Ending:
    """Finds how the nodes of a mission may end."""

    def __init__(self, program: Program, robot: RobotNames, within: tuple[str, ...] = ()) -> None:
        self.program = program
        self.robot = robot
        self.within = within  # missions that are being examined
        self._known: dict[int, Outcomes] = {}

    @cached_property
    def constants(self) -> Constants:
        """Return the data that nothing changes."""
        return constants_of(self.program, {})

    def of(self, number: int, /) -> Outcomes:
        """Return how a node may end, its modifiers included."""
        if number not in self._known:
            self._known[number] = self.inside_of(self.program.nodes[number])
        return self._known[number]

    def inside_of(self, node: MissionNode, key: str = "") -> Outcomes:
        """Return the outcomes of a node inside its modifier `key`; without a key, with all its modifiers."""
        found = node.step.may_end(node, self)
        for name in takewhile(lambda modifier: modifier != key, reversed(tuple(node.modifiers))):
            found = node.modifiers[name].changed(found)
        return found

    def mission(self) -> Outcomes:
        """Return how the mission may end."""
        found = self.of(self.program.main)
        for interrupt in self.program.interrupts:
            reaction = ALWAYS_SUCCEEDS if interrupt.root is None else self.of(interrupt.root)
            found = found.both(Outcomes(interrupt.afterwards == END, reaction.counting_as(FAILS)))
        for result in (node.step.ends_mission for node in self.program.nodes if node.step.ends_mission):
            found = found.both(Outcomes(result == SUCCEEDS, result == FAILS))
        return found

    def of_mission(self, name: str, /) -> Outcomes:
        """Return how another mission may end."""
        program, known = self.robot.missions.get(name), self.robot.ends
        if program is None or name in self.within:
            return ANY
        if name not in known:
            known[name] = Ending(program, self.robot, (*self.within, name)).mission()
        return known[name]

    def of_branches(self, node: MissionNode) -> dict[str, Outcomes]:
        """Return how each branch of a node may end, by its name."""
        names = node.step.branches.names if node.step.branches else ()
        return {name: self.of(child) for name, child in zip(names, node.children, strict=False)}


@dataclass(frozen=True)
class Examined:
    """A mission, and what the robot offers it."""

    program: Program
    robot: RobotNames

    @cached_property
    def views(self) -> tuple[View, ...]:
        """Return each node with its scope, in the order of the text."""
        return tuple(views(self.program, self.robot))

    @cached_property
    def scope(self) -> NodeScope:
        """Return the scope of the whole mission."""
        return base_scope(self.program, self.robot)

    @cached_property
    def ending(self) -> Ending:
        """Return the analyser of how nodes may end."""
        return Ending(self.program, self.robot)

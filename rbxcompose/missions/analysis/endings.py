"""How the nodes of a mission may end, as far as the text shows: the outcomes that machines need transitions for."""

from __future__ import annotations

from functools import cached_property
from itertools import takewhile

from rbxcompose.missions.analysis.facts import Constants, constants_of
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, ANY, FAILS, SUCCEEDS, Outcomes
from rbxcompose.missions.program.program import END, MissionNode, Program, RobotNames


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
        for name in takewhile(lambda one: one != key, reversed(tuple(node.modifiers))):
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

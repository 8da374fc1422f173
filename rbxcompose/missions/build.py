"""From a program to its tasks: one per node, with a task around it for each of its modifiers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.missions.modifiers import MODIFIERS, Modifier
from rbxcompose.missions.program import Node, Program, RobotNames
from rbxcompose.missions.registry import kinds
from rbxcompose.missions.scopes import ItemScope, MissionScope, SinceScope, new_names
from rbxcompose.missions.skill import SkillTask
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.engine import Engine


class Since(Modifier):
    """Counts messages from the start of its node, outermost around one that asks `new($x)`."""

    __slots__ = ("view",)

    def __init__(self, site: Site, options: SinceScope, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.view = options

    def begin(self) -> int:
        """Count from now on."""
        self.view.mark()
        return self.advance(self.inner)


class Builder:
    """Makes the tasks of one engine; `leaves` are those of skills, by node number."""

    def __init__(self, engine: Engine, program: Program, robot: RobotNames) -> None:
        self.engine = engine
        self.program = program
        self.robot = robot
        self.leaves: dict[int, SkillTask] = {}

    def build(self, number: int, scope: MissionScope) -> Task:
        """Return the outermost task of a node, with all below it.

        Raises:
            KeyError: if the robot has no such skill; `check_program` finds that before.
        """
        node = self.program.nodes[number]
        names = frozenset[str]().union(*(new_names(asked.expression) for asked in node.asked))
        since = SinceScope(scope, names) if names else None
        own: MissionScope = since or scope
        item = ItemScope(own, node.item) if node.item else None
        children = tuple(self.build(child, item or own) for child in node.children)
        site = Site(self.engine, node, own, children, item)
        task = kinds()[node.kind].task(site, node.options) if node.kind else self._skill(site, node)
        for name in reversed(MODIFIERS):
            if name in node.modifiers:
                task = MODIFIERS[name](site, node.modifiers[name], task)
        return Since(site, since, task) if since else task

    def _skill(self, site: Site, node: Node) -> Task:
        task = self.leaves[node.number] = SkillTask(site, self.robot.skills[node.skill], node.arguments)
        return task

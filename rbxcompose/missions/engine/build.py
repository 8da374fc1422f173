"""Builds the tasks of a program: one per node, with a task around it for each of its modifiers."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.missions.engine.engine_base import EngineBase
from rbxcompose.missions.engine.leaf import Leaf
from rbxcompose.missions.engine.observers import Branch, NamedObserver, Observed, Since
from rbxcompose.missions.engine.run import Run
from rbxcompose.missions.engine.scopes import ItemScope, MissionScope, SinceScope
from rbxcompose.missions.engine.since import since_scope
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.modifiers.registry import decorator_of
from rbxcompose.missions.program.history import WithHistory
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames
from rbxcompose.missions.program.registry import task_of


class Builder:
    """Builds the runs and tasks of one engine; `leaves` are the tasks that wait for results, by node number."""

    def __init__(self, engine: EngineBase, robot: RobotNames) -> None:
        self.engine = engine
        self.robot = robot
        self.nodes = engine.program.nodes
        self.leaves: dict[int, Leaf] = {}
        self.tasks: list[Task] = []
        self.runs: list[Run] = []

    def run(self, program: Program) -> Run:
        """Return the run of a mission with all its tasks, including those below a `use`."""
        run = Run(self.engine, program, self.robot)
        self.runs.append(run)
        run.mission.root = self.build(program.main, run, run.scope)
        for interrupt, reaction in zip(program.interrupts, run.reactions, strict=True):
            if interrupt.root is not None:
                reaction.root = self.build(interrupt.root, run, run.scope)
        return run

    def build(self, number: int, run: Run, scope: MissionScope, branch: str = "") -> Task:
        """Return the outermost task of a node, with all tasks below it; `branch` is its name in a parallel above.

        Raises:
            KeyError: if the robot has no such skill; `check_program` reports that earlier.
        """
        node = self.nodes[number]
        view = since_scope(scope, node.asked, self.robot, run.program)
        since = view if view.is_needed else None
        own: MissionScope = since or scope
        item = ItemScope(own, node.item) if node.item else None
        inner = self.run(node.inner) if node.inner else None
        children = () if node.inner else tuple(self._below(node, run, item or own))
        site = Site(self.engine, run, node, own, children, item, inner)
        task = self._kept(self._inside(site, run))
        for modifier in reversed(tuple(node.modifiers.values())):
            task = self._kept(decorator_of(modifier, site, task))
        return self._around(site, since, task, branch)

    def _below(self, node: MissionNode, run: Run, scope: MissionScope) -> Iterator[Task]:
        names = node.step.branches.names if node.step.branches else ()
        for child, branch in zip(node.children, names or ("",) * len(node.children), strict=True):
            yield self.build(child, run, scope, branch)

    def _inside(self, site: Site, run: Run) -> Task:
        task = task_of(site)
        if isinstance(task, Leaf):
            self.leaves[site.node.number] = task
        if isinstance(task, WithHistory) and task.number == run.program.main:
            run.keepers.append(task)
        return task

    def _around(self, site: Site, since: SinceScope | None, task: Task, branch: str) -> Task:
        """Return the task, wrapped in the tasks that belong to no modifier."""
        node = site.node
        if since:
            task = self._kept(Since(site, since, task))
        if node.name:
            task = self._kept(NamedObserver(site, node.name, task))
        elif branch:
            task = self._kept(Branch(site, branch, task))
        if self.engine.settings.observer:
            task = self._kept(Observed(site, self.engine.settings.observer, task))
        return task

    def _kept(self, task: Task) -> Task:
        self.tasks.append(task)
        return task

"""Builds the tasks of a program: one per node, with a task around it for each of its modifiers and observers."""

from collections.abc import Iterator
from typing import Any

from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.missions.analysis.examined import NodeScope
from rbxcompose.missions.engine.events import BranchEnded, NodeEnded, NodeStarted
from rbxcompose.missions.engine.task import EngineBase, Leaf, MovedChildren, Run, Site, Task, since_scope
from rbxcompose.missions.engine.world import ItemScope, MissionScope, Observer, SinceScope, item_types
from rbxcompose.missions.program.families import Decorator, WithHistory
from rbxcompose.missions.program.outcomes import IDLE, NAMES, RUNNING
from rbxcompose.missions.program.parts import Form
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames
from rbxcompose.missions.program.registry import decorator_of, task_of


class Since(Decorator):
    """Counts messages from the start of a node that uses `new($x)`."""

    __slots__ = ("view",)
    saved = ("seen",)

    def __init__(self, site: Site, options: SinceScope, inner: Task) -> None:
        super().__init__(site, inner)
        self.view = options

    @property
    def seen(self) -> dict[str, int]:
        """Return how many messages of each name had arrived when it started."""
        return self.view.seen

    @seen.setter
    def seen(self, seen: dict[str, int]) -> None:
        self.view.seen = seen

    def adapted(self, state: dict[str, Any], children: MovedChildren) -> dict[str, Any]:
        """Count on; what is newly counted counts from now on."""
        self.view.mark()
        return {"seen": {name: state["seen"].get(name, count) for name, count in self.seen.items()}}

    def begin(self) -> int:
        """Count from now on."""
        self.view.mark()
        return self.advance(self.inner)


class Around(Decorator):
    """A task notified when its node starts, ends or is halted; a restart after an interrupt counts as halted."""

    __slots__ = ()

    def begin(self) -> int:
        """Report that it starts."""
        self.started()
        return self.proceed()

    def proceed(self) -> int:
        """Continue, and report if it ends."""
        status = self.advance(self.inner)
        if status != RUNNING:
            self.ended(status)
        return status

    def halt(self) -> None:
        """Report that it is halted."""
        super().halt()
        self.ended(IDLE)

    def suspend(self, from_start: bool) -> bool:
        """Report that it is halted, if it starts again."""
        starts_over = super().suspend(from_start)
        if starts_over:
            self.ended(IDLE)
        return starts_over

    def started(self) -> None:
        """Handle the start of the node."""
        raise NotImplementedError

    def ended(self, status: int) -> None:
        """Handle the end of the node; IDLE means that it was halted."""
        raise NotImplementedError

    def how(self, status: int) -> str:
        """Return the word for how the node ended: its own outcome, if it has one, else its status."""
        return "halted" if status == IDLE else self.engine.outcome or NAMES[status]


class NamedObserver(Around):
    """Reports when a named node or a state starts and ends."""

    __slots__ = ("is_state", "name")

    def __init__(self, site: Site, options: str, inner: Task) -> None:
        super().__init__(site, inner)
        self.name = options
        self.is_state = site.node.step.look.form is Form.STATE

    def started(self) -> None:
        """Report it."""
        self.engine.say(NodeStarted(self.number, self.name, self.is_state))

    def ended(self, status: int) -> None:
        """Report it."""
        self.engine.say(NodeEnded(self.number, self.name, self.how(status), self.is_state))


class Branch(Around):
    """Reports when a branch of a parallel ends; its start shows in what it does first."""

    __slots__ = ("name",)

    def __init__(self, site: Site, options: str, inner: Task) -> None:
        super().__init__(site, inner)
        self.name = options

    def started(self) -> None:
        """Report nothing."""

    def ended(self, status: int) -> None:
        """Report it."""
        self.engine.say(BranchEnded(self.number, self.name, self.how(status)))


class Observed(Around):
    """Notifies an observer, and counts the work: whoever runs an engine with an observer can limit it."""

    __slots__ = ("observer",)

    def __init__(self, site: Site, options: Observer, inner: Task) -> None:
        super().__init__(site, inner)
        self.observer = options

    def proceed(self) -> int:
        """Count it, and continue."""
        self.engine.work += 1
        return super().proceed()

    def started(self) -> None:
        """Report it."""
        self.observer.started(self.number)

    def ended(self, status: int) -> None:
        """Report it."""
        self.observer.ended(self.number, status, self.engine.outcome)


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
        item = ItemScope(own, node.item, self._type_of_item(node, run, own)) if node.item else None
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

    def _type_of_item(self, node: MissionNode, run: Run, scope: MissionScope) -> Type:
        names = {**run.types, **item_types(scope)}
        return node.step.shows(node, NodeScope(names, self.robot.places)).get(node.item, UNKNOWN)

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

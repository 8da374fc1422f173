"""The exchange of a mission that runs for a changed one: a new engine goes on where the old one is.

What runs must be in both. A leaf that runs and says the same keeps its request; one that says something else begins
again. Everything else that runs keeps its place, and its new options count from its next start, except for what it
evaluates at each tick. The old engine is only read: if the exchange is impossible, it goes on.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import NOT_ARRIVED
from rbxcompose.missions.engine.debugger import Probed, named
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.interventions import NotPossible
from rbxcompose.missions.engine.snapshot import OF_ENGINE, OF_RUN
from rbxcompose.missions.engine.task import Course, Leaf, MovedChildren, Run, Task
from rbxcompose.missions.language.literals import HeldNode
from rbxcompose.missions.program.counterparts import Pairing
from rbxcompose.missions.program.families import Decorator, InTurnTask
from rbxcompose.missions.program.outcomes import RUNNING
from rbxcompose.missions.program.program import MissionNode


@dataclass(frozen=True, slots=True)
class Exchanged:
    """What came of an exchange, for the world of the mission and for people.

    `nodes` are the numbers now of the nodes before that are still there. `requests` are the leaves whose requests go
    on, by their numbers before; `halted` are those whose requests are to be stopped. `notes` say what happens to what
    runs and has changed.
    """

    nodes: Mapping[int, int] = field(default_factory=dict)
    requests: Mapping[int, int] = field(default_factory=dict)
    halted: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()


def exchange(old: Engine, new: Engine) -> Exchanged:
    """Let `new`, which was just made, go on where `old` is.

    Raises:
        NotPossible: if something that runs is no longer there, or cannot go on; both are as before then, and `new` is
            of no use.
    """
    return _Exchange(old, new).done()


class _Exchange:
    """One exchange, step by step; the first steps find out whether it is possible."""

    def __init__(self, old: Engine, new: Engine) -> None:
        self.old, self.new = old, new
        self.pairing = Pairing(old.program, new.program)
        self.before, self.after = self.pairing.before, self.pairing.after
        self.live = old.debugger.live()
        self.waiting = {number for number, is_waiting, _ in old.debugger.pending() if is_waiting}
        self.old_tasks, self.new_tasks = _by_node(old.tasks), _by_node(new.tasks)
        self.counterparts = dict(self._counterparts())
        self.running = {task for above in old.tasks for task in above.running()} | {
            course.current for run in old.runs for course in run.courses if course.current is not None
        }
        self.restarted = frozenset(self._restarted())
        self.astray: set[Task] = set()  # those that kept their place at something that is gone
        self.notes: list[str] = []

    def done(self) -> Exchanged:
        self._refuse_lost()
        for run, before in self._runs():
            self._take_run(run, before)
        for number, inside in self.pairing.around.items():
            if inside in self.live:
                self._put_around(number)
        for number, tasks in self.new_tasks.items():
            if number in self.before:
                self._take_node(number, tasks)
        self._take_engine()
        asked = [task.number for task in self.old.tasks if isinstance(task, Leaf) and task.is_asked]
        goes_on = {leaf: self.after[leaf] for leaf in asked if self.after.get(leaf, -1) not in {*self.restarted, -1}}
        notes = (*self.notes, *self._changes())
        return Exchanged(self.after, goes_on, tuple(leaf for leaf in asked if leaf not in goes_on), notes)

    # What stands for what

    def _counterparts(self) -> Iterator[tuple[Task, Task]]:
        """Yield the tasks of the new engine with those of the old one: of each node, those of a class in order."""
        for number, before in self.before.items():
            left = list(self.old_tasks[before])
            for task in self.new_tasks[number]:
                found = next((one for one in left if _class(one) is _class(task)), None)
                if found is not None:
                    del left[: left.index(found) + 1]
                    yield task, found

    def _restarted(self) -> Iterator[int]:
        """Yield the leaves that run and say something else: they begin again."""
        for before in sorted(self.live & self.after.keys() - self.waiting):
            number = self.after[before]
            is_leaf = not self.new.program.nodes[number].children and not self.old.program.nodes[before].children
            if is_leaf and not self.pairing.says_the_same(number):
                yield number

    def _runs(self) -> Iterator[tuple[Run, Run]]:
        """Yield the runs of the new engine with those of the old one: of the mission, and of each `use`."""
        yield self.new.main, self.old.main
        now, before = _inner_runs(self.new), _inner_runs(self.old)
        yield from ((run, before[self.before[number]]) for number, run in now.items() if number in self.before)

    def _refuse_lost(self) -> None:
        """Raise NotPossible if something that runs is gone, or may not begin again."""
        nodes = self.old.program.nodes
        for number in sorted(self.live - self.after.keys() - self.pairing.opened.keys()):
            raise NotPossible(f"{_shown(nodes[number])} runs, and would be gone or elsewhere")
        for number in sorted(self.restarted):
            leaf = self.old_tasks[self.before[number]][0]
            if isinstance(leaf, Leaf) and leaf.is_asked and not leaf.is_restartable:
                raise NotPossible(f"{_shown(nodes[leaf.number])} runs, would change, and may not be started again")

    # What is taken over

    def _take_run(self, run: Run, before: Run) -> None:
        for name in OF_RUN:
            setattr(run, name, getattr(before, name))
        if not before.begun:
            return
        self._take_values(run, before)
        courses: dict[Course, Course] = {before.mission: run.mission}
        known = {reaction.name: reaction for reaction in before.reactions}
        for reaction in run.reactions:
            reaction.scope.mark()
            if (was := known.get(reaction.name)) is not None:
                courses[was] = reaction
                reaction.is_armed, reaction.trouble = was.is_armed, was.trouble
                reaction.scope.seen |= {
                    name: was.scope.seen.get(name, count) for name, count in reaction.scope.seen.items()
                }
        if gone := next((course for course in before.stack if course not in courses), None):
            raise NotPossible(f"the interrupt '{getattr(gone, 'name', '')}' acts, and would be gone")
        for course, now in courses.items():
            runs = course.current is not None and now.root is not None and now.root.number not in self.restarted
            now.current = now.root if runs else None
            now.lost, now.left = course.lost, course.left
        run.stack[:] = [courses[course] for course in before.stack]
        run.returns[:] = [tuple(self.after[leaf] for leaf in back if leaf in self.after) for back in before.returns]
        orders = [course.order for course in run.stack]
        if orders != sorted(orders, reverse=True):
            raise NotPossible("interrupts that act would change their order")

    def _take_values(self, run: Run, before: Run) -> None:
        """Keep data and inputs of the same name and type; others begin with what the mission says."""
        program, known = run.program, before.program
        run.data.update(dict.fromkeys(program.saved, NOT_ARRIVED))
        run.data.update((name, datum.value) for name, datum in program.data.items())
        for name, value in before.data.items():
            declared = program.data.get(name)
            is_same = name in program.saved or (
                declared is not None and name in known.data and known.data[name].type == declared.type
            )
            if is_same:
                run.data[name] = value
            elif declared is not None:
                self.notes.append(f"'{name}' has another type: it begins with {run.show(name, declared.value)}")
        held = {node.held for node in self.new.program.nodes}
        for name, value in run.data.items():
            if any(one.key not in held for one in _held_in(value)):
                raise NotPossible(f"'{name}' holds a node that would be gone")
        if run is self.new.main:
            run.inputs.update(self.new.inputs)
            return
        for name, wanted in program.inputs.items():
            if name in before.inputs and known.inputs[name].type == wanted.type:
                run.inputs[name] = before.inputs[name]
            elif wanted.default is not None:
                run.inputs[name] = wanted.default.value
            else:
                raise NotPossible(f"mission '{program.name}' runs, and would need the input '{name}'")

    def _take_node(self, number: int, tasks: Sequence[Task]) -> None:
        before = self.before[number]
        runs = before in self.live and number not in self.restarted
        if number not in self.restarted:
            self.new.statuses[number] = self.old.statuses[before]
        for task in tasks:
            known = self.counterparts.get(task)
            if known is None:
                if runs and before not in self.waiting and task.saved:
                    self._refuse_added(number)
            elif number not in self.restarted or isinstance(task, Decorator):
                self._take_task(task, known)
            if runs and isinstance(task, Decorator) and self._runs_inside(task.inner):
                task.current = task.inner

    def _take_task(self, task: Task, known: Task) -> None:
        children = self._moved(task.number)
        state = {name: copy(getattr(known, name)) for name in known.saved}
        for name, value in task.adapted(state, children).items():
            setattr(task, name, value)
        if not isinstance(task, Decorator) and known.current is not None:
            task.current = self._running(self._child(task.number, known.current.number))
        if children.is_astray:
            self.astray.add(task)
        task.restored()

    def _child(self, number: int, before: int) -> int:
        """Return the child of a node that goes on for a node before, or has been put around it."""
        now = self.after[before] if before in self.after else self.pairing.opened[before]
        while (above := self.new.program.nodes[now].parent) != number and above is not None:
            now = above
        return now

    def _running(self, child: int) -> Task | None:
        """Return the task of a child that goes on; None if it begins again."""
        return None if child in self.restarted else self.new_tasks[child][-1]

    def _put_around(self, number: int) -> None:
        """Let a new list run, since the node that it was put around does."""
        node, before = self.new.program.nodes[number], self.pairing.around[number]
        for task in self.new_tasks[number]:
            if isinstance(task, Decorator):
                if task.saved:
                    raise NotPossible(f"{_shown(node)} would be around what runs: its options count from its start")
                task.current = task.inner
            elif isinstance(task, InTurnTask):
                child = self._child(number, before)
                task.current, task.index = self._running(child), node.children.index(child)
        self.new.statuses[number] = RUNNING

    def _moved(self, number: int) -> MovedChildren:
        new, old = self.new.program.nodes[number].children, self.old.program.nodes[self.before[number]].children
        came_from = {child: self.pairing.around.get(child, self.before.get(child)) for child in new}
        lists = {now: before for before, now in self.pairing.opened.items()}
        places = {child: lists.get(child, before) for child, before in came_from.items()}
        moved = {old.index(before): at for at, child in enumerate(new) if (before := places[child]) in old}
        restarted = frozenset(at for at, child in enumerate(new) if child in self.restarted)
        return MovedChildren(moved, len(old), len(new), restarted)

    def _runs_inside(self, inner: Task) -> bool:
        """Return whether the task inside a decorator runs, by what stands for it or for the next one further inside."""
        while inner not in self.counterparts and isinstance(inner, Decorator):
            inner = inner.inner
        return self.counterparts.get(inner) in self.running

    def _refuse_added(self, number: int) -> None:
        node, known = self.new.program.nodes[number], self.old.program.nodes[self.before[number]]
        added = [key for key in node.modifiers if key not in known.modifiers]
        what = f"'{added[0]}'" if added else "what counts from its start"
        raise NotPossible(f"{_shown(node)} runs: {what} cannot be added to it before it starts again")

    def _take_engine(self) -> None:
        old, new, after = self.old, self.new, self.after
        for name in OF_ENGINE:
            setattr(new, name, getattr(old, name))
        nodes = [
            (old.program.nodes[before].span.place, new.program.nodes[now].span.place) for before, now in after.items()
        ]
        places = dict(nodes)
        new.reading, new.named = set(old.reading), {places.get(place, place) for place in old.named}
        new.reasons = {after[number]: reason for number, reason in old.reasons.items() if number in after}
        kept = {now for now, before in self.counterparts.items() if before in old.places.kept}
        new.places.kept = {*kept - self.astray}
        goes_on = {before: now for before, now in after.items() if now not in self.restarted}
        new.arrived = [(goes_on[leaf], result) for leaf, result in old.arrived if leaf in goes_on]
        new.stops[:] = [goes_on[number] for number in old.stops if number in goes_on]
        new.debugger.take_up(
            [(goes_on[number], *rest) for number, *rest in old.debugger.pending() if number in goes_on]
        )

    # What people should know

    def _changes(self) -> Iterator[str]:
        """Yield what happens to the nodes that run and have changed."""
        for before in sorted(self.live & self.after.keys()):
            node = self.new.program.nodes[self.after[before]]
            if node.number in self.restarted:
                yield f"{_shown(node)} runs and has changed: it begins again"
            elif node.children and not self.pairing.has_same_options(node.number):
                yield f"{_shown(node)} runs and has changed: what it reads at its start counts from its next one"


def _class(task: Task) -> type[Task]:
    return task.plain if isinstance(task, Probed) else type(task)


def _by_node(tasks: Sequence[Task]) -> Mapping[int, list[Task]]:
    """Return the tasks of each node, from the inside out."""
    found: defaultdict[int, list[Task]] = defaultdict(list)
    for task in tasks:
        found[task.number].append(task)
    return found


def _inner_runs(engine: Engine) -> Mapping[int, Run]:
    """Return the runs of the missions that others use, by the number of the `use`."""
    found = ((task.number, getattr(task, "inner", None)) for task in engine.tasks)
    return {number: inner for number, inner in found if isinstance(inner, Run)}


def _held_in(value: object) -> Iterator[HeldNode]:
    match value:
        case HeldNode():
            yield value
        case list() | tuple():
            for item in value:
                yield from _held_in(item)
        case Mapping():
            for item in value.values():
                yield from _held_in(item)


def _shown(node: MissionNode) -> str:
    return f"{node.span.place}: '{named(node)}'"

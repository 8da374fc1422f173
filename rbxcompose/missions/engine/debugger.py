"""The debugger of an engine: breakpoints, steps, forced results, changed data and jumps.

A breakpoint replaces the class of the one task that it concerns by a subclass that asks for its probe. All other tasks
run as if there were no debugger.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from types import new_class
from typing import Any, ClassVar, assert_never, cast

from rbxcompose.missions.engine.build import Around
from rbxcompose.missions.engine.events import Intervened, Stopped
from rbxcompose.missions.engine.interventions import (
    ChangeData,
    ForceResult,
    Intervention,
    JumpToState,
    NotPossible,
    SetBreakpoints,
    TakeStep,
)
from rbxcompose.missions.engine.task import EngineBase, NodeProbe, Run, Task, result_word
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, RUNNING, SUCCESS
from rbxcompose.missions.program.program import NOTHING, MissionNode, Program, Target

BY_HAND = "ended by hand"


class Probed(Task):
    """A task that asks for its probe whenever it starts or ends. What has not begun, or has ended, is left alone."""

    __slots__ = ()
    plain: ClassVar[type[Task]]

    def start(self) -> int:
        """Start, or stop the mission before that."""
        probe = self.engine.probes[self.number]
        stops = probe.starts or probe.steps_in
        if not stops or (probe.only_first and self.statuses[self.number] != IDLE):
            return self._through(super().start(), probe)
        probe.is_waiting = True
        return self._stopped("")

    def tick(self) -> int:
        """Start what has waited, end what has ended meanwhile, or continue."""
        probe = self.engine.probes[self.number]
        if probe.result is not None:
            (status, self.engine.outcome), probe.result = probe.result, None
            self.statuses[self.number] = status
            return status
        if probe.is_waiting:
            probe.is_waiting = False
            return self._through(super().start(), probe)
        return self._through(super().tick(), probe)

    def halt(self) -> None:
        """Stop what runs."""
        probe = self.engine.probes[self.number]
        if not probe.is_pending:
            super().halt()
            return
        probe.is_waiting, probe.result = False, None
        self.statuses[self.number] = IDLE
        if self.number in self.engine.stops:
            self.engine.stops.remove(self.number)

    def suspend(self, from_start: bool) -> bool:
        """Suspend what runs."""
        return not self.engine.probes[self.number].is_pending and super().suspend(from_start)

    def restart(self, target: Target) -> bool:
        """Restart the target, if it runs below."""
        return not self.engine.probes[self.number].is_pending and super().restart(target)

    def running(self) -> tuple[Task, ...]:
        """Return the tasks below that run now."""
        return () if self.engine.probes[self.number].is_pending else super().running()

    def _through(self, status: int, probe: NodeProbe) -> int:
        """Return a status, unless the mission stops at the transition to which it leads."""
        if status == RUNNING or not (probe.ends or probe.steps_out):
            return status
        outcome = self.engine.outcome or result_word(status)
        leads = self.engine.program.nodes[self.number].step.leads_to
        key = leads.key_for(outcome, result_word(status)) if leads else None
        if leads is None or key is None or not (probe.steps_out or key in probe.ends):
            return status
        probe.result = status, self.engine.outcome
        self.engine.outcome = ""
        return self._stopped(f"{outcome}, on to {leads.to[key]}")

    def _stopped(self, after: str) -> int:
        engine, node = self.engine, self.engine.program.nodes[self.number]
        engine.stops.append(self.number)
        self.statuses[self.number] = RUNNING
        engine.say(Stopped(self.number, node.span.place, named(node), after))
        return RUNNING


@cache
def _probed(cls: type[Task]) -> type[Probed]:
    """Return the class of tasks of a kind that have a probe: of the same layout, so that a task can change to it."""
    made = new_class(
        f"Probed{cls.__name__}", (Probed, cls), exec_body=lambda body: body.update(__slots__=(), plain=cls)
    )
    return cast("type[Probed]", made)


def named(node: MissionNode) -> str:
    """Return what people call a node."""
    return node.name or f"{node.step.word} {node.step.text(node)}".strip()


class Debugger:
    """What people do to the tasks of one engine."""

    def __init__(
        self, engine: EngineBase, tasks: Sequence[Task], runs: Sequence[Run], take_results: Callable[[], None]
    ) -> None:
        self._engine, self._all, self._runs, self._take_results = engine, tasks, runs, take_results
        self._outer: dict[int, Task] = {}  # the task around each node and its modifiers, by node number
        self._inner: dict[int, Task] = {}  # the task of each node without its modifiers

    @property
    def _program(self) -> Program:
        return self._engine.program

    def do(self, intervention: Intervention) -> None:
        """Do what a person wants; raise `NotPossible` if that cannot be done."""
        self._find_tasks()
        match intervention:
            case SetBreakpoints():
                self._set(intervention)
            case TakeStep():
                self._step()
            case ForceResult():
                self._force(intervention)
            case ChangeData():
                self._change(intervention)
            case JumpToState():
                self._jump(intervention)
            case _:
                assert_never(intervention)

    def release(self) -> None:
        """Let the mission go on from where it was stopped; that ends a step."""
        if self._engine.stops:
            self._engine.stops.clear()
            for probe in self._engine.probes.values():
                probe.steps_in = probe.steps_out = False
            self._settle()

    def pending(self) -> list[list[Any]]:
        """Return the nodes that only seem to run, as data: number, whether it has not begun, how it will end."""
        probes = self._engine.probes.items()
        return [
            [number, probe.is_waiting, list(probe.result) if probe.result else None]
            for number, probe in sorted(probes)
            if probe.is_pending
        ]

    def outcomes(self) -> dict[int, str]:
        """Return the outcomes of the nodes that have ended, and whose mission was stopped before it took notice."""
        probes = self._engine.probes.items()
        return {number: probe.result[1] or result_word(probe.result[0]) for number, probe in probes if probe.result}

    def take_up(self, pending: Sequence[Sequence[Any]]) -> None:
        """Restore what `pending` returned; there are no breakpoints then."""
        if not pending and not self._engine.probes:
            return
        self._find_tasks()
        for probe in self._engine.probes.values():
            probe.is_waiting, probe.result = False, None
        for number, is_waiting, result in pending:
            probe = self._probe(number)
            probe.is_waiting, probe.result = is_waiting, (result[0], result[1]) if result else None
        self._settle()

    def live(self) -> frozenset[int]:
        """Return the nodes that run or are suspended, with those at which the mission was stopped."""
        courses = (course for run in self._runs for course in run.stack)
        return frozenset(task.number for course in courses if course.current for task in _below(course.current))

    def _find_tasks(self) -> None:
        for task in () if self._outer else self._all:
            self._inner.setdefault(task.number, task)
            if not isinstance(task, Around):
                self._outer[task.number] = task

    def _set(self, wanted: SetBreakpoints) -> None:
        numbers = {*wanted.starts, *(number for number, _ in wanted.ends)}
        if not all(0 <= number < len(self._program.nodes) for number in numbers):
            raise NotPossible("the mission has no such node")
        for probe in self._engine.probes.values():
            probe.starts, probe.ends = False, NOTHING
        for number in wanted.starts:
            self._probe(number).starts = True
        for number, outcome in wanted.ends:
            probe = self._probe(number)
            probe.ends |= {outcome}
        self._settle()

    def _step(self) -> None:
        self._engine.stops.clear()
        for node in self._program.nodes:
            if not node.children:
                self._probe(node.number).steps_in = True
            elif node.step.leads_to:
                self._probe(node.number).steps_out = True

    def _force(self, wanted: ForceResult) -> None:
        node = self._live_node(wanted.node)
        self._take_results()
        engine, probe = self._engine, self._probe(wanted.node)
        word = wanted.outcome or result_word(SUCCESS if wanted.succeeds else FAILURE)
        engine.say(Intervened(f"{node.span.place}, {named(node)} ends in {word}"))
        if not probe.is_pending:
            engine.because = BY_HAND
            self._outer[wanted.node].halt()
            engine.because = engine.outcome = ""
        probe.is_waiting, probe.result = False, (SUCCESS if wanted.succeeds else FAILURE, wanted.outcome)
        engine.statuses[wanted.node] = RUNNING
        if not wanted.succeeds:
            engine.reasons[wanted.node] = BY_HAND

    def _change(self, wanted: ChangeData) -> None:
        if wanted.name not in self._program.data:
            raise NotPossible(f"the mission has no data '{wanted.name}'")
        self._runs[0].data[wanted.name] = wanted.value
        self._engine.say(Intervened(f"{wanted.name} = {show(self._program.data[wanted.name].type, wanted.value)}"))

    def _jump(self, wanted: JumpToState) -> None:
        node = self._live_node(wanted.machine)
        states = node.step.states
        if states is None or wanted.state not in states.names:
            raise NotPossible(f"'{named(node)}' has no state '{wanted.state}'")
        if (probe := self._engine.probes.get(node.number)) and probe.is_pending:
            raise NotPossible(f"the machine at {node.span.place} is stopped before its start or after its end")
        self._take_results()
        self._engine.say(Intervened(f"{node.span.place}, jump to state {wanted.state}"))
        self._engine.because = BY_HAND
        self._inner[node.number].jump(wanted.state)
        self._engine.because = self._engine.outcome = ""

    def _live_node(self, number: int) -> MissionNode:
        if number not in self.live():
            raise NotPossible("the node does not run")
        return self._program.nodes[number]

    def _probe(self, number: int) -> NodeProbe:
        """Return the probe of a node; it gets one if it has none."""
        if number not in self._engine.probes:
            task = self._outer[number]
            self._engine.probes[number] = NodeProbe(only_first=self._is_asked_again(self._program.nodes[number]))
            task.__class__ = _probed(type(task))
        return self._engine.probes[number]

    def _is_asked_again(self, node: MissionNode) -> bool:
        """Return whether a node is a condition, or a part of one, that a list around it may evaluate at each tick."""
        while node.step.only_asks and node.parent is not None:
            node = self._program.nodes[node.parent]
            if node.step.comes_again:
                return True
        return False

    def _settle(self) -> None:
        """Return nodes to their own classes that need no probe any more."""
        for number in [number for number, probe in self._engine.probes.items() if not probe.is_needed]:
            task = self._outer[number]
            if isinstance(task, Probed):
                task.__class__ = task.plain  # type: ignore[assignment]
            del self._engine.probes[number]


def _below(task: Task) -> Iterator[Task]:
    yield task
    for child in task.running():
        yield from _below(child)

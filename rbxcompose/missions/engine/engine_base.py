"""The engine and its runs as tasks see them: time, statuses, data, what wakes them, who observes them."""

from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Collection, Iterable, Mapping
from functools import reduce
from random import Random
from typing import Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.text import Show, Template, fill
from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.engine import value_text
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.resume_points import ResumableTask, ResumePoints
from rbxcompose.missions.engine.scopes import MissionScope, RunScope, item_types
from rbxcompose.missions.engine.world import Settings, Watched, World
from rbxcompose.missions.program.outcomes import IDLE, NAMES, SKIPPED, SUCCESS, Result
from rbxcompose.missions.program.program import NOTHING, Program, RobotNames, Target

ROUNDING = 1e-6  # [s] tolerance with which a deadline counts as reached


class TickSource(Protocol):
    """Something that may request another tick."""

    @property
    def place(self) -> str:
        """Return its file and line."""
        ...


@dataclass(slots=True)
class NodeProbe:
    """Where a debugger stops the mission at a node, and what has come of that; a node without one never asks.

    `ends` are the transitions of a state that stop it, by the outcomes under which they are written. A step stops at
    the start of a leaf (`steps_in`) and at any transition of a state (`steps_out`). `is_waiting` is a node that was to
    start and has not begun. `result` is the status and the outcome with which a node will end at its next tick.
    """

    starts: bool = False
    ends: frozenset[str] = NOTHING
    steps_in: bool = False
    steps_out: bool = False
    only_first: bool = False  # a condition that a reactive list evaluates again and again
    is_waiting: bool = False
    result: tuple[int, str] | None = None

    @property
    def is_pending(self) -> bool:
        """Return whether the node only seems to run: it has not begun, or has ended."""
        return self.is_waiting or self.result is not None

    @property
    def is_needed(self) -> bool:
        """Return whether the node must still be observed."""
        return self.starts or bool(self.ends) or self.steps_in or self.steps_out or self.is_pending


def result_word(status: int) -> str:
    """Return the result that a status counts as for the transitions of a state."""
    return NAMES[SUCCESS if status == SKIPPED else status]


class EngineBase:
    """The state of an engine, and what tasks do with it. `statuses` holds the status of each node by its number."""

    def __init__(self, program: Program, robot: RobotNames, world: World, settings: Settings) -> None:
        self.program = program
        self.world = world
        self.robot = robot
        self.settings = settings
        self.statuses = [IDLE] * len(program.nodes)
        self.outcome = ""  # the own outcome of the node that ended last; empty if it has none
        self.now = 0.0  # [s] of robot time
        self.time = 0.0  # [s] on the clock of the course being ticked; timers use it
        self.lost = 0.0  # [s] for which the mission was paused; during a pause, minus the time at which it began
        self.because = ""  # why leaves are being halted
        self.cut_short: list[int] = []  # leaves that were halted by the latest suspension
        self.restarting: tuple[Target, ...] = ()  # what starts again after the current suspension
        self.is_aborting = False  # the whole mission is being ended from outside
        self.places = ResumePoints()
        self.reasons: dict[int, str] = {}  # why each node last failed
        self.draws = 0  # random draws so far
        self.work = 0  # how often an observed node was started or continued so far
        self.arrived: list[tuple[int, Result]] = []
        self.wake: float | None = None
        self.reading: set[str] = set()
        self.probes: dict[int, NodeProbe] = {}  # breakpoints and what follows from them, by node number
        self.stops: list[int] = []  # nodes at which probes stopped the mission; the shell then pauses it
        self.wants_again: TickSource | None = None  # what requested another tick at this instant

    @property
    def unpaused(self) -> float:
        """Return robot time without the pauses of the mission [s]; unlike `time`, it continues during interrupts."""
        return self.now - self.lost

    def again(self, by: TickSource) -> None:
        """Request another tick at this instant."""
        self.wants_again = by

    def is_past(self, time: float) -> bool:
        """Return whether a time on the clock of this course [s] has been reached."""
        return time - self.time <= ROUNDING

    def has_gone_by(self, seconds: float, since: float) -> bool:
        """Return whether this many seconds have passed since a time of `unpaused`."""
        return seconds - (self.unpaused - since) <= ROUNDING

    def chance(self) -> Random:
        """Return a random source for one draw, which depends only on the seed and the number of earlier draws."""
        self.draws += 1
        return Random(f"{self.settings.seed}/{self.draws}")  # noqa: S311 - no secret, and must be repeatable

    def is_due(self, deadline: float) -> bool:
        """Return whether a deadline on the clock of this course [s] has been reached; if not, wake then."""
        if self.is_past(deadline):
            return True
        self.wake_at(deadline + (self.now - self.time))
        return False

    def watch(self, watched: Watched) -> None:
        """Wake when the condition may have changed."""
        self.reading |= watched.names
        if watched.is_polled:
            self.wake_at(self.now + 1 / self.program.rate)

    def wake_at(self, at: float) -> None:
        """Wake at a robot time [s], unless something is due before."""
        if self.wake is None or at < self.wake:
            self.wake = at

    def forget_result(self, leaf: int) -> None:
        """Drop the result of a leaf that is halted before the result was taken."""
        self.arrived = [result for result in self.arrived if result[0] != leaf]

    def say(self, event: MissionEvent) -> None:
        """Report an event to the world."""
        self.world.say(event)


class RunBase(ABC):
    """What tasks know about the run of their mission, and a `use` about the run of the mission it uses.

    `begun` counts its starts.
    """

    def __init__(self, engine: EngineBase, program: Program, robot: RobotNames) -> None:
        self.engine = engine
        self.program = program
        self.data: dict[str, Value] = {}
        self.inputs: dict[str, Value] = {}
        self.scope = RunScope(self.data, self.inputs, robot.places, engine.world)
        self.begun = 0
        self.ending: int | None = None  # the status with which an `end` node ends it
        self.message = ""  # of that node
        self.types: dict[str, Type] = {
            **robot.values,
            **{name: input_.type for name, input_ in program.inputs.items()},
            **{name: datum.type for name, datum in program.data.items()},
        }

    def show(self, name: str, value: Value) -> str:
        """Return the value of a name as text for people."""
        return value_text.show_briefly(self.types.get(name), value)

    def filled(self, template: Template, scope: MissionScope) -> str:
        """Return a text for people with its values filled in; names of places lose their underscores."""
        return fill(template, scope, self._shown(scope, self.engine.robot.places))

    def written(self, template: Template, scope: MissionScope) -> str:
        """Return a text for programs with its values filled in; texts among these stay as they are."""
        return fill(template, scope, self._shown(scope))

    def _shown(self, scope: MissionScope, places: Collection[str] = ()) -> Show:
        types = ChainMap(item_types(scope), self.types)

        def show(path: str, value: Value) -> str:
            name, *fields = path.split(".")
            found = reduce(Type.part, fields, types.get(name, UNKNOWN))
            return value_text.show(found, value, briefly=True, places=places)

        return show

    @abstractmethod
    def begin(self, inputs: Mapping[str, Value]) -> None:
        """Start afresh: initial data, nothing runs, every interrupt is armed."""

    @abstractmethod
    def begin_again(self) -> None:
        """Start again with the current data; nodes that keep their place resume there."""

    @abstractmethod
    def tick(self, now: float) -> int:
        """Check the interrupts, then continue with the course on top; return the status of the mission."""

    @abstractmethod
    def halt(self) -> None:
        """Stop what runs, for good."""

    @abstractmethod
    def suspend(self, from_start: bool) -> None:
        """Stop the running leaves, and keep the place."""

    @abstractmethod
    def main_tasks(self) -> Iterable[ResumableTask]:
        """Return the tasks of the main node that can keep a place."""

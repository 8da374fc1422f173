"""The engine as its tasks see it: time, statuses, what wakes it, who observes it."""

from __future__ import annotations

from random import Random
from typing import Protocol

from rbxcompose.missions.engine.condition_watches import Watched
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.resume_points import ResumePoints
from rbxcompose.missions.engine.world import Settings, World
from rbxcompose.missions.program.program import Program, RobotNames, Target
from rbxcompose.missions.program.results import Result
from rbxcompose.missions.program.statuses import IDLE

ROUNDING = 1e-6  # [s] by which a deadline may seem to lie ahead when it has come


class TickSource(Protocol):
    """Who may want another tick."""

    @property
    def path(self) -> str:
        """Return where in the mission it is."""
        ...


class EngineBase:
    """The state of an engine, and what tasks do with it. `statuses` holds the status of each node by its number."""

    def __init__(self, program: Program, robot: RobotNames, world: World, settings: Settings) -> None:
        self.program = program
        self.world = world
        self.robot = robot
        self.settings = settings
        self.statuses = [IDLE] * len(program.nodes)
        self.outcome = ""  # with which the node that ended last did so; empty for the plain one
        self.now = 0.0  # [s] of robot time
        self.time = 0.0  # [s] of the course that is being ticked: timers use it
        self.lost = 0.0  # [s] for which the mission was paused; while it is, less the time at which that began
        self.because = ""  # why leaves are being halted
        self.cut_short: list[int] = []  # leaves that were halted by the latest suspension
        self.restarting: tuple[Target, ...] = ()  # what starts again after the current suspension
        self.is_aborting = False  # the mission as a whole is ended from outside
        self.places = ResumePoints()
        self.reasons: dict[int, str] = {}  # why a node failed the last time
        self.draws = 0  # of chance so far
        self.arrived: list[tuple[int, Result]] = []
        self.wake: float | None = None
        self.reading: set[str] = set()
        self.wants_again: TickSource | None = None  # who wants another tick at this instant

    @property
    def unpaused(self) -> float:
        """Return robot time without the pauses of the mission [s]; unlike `time` it goes on during interrupts."""
        return self.now - self.lost

    def again(self, by: TickSource) -> None:
        """Ask for another tick at this instant."""
        self.wants_again = by

    def is_past(self, time: float) -> bool:
        """Return whether a time of this course [s] has come."""
        return time - self.time <= ROUNDING

    def has_gone_by(self, seconds: float, since: float) -> bool:
        """Return whether so much time has gone by since a time without the pauses of the mission."""
        return seconds - (self.unpaused - since) <= ROUNDING

    def chance(self) -> Random:
        """Return a source of chance for one draw: the same for the same seed and the same draws before."""
        self.draws += 1
        return Random(f"{self.settings.seed}/{self.draws}")  # noqa: S311 - no secret, and to be drawn again

    def is_due(self, deadline: float) -> bool:
        """Return whether a time of this course [s] has come; if not, the engine wakes then."""
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
        """Drop a result that has come for a leaf which is halted before it was taken."""
        self.arrived = [result for result in self.arrived if result[0] != leaf]

    def say(self, event: MissionEvent) -> None:
        """Report to the world what happens."""
        self.world.say(event)

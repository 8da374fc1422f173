"""The record of a run: lines with their times, the steps that ran, messages, data, the end."""

from collections.abc import Callable, Mapping
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.levels import Level
from rbxcompose.missions.engine import events
from rbxcompose.missions.engine.story import MissionStory
from rbxcompose.tools.mission_tests.model import RUNS


@dataclass(frozen=True, slots=True)
class TraceLine:
    """One line of the trace, at a time [s]."""

    time: float
    text: str
    level: Level = Level.OK


@dataclass(slots=True)
class Done:
    """A step that ran: a call of a skill, a named node or a state, from `began` to `ended_at` [s].

    `line` is the line of its start in the trace. `ended` is `running` until it ends.
    """

    name: str
    text: str
    arguments: Mapping[str, Value]
    began: float
    line: int
    ended: str = RUNS
    ended_at: float | None = None


@dataclass(slots=True)
class TrialRecord:
    """Records the events of a mission, and the actions of the test."""

    mission: str
    now: float = 0.0  # [s] since the start
    lines: list[TraceLine] = field(default_factory=list)
    steps: list[Done] = field(default_factory=list)
    published: list[tuple[str, Mapping[str, Value]]] = field(default_factory=list)
    reports: list[str] = field(default_factory=list)
    data: Mapping[str, Value] = field(default_factory=dict)
    end: events.MissionEnded | None = None
    trouble: str = ""  # why the run itself could not be completed
    late: int = 0  # events of the test that were never reached
    _story: MissionStory = field(init=False)
    _open: dict[int, Done] = field(default_factory=dict)  # running steps: calls by node, named nodes by its negative

    def __post_init__(self) -> None:
        """Begin the story."""
        self._story = MissionStory(self.mission)

    def name_by(self, heading: Callable[[int], str]) -> None:
        """Begin the story of a mission whose steps are named by their sentences."""
        self._story = MissionStory(self.mission, heading)

    def note(self, text: str) -> None:
        """Add a line on an action of the test."""
        self.lines.append(TraceLine(self.now, f"* {text}"))

    def receive(self, event: events.MissionEvent) -> None:
        """Record an event."""
        level, text = self._story.line(event)
        if text:
            self.lines.append(TraceLine(self.now, text, level))
        match event:
            case events.SkillStarted(leaf=node, skill=name, arguments=arguments):
                self._begin(node, Done(name, text, dict(arguments), self.now, len(self.lines) - 1))
            case events.NodeStarted(node=node, name=name):
                self._begin(-1 - node, Done(name, name, {}, self.now, len(self.lines) - 1))
            case events.SkillEnded(leaf=node, result=result, message=message):
                self._end(node, result)
                self.reports += [message, text] if message else []
            case events.NodeEnded(node=node, result=result):
                self._end(-1 - node, result)
            case events.Published(topic=topic, fields=fields):
                self.published.append((topic, fields))
            case events.Logged(text=message) | events.Reported(message=message):
                self.reports += [message, text]  # alone, and as the trace shows it
            case events.MissionEnded(message=message):
                self.end = event
                self.reports += [message, text] if message else []

    def _begin(self, key: int, step: Done) -> None:
        self._open[key] = step
        self.steps.append(step)

    def _end(self, key: int, result: str) -> None:
        step = self._open.pop(key, None)
        if step:
            step.ended, step.ended_at = result, self.now

    @property
    def outcome(self) -> str:
        """Return the outcome of the mission in its own word; `running` if it has not ended."""
        return RUNS if self.end is None else self.end.outcome or self.end.result

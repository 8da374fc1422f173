"""The world of one running mission: its values, skills, topics and services are those of the robot."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from rbxcompose.base.expressions.values import NOT_ARRIVED, NotArrived, Value
from rbxcompose.base.levels import level_of
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.execution import errands
from rbxcompose.missions.execution.equipment import CALLS, PUBLISHES, SKILL, port_name
from rbxcompose.missions.execution.errands import Desks, PythonErrand, TopicErrand
from rbxcompose.missions.program.goals import filled, goal_of, message_of
from rbxcompose.missions.program.outcomes import Result
from rbxcompose.missions.sources import SkillWay, ValueSource
from rbxcompose.msgs import registry
from rbxcompose.sdk.registry import skill_type


class Arrivals:
    """Takes messages and keeps the values in them; times are robot time [s]."""

    def __init__(self, sources: Mapping[str, ValueSource]) -> None:
        self._sources = sources
        self._values: dict[str, Value | NotArrived] = dict.fromkeys(sources, NOT_ARRIVED)
        self._times: dict[str, float] = {}
        self._counts = dict.fromkeys(sources, 0)

    def take(self, name: str, message: Any, now: float) -> str:
        """Keep the value in a message; return what is wrong with the message, or nothing."""
        source = self._sources[name]
        try:
            value = _level(message, source.group) if source.group else _field(message, source.field)
        except AttributeError:
            return f"the messages on {source.topic} have no field '{source.field}'"
        if value is None:
            return ""  # the group has not reported yet
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        self._values[name] = float(value) * source.times / source.per if is_number else value
        self._times[name] = now
        self._counts[name] += 1
        return ""

    def value(self, name: str) -> Value | NotArrived:
        """Return the newest value in SI."""
        return self._values[name]

    def age(self, name: str, now: float) -> float | NotArrived:
        """Return the time since the last message [s]."""
        return NOT_ARRIVED if self._values[name] is NOT_ARRIVED else now - self._times[name]

    def count(self, name: str) -> int:
        """Return how many messages have arrived."""
        return self._counts[name]


def _field(message: Any, path: str) -> Any:
    value = message
    for field in path.split("."):
        value = getattr(value, field)
    return value


def _level(message: Any, group: str) -> str | None:
    """Return the level of a group of the diagnostics in lower case; None if it is absent."""
    levels = (level_of(status.level) for status in message.status if status.name == f"/{group}")
    return next((level.name.lower() for level in levels), None)


class RobotWorld:
    """Carries out the requests of an engine; `ended` receives results, `say` events."""

    def __init__(
        self,
        shell: errands.Shell,
        arrivals: Arrivals,
        desks: Desks,
        ended: Callable[[int, Result], None],
        say: Callable[[MissionEvent], None],
    ) -> None:
        self._shell, self._arrivals, self._desks, self._on_end, self._say = shell, arrivals, desks, ended, say
        self._errands: dict[int, errands.Errand] = {}

    # Values

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value in SI."""
        if name == POSE:
            pose = self._shell.bound[POSE].now() if POSE in self._shell.bound else None
            return NOT_ARRIVED if pose is None else pose
        return self._arrivals.value(name)

    def age(self, name: str, /) -> float | NotArrived:
        """Return the time since the last message [s]; the pose, which is computed on request, has age 0."""
        if name == POSE:
            return NOT_ARRIVED if self.value(POSE) is NOT_ARRIVED else 0.0
        return self._arrivals.age(name, self._shell.now)

    def count(self, name: str, /) -> int:
        """Return how many messages have arrived; the pose needs none."""
        return 0 if name == POSE else self._arrivals.count(name)

    # What a mission does

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Start a skill: send a goal or an order, call a service, or run Python."""
        self._begin(leaf, self._errand(self._done(leaf), skill, arguments))

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Call a service."""
        request = message_of(registry.service(self._shell.config.services[service]).Request, fields)
        self._begin(
            leaf, errands.CallErrand(self._shell, self._done(leaf), service, port_name(CALLS, service), request)
        )

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Publish a message; raises ValueError if a field does not fit."""
        message = registry.message(self._shell.config.topics[topic].message)
        self._shell.bound[port_name(PUBLISHES, topic)](message_of(message, fields))

    def halt(self, leaf: int, /) -> None:
        """Stop the request of a leaf."""
        errand = self._errands.pop(leaf, None)
        if errand is not None:
            errand.halt()

    def pause(self, leaf: int, /) -> None:
        """Pause the skill of a leaf."""
        self._errands[leaf].pause()

    def resume(self, leaf: int, /) -> None:
        """Resume the skill of a leaf."""
        self._errands[leaf].resume()

    def say(self, event: MissionEvent, /) -> None:
        """Forward an event."""
        self._say(event)

    def renumber(self, requests: Mapping[int, int]) -> None:
        """Report to other leaves from now on, by those before: the mission has changed."""
        self._errands = {requests[leaf]: errand for leaf, errand in self._errands.items()}
        for leaf, errand in self._errands.items():
            errand.report_to(self._done(leaf))

    # Polling

    def next_look(self) -> float | None:
        """Return when to poll the requests under way [s]."""
        return min(
            (time for errand in self._errands.values() if (time := errand.next_look()) is not None), default=None
        )

    def look(self) -> None:
        """Poll the requests under way."""
        for errand in list(self._errands.values()):
            errand.look()

    def _errand(self, done: errands.WhenDone, skill: str, arguments: Mapping[str, Value]) -> errands.Errand:
        source = self._shell.config.skills[skill]
        if mistake := next(filter(None, (source.skill.mistake_in(*each) for each in arguments.items())), ""):
            raise ValueError(mistake)
        match source.way:
            case SkillWay.ACTION:
                goal = goal_of(registry.action(source.action), arguments, source.skill.entries)
                return errands.GoalErrand(self._shell, done, source.skill, goal)
            case SkillWay.SERVICE:
                request = filled(registry.service(source.action).Request, arguments)
                return errands.CallErrand(self._shell, done, skill, SKILL + skill, request)
            case SkillWay.TOPIC:
                order = filled(registry.message(source.action), arguments, source.skill.entries)
                return TopicErrand(self._shell, done, self._desks.of(source), source, order)
            case SkillWay.PYTHON:
                return PythonErrand(self._shell, done, skill_type(skill), arguments)

    def _begin(self, leaf: int, errand: errands.Errand) -> None:
        self._errands[leaf] = errand
        try:
            errand.begin()
        except (Exception, SystemExit):
            self._errands.pop(leaf, None)
            raise

    def _done(self, leaf: int) -> errands.WhenDone:
        return partial(self._ended, leaf)

    def _ended(self, leaf: int, result: Result) -> None:
        self._errands.pop(leaf, None)
        self._on_end(leaf, result)

"""The executive: runs the robot's mission with the actions of other components."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import InstanceOf, WithJsonSchema

from rbxcompose.expressions.values import NOT_ARRIVED, NotArrived, Value
from rbxcompose.missions.engine import Engine
from rbxcompose.missions.events import MissionEnded, MissionEvent
from rbxcompose.missions.goals import goal_of
from rbxcompose.missions.program import Program, RobotNames, Skill
from rbxcompose.missions.sources import SkillSource, ValueSource
from rbxcompose.missions.statuses import IDLE, NAMES, RUNNING
from rbxcompose.missions.story import Story
from rbxcompose.missions.watching import POSE
from rbxcompose.msgs import registry
from rbxcompose.sdk import (
    CallsAction,
    Component,
    Config,
    Ended,
    In,
    Level,
    Looks,
    Outcome,
    Place,
    Port,
    Refused,
    SentGoal,
    component,
)

BACK_WITHIN = 5.0  # [s] in which a server that is gone must be back
STOP_WITHIN = 0.5  # [s] in which the stop that cancelled a goal is heard of here
LOOK_AGAIN = 0.1  # [s] between two looks at what nothing announces
VALUE, SKILL = "value_", "skill_"  # begin the ports of values and of skills


T = TypeVar("T")
Made = Annotated[InstanceOf[T], WithJsonSchema({"type": "object"})]  # by the compiler, never by people


class MissionConfig(Config):
    """What the compiler has put together of the robot's missions."""

    programs: dict[str, Made[Program]] = {}
    """Missions by name."""
    start: str | None = None
    """The one that runs by itself."""
    inputs: dict[str, dict[str, Any]] = {}
    """Values of the inputs, by mission and name."""
    values: dict[str, Made[ValueSource]] = {}
    """Where the robot's values come from."""
    places: dict[str, Made[Place]] = {}
    """The robot's places."""
    skills: dict[str, Made[SkillSource]] = {}
    """The robot's skills."""

    @property
    def reads(self) -> frozenset[str]:
        """Return the names that any mission reads."""
        return frozenset[str]().union(*(program.reads() for program in self.programs.values()))

    @property
    def names(self) -> RobotNames:
        """Return what the robot gives to missions."""
        types = {name: source.type for name, source in self.values.items()}
        return RobotNames(types, self.places, {name: source.skill for name, source in self.skills.items()})


class Errand:
    """A goal on its way for a leaf; without `handle`, nobody is at it until `until` [s]."""

    def __init__(self, leaf: int, skill: Skill, goal: Any) -> None:
        self.leaf = leaf
        self.skill = skill
        self.goal = goal
        self.handle: SentGoal | None = None
        self.earliest = 0.0  # when to look for a server again [s]
        self.until = 0.0
        self.was_cancelled = False


@component("mission")
class Mission(Component[MissionConfig]):
    """Runs the mission that the robot starts with; each action of the robot is a skill.

    It is made of the sections `missions`, `start`, `values` and `places`.

    Example:
        executive: {type: mission}
    """

    process = "mission"

    @classmethod
    def ports(cls, config: MissionConfig) -> dict[str, Port[Any]]:
        """Return an input per value that is read, an action per skill that is used, and the pose if it is read."""
        ports: dict[str, Port[Any]] = {}
        for name in sorted(config.reads & config.values.keys()):
            source = config.values[name]
            ports[VALUE + name] = In(registry.message(source.message), source.topic).named(VALUE + name)
        used = {node.skill for program in config.programs.values() for node in program.nodes}
        for name in sorted(used & config.skills.keys()):
            skill = config.skills[name]
            ports[SKILL + name] = CallsAction(registry.action(skill.action), skill.topic).named(SKILL + name)
        if POSE in config.reads:
            ports[POSE] = Looks(source="base_footprint", target="map").named(POSE)
        return ports

    def configure(self) -> None:
        """Nothing has arrived and nothing runs."""
        self.robot = MissionWorld(self)
        self.engine: Engine | None = None  # from `start` on
        self.is_paused = False
        self.is_over = False
        self.shown = ""  # the status that was told last
        self.planned: float | None = None  # the wake that was asked for last [s]

    def start(self) -> None:
        """Run the start mission, as soon as every value that it reads has arrived."""
        name = self.config.start
        if name is None:
            self.show(Level.OK, "no mission to start")
            return
        self.story = Story(name, self.config.names.skills)
        program, inputs = self.config.programs[name], self.config.inputs.get(name, {})
        self.engine = Engine(program, self.config.names, inputs, self.robot)
        if missing := self.missing():
            self.info(f"mission {name} waits for {', '.join(missing)}")
        if self.is_paused:
            self.tell(f"mission {name} is held until it is resumed")
        self.context.wake_at(self.now)

    def received(self, port: str, message: Any) -> None:
        """Take a value, and look at the mission if that waits for it."""
        name = port.removeprefix(VALUE)
        self.robot.take(name, message)
        if self.engine and (self.engine.status == IDLE or name in self.engine.reads()):
            self.context.wake_at(self.now)

    def wake(self) -> None:
        """Do what is due."""
        if self.planned is not None and self.planned <= self.now:
            self.planned = None
        if self.engine is None or self.is_over or self.is_paused:
            return
        if self.engine.status == IDLE and (missing := self.missing()):
            self.show(Level.OK, f"waiting for {', '.join(missing)}")
            self.plan(self.now + LOOK_AGAIN if POSE in missing else None)
            return
        self.show(Level.OK, f"running {self.config.start}")
        self.robot.look_after_errands()
        if self.engine.tick(self.now) == RUNNING:
            due = (self.engine.next_wake(), self.robot.next_look())
            self.plan(min((time for time in due if time is not None), default=None))
        elif self.robot.end:
            self.finish(self.robot.end)

    def plan(self, time: float | None) -> None:
        """Ask for a wake, once for each time."""
        if time is not None and time != self.planned:
            self.context.wake_at(time)
        self.planned = time

    def missing(self) -> list[str]:
        """Return the names that the mission reads and of which nothing has come yet."""
        reads = self.engine.program.reads() if self.engine else frozenset[str]()
        known = reads & {*self.config.values, POSE}
        return sorted(name for name in known if self.robot.value(name) is NOT_ARRIVED)

    def finish(self, end: MissionEnded) -> None:
        """Tell the supervisor that the mission has ended."""
        self.is_over = True
        self.show(Level.OK if end.result == "success" else Level.ERROR, f"{self.config.start}: {end.result}")
        self.context.notify("mission_ended", mission=self.config.start, outcome=end.result, message=end.message)

    def stop(self) -> None:
        """Pause the mission; what it was at is asked for again at the resume."""
        if not self.is_over and not self.is_paused:
            self.pause("stopped")

    def brake(self) -> None:
        """End the mission: the robot is going down."""
        if self.engine and not self.is_over:
            self.is_over = True
            self.engine.abort(self.now)

    def command(self, verb: str) -> str:
        """Pause or resume the mission.

        Raises:
            Refused: if there is nothing to pause or to resume, or the robot is held by a stop.
        """
        if verb not in ("pause", "resume"):
            return super().command(verb)
        if self.engine is None or self.is_over:
            raise Refused("no mission is running")
        if verb == "pause":
            if self.is_paused:
                raise Refused(f"mission {self.config.start} is paused already")
            return self.pause("paused")
        if self.context.is_stopped:
            raise Refused("the robot is stopped: release it first")
        if not self.is_paused:
            raise Refused(f"mission {self.config.start} is not paused")
        return self.resume()

    def pause(self, why: str) -> str:
        """Hold the mission and return what is told of it."""
        self.is_paused = True
        if self.engine is None:
            return ""
        self.engine.pause(self.now)
        return self.tell(f"mission {self.config.start} {why}")

    def resume(self) -> str:
        """Go on and return what is told of it."""
        self.is_paused = False
        if self.engine:
            self.engine.resume(self.now)
        self.context.wake_at(self.now)
        return self.tell(f"mission {self.config.start} resumed")

    def tell(self, text: str) -> str:
        """Log a text and make it the status."""
        self.info(text)
        self.show(Level.OK, text)
        return text

    def show(self, level: Level, text: str) -> None:
        """Make a text the status, if it is another one."""
        if text != self.shown:
            self.shown = text
            self.status(level, text)

    def summary(self) -> dict[str, str]:
        """Return how the mission stands and what it did."""
        if self.engine is None:
            return {}
        how = self.robot.end.result if self.robot.end else NAMES[self.engine.status]
        return {"mission": f"{self.config.start}: {how}", "skills": self.story.skills()}


class MissionWorld:
    """What the engine needs of the robot: values from messages, skills as goals, a log."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self.end: MissionEnded | None = None
        self._values: dict[str, Value] = dict.fromkeys(mission.config.values, NOT_ARRIVED)
        self._arrived: dict[str, float] = {}
        self._counts: dict[str, int] = dict.fromkeys(mission.config.values, 0)
        self._errands: dict[int, Errand] = {}

    def take(self, name: str, message: Any) -> None:
        """Keep the value in a message."""
        source = self.mission.config.values[name]
        value = message
        for field in source.field.split("."):
            value = getattr(value, field)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        self._values[name] = float(value) * source.scale if is_number else value
        self._arrived[name] = self.mission.now
        self._counts[name] += 1

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value in SI."""
        if name == POSE:
            pose = self.mission.bound[POSE].now()
            return NOT_ARRIVED if pose is None else pose
        return self._values[name]

    def age(self, name: str, /) -> float | NotArrived:
        """Return the time since the last message [s]."""
        if self._values[name] is NOT_ARRIVED:
            return NOT_ARRIVED
        return self.mission.now - self._arrived[name]

    def count(self, name: str, /) -> int:
        """Return how many messages have come."""
        return self._counts[name]

    def say(self, event: MissionEvent, /) -> None:
        """Log what happens."""
        level, text = self.mission.story.tell(event)
        if isinstance(event, MissionEnded):
            self.end = event
        self.mission.context.log(level, text)

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Send a goal."""
        source = self.mission.config.skills[skill]
        errand = Errand(leaf, source.skill, goal_of(registry.action(source.action), arguments))
        self._errands[leaf] = errand
        if not self._send(errand):
            self._wait(errand, f"nobody serves {skill}", BACK_WITHIN)

    def halt(self, leaf: int, /) -> None:
        """Cancel a goal, and hear nothing of it any more."""
        errand = self._errands.pop(leaf, None)
        if errand is not None and errand.handle is not None:
            errand.handle.cancel()

    def next_look(self) -> float | None:
        """Return when to look after the errands that nobody is at [s]."""
        if any(errand.handle is None for errand in self._errands.values()):
            return self.mission.now + LOOK_AGAIN
        return None

    def look_after_errands(self) -> None:
        """Send the goals again whose server is back; give up those that have waited long enough."""
        for errand in list(self._errands.values()):
            if errand.handle is not None:
                continue
            if self.mission.now < errand.earliest:
                continue  # who has just gone may still be in the books
            if not errand.was_cancelled and self._send(errand):
                self.mission.info(f"{errand.skill.name}: sent again")
            elif self.mission.now >= errand.until:
                reason = "cancelled by someone else" if errand.was_cancelled else "its server is gone"
                self._end(errand, False, reason)

    def _send(self, errand: Errand) -> bool:
        """Send the goal, if a server is there."""
        caller = self.mission.bound[SKILL + errand.skill.name]
        if not caller.is_available:
            return False
        errand.handle = caller(errand.goal, lambda ended: self._ended(errand, ended))
        return True

    def _ended(self, errand: Errand, ended: Ended[Any]) -> None:
        if self._errands.get(errand.leaf) is not errand:
            return  # it was halted meanwhile
        errand.handle = None
        match ended.outcome:
            case Outcome.SUCCEEDED:
                self._end(errand, True, ended.message)
            case Outcome.LOST if errand.skill.restartable:
                self._wait(errand, f"the server of {errand.skill.name} is gone", BACK_WITHIN)
            case Outcome.LOST:
                self._end(errand, False, "its server is gone")
            case Outcome.CANCELED:
                # A stop cancels goals, too, and may be on its way to this process: then it is no failure.
                errand.was_cancelled = True
                errand.until = self.mission.now + STOP_WITHIN
            case _:
                self._end(errand, False, ended.message or str(ended.outcome))
        self.mission.context.wake_at(self.mission.now)

    def _wait(self, errand: Errand, why: str, seconds: float) -> None:
        errand.earliest = self.mission.now + LOOK_AGAIN
        errand.until = self.mission.now + seconds
        self.mission.warn(f"{why}; waiting for up to {seconds:.0f} s")

    def _end(self, errand: Errand, success: bool, message: str) -> None:
        del self._errands[errand.leaf]
        if self.mission.engine:
            self.mission.engine.ended(errand.leaf, success, message)

"""A fake robot for missions: servers that tests drive by hand, time that they advance."""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

from rbxcompose.base.clock import Clock, SteppedClock
from rbxcompose.base.expressions.types import FLAG, TEXT, TYPES
from rbxcompose.base.findings import Report
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Query
from rbxcompose.compiler.model.skills import python_skills
from rbxcompose.domains.arms.goals import RANGES, SHARES
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.analysis.facts import sent_by
from rbxcompose.missions.components.mission import Mission
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.goals import skill_of
from rbxcompose.missions.program.program import Program, Skill
from rbxcompose.missions.sources import SkillSource, SkillWay, TopicSource, ValueSource
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, Recharge
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk import Activity, Ended, Outcome, Place, skill
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.component import BusAddress, MissionOver, RobotEvent
from rbxcompose.sdk.ports import In
from rbxcompose.sdk.updater import DiagnosticTask


@skill("toy_count", outcomes={"nobody": "failure"})
def toy_count(room: Place, least: int = 1) -> str | dict[str, int]:
    """Find as many people as the place is metres away."""
    return {"people": int(room.x)} if room.x >= least else "nobody"


@skill("toy_raise")
def toy_raise() -> None:
    """Raise."""
    raise ZeroDivisionError("no such thing")


@skill("toy_exit")
def toy_exit() -> None:
    """Exit, as a library does that was made for commands."""
    sys.exit(7)


@skill("toy_slow", claims="arm", pausable=True)
class ToySlow(Activity):
    """Take a second, and fail if told to; `heard` is what happened to all of them."""

    rate = 10.0
    heard: ClassVar[list[str]] = []

    def start(self, fails: bool = False) -> None:
        """Begin."""
        self.left, self.fails = 10, fails

    def step(self, now: float) -> bool | None:
        """Count down."""
        self.left -= 1
        return None if self.left else not self.fails

    def halt(self) -> None:
        """Tell."""
        self.heard.append("halt")

    def pause(self, now: float) -> None:
        """Tell."""
        self.heard.append("pause")

    def resume(self, now: float) -> None:
        """Tell."""
        self.heard.append("resume")


PLACES = {"dock": Place("dock", 0.5, 0.5, 0.0), "corner": Place("corner", 1.0, 0.0, 0.0)}


def program_of(text: str, file: str = "mission.yaml") -> Program:
    root, findings = read_text(textwrap.dedent(text), file)
    assert isinstance(root, MappingNode)
    assert not findings
    report = Report()
    program = read_program(root, report)
    assert program is not None
    assert not report.has_errors, list(report)
    return program


class Goal:
    """A goal at the fake server."""

    def __init__(self, request: Any, then: Callable[[Ended[Any]], None]) -> None:
        self.request = request
        self.then = then
        self.is_cancelled = False

    def cancel(self) -> None:
        self.is_cancelled = True


class Server:
    """An action server that tests drive by hand."""

    def __init__(self) -> None:
        self.is_available = True
        self.goals: list[Goal] = []

    def __call__(self, request: Any, then: Callable[[Ended[Any]], None], feedback: object = None, /) -> Goal:
        self.goals.append(Goal(request, then))
        return self.goals[-1]

    def end(self, outcome: Outcome, message: str = "", result: Any = None) -> None:
        self.goals[-1].then(Ended(outcome, result, message))


class Service:
    """A server of a service that tests drive by hand."""

    def __init__(self) -> None:
        self.is_available = True
        self.asked: list[tuple[Any, Callable[[Reply[Any]], None]]] = []

    def __call__(self, request: Any, then: Callable[[Reply[Any]], None], /, *, timeout: float = 5.0) -> None:
        self.asked.append((request, then))

    def answer(self, response: Any, error: str = "") -> None:
        self.asked[-1][1](Reply(response, error))


class Look:
    def __init__(self) -> None:
        self.pose: Pose2 | None = None

    def now(self) -> Pose2 | None:
        return self.pose

    def transform(self, *, at: int | None = None) -> Transform3:
        if self.pose is None:
            raise LookupError
        return Transform3.from_pose2(self.pose)


VALUES = {
    "battery": ValueSource("battery_level", "std_msgs/msg/Float32", "data", 1, 100, TYPES["ratio"]),
    "confirmed": ValueSource("button", "std_msgs/msg/Bool", "data", type=FLAG, is_event=True),
}


class FakeWindow:
    """A window whose viewer is the test."""

    def __init__(self, question: Query[Any]) -> None:
        self.question = question
        self.is_watched = False
        self.news: list[Any] = []

    def put(self, value: object, /) -> None:
        self.news.append(json.loads(json.dumps(value)))


def skills() -> dict[str, SkillSource]:
    """Return what the robot can do, by name."""
    return {
        "go_to": SkillSource(skill_of(NavigateToPose, "go_to", "base"), "nav2_msgs/action/NavigateToPose", "go_to"),
        "recharge": SkillSource(
            skill_of(Recharge, "recharge", restartable=False), "rbxcompose_msgs/action/Recharge", "recharge"
        ),
        "scan": SkillSource(
            skill_of(Recharge, "scan", "head", pausable=True), "rbxcompose_msgs/action/Recharge", "scan"
        ),
        "reach": SkillSource(
            skill_of(MoveArm, "reach", measures=SHARES, ranges=RANGES), "rbxcompose_msgs/action/MoveArm", "reach"
        ),
        "switch": SkillSource(
            Skill("switch", {"data": FLAG}, "data", results={"message": TEXT}),
            "std_srvs/srv/SetBool",
            "switch",
            SkillWay.SERVICE,
        ),
        **{
            python_skill.skill.name: python_skill
            for python_skill in python_skills(["say", "toy_count", "toy_raise", "toy_exit", "toy_slow"])
        },
    }


class Robot:
    """A mission component with a fake context and fake ports, on a stepped clock."""

    def __init__(self, text: str, start: str | None = "test", **others: str) -> None:
        self.stepped = SteppedClock()
        self.clock: Clock = self.stepped
        self.is_stopped = self.is_over = self.is_again = False
        self.starts_mission = True
        self.lines: list[str] = []
        self.levels: list[Level] = []
        self.events: list[RobotEvent] = []
        self.repeated: Sequence[Command] = ()
        self.statuses: list[str] = []
        self.wakes: list[float] = []
        self.windows: dict[str, FakeWindow] = {}
        programs = {name: program_of(one) for name, one in {"test": text, **others}.items()}
        published, called = sent_by(programs.values())
        topics = {"words": TopicSource("std_msgs/msg/String"), "goal": TopicSource(PoseStamped.TYPE)}
        config = MissionConfig(
            programs=programs,
            start=start,
            values=VALUES,
            places=PLACES,
            skills=skills(),
            topics={name: topics[name] for name in published},
            services=dict.fromkeys(called, "std_srvs/srv/Trigger"),
        )
        self.go_to, self.recharge, self.reach, self.look = Server(), Server(), Server(), Look()
        self.mission = Mission("mission", config, self)
        self.scan, self.pauses, self.switch, self.reset = Server(), Service(), Service(), Service()
        self.sent: list[Any] = []
        self.published: list[dict[str, Any]] = []
        self.mission.bound = {
            "skill_go_to": self.go_to,
            "skill_recharge": self.recharge,
            "skill_reach": self.reach,
            "pose": self.look,
            "skill_scan": self.scan,
            "pauses_scan": self.pauses,
            "skill_switch": self.switch,
            "calls_reset": self.reset,
            "publishes_words": self.sent.append,
            "publishes_goal": self.sent.append,
            "publishes_mission_events": lambda message: self.published.append(json.loads(message.data)),
        }
        self.mission.configure()
        self.mission.activate()

    @property
    def address(self) -> BusAddress:
        return BusAddress("robot", "", 0, "", "jazzy")

    def log(self, level: Level, text: str) -> None:
        self.lines.append(f"{self.clock.now():g} {text}")
        self.levels.append(level)

    def status(self, level: Level, message: str, values: Mapping[str, object]) -> None:
        self.statuses.append(message)

    def watch(self, name: str, task: DiagnosticTask) -> None:
        """Ask for nothing: a mission has no tasks."""

    def wake_at(self, time: float) -> None:
        self.wakes.append(time)

    def notify(self, event: RobotEvent) -> None:
        self.events.append(event)

    @property
    def ends(self) -> list[MissionOver]:
        """Return how the start mission ended, each time."""
        return [event for event in self.events if isinstance(event, MissionOver)]

    def repeat(self, requests: Sequence[Command]) -> None:
        self.repeated = tuple(requests)

    def window(self, path: str, question: Query[Any]) -> FakeWindow:
        return self.windows.setdefault(path, FakeWindow(question))

    def listen(self, port: In[Any]) -> None:
        raise AssertionError("missions subscribe to nothing else")

    def mute(self, name: str) -> None:
        raise AssertionError("missions keep their subscriptions")

    def level(self, percent: float) -> None:
        self.mission.received("value_battery", Float32(data=percent))

    def start(self) -> None:
        self.mission.start()
        self.advance(0.0)

    def advance(self, seconds: float) -> None:
        """Let time pass, and wake the component whenever it asked for it."""
        end = self.clock.now() + seconds
        while due := sorted(time for time in self.wakes if time <= end):
            self.wakes.remove(due[0])
            self.stepped.advance_to(max(due[0], self.clock.now()))
            self.mission.wake()
        self.stepped.advance_to(max(end, self.clock.now()))  # something may have taken its time

"""A simulated robot for tests of missions: skills take a time, values are set, everything is written down."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.types import FLAG, POSE, TEXT, TYPES, quantity_of
from rbxcompose.base.expressions.values import NOT_ARRIVED, NotArrived, Value
from rbxcompose.base.units import LENGTH
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import MissionEnded, MissionEvent
from rbxcompose.missions.engine.story import MissionStory
from rbxcompose.missions.engine.world import PLAIN, Settings
from rbxcompose.missions.program.outcomes import IDLE, NAMES, RUNNING, Result
from rbxcompose.missions.program.program import Program, RobotNames, Skill
from rbxcompose.testing import compile_mission

PLACES = {name: Place(name, float(x), 0.0, 0.0) for x, name in enumerate(("dock", "kitchen", "corner_1", "corner_2"))}
GO_TO = Skill("go_to", {"pose": POSE, "tolerance": quantity_of(LENGTH)}, "pose", frozenset({"pose"}), "base")
SKILLS = {
    "go_to": GO_TO,
    "recharge": Skill("recharge", claims="base"),
    "say": Skill("say", {"words": TEXT}, "words"),
    "pour": Skill("pour", restartable=False),
    "lift": Skill("lift", claims="arm"),
    "press": Skill("press", claims="arm", restartable=False),
    "look": Skill("look", outcomes={"empty": "failure", "person": "success"}, results={"people": TYPES["count"]}),
    "hold": Skill("hold", pausable=True),
    **{name: Skill(name) for name in ("a", "b", "c", "d", "react", "first", "second")},
}
VALUES = {"battery": TYPES["ratio"], "door": FLAG, "count_of_people": TYPES["count"]}
TOPICS = {"greetings": "std_msgs/msg/String", "steering": "geometry_msgs/msg/Twist"}
SERVICES = {"reset": "std_srvs/srv/Trigger", "light": "std_srvs/srv/SetBool"}
ROBOT = RobotNames(VALUES, PLACES, SKILLS, topics=TOPICS, services=SERVICES)


def tree(text: str, file: str = "mission.yaml") -> MappingNode:
    """Return the located tree of a mission's text."""
    root, findings = read_text(textwrap.dedent(text), file)
    assert not findings
    assert isinstance(root, MappingNode)
    return root


def program_of(text: str, robot: RobotNames = ROBOT) -> Program:
    """Return the program of a mission without mistakes; the head of the file may be left out."""
    program, report = compile_mission(text, robot)
    assert not report.has_errors, list(report)
    assert program is not None
    return program


@dataclass
class Simulated:
    """A world in virtual time: a skill takes `takes[skill]` [s], else 1 s, and fails at the calls `fails[skill]`.

    `outcomes[skill]` are the outcomes of its calls in turn, where they are not empty; `tells[skill]` is what it found.
    """

    program: Program
    inputs: Mapping[str, Value] = field(default_factory=dict)
    takes: Mapping[str, float] = field(default_factory=dict)
    fails: Mapping[str, frozenset[int]] = field(default_factory=dict)
    raises: frozenset[str] = frozenset()
    robot: RobotNames = ROBOT
    settings: Settings = PLAIN
    outcomes: Mapping[str, Sequence[str]] = field(default_factory=dict)
    tells: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make the engine; nothing has happened."""
        self.now = 0.0
        self.values: dict[str, Value] = {}
        self.counts: dict[str, int] = {}
        self.arrived: dict[str, float] = {}
        self.running: dict[int, tuple[float, str]] = {}
        self.held: dict[int, tuple[float, str]] = {}
        self.published: list[tuple[float, str, dict[str, Value]]] = []
        self.calls: dict[str, int] = {}
        self.events: list[tuple[float, MissionEvent]] = []
        self.told: list[str] = []
        self.story = MissionStory("test")
        self.changes: list[tuple[float, Callable[[], None]]] = []
        defaults = {name: input_.default.value for name, input_ in self.program.inputs.items() if input_.default}
        self.engine = Engine(self.program, self.robot, {**defaults, **self.inputs}, self, self.settings)

    def at(self, time: float, change: Callable[[], None]) -> None:
        """Do something at a time, before the tick of that instant."""
        self.changes.append((time, change))

    def set(self, name: str, value: Value) -> None:
        """Let a message arrive."""
        self.values[name] = value
        self.counts[name] = self.counts.get(name, 0) + 1
        self.arrived[name] = self.now

    def value(self, name: str, /) -> Value | NotArrived:
        """Return a value."""
        return self.values.get(name, NOT_ARRIVED)

    def age(self, name: str, /) -> float | NotArrived:
        """Return how old a value is [s]."""
        return self.now - self.arrived[name] if name in self.arrived else NOT_ARRIVED

    def count(self, name: str, /) -> int:
        """Return how many messages came."""
        return self.counts.get(name, 0)

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Begin a skill."""
        assert leaf not in self.running, "a leaf is started while it runs"
        if skill in self.raises:
            raise RuntimeError("out of order")
        self.calls[skill] = self.calls.get(skill, 0) + 1
        self.running[leaf] = (self.now + self.takes.get(skill, 1.0), skill)

    def halt(self, leaf: int, /) -> None:
        """Stop a skill that runs."""
        assert leaf in self.running or leaf in self.held, "a leaf is halted that does not run"
        self.running.pop(leaf, None)
        self.held.pop(leaf, None)

    def pause(self, leaf: int, /) -> None:
        """Hold a skill: its time stands still."""
        end, skill = self.running.pop(leaf)
        self.held[leaf] = (end - self.now, skill)

    def resume(self, leaf: int, /) -> None:
        """Let a skill go on."""
        rest, skill = self.held.pop(leaf)
        self.running[leaf] = (self.now + rest, skill)

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Write a message down."""
        self.published.append((self.now, topic, dict(fields)))

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Begin a call; it takes as long as a skill."""
        self.start(leaf, service, fields)

    def say(self, event: MissionEvent, /) -> None:
        """Write an event down."""
        self.events.append((self.now, event))
        self.told.append(f"{self.now:g} {self.story.line(event)[1]}")

    def finish(self, leaf: int) -> None:
        """Tell the engine how a skill ended."""
        _, skill = self.running.pop(leaf)
        failed = self.calls[skill] in self.fails.get(skill, frozenset())
        if skill == "recharge" and not failed:
            self.set("battery", 1.0)
        outcomes = self.outcomes.get(skill, ())
        outcome = outcomes[self.calls[skill] - 1] if self.calls[skill] <= len(outcomes) else ""
        self.engine.ended(leaf, Result(not failed, "no luck" if failed else "", outcome, self.tells.get(skill, {})))

    @property
    def ended(self) -> str:
        """Return the outcome of the mission, which may be the name of an end."""
        event = self.events[-1][1]
        assert isinstance(event, MissionEnded), "it has not ended"
        return event.outcome

    def advance(self, until: float) -> str:
        """Jump from event to event until a time [s] or the end, and return the status."""
        while self.engine.status in (IDLE, RUNNING):
            for leaf in [leaf for leaf, (end, _) in self.running.items() if end <= self.now]:
                self.finish(leaf)
            due = [change for change in self.changes if change[0] <= self.now]
            self.changes = [change for change in self.changes if change not in due]
            for _, change in due:
                change()
            self.engine.tick(self.now)
            upcoming = [end for end, _ in self.running.values()] + [time for time, _ in self.changes]
            if (wake := self.engine.next_wake()) is not None:
                upcoming.append(wake)
            if not upcoming or min(upcoming) > until or self.engine.status not in (IDLE, RUNNING):
                break
            assert min(upcoming) > self.now, "time stands still"
            self.now = min(upcoming)
        if self.engine.status == RUNNING:
            self.now = until
        return NAMES[self.engine.status]


def simulate(text: str, used: Mapping[str, str] | None = None, /, **settings: object) -> Simulated:
    """Return a simulated robot with the mission of this text; `used` are the texts of missions that it may use."""
    robot = robot_with(used or {})
    return Simulated(program_of(text, robot), robot=robot, **settings)  # type: ignore[arg-type]


def robot_with(used: Mapping[str, str]) -> RobotNames:
    """Return the names of a robot with missions of these texts; each may use those before it."""
    robot = ROBOT
    for name, text in used.items():
        robot = replace(robot, missions={**robot.missions, name: program_of(text, robot)})
    return robot

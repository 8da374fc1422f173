"""Manifests and missions written in a test."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import NOT_ARRIVED, NotArrived, Value
from rbxcompose.base.findings import Report
from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.story import MissionStory
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.outcomes import NAMES, Result
from rbxcompose.missions.program.program import Program, RobotNames


@dataclass(frozen=True, slots=True)
class Checked:
    """The compiler's result for a text."""

    compilation: Compilation

    @property
    def text(self) -> str:
        """Return the findings as a person reads them."""
        return render_text(self.compilation.report, self.compilation.sources)

    @property
    def codes(self) -> list[str]:
        """Return the codes of the findings, by place."""
        return [finding.code for finding in self.compilation.report]

    @property
    def plan(self) -> Plan:
        """Return the plan.

        Raises:
            AssertionError: with the findings, if there is none.
        """
        if self.compilation.plan is None:
            raise AssertionError(self.text)
        return self.compilation.plan


def check_text(
    text: str,
    folder: Path,
    *,
    others: Mapping[str, str] | None = None,
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    sets: Sequence[str] = (),
    real: bool = False,
    environment: Mapping[str, str] | None = None,
) -> Checked:
    """Write `text` to `robot.yaml` in `folder`, with `others` beside it by their paths, and compile the robot."""
    for name, other in {**(others or {}), "robot.yaml": text}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(other, encoding="utf-8")
    file = folder / "robot.yaml"
    return check_file(file, profiles=profiles, overlays=overlays, sets=sets, real=real, environment=environment)


def check_file(
    path: Path,
    *,
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    sets: Sequence[str] = (),
    real: bool = False,
    environment: Mapping[str, str] | None = None,
) -> Checked:
    """Compile a robot's file."""
    return Checked(
        compile_robot(
            str(path),
            profiles=profiles,
            overlays=overlays,
            sets=sets,
            real=real,
            environment=environment or {},
            tries_profiles=True,
        )
    )


NOBODY = RobotNames()


def compile_mission(
    text: str, robot: RobotNames = NOBODY, *, file: str = "mission.yaml"
) -> tuple[Program | None, Report]:
    """Return the program of a mission on a robot with these names, None if it cannot be read; and all findings.

    Example:
        program, findings = compile_mission("do: blink", RobotNames(skills={"blink": Skill("blink")}))
    """
    root, found = read_text(textwrap.dedent(text), file)
    report = Report()
    report.extend(found)
    program = read_program(root, report) if isinstance(root, MappingNode) else None
    if program is not None:
        report.extend(check_program(program, robot))
    return program, report


class SteppedMission:
    """A mission whose skills and calls a test ends by hand, and whose time goes on only in `tick`.

    `calls` are the names and arguments of all skills and services that it has begun, `told` the lines of its story.
    """

    def __init__(self, program: Program, robot: RobotNames = NOBODY, inputs: Mapping[str, Value] | None = None) -> None:
        """Begin nothing yet; inputs that are not given have their defaults."""
        self.now = 0.0  # [s]
        self.calls: list[tuple[str, Mapping[str, Value]]] = []
        self.published: list[tuple[str, Mapping[str, Value]]] = []
        self.told: list[str] = []
        self._values: dict[str, Value] = {}
        self._arrived: dict[str, float] = {}
        self._counts: dict[str, int] = {}
        self._running: dict[int, str] = {}
        self._story = MissionStory(program.name)
        defaults = {name: input_.default.value for name, input_ in program.inputs.items() if input_.default}
        self.engine = Engine(program, robot, {**defaults, **(inputs or {})}, self)

    @property
    def running(self) -> list[str]:
        """Return the names of the skills and services that it waits for."""
        return list(self._running.values())

    def tick(self, seconds: float = 0.0) -> str:
        """Let time pass, tick the engine, and return the mission's status: `running`, `success` or `failure`."""
        self.now += seconds
        return NAMES[self.engine.tick(self.now)]

    def set(self, name: str, value: Value) -> None:
        """Let a message arrive for a value, in SI."""
        self._values[name], self._arrived[name] = value, self.now
        self._counts[name] = self.count(name) + 1

    def end(self, name: str, *, success: bool = True, outcome: str = "", message: str = "") -> None:
        """End the skill or service of this name that has run for the longest time; the next tick takes the result.

        Raises:
            KeyError: if none runs.
        """
        leaf = next((leaf for leaf, running in self._running.items() if running == name), None)
        if leaf is None:
            raise KeyError(f"'{name}' does not run")
        del self._running[leaf]
        self.engine.ended(leaf, Result(success, message, outcome))

    # The world of the engine

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value."""
        return self._values.get(name, NOT_ARRIVED)

    def age(self, name: str, /) -> float | NotArrived:
        """Return the age of a value [s]."""
        return self.now - self._arrived[name] if name in self._arrived else NOT_ARRIVED

    def count(self, name: str, /) -> int:
        """Return how many messages have arrived."""
        return self._counts.get(name, 0)

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Begin a skill."""
        self.calls.append((skill, dict(arguments)))
        self._running[leaf] = skill

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Begin a call of a service."""
        self.start(leaf, service, fields)

    def halt(self, leaf: int, /) -> None:
        """Forget a skill."""
        self._running.pop(leaf, None)

    def pause(self, leaf: int, /) -> None:
        """Leave a skill as it is: a test ends it or not."""

    def resume(self, leaf: int, /) -> None:
        """Leave a skill as it is."""

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Keep a message."""
        self.published.append((topic, dict(fields)))

    def say(self, event: MissionEvent, /) -> None:
        """Keep what it tells."""
        if text := self._story.line(event)[1]:
            self.told.append(text)

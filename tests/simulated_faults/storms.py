"""Storms: what goes wrong during one run of a robot, all of it from one seed."""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random

from rbxcompose.bus.topics import Publisher
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.missions.execution.requests import ResumeMission
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.runtime.supervision.members import Phase
from rbxcompose.sdk.ports import Qos
from tests.simulated_faults.safety import Laws, Violation, laws_of, violations
from tests.simulated_faults.whole_robot import Guest, WholeRobot

RAGES, CALMS = 9.0, 4.0  # [s] of robot time
TELEOP = "cmd_vel/teleop"
ABSURD = (math.nan, math.inf, -math.inf, 1e9, 1e-320)
SPEEDS = ("base", "max_speed"), ("go_to", "speed"), ("go_to", "turn_rate"), ("base", "max_turn_rate")


class Storm:
    """A weather, and faults that come at times of their own; `slack` is how late a message may be [s]."""

    def __init__(self, plan: Plan, seed: int) -> None:
        self.seed, self._random, self._luck = seed, Random(seed), Random(-seed - 1)
        self._longest_delay = self._random.choice([0.0, 0.01, 0.1, 0.3])
        self._losses, self._doubles = self._random.choice([0.0, 0.1, 0.4]), self._random.choice([0.0, 0.1])
        self.slack = self._longest_delay
        self.is_over = False
        self.faults: list[str] = []
        self.robot = WholeRobot(plan, self)
        self._guest = Guest(self.robot)
        self._teleop: Publisher[Twist] = self._guest.bus.publisher("guest", TELEOP, Twist, Qos.COMMAND)
        kinds = [self.kill, self.stall, self.cut, self.raise_, self.stop, self.teleop, self.absurd, self.param]
        for _ in range(self._random.randint(2, 8)):
            self._at(self._random.uniform(0.5, RAGES), self._random.choice(kinds))

    def run(self) -> None:
        """Let it rage, let the robot go on in calm weather, and bring it down."""
        self.robot.advance(RAGES)
        self.is_over = True
        self._release()
        self.robot.advance(CALMS)
        self.robot.conductor.go_down(0, "the storm is over")
        self.robot.advance(CALMS)

    @property
    def laws(self) -> Laws:
        """Return what the robot has to keep to in this weather."""
        return laws_of(self.robot.plan, slack=self.slack, is_lossless=not self._losses)

    def violations(self) -> list[Violation]:
        """Return what was not safe."""
        return violations(self.laws, self.robot.story)

    def __str__(self) -> str:
        return "\n".join([f"seed {self.seed}", *self.faults, "the log:", *self.robot.texts[-40:]])

    # The weather

    def delay(self) -> float:
        return 0.0 if self.is_over else self._luck.uniform(0.0, self._longest_delay)

    def copies(self) -> int:
        chance = self._luck.random()
        if self.is_over or chance >= self._losses + self._doubles:
            return 1
        return 0 if chance < self._losses else 2

    # Faults

    def kill(self) -> str:
        name = self._random.choice(["robot", "mission"])
        self.robot.kill_process(name)
        return f"{name} is killed"

    def stall(self) -> str:
        name = self._random.choice(["world", "robot", "mission"])
        seconds = self._random.choice([0.05, 0.3, 0.8, 1.5, *([3.0] if name != "world" else [])])
        self.slack = max(self.slack, self._longest_delay + seconds)
        self.robot.stall(name, seconds)
        return f"{name} hangs for {seconds} s"

    def cut(self) -> str:
        processes = self.robot.processes
        if len(processes) < 2:
            return "nobody is there to be parted"
        one, other = self._random.sample(sorted(processes), 2)
        seconds = self._random.uniform(0.1, 2.0)
        self.robot.network.cut(processes[one].session, processes[other].session, seconds)
        return f"{one} and {other} do not reach each other for {seconds:.2f} s"

    def raise_(self) -> str:
        one = self._random.choice([instance for instance in self.robot.plan.instances if instance.name != "base"])
        process = self.robot.processes.get(one.process)

        def planted() -> None:
            raise ValueError("planted")

        if process is not None and process.host is not None:
            process.post(one.name, planted)
        return f"{one.name} raises"

    def stop(self) -> str:
        self.robot.set_stopped(True)
        seconds = self._random.uniform(0.5, 2.0)
        self.robot.scheduler.at(self.robot.clock.now() + seconds, "storm", self._release)
        return f"stop, release after {seconds:.2f} s"

    def _release(self) -> None:
        if self.robot.conductor.is_stopped:
            self.robot.set_stopped(False)
        if "mission" in self.robot.processes and self.robot.conductor.states["mission"][0] == "active":
            self.robot.command("mission", ResumeMission())

    def teleop(self) -> str:
        speed, turn = self._random.uniform(-0.5, 0.5), self._random.uniform(-1.5, 1.5)
        for number in range(count := self._random.randint(1, 40)):
            twist = Twist(linear=Vector3(x=speed + number * 1e-7), angular=Vector3(z=turn))
            self._later(number * 0.05, lambda twist=twist: self._teleop(twist))  # type: ignore[misc]
        return f"teleop drives for {count * 0.05:.2f} s"

    def absurd(self) -> str:
        for number in range(count := self._random.randint(1, 20)):
            twist = Twist(linear=Vector3(x=self._random.choice(ABSURD)), angular=Vector3(z=self._random.choice(ABSURD)))
            self._later(number * 0.02, lambda twist=twist: self._teleop(twist))  # type: ignore[misc]
        return f"{count} commands that make no sense"

    def param(self) -> str:
        name, key = self._random.choice(SPEEDS)
        value = self._random.choice([0.1, 0.2, 0.4, -1.0, math.nan])
        client = self._guest.bus.client("guest", f"{name}/set_parameters", rcl.SetParameters)
        parameter = rcl.Parameter(
            name=key, value=rcl.ParameterValue(type=rcl.ParameterType.PARAMETER_DOUBLE, double_value=value)
        )
        client(rcl.SetParameters.Request(parameters=(parameter,)), lambda reply: None)
        return f"{name}.{key} is set to {value}"

    def _at(self, time: float, fault: Callable[[], str]) -> None:
        self.robot.scheduler.at(time, "storm", lambda: self._strike(fault))

    def _strike(self, fault: Callable[[], str]) -> None:
        if self.robot.conductor.phase is Phase.RUNNING:
            self.faults.append(f"{self.robot.clock.now():.3f} s: {fault()}")

    def _later(self, seconds: float, act: Callable[[], None]) -> None:
        self.robot.scheduler.at(self.robot.clock.now() + seconds, "storm", lambda: self._guest.post("guest", act))

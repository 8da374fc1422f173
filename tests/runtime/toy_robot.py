"""A robot of toy components, as a program: what `up` does, without a manifest. Tests run it in processes of its own."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from typing import Annotated

from pydantic import ValidationInfo, field_validator

from rbxcompose.compiler.plan.model import BusPlan, Instance, Plan
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.sdk import Component, Config, Live, MissionOver, MissionWaits, RobotHeld, component
from rbxcompose.tools.run_view import run_plan

SLOW = 120.0  # [s], longer than any test waits


class ToyConfig(Config):
    """How a toy behaves."""

    runs: float = 0.0
    """When its mission ends [s of robot time]; 0: never."""
    outcome: str = "success"
    """How its mission ends."""
    brakes: float = 0.1
    """Time to come to rest [s]."""
    is_broken: bool = False
    """Cannot be configured."""
    prints: str = ""
    """What it prints when it starts."""
    is_slow: bool = False
    """Takes long to configure."""
    dies_at: float = 0.0
    """When its process kills itself [s of robot time]; 0: never."""
    holds_at: float = 0.0
    """When it needs the robot to stand still [s of robot time]; 0: never."""
    holds_for: float = 1.0
    """How long it needs that [s]."""
    fails_at: float = 0.0
    """From when on it raises in each step [s of robot time]; 0: never."""
    hangs_at: float = 0.0
    """When it hangs [s of robot time]; 0: never."""
    waits_for: str = ""
    """The file for whose end it waits before it says whether it would take another size."""
    size: Annotated[int, Live()] = 0
    """Tells when somebody wants to change it."""

    @field_validator("size")
    @classmethod
    def _asked(cls, size: int, others: ValidationInfo) -> int:
        file = others.data["waits_for"]
        if size:
            print(f"{file or 'first'} asked to be {size}")  # noqa: T201
            while file and os.path.exists(file):
                time.sleep(0.01)
        return size


@component("toy")
class Toy(Component[ToyConfig]):
    """Counts its steps, tells what it is told."""

    rate = 20.0

    def configure(self) -> None:
        if self.config.is_slow:
            time.sleep(SLOW)
        if self.config.is_broken:
            raise OSError("no such device")
        self.steps = 0
        self.has_started = False
        self.reason = ""
        self.is_moving = False
        self.rests_at = 0.0

    def activate(self) -> None:
        self.is_moving = True

    def start(self) -> None:
        self.has_started = True
        self.info("started")
        if self.config.prints:
            print(self.config.prints)  # noqa: T201

    def stop(self) -> None:
        self.info("held")

    def release(self) -> None:
        self.info("free again")

    def brake(self) -> None:
        self.is_moving, self.rests_at = False, self.now + self.config.brakes
        self.info("braking")

    def lost(self, names: tuple[str, ...], cause: str) -> None:
        self.warn(f"lost {', '.join(names)}: {cause}")

    @property
    def is_at_rest(self) -> bool:
        return not self.is_moving and self.now >= self.rests_at

    def step(self, dt: float) -> None:
        self.steps += 1
        if self.steps % 10 == 0:
            self.info(f"step {self.steps}")
        if self.config.dies_at and self.now >= self.config.dies_at:
            signal.raise_signal(signal.SIGKILL)
        if self.config.holds_at:
            self.hold_still()
        if self.config.fails_at and self.now >= self.config.fails_at:
            raise OSError("no such device")
        if self.config.hangs_at and self.now >= self.config.hangs_at:
            time.sleep(60.0)
        if self.config.runs and self.has_started and self.now >= self.config.runs:
            self.has_started = False
            is_waiting = self.config.outcome == "waiting"
            end = MissionOver("toy", self.config.outcome)
            self.context.notify(MissionWaits("toy", "waits") if is_waiting else end)

    def hold_still(self) -> None:
        over = self.config.holds_at + self.config.holds_for
        reason = "a toy is on the floor" if self.config.holds_at <= self.now < over else ""
        if reason != self.reason:
            self.reason = reason
            self.context.notify(RobotHeld(self.name, reason))

    def deactivate(self) -> None:
        self.info("deactivated")

    def summary(self) -> dict[str, str]:
        return {"steps": str(self.steps)}


def toy_plan(name: str = "toys", *, port: int = 17447, access: str = "machine", **config: object) -> Plan:
    """Return a plan of two toys in two processes; `config` is that of the second."""
    first = Instance("first", "toy", ToyConfig(), "robot")
    second = Instance("second", "toy", ToyConfig.model_validate(config), "other", starts_after=("first",))
    return Plan(name, "toys.yaml", (first, second), BusPlan(port=port, access=access), start="toy")


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--name", default="toys")
    parser.add_argument("--config", default="{}", help="JSON")
    parser.add_argument("--port", type=int, default=17447)
    parser.add_argument("--access", default="machine")
    parser.add_argument("--rate", type=float, default=None)
    parser.add_argument("--stepped", action="store_true")
    parser.add_argument("--duration", type=float, default=None)
    parser.add_argument("-d", action="store_true")
    arguments = parser.parse_args()
    config = ToyConfig.model_validate_json(arguments.config).model_dump()
    options = RunOptions(arguments.stepped, arguments.rate, arguments.duration, arguments.d)
    return run_plan(toy_plan(arguments.name, port=arguments.port, access=arguments.access, **config), options)


if __name__ == "__main__":
    sys.exit(main())

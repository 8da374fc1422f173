"""Muxes of velocities in virtual time: each source is known by the speed that it commands."""

from __future__ import annotations

from typing import Any

from rbxcompose.domains.muxes.config import MuxConfig
from rbxcompose.domains.muxes.core import MuxCore, core_of
from rbxcompose.msgs.geometry_msgs import Twist, Vector3

Input = dict[str, Any]


def twist(speed: float) -> Twist:
    return Twist(linear=Vector3(x=speed))


class Driven:
    """A mux whose sources send speeds; `out` has what came out, with its time."""

    def __init__(self, inputs: dict[str, Input], **words: Any) -> None:
        self.core: MuxCore[Any] = core_of(MuxConfig.model_validate({"output": "cmd_vel", "inputs": inputs, **words}))
        self.out: list[tuple[float, float]] = []
        self.now = 0.0

    def at(self, now: float) -> None:
        """Let time pass, deadline by deadline."""
        while (deadline := self.core.next_deadline()) is not None and deadline <= now:
            self.now = max(deadline, self.now)
            self.take(self.core.tick(self.now))
        self.now = now

    def send(self, now: float, name: str, speed: float) -> bool:
        """Let a source send; return whether it gets through."""
        self.at(now)
        count = len(self.out)
        self.take(self.core.receive(name, twist(speed), now))
        return len(self.out) > count

    def flag(self, now: float, lock: str, is_on: bool) -> None:
        self.at(now)
        self.core.flag(lock, is_on, now)
        self.take(self.core.tick(now))

    def take(self, message: Twist | None) -> None:
        if message is not None:
            self.out.append((self.now, message.linear.x))

    @property
    def speeds(self) -> list[float]:
        return [speed for _, speed in self.out]

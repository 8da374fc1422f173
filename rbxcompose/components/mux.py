"""The command mux."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field

from rbxcompose.msgs import registry
from rbxcompose.msgs.std_msgs import Empty
from rbxcompose.msgs.types import Message
from rbxcompose.mux.core import MuxCore, MuxSource
from rbxcompose.sdk import Capability, Component, Config, Forwards, Frequency, In, Level, Out, Port, Time, component

LOCK = "lock_"  # prefix of the ports of locks; no input name may begin with it


class MuxSourceConfig(Config):
    """An input or a lock."""

    priority: int
    """The input with the highest priority wins."""
    timeout: Time = Field(gt=0)
    """The input counts as silent after this long without a message."""


class MuxInputConfig(MuxSourceConfig):
    """An input."""

    max_rate: Frequency | None = Field(None, gt=0)
    """Most messages from one publisher in another process; the rest is dropped and reported. Default: 1000 Hz."""


class MuxConfig(Config):
    """The output, its inputs and locks, and their priorities."""

    output: str
    """Topic to which the winner's messages are forwarded."""
    message: str = "geometry_msgs/msg/Twist"
    """ROS name of the message type."""
    inputs: dict[str, MuxInputConfig]
    """Sources by name; each has the topic `<output>/<name>`."""
    locks: dict[str, MuxSourceConfig] = {}
    """Heartbeat topics `<output>/<name>`: a silent one locks all inputs of a lower priority."""


@component("mux")
class Mux(Component[MuxConfig]):
    """Forwards the commands of one source: the live one with the highest priority. It never repeats a message.

    The lock `stop` is above all inputs; `rbxcompose stop` latches it and `release` opens it.

    Example:
        cmd_vel: {type: mux, output: cmd_vel, inputs: {teleop: {priority: 100, timeout: 0.5 s}}}
    """

    made_by = "There is one for each entry of the section `muxes`."

    @classmethod
    def ports(cls, config: MuxConfig) -> dict[str, Port[Any]]:
        """Return the output, one input per source and one per lock."""
        message = registry.message(config.message)
        ports: dict[str, Port[Any]] = {"output": Out(message, config.output, qos="command").named("output")}
        for name, one in config.inputs.items():
            topic = f"{config.output}/{name}"
            ports[name] = In(message, topic, qos="command", is_open=True, max_rate=one.max_rate).named(name)
        for name in config.locks:
            ports[LOCK + name] = In(Empty, f"{config.output}/{name}", qos="command", is_open=True).named(LOCK + name)
        return ports

    @classmethod
    def capabilities(cls, config: MuxConfig) -> tuple[Capability, ...]:
        """Declare which inputs it forwards."""
        ranked = sorted(config.inputs, key=lambda name: config.inputs[name].priority, reverse=True)
        return (Forwards(tuple(ranked), "output"),)

    def configure(self) -> None:
        """Build the core; a mux restarted while the robot is stopped starts closed."""
        zero = registry.message(self.config.message)()
        self.core: MuxCore[Message] = MuxCore(
            {name: MuxSource(one.priority, one.timeout) for name, one in self.config.inputs.items()},
            zero=zero,
            is_zero=lambda message: message == zero,
            locks={name: MuxSource(one.priority, one.timeout) for name, one in self.config.locks.items()},
            stopped=self.context.is_stopped,
        )
        self.told: object = None
        self.wakes_at = math.inf  # [s], the first of the wakes to come
        self.refused: list[str] = []

    def activate(self) -> None:
        """Check that all locks send heartbeats, after each has had time to do so."""
        if self.config.locks:
            self.context.wake_at(self.now + max(lock.timeout for lock in self.config.locks.values()))

    def take_over(self, old: Mux) -> None:
        """Take over who was sending: otherwise all sources would have to come to rest once after a stop."""
        self.core.take_over(old.core)

    def received(self, port: str, message: Any) -> None:
        """Forward a message of the winner, or take a heartbeat."""
        if port.startswith(LOCK):
            self.core.heartbeat(port.removeprefix(LOCK), self.now)
        elif (forwarded := self.core.receive(port, message, self.now)) is not None:
            self.send(forwarded)
        self.settle()

    def wake(self) -> None:
        """Send the single zero after the last source has ended."""
        self.wakes_at = math.inf
        if (zero := self.core.tick(self.now)) is not None:
            self.send(zero)
        self.settle()

    def stop(self) -> None:
        """Latch the lock `stop` and send a zero immediately."""
        self.send(self.core.stop(self.now))
        self.settle()

    def release(self) -> None:
        """Open the lock; a source that is still sending must come to rest once."""
        self.core.release(self.now)
        self.settle()

    def hold(self) -> None:
        """Send a zero and let nothing through while robot time stands still."""
        self.send(self.core.hold(self.now))
        self.settle()

    def go_on(self) -> None:
        """Let new messages through."""
        self.core.resume(self.now)
        self.settle()

    def brake(self) -> None:
        """Send a last zero and let nothing through any more."""
        self.send(self.core.close(self.now))
        self.settle()

    def send(self, message: Message) -> None:
        """Publish on the output."""
        self.bound["output"](message)

    def settle(self) -> None:
        """Schedule the next deadline, and report changes in which source is let through and which are locked out."""
        deadline = self.core.next_deadline()
        if deadline is not None and not self.now <= self.wakes_at <= deadline:  # each message puts off the deadline
            self.wakes_at = deadline
            self.context.wake_at(deadline)
        active = "stop" if self.core.stopped else self.core.active
        locked, refused = self.core.locked_out(self.now), self.core.refused(self.now)
        why = self.core.why(self.now)
        if (why, active, locked) != self.told:
            self.told = why, active, locked
            level = Level.WARN if locked else Level.OK
            self.status(level, why, active=active or "none", locked_out=", ".join(locked) or "none")
        if refused and not self.refused:
            self.warn(f"commands are blocked: {why}")
        self.refused = refused

"""Sees a robot from outside: what it commands and how it moves, as any other participant of the bus would."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from rbxcompose.bus.names import data_key
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.ports import Qos
from tests.simulated_faults.safety import PlanarVelocity, SentVelocity

COMMAND, MOTION = "cmd_vel", "odom"
PATIENCE = 60.0  # [s]
LOOK = 0.005  # [s] between two looks at what has come
TURNING = 0.1  # [rad/s]
ROLLING = 0.05  # [m/s]; more of either is motion
ON_ITS_WAY = 0.1  # [s]; a command that comes this late was sent before

M = TypeVar("M", bound=Message)


@dataclass
class Observer:
    """Keeps commands and motion with the time of their arrival [s, monotonic], told by Zenoh's own thread."""

    router: str
    hears_commands: bool = True
    story: list[SentVelocity] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._transport = ZenohTransport(open_peer(self.router), lambda owner, callback: None)
        if self.hears_commands:
            self._follow(COMMAND, Twist, Qos.COMMAND, lambda one: (one.linear.x, one.angular.z))
        self._follow(MOTION, Odometry, Qos.STATE, lambda one: (one.twist.twist.linear.x, one.twist.twist.angular.z))

    def listen(self, topic: str, message: type[M], qos: Qos, take: Callable[[M], None]) -> None:
        """Have each message of a topic taken, by Zenoh's thread."""
        key = data_key(0, topic, message.TYPE, message.HASH)
        self._transport.subscribe(key, qos, lambda arrival: take(decode(message, arrival.payload)))

    def _follow(self, topic: str, message: type[M], qos: Qos, velocity: Callable[[M], PlanarVelocity]) -> None:
        self.listen(
            topic, message, qos, lambda one: self.story.append(SentVelocity(time.monotonic(), topic, velocity(one)))
        )

    def last(self, topic: str) -> SentVelocity | None:
        """Return what came last on a topic."""
        return next((velocity for velocity in reversed(self.story) if velocity.topic == topic), None)

    @property
    def is_moving(self) -> bool:
        """Tell whether the base moved when it was heard of last."""
        last = self.last(MOTION)
        return last is not None and (abs(last.velocity[0]) > ROLLING or abs(last.velocity[1]) > TURNING)

    def wait_until_it_moves(self, since: float, holds: Callable[[], bool]) -> bool:
        """Wait for motion that was told after `since` [s], as long as something holds; tell whether it came."""
        deadline = time.monotonic() + PATIENCE
        while holds() and time.monotonic() < deadline:
            last = self.last(MOTION)
            if self.is_moving and last is not None and last.time > since:
                return True
            time.sleep(LOOK)
        return False

    def time_to_rest(self, since: float) -> float | None:
        """Return the time from the last command to rest [s], if none has come after `since` [s] until then."""
        story = list(self.story)
        rest = next(
            (
                velocity.time
                for velocity in story
                if velocity.topic == MOTION and velocity.time > since and velocity.is_rest
            ),
            None,
        )
        last = max(
            (velocity.time for velocity in story if velocity.topic == COMMAND and velocity.time < (rest or 0.0)),
            default=None,
        )
        if rest is None or last is None or last > since + ON_ITS_WAY:
            return None
        return rest - last

    def close(self) -> None:
        """Leave the bus."""
        self._transport.close()

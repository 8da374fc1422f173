"""Who drives the robot from a browser: one connection at a time, for as long as it keeps sending."""

import math
from dataclasses import replace

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.console.json_messages import WrongMessageError
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped, Vector3
from rbxcompose.msgs.types import Message

LEASE = 0.5  # [s] after the last command, when the robot is stopped and anyone may drive
LATEST = 0.25  # [s] by which a command may be older than the fastest one of its connection
DRIFT = 2e-4  # [s/s] by which the clock of a client may differ from ours
_MOST = 1e15  # [ms], beyond which nothing is a time


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """Where velocities go, and how fast they may be."""

    topic: str
    type: str
    max_speed: float = math.inf  # [m/s]
    max_turn_rate: float = math.inf  # [rad/s]
    aliases: frozenset[str] = frozenset()
    """Other topics on the way to the base: who sends there is taken to send to `topic`."""


class DriveLease:
    """The right of one client to send velocities; it ends `LEASE` after the last of them."""

    def __init__(self) -> None:
        self.client: int | None = None
        self.holder = ""  # its name
        self.until = math.inf  # [s]

    def take(self, client: int, name: str, now: float) -> bool:
        """Give the lease to a client and return whether it has it: nobody takes it from another one."""
        if self.client not in (None, client):
            return False
        self.client, self.holder, self.until = client, name, now + LEASE
        return True

    def renew(self, client: int, now: float) -> bool:
        """Extend the lease if this client has it; return whether it has."""
        if self.client != client or now >= self.until:
            return False
        self.until = now + LEASE
        return True

    def release(self, client: int) -> bool:
        """End the lease of this client; return whether it had it."""
        if self.client != client:
            return False
        self.client, self.holder, self.until = None, "", math.inf
        return True

    def expire(self, now: float) -> bool:
        """End a lease that was not renewed in time; return whether there was one."""
        return self.client is not None and now >= self.until and self.release(self.client)


class Lateness:
    """Judges how late commands come, by a clock of the client that nobody has set.

    What counts is how much longer a command took than the fastest one. This shortest delay may grow only as fast as
    clocks drift apart: a network that becomes slow is not taken for a clock.
    """

    def __init__(self) -> None:
        self._shortest: float | None = None  # [s], and the unknown difference of the clocks
        self._since = 0.0  # [s]

    def of(self, sent: object, now: float) -> float:
        """Return how late a command is [s] that was `sent` by the client's clock [ms] and came at `now` [s].

        Raises:
            WrongMessageError: if `sent` is no time.
        """
        if isinstance(sent, bool) or not isinstance(sent, int | float) or not abs(sent) < _MOST:
            raise WrongMessageError("'sent' is a time in milliseconds")
        delay = now - sent / 1000
        if self._shortest is None:
            self._shortest = delay
        else:
            self._shortest = min(delay, self._shortest + DRIFT * (now - self._since))
        self._since = now
        return delay - self._shortest


def limited(message: Message, limits: DriveLimits) -> Message:
    """Return a command with velocities within the limits: along the ground, and about the vertical axis.

    Raises:
        WrongMessageError: if a velocity is not finite, or the message has none.
    """
    if isinstance(message, Twist):
        return _limited(message, limits)
    if isinstance(message, TwistStamped):
        return replace(message, twist=_limited(message.twist, limits))
    raise WrongMessageError(f"{message.TYPE} has no velocity")


def moves(message: Message) -> bool:
    """Return whether a limited command is other than rest."""
    twist = message.twist if isinstance(message, TwistStamped) else message
    return isinstance(twist, Twist) and any((twist.linear.x, twist.linear.y, twist.angular.z))


def _limited(twist: Twist, limits: DriveLimits) -> Twist:
    x, y, turn = twist.linear.x, twist.linear.y, twist.angular.z
    if not all(map(math.isfinite, (x, y, turn))):
        raise WrongMessageError("a velocity is a number")
    speed = math.hypot(x, y)
    share = min(1.0, limits.max_speed / speed) if speed > 0 else 1.0
    turn = max(-limits.max_turn_rate, min(limits.max_turn_rate, turn))
    return Twist(linear=Vector3(x=share * x, y=share * y), angular=Vector3(z=turn))

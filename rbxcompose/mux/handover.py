"""A hand-over between two sources of velocities without a jump."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped, Vector3
from rbxcompose.mux.sources import Ramp

AXES = ("x", "y", "z")


def grown(last: float, wanted: float, most: float) -> float:
    """Return the next value on the way from `last` to `wanted`: it may grow by `most`, and shrink at once.

    What goes the other way is brought to 0 first. So nothing is ever faster than the new source wants it.
    """
    start = last if last * wanted > 0 else 0.0
    return math.copysign(min(abs(wanted), abs(start) + most), wanted)


class TwistRamp:
    """Bounds the growth [m/s^2, rad/s^2] of velocities after a hand-over, until they are what the new source commands.

    A smaller command, and so a stop, is never delayed.
    """

    def __init__(self, linear: float = math.inf, angular: float = math.inf) -> None:
        self._linear, self._angular = linear, angular
        self._last: tuple[Twist, float] | None = None  # what came out last, and when; None if nothing is bounded

    def limit(self, linear: float, angular: float) -> None:
        """Have other limits from now on."""
        self._linear, self._angular = linear, angular

    def begin(self, last: Twist, now: float) -> None:
        """Begin at the velocity that came out last."""
        self._last = last, now

    def through(self, message: Twist, now: float) -> Twist:
        """Return the velocity that comes out for a command."""
        if self._last is None:
            return message
        last, then = self._last
        linear = _limited(last.linear, message.linear, self._linear, now - then)
        angular = _limited(last.angular, message.angular, self._angular, now - then)
        if linear == message.linear and angular == message.angular:
            self._last = None
            return message
        out = Twist(linear=linear, angular=angular)
        self._last = out, now
        return out

    def end(self) -> None:
        """Bound nothing any more."""
        self._last = None


class StampedTwistRamp:
    """The same for velocities with a stamp; what comes out has the stamp of the command."""

    def __init__(self, linear: float = math.inf, angular: float = math.inf) -> None:
        self._ramp = TwistRamp(linear, angular)

    def limit(self, linear: float, angular: float) -> None:
        """Have other limits from now on."""
        self._ramp.limit(linear, angular)

    def begin(self, last: TwistStamped, now: float) -> None:
        """Begin at the velocity that came out last."""
        self._ramp.begin(last.twist, now)

    def through(self, message: TwistStamped, now: float) -> TwistStamped:
        """Return the velocity that comes out for a command."""
        return replace(message, twist=self._ramp.through(message.twist, now))

    def end(self) -> None:
        """Bound nothing any more."""
        self._ramp.end()


RAMPS: dict[str, Callable[[float, float], Ramp[Any]]] = {
    Twist.TYPE: TwistRamp,
    TwistStamped.TYPE: StampedTwistRamp,
}
"""By the name of the message type; there is none for other types."""


def _limited(last: Vector3, wanted: Vector3, acceleration: float, time: float) -> Vector3:
    most = acceleration * time if acceleration < math.inf else math.inf
    return Vector3(**{axis: grown(getattr(last, axis), getattr(wanted, axis), most) for axis in AXES})

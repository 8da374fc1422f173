"""How a head follows something that moves: by positions or by speeds, and what it does when that is lost.

The laws are those of the head tracker in P. Goebel, ROS By Example, volume 2 (2015), chapter 9, with angles of joints
in place of ratios in a picture, and with the speed of the target known from where it was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import Literal

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.limits import MotionLimits

SLOWS, EACH = 1.1, 0.05  # by which speeds are divided in each such time [s] without a target
SMOOTH = 0.1  # [s] over which the speed of a target is averaged
LEAP = 0.5  # [rad] at once: it is another target, whose speed is not known
STEADY = 0.3  # [s] after a picture of a target, for which that goes on as it did
CLOSE = 0.02  # [rad] from the middle that is as good as there


class HeadTrackingState(StrEnum):
    """What a head does."""

    FOLLOWS = "follows"
    SLOWS = "slows down"
    SEARCHES = "searches"
    RECENTRES = "recentres"
    RESTS = "rests"


@dataclass(frozen=True, slots=True)
class HeadTrackingSettings:
    """How to follow."""

    mode: Literal["position", "speed"] = "speed"
    """Whether it goes to where the target is, or at a speed by how far away it is."""
    gain: float = 5.0
    """Speed by the angle that is missing [1/s]; by positions, the part of that angle which is made up for at once."""
    threshold: float = 0.0
    """Angle that it does not make up for [rad]."""
    speed: float = 1.5
    """At most [rad/s]."""
    slowest: float = 0.001
    """If it moves at all [rad/s]."""
    ahead: float = 0.5
    """How far a position that it is told may be from where it is [rad]."""
    delay: float = 0.1
    """From where a joint should be until it is there [s]: so far ahead the target is expected."""
    lost: float = 0.5
    """Without a target, after which that is lost [s]."""
    recentre: float = 2.0
    """After which it looks ahead again; 0 is never [s]."""
    search: float = 0.0
    """How long it looks around before that [s]."""
    calm: float = 0.3
    """How fast it looks around and back [rad/s]."""


class HeadTracker:
    """Tells joints where to go; positions and speeds are in rad and rad/s, by joint."""

    def __init__(self, limits: Mapping[str, MotionLimits]) -> None:
        """Know the joints with their limits; the first one turns the head when it looks around."""
        self._limits = limits
        self._target: Mapping[str, float] | None = None
        self._speeds = dict.fromkeys(limits, 0.0)  # of the target
        self._seen = -math.inf  # [s]
        self._told: dict[str, float] = {}
        self._rates = dict.fromkeys(limits, 0.0)  # at which it goes by speeds
        self._side = 1.0
        self.state = HeadTrackingState.RESTS

    def see(self, target: Mapping[str, float], time: float) -> None:
        """Take the positions at which the head would look at the target at a time [s]."""
        passed = time - self._seen
        if passed <= 0.0:
            return
        known, self._target, self._seen = self._target, target, time
        for name, position in target.items():
            moved = position - known[name] if known is not None else math.inf
            if abs(moved) > LEAP or passed > STEADY:
                self._speeds[name] = 0.0
            else:
                share = 1.0 - math.exp(-passed / SMOOTH)
                self._speeds[name] += share * (moved / passed - self._speeds[name])

    def update(
        self, settings: HeadTrackingSettings, time: float, dt: float, present: Mapping[str, float]
    ) -> dict[str, float] | None:
        """Return where joints that are at `present` shall go, `dt` [s] after the last time; None if they may rest."""
        gone = time - self._seen
        told: dict[str, float] | None
        if gone <= settings.lost and self._target is not None:
            self.state = HeadTrackingState.FOLLOWS
            follow = self._by_speed if settings.mode == "speed" else self._by_position
            told = follow(settings, self._target, gone, dt, present)
        elif self._target is None or settings.recentre <= 0.0 or gone <= settings.lost + settings.recentre:
            told = self._slower(settings, dt)
        elif gone <= settings.lost + settings.recentre + settings.search:
            told = self._around(settings, dt, present)
        else:
            told = self._back(settings, dt, present)
        self._told = told if told is not None else {}
        return told

    def _expected(self, settings: HeadTrackingSettings, target: Mapping[str, float], gone: float, name: str) -> float:
        return target[name] + self._speeds[name] * (min(gone, STEADY) + settings.delay)

    def _by_position(
        self,
        settings: HeadTrackingSettings,
        target: Mapping[str, float],
        gone: float,
        dt: float,
        present: Mapping[str, float],
    ) -> dict[str, float]:
        told = {}
        for name in self._limits:
            missing = self._expected(settings, target, gone + dt, name) - present[name]
            step = min(max(missing * min(settings.gain, 1.0), -settings.ahead), settings.ahead)
            near = abs(target[name] - present[name]) <= settings.threshold
            told[name] = self._within(name, self._told.get(name, present[name]) if near else present[name] + step)
        return told

    def _by_speed(
        self,
        settings: HeadTrackingSettings,
        target: Mapping[str, float],
        gone: float,
        dt: float,
        present: Mapping[str, float],
    ) -> dict[str, float]:
        told = {}
        for name in self._limits:
            reference = self._told.get(name, present[name])
            missing = self._expected(settings, target, gone, name) - reference
            rate = 0.0 if abs(missing) <= settings.threshold else missing * settings.gain + self._speeds[name]
            if rate:
                rate = math.copysign(min(max(abs(rate), settings.slowest), settings.speed), rate)
            self._rates[name] = rate
            there = min(max(reference + rate * dt, present[name] - settings.ahead), present[name] + settings.ahead)
            told[name] = self._within(name, there)
        return told

    def _slower(self, settings: HeadTrackingSettings, dt: float) -> dict[str, float] | None:
        """Go on, slower and slower, if it went by speeds."""
        moving = settings.mode == "speed" and self._told and max(map(abs, self._rates.values())) > settings.slowest
        if not moving:
            self.state = HeadTrackingState.RESTS
            return None
        self.state = HeadTrackingState.SLOWS
        for name in self._rates:
            self._rates[name] *= SLOWS ** (-dt / EACH)
        return {name: self._within(name, at + self._rates[name] * dt) for name, at in self._told.items()}

    def _around(self, settings: HeadTrackingSettings, dt: float, present: Mapping[str, float]) -> dict[str, float]:
        """Turn to one side and to the other, by a quarter turn from ahead if the limits allow it."""
        self.state = HeadTrackingState.SEARCHES
        told = {name: self._told.get(name, present[name]) for name in self._limits}
        first = next(iter(self._limits))
        wanted, ahead = told[first] + self._side * settings.calm * dt, self._within(first, 0.0)
        told[first] = self._within(first, wanted)
        if wanted >= self._within(first, ahead + math.pi / 2):
            self._side = -1.0
        elif wanted <= self._within(first, ahead - math.pi / 2):
            self._side = 1.0
        return told

    def _back(self, settings: HeadTrackingSettings, dt: float, present: Mapping[str, float]) -> dict[str, float] | None:
        """Look ahead."""
        told = {}
        for name in self._limits:
            at = self._told.get(name, present[name])
            most = settings.calm * dt
            told[name] = at + min(max(self._within(name, 0.0) - at, -most), most)
        if all(abs(self._within(name, 0.0) - present[name]) <= CLOSE for name in self._limits):
            self.state = HeadTrackingState.RESTS
            return None
        self.state = HeadTrackingState.RECENTRES
        return told

    def _within(self, name: str, position: float) -> float:
        limits = self._limits[name]
        return min(max(position, limits.least), limits.greatest)

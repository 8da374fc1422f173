"""Backs a robot off from what its bumpers and cliff sensors feel, and holds it while a wheel has no ground."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from enum import Enum, auto
from typing import TYPE_CHECKING

from rbxcompose.base.geometry import AT_REST, Velocity2

if TYPE_CHECKING:
    from rbxcompose.domains.bases.components.safety_controller import SafetyControllerConfig

NEVER = -math.inf
ASIDE = 0.1  # sine above which a switch is at one side of the robot, and not ahead of it
CORNER = 3.0  # [s] after a manoeuvre within which another one turns the same way, so that corners are left


REACTION = 0.06  # [s] from an edge below a sensor to wheels that brake: two cycles of sensors and one of the base
STEEPEST = 60  # [deg] between the way of a base and straight over an edge; beyond that it drives along the edge


def lead_of(points: Collection[tuple[float, float]], wheel_distance: float) -> float:
    """Return how far a base drives at least from where a sensor passes a straight edge to where a wheel does [m].

    `points` are those of the sensors, x (ahead) and y; the wheels are beside the origin.
    """

    def lead(angle: float) -> float:
        cos, sin = math.cos(angle), math.sin(angle)
        return (max(x * cos + y * sin for x, y in points) - abs(sin) * wheel_distance / 2) / cos

    return min(lead(math.radians(degrees)) for degrees in range(-STEEPEST, STEEPEST + 1))


def speed_within(way: float, acceleration: float) -> float:
    """Return from which speed a base comes to rest within a way [m], its reaction included [m/s]."""
    return acceleration * (math.sqrt(REACTION**2 + 2.0 * max(way, 0.0) / acceleration) - REACTION)


class SafetyPhase(Enum):
    """What it does about what it feels."""

    WATCH = auto()
    """Nothing: others command the base."""
    PAUSE = auto()
    """It has just felt something, and stops."""
    BACK = auto()
    """It backs off."""
    STUCK = auto()
    """It has backed off for the longest time, still feels something, and stands still until that is over."""
    TURN = auto()
    """It turns away."""


class SafetyCore:
    """Decides, from switches around the robot, whether to command its base, and what.

    It `evades` what some kinds of switches feel: it stops, backs off, turns away from the side on which they are, and
    lets others command again. It never backs off for longer than `longest` at a time, however sensors flicker. It
    stands still while a switch of another kind is on (`holds`, such as dropped wheels), or while any kind is silent.
    `settings` may be replaced at any time. All times are robot time [s].
    """

    def __init__(self, settings: SafetyControllerConfig) -> None:
        self.settings = settings
        self.evades, self.holds = tuple(settings.evades), tuple(settings.holds)
        self.phase = SafetyPhase.WATCH
        self._on: dict[str, Mapping[str, float]] = {kind: {} for kind in (*self.evades, *self.holds)}
        self._heard = dict.fromkeys(self._on, NEVER)
        self._since = self._until = NEVER  # when the phase began, and when it ends if nothing is felt
        self._held_until = NEVER
        self._ended = NEVER  # when the last manoeuvre ended
        self._drives = -1.0  # backwards, forwards, or not at all
        self._turns, self._is_aside = 1.0, False  # to the left or right, and whether a switch at a side has decided it

    @property
    def felt(self) -> dict[str, float]:
        """Return what is to be evaded: names of switches, such as `left bumper`, with their angles [rad]."""
        return {f"{name} {kind}": angle for kind in self.evades for name, angle in self._on[kind].items()}

    @property
    def held(self) -> list[str]:
        """Return the switches that hold the robot, such as `left wheel_drop`."""
        return [f"{name} {kind}" for kind in self.holds for name in self._on[kind]]

    def silent(self, now: float) -> list[str]:
        """Return the kinds that are silent, or were never heard."""
        return [kind for kind, heard in self._heard.items() if now - heard > self.settings.silence]

    def feel(self, kind: str, on: Mapping[str, float], now: float) -> None:
        """Take which switches of a kind are on, with their angles around the robot [rad]."""
        self._on[kind], self._heard[kind] = dict(on), now

    def forget(self, now: float) -> None:
        """End what it does, and count all silence anew: a stop held the robot, or robot time stood still."""
        self.phase, self._held_until = SafetyPhase.WATCH, NEVER
        self._heard = {kind: NEVER if heard == NEVER else now for kind, heard in self._heard.items()}

    def command(self, now: float) -> Velocity2 | None:
        """Return what the base must do now, or None while others may command it."""
        if self.held:
            self._held_until = now + self.settings.settle
        if self.silent(now) or self.held or now < self._held_until:
            self.phase = SafetyPhase.WATCH
            return AT_REST
        self._proceed(self.felt.values(), now)
        match self.phase:
            case SafetyPhase.WATCH:
                return None
            case SafetyPhase.BACK:
                return Velocity2(self._drives * self.settings.back_speed)
            case SafetyPhase.TURN:
                return Velocity2(angular=self._turns * self.settings.turn_rate)
            case _:
                return AT_REST

    def _proceed(self, angles: Collection[float], now: float) -> None:
        """Go on to the phase that is due."""
        settings, phase = self.settings, self.phase
        if angles:
            if phase in (SafetyPhase.WATCH, SafetyPhase.TURN):
                self._is_aside = now - self._ended < CORNER if phase is SafetyPhase.WATCH else True
                self._enter(SafetyPhase.PAUSE, now, settings.pause)
            self._look_around(angles)
        if self.phase is SafetyPhase.PAUSE and now >= self._until:
            self._enter(SafetyPhase.BACK, now, settings.back_time)
        if self.phase is SafetyPhase.BACK:
            if angles:
                self._until = now + settings.back_time
            if now - self._since >= settings.longest:
                self._enter(SafetyPhase.STUCK, now, 0.0)
            elif not angles and now >= self._until:
                self._turn_away(now)
        if self.phase is SafetyPhase.STUCK and not angles:
            self._turn_away(now)
        if self.phase is SafetyPhase.TURN and now >= self._until:
            self.phase, self._ended = SafetyPhase.WATCH, now

    def _enter(self, phase: SafetyPhase, now: float, duration: float) -> None:
        self.phase, self._since, self._until = phase, now, now + duration

    def _turn_away(self, now: float) -> None:
        self._enter(SafetyPhase.TURN, now, self.settings.turn / self.settings.turn_rate)

    def _look_around(self, angles: Collection[float]) -> None:
        """Decide how to drive away, not at all from both ends, and to which side to turn.

        It turns away from the first switch that is not straight ahead or behind, else as the last time.
        """
        is_ahead, is_behind = (any(sign * math.cos(angle) >= 0 for angle in angles) for sign in (1, -1))
        self._drives = float(is_behind - is_ahead)
        aside = sum(map(math.sin, angles))
        if not self._is_aside and abs(aside) > ASIDE:
            self._turns, self._is_aside = -math.copysign(1.0, aside), True

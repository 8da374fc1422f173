"""Grippers: how far they are open, by the angle of their servos, and when a grip is done.

Openings are the distance between the pads [m], angles those of servos [rad], times robot time [s].
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Literal

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.transmission import Calibration


@dataclass(frozen=True, slots=True)
class FingerGeometry:
    """Fingers that turn about their bases: opening = pad_width + 2 finger_length sin(angle).

    ValueError if the range of openings is not reachable. The formula is that of the ArbotiX gripper controller.
    """

    pad_width: float = 0.01
    """Opening with parallel fingers [m]."""
    finger_length: float = 0.02
    """From the axis to the pad [m]."""
    least: float = 0.0
    greatest: float = 0.05

    def __post_init__(self) -> None:
        _check_range(self.least, self.greatest)
        if not self.finger_length > 0.0:
            raise ValueError(f"a finger of {self.finger_length} m does not open anything")
        reach = 2.0 * self.finger_length
        low, high = self.pad_width - reach, self.pad_width + reach
        for opening in (self.least, self.greatest):
            if not low <= opening <= high:
                raise ValueError(
                    f"fingers of {self.finger_length:g} m with pads of {self.pad_width:g} m open from {low:.4g} m to "
                    f"{high:.4g} m, so {opening:g} m is not reachable"
                )

    def angle(self, opening: float) -> float:
        """Return the angle of a finger [rad]. ValueError outside of the range."""
        _check_opening(opening, self.least, self.greatest)
        return math.asin(max(-1.0, min(1.0, (opening - self.pad_width) / (2.0 * self.finger_length))))

    def opening(self, angle: float) -> float:
        """Return the opening at an angle [m], within the range."""
        angle = max(-math.pi / 2, min(math.pi / 2, angle))
        opening = self.pad_width + 2.0 * self.finger_length * math.sin(angle)
        return max(self.least, min(self.greatest, opening))


@dataclass(frozen=True, slots=True)
class FingerGripper:
    """A servo turns a finger; a second one turns the other finger, if that is not fixed, in the opposite direction."""

    geometry: FingerGeometry
    centers: tuple[float, ...] = (0.0,)
    """The angle of each servo with parallel fingers [rad]."""
    inverts: tuple[bool, ...] = (False,)

    @property
    def _turns(self) -> tuple[float, ...]:
        """Which way each servo turns as the gripper opens, 1 or -1."""
        return tuple(-1.0 if invert != bool(side) else 1.0 for side, invert in enumerate(self.inverts))

    @property
    def openings(self) -> tuple[float, float]:
        """The least and the greatest opening [m]."""
        return self.geometry.least, self.geometry.greatest

    def angles(self, opening: float) -> tuple[float, ...]:
        """Return the angle of each servo [rad]."""
        angle = self.geometry.angle(opening)
        return tuple(center + turn * angle for center, turn in zip(self.centers, self._turns, strict=True))

    def opening(self, angles: Sequence[float]) -> float:
        """Return the opening at the measured angles [m]: that of the mean of the fingers."""
        turned = [turn * (at - center) for at, center, turn in zip(angles, self.centers, self._turns, strict=False)]
        return self.geometry.opening(sum(turned) / len(turned))


@dataclass(frozen=True, slots=True)
class ParallelGripper:
    """One servo moves both pads in parallel: angle = center + scale * opening."""

    scale: float = 1.0
    """[rad/m]; below 0 the servo turns the other way."""
    center: float = 0.0
    """Angle when closed [rad]."""
    least: float = 0.0
    greatest: float = 0.05

    def __post_init__(self) -> None:
        _check_range(self.least, self.greatest)
        if not math.isfinite(self.scale) or not self.scale:
            raise ValueError("with a scale of 0, or of no number, no angle belongs to an opening")

    @property
    def openings(self) -> tuple[float, float]:
        """The least and the greatest opening [m]."""
        return self.least, self.greatest

    def angles(self, opening: float) -> tuple[float, ...]:
        """Return the angle of the servo [rad]."""
        _check_opening(opening, self.least, self.greatest)
        return (self.center + self.scale * opening,)

    def opening(self, angles: Sequence[float]) -> float:
        """Return the opening at the measured angle [m]."""
        return max(self.least, min(self.greatest, (angles[0] - self.center) / self.scale))


@dataclass(frozen=True, slots=True)
class CalibratedGripper:
    """One servo, measured: pairs of opening [m] and angle [rad]."""

    table: Calibration

    @property
    def openings(self) -> tuple[float, float]:
        """The least and the greatest opening [m]."""
        return self.table.pairs[0][0], self.table.pairs[-1][0]

    def angles(self, opening: float) -> tuple[float, ...]:
        """Return the angle of the servo [rad]."""
        _check_opening(opening, *self.openings)
        return (self.table.value(opening),)

    def opening(self, angles: Sequence[float]) -> float:
        """Return the opening at the measured angle [m]."""
        return self.table.inverse(angles[0])


GripperModel = FingerGripper | ParallelGripper | CalibratedGripper
"""From the opening to the angles of the servos and back, exact within the domain."""


@dataclass(frozen=True, slots=True)
class GripPolicy:
    """When a grip is done."""

    tolerance: float = 0.002
    """Within this of the wanted opening it has been reached [m]."""
    stall_progress: float = 0.001
    """A gripper that moves less than this within `stall_window` has stalled [m]."""
    stall_window: float = 1.0
    """[s]."""
    on_stall: Literal["success", "fail"] = "success"
    """Whether to stall, which is how a gripper holds an object, is what was wanted."""


@dataclass(frozen=True, slots=True)
class GripOutcome:
    """How a grip ended, with the fields of `control_msgs/action/GripperCommand`."""

    position: float
    """Opening [m]."""
    effort: float
    stalled: bool
    reached_goal: bool
    is_success: bool
    message: str


class GripAttempt:
    """One command of a gripper, judged by the progress of its opening: no effort needs to be measured."""

    def __init__(self, model: GripperModel, opening: float, policy: GripPolicy) -> None:
        """Begin; ValueError with the reason if the gripper cannot open that far."""
        self.angles = model.angles(opening)
        self._model, self._wanted, self._policy = model, opening, policy
        self._seen: deque[tuple[float, float]] = deque()  # times and openings of the window

    def step(self, now: float, angles: Sequence[float], effort: float = 0.0) -> GripOutcome | None:
        """Return the outcome at measured `angles` [rad] and `effort` [Nm or N], None while it goes on."""
        if not all(map(math.isfinite, angles)):
            return None
        opening = self._model.opening(angles)
        self._seen.append((now, opening))
        if abs(opening - self._wanted) <= self._policy.tolerance:
            return GripOutcome(opening, effort, False, True, True, f"open by {opening:.4f} m")
        if not self._has_stalled(now):
            return None
        is_success = self._policy.on_stall == "success"
        message = f"stalled at {opening:.4f} m, {abs(opening - self._wanted):.4f} m from {self._wanted:.4f} m"
        return GripOutcome(opening, effort, True, False, is_success, message)

    def _has_stalled(self, now: float) -> bool:
        begin = now - self._policy.stall_window
        if self._seen[0][0] > begin:
            return False
        while len(self._seen) > 1 and self._seen[1][0] <= begin:
            self._seen.popleft()
        openings = [opening for _, opening in self._seen]
        return max(openings) - min(openings) < self._policy.stall_progress


def _check_range(least: float, greatest: float) -> None:
    if not (math.isfinite(least) and math.isfinite(greatest) and 0.0 <= least < greatest):
        raise ValueError(f"openings from {least:g} m to {greatest:g} m are no range at or above 0 m")


def _check_opening(opening: float, least: float, greatest: float) -> None:
    if not least <= opening <= greatest:
        raise ValueError(f"it opens from {least:g} m to {greatest:g} m, not by {opening:g} m")

"""The least time of a drive from pose to pose, as `GoToCore` drives: turn, drive straight, turn again."""

from __future__ import annotations

import math

from rbxcompose.geometry import Pose2, wrap_angle
from rbxcompose.navigation.go_to import AIM, ALIGNED, GoToSettings


def least_time(
    start: Pose2,
    goal: Pose2,
    settings: GoToSettings,
    *,
    acceleration: float = math.inf,
    turn_acceleration: float = math.inf,
) -> float:
    """Return the least time from a pose to a goal [s], for a base with these accelerations [m/s^2, rad/s^2].

    The start may be anywhere within the tolerances around the pose. A drive of 20 tolerances or more takes at most a
    quarter longer, if nothing is in its way.
    """

    def turn(angle: float, until: float) -> float:
        return _glide(angle, until, settings.turn_rate, settings.turn_deceleration, turn_acceleration)

    distance, tolerance = start.distance(goal), settings.distance_tolerance
    if distance <= 2 * tolerance:
        return 0.0
    bearing = math.atan2(goal.y - start.y, goal.x - start.x)
    first = abs(wrap_angle(bearing - start.heading)) - settings.heading_tolerance - math.asin(tolerance / distance)
    last = abs(wrap_angle(goal.heading - bearing)) - math.asin(2 * tolerance / distance)
    straight = _glide(distance - tolerance, tolerance * AIM, settings.speed, settings.deceleration, acceleration)
    return turn(first, ALIGNED) + straight + turn(last, settings.heading_tolerance * AIM)


def _glide(left: float, until: float, most: float, deceleration: float, acceleration: float) -> float:
    """Return the time from rest until only `until` is left of a way: speed up, keep the speed `most`, brake."""
    if left <= until:
        return 0.0
    part = 1.0 if math.isinf(acceleration) else acceleration / (acceleration + deceleration)
    peak = min(most, math.sqrt(2 * left * deceleration * part))
    brakes_at = max(peak * peak / (2 * deceleration), until)
    speeding_up = peak * peak / (2 * acceleration)
    cruising = max(0.0, left - speeding_up - brakes_at) / peak
    braking = math.sqrt(2 * min(brakes_at, left) / deceleration) - math.sqrt(2 * until / deceleration)
    return peak / acceleration + cruising + max(0.0, braking)

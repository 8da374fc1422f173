"""Things and spots that an arm does not reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.body.model import Body
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity, Span
from rbxcompose.geometry import Vector3
from rbxcompose.hand_config import SpotModel
from rbxcompose.model.arm_goals import WrittenReach, first_joint_in, length_of, word_of, written_reaches
from rbxcompose.model.robot import Robot
from rbxcompose.motion.grasps import reach_of
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.rules import WIRING
from rbxcompose.sections.scene import scene
from rbxcompose.units import LENGTH, format_quantity

_TIMES = 10.0  # as far as the arm is long: a unit is wrong
_HELD = 0.5  # [m] above a spot in which an arm may hold what it puts there
_UP: Vector3 = (0.0, 0.0, 1.0)


@check("RBX2382", Severity.WARNING, closed=(WIRING, "scene"))
def too_far(robot: Robot) -> Iterator[Finding]:
    """An arm is to pick or place something where it does not reach

    The thing, or the spot for it, is farther from the arm than all its links together with its fingers are long. What
    stands in a frame outside of the body, such as `map`, may come nearer when the robot drives, and is not told.

    Bad: `pick_arm: cup`, where the cup is 2 m away and the arm is 40 cm long.
    Good: `pick_arm: cup`, where the cup is 30 cm away.
    """
    contents, description = robot.manifest.contents, robot.manifest.body
    if description is None:
        return
    body, things = description.body, {one.name: one for one in contents.of(scene).objects}
    picked = {(word_of(one, "object")[0], one.name) for one in written_reaches(robot, "pick")}
    for pick in written_reaches(robot, "pick"):
        name, span = word_of(pick, "object")
        shoulder = first_joint_in(body, pick.arm, things[name].link) if _is_carried(body, things.get(name)) else None
        is_brought = any(one == name and arm != pick.name for one, arm in picked)
        if shoulder is None or is_brought:  # by another arm, to a place that nobody knows
            continue
        away = math.dist(shoulder, things[name].pose.translation) - _radius(things[name])
        related = Related(robot.key("scene", "objects", name), "the thing")
        yield from _told(robot, body, pick, (f"'{name}'", away, span), related)
    for place in written_reaches(robot, "place"):
        name, span = word_of(place, "spot")
        spot, length = place.arm.model.spots.get(name), length_of(robot, body, place.arm)
        if spot is None or (spot.on in things and max(things[spot.on].shape.size) > _TIMES * length):
            continue  # a support in a wrong unit, which RBX2246 tells
        if (from_it := _from_spot(body, place, spot, things.get(spot.on or ""))) is not None:
            related = Related(robot.key("arms", place.name, "spots", name), "the spot")
            yield from _told(robot, body, place, (f"the spot '{name}'", from_it - spot.tolerance, span), related)


def _told(
    robot: Robot, body: Body, reach: WrittenReach, goal: tuple[str, float, Span], related: Related
) -> Iterator[Finding]:
    (what, away, span), model = goal, reach.arm.model
    poses = body.poses({})
    fingers = poses[reach.arm.group.tip].inverse().compose(poses[model.grasp or reach.arm.group.tip]).translation
    length = length_of(robot, body, reach.arm) + math.hypot(*fingers)
    if away <= length + 0.001 or reach.may_fail:
        return
    shown, most = (format_quantity(round(one, 3), LENGTH, "m" if one >= 1.0 else "cm") for one in (away, length))
    is_unit = away > _TIMES * length
    yield too_far.at(
        span,
        f"{what} is {shown} from the first joint of '{reach.name}', which reaches {most} with all its links",
        help="is a unit wrong? A number without a unit counts in metres" if is_unit else "place it nearer to the arm",
        related=[related],
    )


def _is_carried(body: Body, one: PlacedObject | None) -> bool:
    return one is not None and one.link in body.links


def _radius(one: PlacedObject) -> float:
    """Return how far a thing reaches from its origin at most [m]; infinite if that is unknown."""
    axes: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), _UP)
    sides = [(reach_of(one, one.pose.rotation, axis), reach_of(one, one.pose.rotation, _back(axis))) for axis in axes]
    far = [max(ahead, back) if ahead is not None and back is not None else math.inf for ahead, back in sides]
    return math.hypot(*far)


def _back(axis: Vector3) -> Vector3:
    x, y, z = axis
    return (-x, -y, -z)


def _from_spot(body: Body, place: WrittenReach, spot: SpotModel, on: PlacedObject | None) -> float | None:
    """Return how far a spot is at least from the first joint [m]; None if nobody knows."""
    if spot.on is not None and (on is None or on.link != body.root):
        return None
    frame = body.root if on is not None else spot.frame or body.root
    shoulder = first_joint_in(body, place.arm, frame) if frame in body.links else None
    if shoulder is None:
        return None
    if on is None:
        return math.dist(shoulder, (spot.x, spot.y, spot.z))
    top, (x, y, z) = reach_of(on, on.pose.rotation, _UP), on.pose.translation
    if top is None:
        return None
    level = max(0.0, math.hypot(shoulder[0] - x, shoulder[1] - y) - math.hypot(spot.x, spot.y))
    low = z + top + spot.z
    return math.hypot(level, shoulder[2] - min(max(shoulder[2], low), low + _HELD))

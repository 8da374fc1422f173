"""Things and spots that an arm does not reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.body.model import Body
from rbxcompose.check_runner import check
from rbxcompose.checks.goal_beyond_limits import known_value
from rbxcompose.findings import Finding, Related, Severity, Span
from rbxcompose.geometry import Vector3
from rbxcompose.hand_config import SpotModel
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.model.arm_goals import WrittenReach, first_joint_in, length_of, word_of, written_reaches
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot
from rbxcompose.motion.grasps import reach_of
from rbxcompose.motion.scene import PlacedObject, settled
from rbxcompose.rules import WIRING
from rbxcompose.sections.arms import ArmOfRobot, arms
from rbxcompose.sections.scene import scene
from rbxcompose.units import LENGTH, format_quantity

_TIMES = 10.0  # as far as the arm is long: a unit is wrong
_HELD = 0.5  # [m] above a spot in which an arm may hold what it puts there
_UP: Vector3 = (0.0, 0.0, 1.0)
_AXES = ("x", "y", "z")
_NUMBERS = (*_AXES, "tolerance")
_ATTACH = "attach"
_MOVES_THINGS = "moveit_msgs/msg/CollisionObject"


@check("RBX2382", Severity.WARNING, closed=(WIRING, "scene"))
def too_far(robot: Robot) -> Iterator[Finding]:
    """An arm is to pick or place something where it does not reach."""
    description = robot.manifest.body
    if description is not None:
        yield from _Reaches(robot, description.body).findings()


class _Reaches:
    """The things of a robot, its spots, and who may bring a thing elsewhere before it is needed."""

    def __init__(self, robot: Robot, body: Body) -> None:
        self.robot, self.body = robot, body
        self.things = {one.name: one for one in robot.manifest.contents.of(scene).objects}
        self.picks = [(one, *word_of(one, "object")) for one in written_reaches(robot, "pick")]
        self.places = list(written_reaches(robot, "place"))
        self.is_open = any(one.type_name == _MOVES_THINGS for ends in robot.writers.values() for one in ends)
        self.attached = {_word(one) for one in _steps(robot, _ATTACH)}

    def findings(self) -> Iterator[Finding]:
        """Yield what is out of reach."""
        for pick, name, span in self.picks:
            thing = self.things.get(name)
            if thing is not None and thing.link in self.body.links and not self.is_brought(name, pick.name):
                shoulder = first_joint_in(self.body, pick.arm, thing.link)
                if shoulder is not None and not pick.may_fail:
                    away = math.dist(shoulder, thing.pose.translation) - _radius(thing)
                    related = [Related(self.robot.key("scene", "objects", name), "the thing")]
                    yield from self.told((pick.name, pick.arm), f"'{name}'", away, span, related)
        for place in self.places:
            if not place.may_fail:
                yield from self.placed(place)
        yield from self.unused()

    def is_brought(self, name: str, arm: str) -> bool:
        """Return whether something else than this arm may bring a thing, to a place that nobody knows."""
        others = any(word in ("", name) and one.name != arm for one, word, _ in self.picks)
        return others or self.is_open or bool(self.attached & {name, ""})

    def placed(self, place: WrittenReach) -> Iterator[Finding]:
        """Yield that a place of a mission is out of reach."""
        (name, span), model = word_of(place, "spot"), place.arm.model
        known = constants(place.mission)
        numbers = {one: known_value(place.arguments[one], known) for one in _NUMBERS if one in place.arguments}
        if any(number is None for number in numbers.values()):
            return
        at = {one: number for one, number in numbers.items() if number is not None}
        if "spot" in place.arguments:
            if (spot := model.spots.get(name)) is None:
                return
            spot = spot.model_copy(update={"tolerance": at.get("tolerance") or spot.tolerance})
            related = [Related(self.robot.key("arms", place.name, "spots", name), "the spot")]
            yield from self.far_spot((place.name, place.arm), f"the spot '{name}'", spot, span, related)
            return
        words = {one: word_of(place, one)[0] for one in ("frame", "on") if one in place.arguments}
        if all(words.values()):
            x, y, z, tolerance = (at.get(one, 0.0) for one in _NUMBERS)
            spot = SpotModel(x=x, y=y, z=z, tolerance=max(0.0, tolerance), frame=words.get("frame"), on=words.get("on"))
            far = max((one for one in _AXES if one in at), key=lambda one: abs(at[one]), default="")
            span = place.arguments[far].value.span if far else place.node.span
            yield from self.far_spot((place.name, place.arm), "this", spot, span, [])

    def unused(self) -> Iterator[Finding]:
        """Yield the spots out of reach that no mission names: people and programs may."""
        used = {(one.name, word_of(one, "spot")[0]) for one in self.places if "spot" in one.arguments}
        for name, arm in self.robot.manifest.contents.of(arms).items():
            for word, spot in arm.model.spots.items():
                if not used & {(name, word), (name, "")}:
                    span = self.robot.key("arms", name, "spots", word)
                    yield from self.far_spot((name, arm), f"the spot '{word}'", spot, span, [])

    def far_spot(
        self, arm: tuple[str, ArmOfRobot], what: str, spot: SpotModel, span: Span, related: list[Related]
    ) -> Iterator[Finding]:
        """Yield that a spot is out of reach."""
        on, length = self.things.get(spot.on or ""), length_of(self.robot, self.body, arm[1])
        if on is not None and (self.is_brought(on.name, "") or max(on.shape.size) > _TIMES * length):
            return  # elsewhere, or a support in a wrong unit, which RBX2246 tells
        if (from_it := _from_spot(self.body, arm[1], spot, on)) is not None:
            slack = spot.tolerance + self.held(arm[0])
            yield from self.told(arm, what, from_it, span, related, slack)

    def held(self, arm: str) -> float:
        """Return how far from the middle of a thing the hand may be that puts it down [m]."""
        found = 0.0
        for pick, name, _ in self.picks:
            if pick.name == arm:
                grasps = pick.arm.model.grasps.get(name, ())
                own = _radius(self.things[name]) if name in self.things and not self.is_open else _HELD
                found = max(found, own, *(math.hypot(one.x, one.y, one.z) for one in grasps))
        return found or _HELD

    def told(
        self,
        arm: tuple[str, ArmOfRobot],
        what: str,
        away: float,
        span: Span,
        related: list[Related],
        slack: float = 0.0,
    ) -> Iterator[Finding]:
        """Yield that something is too far `away` from the first joint [m], if that and `slack` do not suffice."""
        (name, one), poses = arm, self.body.poses({})
        fingers = poses[one.group.tip].inverse().compose(poses[one.model.grasp or one.group.tip]).translation
        length = length_of(self.robot, self.body, one) + math.hypot(*fingers)
        if away <= length + slack + 0.001:
            return
        shown, most = (format_quantity(round(one, 3), LENGTH, "m" if one >= 1.0 else "cm") for one in (away, length))
        is_unit = away > _TIMES * length
        yield too_far.at(
            span,
            f"{what} is {shown} from the first joint of '{name}', which reaches {most} with all its links",
            help="is a unit wrong? A number without a unit counts in metres"
            if is_unit
            else "place it nearer to the arm",
            related=related,
        )


def _steps(robot: Robot, skill: str) -> Iterator[MissionNode]:
    return (node for mission in robot.missions.values() for node in mission.program.nodes if node.skill == skill)


def _word(node: MissionNode) -> str:
    """Return the object that a step attaches; nothing if that is known only later."""
    values = [one.value for one in node.step.arguments if one.name in ("", "object")]
    text = values[0].text if values and isinstance(values[0], ScalarNode) else ""
    return "" if "$" in text else text


def _radius(one: PlacedObject) -> float:
    """Return how far a thing reaches from its origin at most [m]; infinite if that is unknown."""
    axes: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), _UP)
    sides = [(reach_of(one, one.pose.rotation, axis), reach_of(one, one.pose.rotation, _back(axis))) for axis in axes]
    far = [max(ahead, back) if ahead is not None and back is not None else math.inf for ahead, back in sides]
    return math.hypot(*far)


def _back(axis: Vector3) -> Vector3:
    x, y, z = axis
    return (-x, -y, -z)


def _from_spot(body: Body, arm: ArmOfRobot, spot: SpotModel, on: PlacedObject | None) -> float | None:
    """Return how far a spot is at least from the first joint [m]; None if nobody knows."""
    on = settled(on, body) if on is not None else None
    if spot.on is not None and (on is None or on.link != body.root):
        return None
    frame = body.root if on is not None else spot.frame or body.root
    shoulder = first_joint_in(body, arm, frame) if frame in body.links else None
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

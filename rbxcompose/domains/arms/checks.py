"""Rules about arms: what they reach, hold and keep, and what is around them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from itertools import product

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import DID_YOU_MEAN, MISSIONS, NAMES, WIRING, Finding, Related, Severity, Span, suggest
from rbxcompose.base.geometry import Transform3, Vector3, conjugate, rotate
from rbxcompose.base.printable import plain
from rbxcompose.base.units import LENGTH, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot, RobotMission
from rbxcompose.compiler.model.skills import constants
from rbxcompose.domains.arms.motion.grasps import least_width, reach_of, solid_of, widths_of
from rbxcompose.domains.arms.motion.groups import way_up
from rbxcompose.domains.arms.motion.scene import PlacedObject, settled
from rbxcompose.domains.arms.section_models import SpotModel
from rbxcompose.domains.arms.sections.arms import ArmOfRobot, arms, hand_in
from rbxcompose.domains.arms.sections.heads import heads
from rbxcompose.domains.arms.sections.scene import scene
from rbxcompose.domains.body.model import Body, BodyJoint, Geometry
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.checks import known_value
from rbxcompose.domains.servos.sections.joints import limits_in
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode, at
from rbxcompose.missions.analysis.facts import Constants
from rbxcompose.missions.program.parts import NodeFlow, WrittenArgument
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.msgs.moveit_msgs import CollisionObject
from rbxcompose.sdk.capabilities import Drives, PutsThings, WritesFrame
from rbxcompose.sdk.ports import Out

_ELSEWHERE = (NodeFlow.FIRST, NodeFlow.ONE_OF, NodeFlow.OPEN)
"""How nodes go through children after whose failure others may follow."""


@dataclass(frozen=True, slots=True)
class WrittenReach:
    """A step of a mission that brings the tip of an arm to a pose, or to a thing."""

    mission: RobotMission
    node: MissionNode
    name: str
    arm: ArmOfRobot
    arguments: Mapping[str, WrittenArgument]

    @property
    def may_fail(self) -> bool:
        """Return whether something else follows a failure, so that it may be meant."""
        node: MissionNode | None = self.node
        while node is not None:
            above = None if node.parent is None else self.mission.program.nodes[node.parent]
            if node.is_forgiven or (above is not None and above.step.flow in _ELSEWHERE):
                return True
            node = above
        return False


def written_reaches(robot: Robot, verb: str = "reach") -> Iterator[WrittenReach]:
    """Yield the steps of all missions that bring the tip of an arm to a pose; or that `pick`, or `place`."""
    skills = {f"{verb}_{name}": (name, arm) for name, arm in robot.manifest.contents.of(arms).items()}
    for mission in robot.missions.values() if skills else ():
        for node in mission.program.nodes:
            if node.skill in skills and node.skill in robot.skills:
                main = robot.skills[node.skill].skill.main
                arguments = {argument.name or main: argument for argument in node.step.arguments}
                yield WrittenReach(mission, node, *skills[node.skill], arguments)


def word_of(reach: WrittenReach, argument: str) -> tuple[str, Span]:
    """Return the word that an argument is, and its place; nothing if it is not there or known only later."""
    written = reach.arguments.get(argument)
    if written is None or not isinstance(written.value, ScalarNode) or "$" in written.value.text:
        return "", reach.node.span
    return written.value.text, written.value.span


def length_of(robot: Robot, body: Body, arm: ArmOfRobot) -> float:
    """Return how far a tip can be from the first joint of its arm [m]: all links stretched out; infinite if unlimited.

    No place farther away can be reached, whatever the directions of the joints are.
    """
    total, way = 0.0, way_up(body, arm.group)
    for joint in way:
        if joint.slides:
            limits = limits_in(robot.manifest.contents, joint)
            ends = (limits.lower, limits.upper)
            total += max(math.inf if end is None else abs(end) for end in ends)
    return total + sum(math.hypot(*joint.origin.translation) for joint in way[:-1])


def first_joint_in(body: Body, arm: ArmOfRobot, frame: str) -> Vector3 | None:
    """Return where the first joint of an arm is in the frame of a link [m]; None if other joints move one of them."""
    first = way_up(body, arm.group)[-1]
    if _movers(body, first.parent) != _movers(body, frame):
        return None
    poses = body.poses({})
    return poses[frame].inverse().apply(poses[first.parent].apply(first.origin.translation))


def _movers(body: Body, link: str) -> set[str]:
    """Return the joints that move a link in the frame of the root."""
    return {joint.name for joint in body.joints_above(link) if joint.kind != "fixed"}


@check("RBX2379", Severity.WARNING, closed=(WIRING, NAMES, "scene"))
def frame_of_object(robot: Robot) -> Iterator[Finding]:
    """A thing of the scene is in a frame without a transform to the body."""
    description, written = robot.manifest.contents.of(body), robot.declared(WritesFrame)
    if description is None or robot.declared(Drives):
        return  # RBX2286
    shape, placed = description.body, {frame.child.value for _, frame in written}
    known = placed | {frame.parent.value for _, frame in written}
    for thing in robot.manifest.contents.of(scene).objects if shape.root not in placed else ():
        if thing.link not in shape.links and thing.link in known:  # RBX2019 reports the others
            yield frame_of_object.at(
                robot.value("scene", "objects", thing.name, "frame"),
                f"no component publishes the transform from '{thing.link}' to '{shape.root}'",
                help="leave 'frame' out: what stands beside the robot counts from its root",
                related=[Related(shape.links[shape.root].span, "the root of the body")],
                about=(shape.root, thing.link),
            )


@check("RBX2340")
def grasp_frame(robot: Robot) -> Iterator[Finding]:
    """The frame between the fingers of an arm does not move with its tip."""
    description = robot.manifest.contents.of(body)
    for name, arm in robot.manifest.contents.of(arms).items():
        link = arm.model.grasp
        if description is None or link is None or link not in description.body.links:
            continue
        above, way = description.body.joint_above, list[BodyJoint]()
        while link != arm.group.tip and link in above:
            way.append(above[link])
            link = above[link].parent
        moving = next((joint for joint in way if joint.moves), None)
        if link != arm.group.tip or moving is not None:
            words = f"'{moving.name}' moves between them" if moving and link == arm.group.tip else "it is not below it"
            message = f"'{arm.model.grasp}' does not move with '{arm.group.tip}', the tip of the arm: {words}"
            yield grasp_frame.at(robot.value("arms", name, "grasp"), message)


@check("RBX2341")
def hand_without_gripper(robot: Robot) -> Iterator[Finding]:
    """An arm without a gripper can neither pick nor place."""
    for name, arm in robot.manifest.contents.of(arms).items():
        for key in ("grasp", "squeeze", "grasps", "spots"):
            if getattr(arm.model, key) and arm.model.gripper is None:
                message = f"'{key}' of the arm '{name}' has no effect: the arm has no 'gripper'"
                yield hand_without_gripper.at(robot.key("arms", name, key), message)
        if arm.model.planner.processes > 1 and arm.model.gripper is None:
            message = f"'processes' of the arm '{name}' has no effect: the arm has no 'gripper'"
            yield hand_without_gripper.at(robot.key("arms", name, "planner", "processes"), message)


@check("RBX2376", Severity.WARNING, closed=(WIRING, MISSIONS, "scene"))
def idle_grasps(robot: Robot) -> Iterator[Finding]:
    """Grasps are given for an object that does not exist."""
    contents = robot.manifest.contents
    objects = [object_.name for object_ in contents.of(scene).objects]
    if not objects or any(isinstance(end.port, Out) and end.port.interface is CollisionObject for end in robot.ends):
        return
    picks = list(written_reaches(robot, "pick"))
    for name, arm in contents.of(arms).items():
        picked = [word_of(pick, "object")[0] for pick in picks if pick.name == name]
        if not picked or not all(picked):
            continue  # what it picks is known only later
        for one in (each for each in arm.model.grasps if each not in (*objects, *picked)):
            others = [each for each in dict.fromkeys(picked) if each not in arm.model.grasps]
            hint = f"{DID_YOU_MEAN} '{others[0]}'?" if len(others) == 1 else suggest(one, objects, "objects")
            yield idle_grasps.at(
                robot.key("arms", name, "grasps", one), f"no object of the scene is named '{one}'", help=hint
            )


_KEEP, _ENDS = "keep", ("lower", "upper")


@check("RBX2375")
def kept_bounds(robot: Robot) -> Iterator[Finding]:
    """The bounds that an arm is to keep on its way are the wrong way round."""
    for verb in ("reach", "move"):
        for goal in written_reaches(robot, verb):
            if _KEEP in goal.arguments:
                for node in _ranges(goal.arguments[_KEEP].value, constants(goal.mission)):
                    yield kept_bounds.at(node.span, "this range goes from more to less", help="exchange its ends")


def _ranges(node: TreeNode, known: Constants) -> Iterator[TreeNode]:
    """Yield the ranges below a node whose ends are known and the wrong way round."""
    if isinstance(node, SequenceNode):
        if _is_reversed(node.items, known):
            yield node
        for item in node.items:
            yield from _ranges(item, known)
    elif isinstance(node, MappingNode):
        ends = [node.entries[end].value for end in _ENDS if end in node.entries]
        if _is_reversed(ends, known):
            yield node
        for entry in node.entries.values():
            yield from _ranges(entry.value, known)


def _is_reversed(ends: list[TreeNode] | tuple[TreeNode, ...], known: Constants) -> bool:
    if len(ends) != len(_ENDS):
        return False
    low, high = (known_value(WrittenArgument("", end, end.span), known) for end in ends)
    return low is not None and high is not None and low > high


@check("RBX2377", closed=("arms", "heads", "scene"))
def look_frame(robot: Robot) -> Iterator[Finding]:
    """A head is to look at an object, or at a point in a frame, that it does not know."""
    contents, description = robot.manifest.contents, robot.manifest.contents.of(body)
    found = contents.of(heads)
    if description is None:
        return
    skills = {"look_at" if len(found) == 1 else f"look_at_{name}": name for name in found}
    for node in (node for mission in robot.missions.values() for node in mission.program.nodes if node.skill in skills):
        head, written = (skills[node.skill], next((item for item in node.step.arguments if item.name == "frame"), None))
        if (thing := _word(node)) and not contents.of(arms):
            yield look_frame.at(
                next(item.value.span for item in node.step.arguments if item.name in ("", "object")),
                f"'{head}' knows no object '{thing}': only a robot with 'arms' has a scene",
                help="look at a point, or at a frame that it 'tracks'",
                related=[Related(robot.key("heads", head), "the head")],
            )
        frames = (*found[head].model.frames, *contents.of(scene).frames)
        if written is None or not isinstance(written.value, ScalarNode) or "$" in written.value.text:
            continue
        frame = written.value.text
        if frame and frame not in description.body.links and frame not in frames:
            near = suggest(frame, (*frames, *description.body.links), "its links")
            listed = ", ".join((*found[head].model.frames, frame))
            yield look_frame.at(
                written.value.span,
                f"'{head}' knows no frame '{frame}'",
                help=f"write 'frames: [{listed}]' below it" if frame in ("map", "odom") else near,
                related=[Related(robot.key("heads", head), "the head")],
            )


@check("RBX2378", Severity.WARNING, closed=())
def moving_stand(robot: Robot) -> Iterator[Finding]:
    """Seen things are to stand in a frame that a joint moves."""
    description = robot.manifest.contents.of(body)
    for component, puts in robot.declared(PutsThings) if description else ():
        shape = description.body if description else Body("")
        mover = next((joint for joint in shape.joints_above(puts.stands_in.value) if joint.moves), None)
        if mover is not None and component.is_sound:
            yield moving_stand.at(
                robot.value(*component.place(puts.stands_in.field)),
                f"'{mover.name}' moves '{puts.stands_in.value}', and with it all things that were seen",
                help=f"write a link that it does not move, such as '{shape.root}'",
                related=[Related(mover.span, "the joint")],
            )


_PARALLEL = 1e-9  # length of a cross product of two unit vectors below which they count as parallel


@dataclass(frozen=True, slots=True)
class SolidBox:
    """A box with its middle at `pose`, and half of its lengths along the axes there [m]."""

    pose: Transform3
    half: Vector3

    @property
    def axes(self) -> list[Vector3]:
        """Return its three axes."""
        return [rotate(self.pose.rotation, one) for one in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]


def box_within(shape: Geometry, pose: Transform3) -> SolidBox | None:
    """Return a box of which no part is outside of a shape; None for what has no simple one, such as a mesh."""
    match shape.kind, shape.size:
        case "box", (x, y, z):
            return SolidBox(pose, (x / 2.0, y / 2.0, z / 2.0))
        case "cylinder", (radius, length):
            across = radius / math.sqrt(2.0)
            return SolidBox(pose, (across, across, length / 2.0))
        case "sphere", (radius,):
            return SolidBox(pose, (radius / math.sqrt(3.0),) * 3)
    return None


def penetration(box: SolidBox, other: SolidBox) -> float:
    """Return how far two boxes reach into each other [m], at most 0 if they are apart.

    They are apart if an axis of one of them, or a normal to an axis of each, separates them (S. Gottschalk et al.,
    OBBTree, 1996). Otherwise the least overlap along these is what would have to be moved.
    """
    first, second = box.axes, other.axes
    x, y, z = (to - at for to, at in zip(other.pose.translation, box.pose.translation, strict=True))
    return min(
        _reach(box, first, axis) + _reach(other, second, axis) - abs(_dot((x, y, z), axis))
        for axis in (*first, *second, *_normals(first, second))
    )


def _normals(first: list[Vector3], second: list[Vector3]) -> Iterator[Vector3]:
    for (ax, ay, az), (bx, by, bz) in product(first, second):
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        if (length := math.hypot(x, y, z)) > _PARALLEL:
            yield x / length, y / length, z / length


def _reach(box: SolidBox, axes: list[Vector3], along: Vector3) -> float:
    return sum(half * abs(_dot(axis, along)) for half, axis in zip(box.half, axes, strict=True))


def _dot(vector: Vector3, other: Vector3) -> float:
    return vector[0] * other[0] + vector[1] * other[1] + vector[2] * other[2]


_OPTICAL = "_optical"  # by REP 103, such a frame is that of its camera, with the suffix `_optical`


@check("RBX2371", Severity.WARNING, closed=())
def optical_camera(robot: Robot) -> Iterator[Finding]:
    """The camera of a head is an optical frame."""
    contents, description = robot.manifest.contents, robot.manifest.contents.of(body)
    if description is None:
        return
    shape = description.body
    for name, head in contents.of(heads).items():
        camera = head.model.camera
        if _OPTICAL in camera and camera in shape.joint_above:
            plain = camera.replace(_OPTICAL, "")
            link = plain if plain in shape.links else shape.joint_above[camera].parent
            yield optical_camera.at(
                robot.value("heads", name, "camera"),
                f"'{camera}' looks along its z, and a head points the x of its camera",
                help=f"write 'camera: {link}'",
                related=[Related(shape.links[camera].span, "the link")],
            )


_AXES = ("x", "y", "z")


@check("RBX2359", Severity.ERROR, closed=(WIRING,))
def placeless_goal(robot: Robot) -> Iterator[Finding]:
    """A step does not say where the tip of an arm should be."""
    for reach in written_reaches(robot):
        any_position = "any_position" in reach.arguments and word_of(reach, "any_position")[0] != "false"
        if not any_position and not reach.arguments.keys() & set(_AXES):
            message = f"'{reach.node.skill}' has no position for the tip"
            help_text = "give 'x', 'y' and 'z', or 'any_position: true' if only the orientation counts"
            yield placeless_goal.at(reach.node.span, message, help=help_text)


_FEW = 3  # joints that a position alone needs
_TIMES = 10.0  # as far as the arm is long: a unit is wrong
_TURNS = ("roll", "pitch", "yaw")


@check("RBX4167", Severity.WARNING, closed=(WIRING,))
def reach_goal(robot: Robot) -> Iterator[Finding]:
    """An arm is to reach what it cannot reach."""
    description = robot.manifest.contents.of(body)
    if description is None:
        return
    for reach in written_reaches(robot):
        yield from _mistakes(robot, description.body, reach)
    for node, known, what in _named(robot, description.body):
        if isinstance(node, ScalarNode) and node.text and "$" not in node.text and node.text not in known:
            yield reach_goal.at(node.span, f"{what} '{node.text}'", help=suggest(node.text, known, "there are"))
    for trace in written_reaches(robot, "trace"):
        yield from _no_way(trace)


def _named(robot: Robot, body: Body) -> Iterator[tuple[TreeNode | None, Collection[str], str]]:
    """Yield links, joints and spots that steps of arms name: what is written, what there is, and the words if it is
    another one."""
    links = body.links, "the body has no link"
    for verb in ("reach", "move"):
        for goal in written_reaches(robot, verb):
            if _KEEP not in goal.arguments:
                continue
            keep = goal.arguments[_KEEP].value
            yield at(keep, ("frame",)), *links
            yield at(keep, ("sight", "sensor")), *links
            yield at(keep, ("sight", "target")), *links
            joints = at(keep, ("joints",))
            for joint in joints.items if isinstance(joints, SequenceNode) else ():
                yield at(joint, ("name",)), goal.arm.group.joints, f"'{goal.name}' has no joint"
    for verb in ("trace", "place"):
        for goal in written_reaches(robot, verb):
            if written := goal.arguments.get("frame"):
                yield written.value, *links
            if (written := goal.arguments.get("spot")) and not goal.arm.model.spots:
                yield written.value, (), f"'{goal.name}' has no 'spots', so not the spot"
    for step in _steps(robot, _ATTACH):
        yield from ((argument.value, *links) for argument in step.step.arguments if argument.name == "link")


def _no_way(trace: WrittenReach) -> Iterator[Finding]:
    """Yield that the points of a step are no way."""
    points = trace.arguments["points"].value if "points" in trace.arguments else None
    if not isinstance(points, SequenceNode):
        return
    last = at(points.items[-1], ("via",)) if points.items else None
    if not points.items:
        yield reach_goal.at(points.span, f"'{trace.node.skill}' has no points to go through")
    elif isinstance(last, ScalarNode) and last.text == "true":
        yield reach_goal.at(last.span, "the last point is in the middle of an arc", help="add the point where it ends")


def _mistakes(robot: Robot, body: Body, reach: WrittenReach) -> Iterator[Finding]:
    frame, written = body.root, reach.arguments.get("frame")
    if written is not None and (not isinstance(written.value, ScalarNode) or "$" in written.value.text):
        return
    if written is not None and isinstance(written.value, ScalarNode):
        frame = written.value.text or body.root
    if written is not None and frame not in body.links:
        message = f"the body has no link '{frame}' in whose frame '{reach.node.skill}' could count"
        yield reach_goal.at(written.value.span, message, help=suggest(frame, body.links, "its links"))
    elif not reach.may_fail:
        yield from filter(None, (_too_stiff(reach), _too_far(robot, body, reach, frame)))


def _too_far(robot: Robot, body: Body, reach: WrittenReach, frame: str) -> Finding | None:
    if any(name in reach.arguments and word_of(reach, name)[0] != "false" for name in ("any_position", "approximate")):
        return None
    known, shoulder = constants(reach.mission), first_joint_in(body, reach.arm, frame)
    at = [known_value(reach.arguments[axis], known) if axis in reach.arguments else 0.0 for axis in _AXES]
    x, y, z, slack = (*at, known_value(reach.arguments["tolerance"], known) if "tolerance" in reach.arguments else 0.0)
    if shoulder is None or x is None or y is None or z is None or slack is None:
        return None
    away, length = math.dist((x, y, z), shoulder), length_of(robot, body, reach.arm)
    if away <= length + slack + 0.001:
        return None
    far = {axis: abs(value) for axis, value in zip(_AXES, (x, y, z), strict=True) if axis in reach.arguments}
    span = reach.arguments[max(far, key=lambda axis: far[axis])].value.span if far else reach.node.span
    shown, most, help_text = _far_words(away, length, "choose a place nearer to it")
    message = f"this is {shown} from the first joint of '{reach.name}', and all its links together are {most} long"
    return reach_goal.at(span, message, help=help_text)


def _far_words(away: float, length: float, cure: str) -> tuple[str, str, str]:
    """Return how far away something is, how long the arm is, and what to do: its unit is wrong, or that cure."""
    shown, most = (format_quantity(round(each, 3), LENGTH, "m" if each >= 1.0 else "cm") for each in (away, length))
    is_unit = away > _TIMES * length
    return shown, most, "is a unit wrong? A number without a unit counts in metres" if is_unit else cure


def _too_stiff(reach: WrittenReach) -> Finding | None:
    asked = reach.arguments.keys() & {*_TURNS, "any_orientation", "any_position", "approximate", "angle_tolerance"}
    count = len(reach.arm.group.joints)
    if count > _FEW or asked:
        return None
    return reach_goal.at(
        reach.node.span,
        f"'{reach.name}' has {count} joints: it cannot turn its tip as it likes, and no orientation is asked for",
        help="add 'any_orientation: true', so that only the position counts",
    )


_SHOWN = 3


@check("RBX2354", Severity.WARNING, closed=())
def seen_only(robot: Robot) -> Iterator[Finding]:
    """A link is seen, and arms move through it."""
    description = robot.manifest.contents.of(body)
    if description is None or not robot.manifest.contents.of(arms):
        return
    found = [link for link in description.body.links.values() if link.visuals and not link.collisions]
    if found:
        names = ", ".join(f"'{plain(link.name, 60)}'" for link in found[:_SHOWN])
        more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
        verb = "has" if len(found) == 1 else "have"
        yield seen_only.at(
            found[0].span,
            f"{names}{more} {verb} visual shapes and no collision shape, so arms may hit things with what is seen",
            help="give each a collision shape, or write 'cover: visual' under 'body'",
            related=[Related(link.span, "the next") for link in found[1:_SHOWN]],
        )


_UPRIGHT = 0.999  # cosine of the angle by which a support may be tilted
_ROUNDING = 1e-6  # [m]


@check("RBX2380", Severity.WARNING, closed=(WIRING, "scene"))
def spot_beside(robot: Robot) -> Iterator[Finding]:
    """A spot is beside what the thing is to be put on."""
    contents = robot.manifest.contents
    things = {object_.name: object_ for object_ in contents.of(scene).objects}
    for arm, one in contents.of(arms).items():
        for name, spot in one.model.spots.items():
            if spot.on in things:
                spans = {axis: robot.value("arms", arm, "spots", name, axis) for axis in ("x", "y")}
                yield from _beyond_edge(robot, f"the spot '{name}'", things[spot.on], (spot.x, spot.y), spans)
    for place in written_reaches(robot, "place"):
        on, _ = word_of(place, "on")
        given = {axis: place.arguments[axis] for axis in ("x", "y") if axis in place.arguments}
        numbers = {axis: known_value(written, constants(place.mission)) for axis, written in given.items()}
        x, y = numbers.get("x", 0.0), numbers.get("y", 0.0)
        if on in things and x is not None and y is not None and not place.may_fail:
            spans = {axis: written.value.span for axis, written in given.items()}
            yield from _beyond_edge(robot, "this", things[on], (x, y), spans)


def _beyond_edge(
    robot: Robot, what: str, on: PlacedObject, at: tuple[float, float], spans: Mapping[str, Span]
) -> Iterator[Finding]:
    for axis, away, edge in _beyond(on, *at):
        shown, most = (format_quantity(round(each, 4), LENGTH, "cm") for each in (abs(away), edge))
        yield spot_beside.at(
            spans[axis],
            f"{what} is {shown} from the middle of '{on.name}', whose edge is {most} from it",
            help=f"choose a place on it: at most {most} from its middle",
            related=[Related(robot.key("scene", "objects", on.name), "it is put on this")],
        )
        return


def _beyond(on: PlacedObject, x: float, y: float) -> Iterator[tuple[str, float, float]]:
    """Yield where a point of the upper face is beyond its edge: the axis, and how far it and the edge are out [m]."""
    solid = solid_of(on)
    turn = on.pose.compose(solid.pose).rotation if solid else (0.0, 0.0, 0.0, 1.0)
    if solid is None or math.hypot(*solid.pose.translation) > _ROUNDING or rotate(turn, (0.0, 0.0, 1.0))[2] < _UPRIGHT:
        return  # its upper face is another one
    if solid.shape.kind == "box":
        own = rotate(conjugate(solid.pose.rotation), (x, y, 0.0))
        for axis, at, size in zip(("x", "y"), own, solid.shape.size, strict=False):
            if abs(at) > size / 2 + _ROUNDING:
                yield axis, at, size / 2
    elif solid.shape.kind == "cylinder" and math.hypot(x, y) > solid.shape.size[0] + _ROUNDING:
        yield "x" if abs(x) >= abs(y) else "y", math.hypot(x, y), solid.shape.size[0]


_HELD = 0.5  # [m] above a spot in which an arm may hold what it puts there
_UP: Vector3 = (0.0, 0.0, 1.0)
_NUMBERS = (*_AXES, "tolerance")
_ATTACH = "attach"
_MOVES_THINGS = "moveit_msgs/msg/CollisionObject"


@check("RBX2382", Severity.WARNING, closed=(WIRING, "scene"))
def too_far(robot: Robot) -> Iterator[Finding]:
    """An arm is to pick or place something where it does not reach."""
    description = robot.manifest.contents.of(body)
    if description is not None:
        yield from _Reaches(robot, description.body).findings()


class _Reaches:
    """The things of a robot, its spots, and who may bring a thing elsewhere before it is needed."""

    def __init__(self, robot: Robot, body: Body) -> None:
        self.robot, self.body = robot, body
        self.things = {object_.name: object_ for object_ in robot.manifest.contents.of(scene).objects}
        self.picks = [(reach, *word_of(reach, "object")) for reach in written_reaches(robot, "pick")]
        self.places = list(written_reaches(robot, "place"))
        self.is_open = any(end.type_name == _MOVES_THINGS for ends in robot.writers.values() for end in ends)
        self.attached = {_word(step) for step in _steps(robot, _ATTACH)}

    def findings(self) -> Iterator[Finding]:
        """Yield what is out of reach."""
        for pick, name, span in self.picks:
            thing = self.things.get(name)
            if thing is not None and thing.link in self.body.links and not self.is_brought(name, pick.name):
                shoulder = first_joint_in(self.body, pick.arm, thing.link)
                if shoulder is not None and not pick.may_fail:
                    away = math.dist(shoulder, thing.pose.translation) - _radius(thing)
                    related = [Related(self.robot.key("scene", "objects", name), "the thing")]
                    yield from self.out_of_reach((pick.name, pick.arm), f"'{name}'", away, span, related)
        for place in self.places:
            if not place.may_fail:
                yield from self.placed(place)
        yield from self.unused()

    def is_brought(self, name: str, arm: str) -> bool:
        """Return whether something else than this arm may bring a thing, to a place that nobody knows."""
        others = any(word in ("", name) and reach.name != arm for reach, word, _ in self.picks)
        return others or self.is_open or bool(self.attached & {name, ""})

    def placed(self, place: WrittenReach) -> Iterator[Finding]:
        """Yield that a place of a mission is out of reach."""
        (name, span), model = word_of(place, "spot"), place.arm.model
        known = constants(place.mission)
        numbers = {item: known_value(place.arguments[item], known) for item in _NUMBERS if item in place.arguments}
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
        words = {text: word_of(place, text)[0] for text in ("frame", "on") if text in place.arguments}
        if all(words.values()):
            x, y, z, tolerance = (at.get(number, 0.0) for number in _NUMBERS)
            spot = SpotModel(x=x, y=y, z=z, tolerance=max(0.0, tolerance), frame=words.get("frame"), on=words.get("on"))
            far = max((axis for axis in _AXES if axis in at), key=lambda text: abs(at[text]), default="")
            span = place.arguments[far].value.span if far else place.node.span
            yield from self.far_spot((place.name, place.arm), "this", spot, span, [])

    def unused(self) -> Iterator[Finding]:
        """Yield the spots out of reach that no mission names: people and programs may."""
        used = {(place.name, word_of(place, "spot")[0]) for place in self.places if "spot" in place.arguments}
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
            return  # elsewhere, or a support in a wrong unit, which RBX2246 reports
        if (from_it := _from_spot(self.body, arm[1], spot, on)) is not None:
            slack = spot.tolerance + self.held(arm[0])
            yield from self.out_of_reach(arm, what, from_it, span, related, slack)

    def held(self, arm: str) -> float:
        """Return how far from the middle of a thing the hand may be that puts it down [m]."""
        found = 0.0
        for pick, name, _ in self.picks:
            if pick.name == arm:
                grasps = pick.arm.model.grasps.get(name, ())
                own = _radius(self.things[name]) if name in self.things and not self.is_open else _HELD
                found = max(found, own, *(math.hypot(grasp.x, grasp.y, grasp.z) for grasp in grasps))
        return found or _HELD

    def out_of_reach(
        self,
        arm: tuple[str, ArmOfRobot],
        what: str,
        away: float,
        span: Span,
        related: list[Related],
        slack: float = 0.0,
    ) -> Iterator[Finding]:
        """Yield that something is too far `away` from the first joint [m], if that and `slack` do not suffice."""
        (name, robot), poses = arm, self.body.poses({})
        fingers = poses[robot.group.tip].inverse().compose(poses[robot.model.grasp or robot.group.tip]).translation
        length = length_of(self.robot, self.body, robot) + math.hypot(*fingers)
        if away <= length + slack + 0.001:
            return
        shown, most, help_text = _far_words(away, length, "place it nearer to the arm")
        message = f"{what} is {shown} from the first joint of '{name}', which reaches {most} with all its links"
        yield too_far.at(span, message, help=help_text, related=related)


def _steps(robot: Robot, skill: str) -> Iterator[MissionNode]:
    return (node for mission in robot.missions.values() for node in mission.program.nodes if node.skill == skill)


def _word(node: MissionNode) -> str:
    """Return the object that a step attaches; nothing if that is known only later."""
    values = [argument.value for argument in node.step.arguments if argument.name in ("", "object")]
    text = values[0].text if values and isinstance(values[0], ScalarNode) else ""
    return "" if "$" in text else text


def _radius(thing: PlacedObject) -> float:
    """Return how far a thing reaches from its origin at most [m]; infinite if that is unknown."""
    axes = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)]
    ends = [end for axis in axes if (end := reach_of(thing, thing.pose.rotation, axis)) is not None]
    return math.hypot(*map(max, ends[:3], ends[3:])) if ends else math.inf


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


_BEARINGS = 16  # directions from which an arm may come


@check("RBX2381", Severity.WARNING, closed=(WIRING, "scene"))
def too_wide(robot: Robot) -> Iterator[Finding]:
    """A gripper is to pick what is wider than it opens."""
    contents, description = robot.manifest.contents, robot.manifest.contents.of(body)
    if description is None:
        return
    things = {object_.name: object_ for object_ in contents.of(scene).objects}
    for pick in written_reaches(robot, "pick"):
        name, span = word_of(pick, "object")
        one, hand = things.get(name), hand_in(contents, pick.arm)
        if one is None or hand is None or hand.opening is None or pick.may_fail:
            continue
        width, widest = _width(description.body, one, [each.width for each in hand.grasps.get(name, ())], hand.opening)
        if width is not None:
            shown, most = (format_quantity(round(each, 4), LENGTH, "cm") for each in (width, widest))
            yield too_wide.at(
                span,
                f"'{name}' is {shown} wide where fingers hold it, and the gripper of '{pick.name}' opens {most}",
                help="choose a thinner thing or a wider gripper; is a unit or a radius wrong?",
                related=[Related(robot.key("scene", "objects", name), "the thing")],
            )


def _width(
    body: Body, thing: PlacedObject, given: list[float], opening: tuple[float, float]
) -> tuple[float | None, float]:
    """Return the width of a thing where it can be held [m], None if it fits or is unknown, and the opening [m]."""
    widest = opening[1]
    if given:
        return (min(given) if min(given) >= widest else None), widest
    if (solid := solid_of(thing)) is None:
        return None, widest
    if least_width(solid.shape) >= widest:
        return least_width(solid.shape), widest
    if thing.link != body.root:
        return None, widest  # nobody knows how it will be turned
    at, turns = thing.pose.compose(solid.pose), (math.tau * index / _BEARINGS for index in range(_BEARINGS))
    width = min((width for turn in turns for width in widths_of(solid.shape, at, turn)), default=None)
    return (None if width is not None and width < widest else width), widest


_COUNTS = {"any_position": ("x", "y", "z", "tolerance"), "any_orientation": ("roll", "pitch", "yaw", "angle_tolerance")}


@check("RBX2358", Severity.WARNING, closed=(WIRING,))
def uncounted_goal(robot: Robot) -> Iterator[Finding]:
    """A step says where the tip should be, and that this does not count."""
    for reach in written_reaches(robot):
        said = [name for name in _COUNTS if word_of(reach, name)[0] == "true"]
        if len(said) > 1:
            span, message = reach.arguments[said[1]].value.span, "neither the position nor the orientation counts"
            yield uncounted_goal.at(span, message, help=f"leave out '{said[0]}' or '{said[1]}'")
        else:
            yield from (finding for word in said for finding in _uncounted(reach, word))


def _uncounted(reach: WrittenReach, word: str) -> Iterator[Finding]:
    related = [Related(reach.arguments[word].value.span, "because of this")]
    for name in _COUNTS[word]:
        if name in reach.arguments:
            message = f"'{name}' does nothing beside '{word}: true'"
            yield uncounted_goal.at(
                reach.arguments[name].value.span, message, help=f"leave out '{name}' or '{word}'", related=related
            )


_ON_AXIS = 0.001  # [m]
_UNIT = "is a unit wrong? A number without a unit counts in metres: for centimetres, write '20 cm'"
_FARTHER = "place it farther away, or name the link below 'touches'"
_INTO = 0.01  # [m]: what stands against the robot, or a little beside its place, is no mistake
_SOLID = ("box", "cylinder", "capsule", "sphere")


@check("RBX2246", Severity.WARNING, closed=())
def object_in_robot(robot: Robot) -> Iterator[Finding]:
    """A thing of the scene is where the robot is."""
    contents, description = robot.manifest.contents, robot.manifest.contents.of(body)
    if description is None or not contents.of(arms):
        return
    shape = description.body
    points = list(_fixed_points(shape))
    longest = max(length_of(robot, shape, arm) for arm in contents.of(arms).values())
    for one in contents.of(scene).objects:
        into = shape.still[one.link].compose(one.pose).inverse() if one.link in shape.still else None
        for link, point in points if into and one.shape.kind in ("box", "sphere", "cylinder") else ():
            if into and link not in one.touches and _contains(one.shape, into.apply(point)):
                yield object_in_robot.at(
                    robot.key("scene", "objects", one.name),
                    f"'{one.name}' is where '{link}' always is, so every arm with this link collides at its start",
                    help=_UNIT if max(one.shape.size) > _TIMES * longest else _FARTHER,
                    related=[Related(shape.links[link].span, "the link")],
                )
                break
        else:
            yield from _in_still_link(robot, shape, one)


def _in_still_link(robot: Robot, body: Body, thing: PlacedObject) -> Iterator[Finding]:
    """Yield the finding about a thing that reaches into a link that nothing moves."""
    still = body.still
    box = box_within(thing.shape, still[thing.link].compose(thing.pose)) if thing.link in still else None
    for link in still if box else ():
        for shape in body.links[link].collisions if link not in thing.touches else ():
            other = box_within(shape.geometry, still[link].compose(shape.origin))
            if box and other and penetration(box, other) > _INTO:
                yield object_in_robot.at(
                    robot.key("scene", "objects", thing.name),
                    f"'{thing.name}' reaches into '{link}', which nothing moves out of it",
                    help=_FARTHER,
                    related=[Related(body.links[link].span, "the link")],
                )
                return


def _fixed_points(body: Body) -> Iterator[tuple[str, Vector3]]:
    """Yield points of solid links that a joint turns and yet leaves in place, in the frame of the root [m]."""
    poses = body.poses({})
    for joint in body.joints_downwards:
        if joint.parent in body.still and joint.moves and not joint.slides:
            for shape in body.links[joint.child].collisions:
                if shape.geometry.kind in _SOLID and _is_on_axis(joint, shape.origin.translation):
                    yield joint.child, poses[joint.child].apply(shape.origin.translation)


def _is_on_axis(joint: BodyJoint, point: Vector3) -> bool:
    (x, y, z), (ax, ay, az) = point, joint.axis
    return math.hypot(y * az - z * ay, z * ax - x * az, x * ay - y * ax) < _ON_AXIS


def _contains(shape: Geometry, point: Vector3) -> bool:
    if shape.kind == "sphere":
        return math.hypot(*point) < shape.size[0]
    if shape.kind == "cylinder":
        return math.hypot(*point[:2]) < shape.size[0] and abs(point[2]) < shape.size[1] / 2.0
    return all(abs(at) < size / 2.0 for at, size in zip(point, shape.size, strict=True))

"""A robot and its world as a model of MuJoCo.

The model is built by MjSpec and not written as MJCF: names need no escaping, numbers keep all their digits, and meshes
are handed over as arrays, of whatever format their files are.

Links that are fixed to each other are one body of MuJoCo, so that frames without mass need no repair and cost nothing.
What else MuJoCo would refuse, or would simulate otherwise than the URDF says, is in `repairs`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Quaternion, Transform3, quaternion_between, quaternion_from_yaw
from rbxcompose.domains.body.model import BodyJoint
from rbxcompose.domains.worlds.contact import MAP
from rbxcompose.domains.worlds.grid_map import wall_rectangles
from rbxcompose.domains.worlds.physics import looks
from rbxcompose.domains.worlds.physics.actuators import Gains, add_actuators, add_followers
from rbxcompose.domains.worlds.physics.rigid import GRAVITY, RigidPart, ensure_mass, rigid_parts
from rbxcompose.domains.worlds.physics.robot import (
    LEVEL,
    PhysicsRobot,
    PhysicsWheels,
    PlacedParts,
    find_wheels,
    is_steady,
    is_tyre,
    placed_parts,
)
from rbxcompose.domains.worlds.physics.solids import THIN, BodyRepair, BodyRepairs, PhysicalShape, apply
from rbxcompose.domains.worlds.shapes import WorldBox, WorldCylinder, WorldHull, WorldMesh, WorldShape
from rbxcompose.domains.worlds.world import SimulatedWorld

TIMESTEP = 2e-3  # [s]
WALL = 3.0  # height of what is occupied in a map [m]
GROUND = "the ground"  # no thing of a world has a name with a space
OF_WORLD, OF_ROBOT = 0, 3  # groups of shapes: rays see the first one only
# Coefficients of friction; of two that touch, the larger one counts.
RUBBER, GRIP, SMOOTH = 1.0, 0.8, 0.3  # wheels; arms and hands; the base and the world
OVERLAP = 1e-4  # links that are deeper in each other at the start do not collide [m]
CASTER = 0.01  # radius of casters that are added [m]
MOST_CORNERS = 64  # of a convex hull

Model = Any  # of an extra, whose stubs are incomplete


@dataclass(frozen=True, slots=True)
class JointPlace:
    """Where a joint is in the arrays of MuJoCo."""

    position: int
    """In `qpos`."""
    velocity: int
    """In `qvel`."""
    actuator: int | None
    """In `ctrl`; None for one that nothing drives."""
    effort: float
    """Greatest torque [Nm] or force [N] of what drives it, before any `limit`; 0 if nothing does."""


@dataclass(frozen=True, eq=False)
class PhysicsModel:
    """A model of MuJoCo, and where everything is in it."""

    model: Model
    robot: PhysicsRobot
    wheels: PhysicsWheels | None
    """None for a robot that stands."""
    signs: Mapping[str, float]
    """1 for wheels that roll ahead when they turn positively, -1 for the others."""
    links: Mapping[str, tuple[int, Transform3]]
    """The body that each link belongs to, and its frame in that of the body."""
    joints: Mapping[str, JointPlace]
    touching: Mapping[int, str]
    """What each shape (geom) belongs to: a link, `the ground`, `map`, or a shape of the world."""
    things: Mapping[str, int]
    """The body of each shape of the world that moves."""
    repairs: tuple[BodyRepair, ...]


def convert(
    robot: PhysicsRobot,
    world: SimulatedWorld,
    loose: Mapping[str, float] = {},
    cameras: Mapping[str, looks.PhysicsCamera] = {},
    *,
    timestep: float = TIMESTEP,
) -> PhysicsModel:
    """Return the model of a robot in a world, where it is at `world.start`.

    `loose` has the masses [kg] of shapes of the world that can be pushed and lifted. What is only seen is added if
    there are `cameras`.

    Raises:
        ModuleNotFoundError: without MuJoCo.
        ValueError: if a link or a joint that the robot or a camera names does not exist, or if a shape that is loose
            does not exist or has a path.
    """
    return _Conversion(robot, world, loose, cameras, timestep).result()


class _Conversion:
    def __init__(
        self,
        robot: PhysicsRobot,
        world: SimulatedWorld,
        loose: Mapping[str, float],
        cameras: Mapping[str, looks.PhysicsCamera],
        timestep: float,
    ) -> None:
        import mujoco

        self.mj: Any = mujoco
        self.robot, self.world, self.loose, self.cameras = robot, world, loose, cameras
        self.repairs: BodyRepairs = []
        self.spec: Model = mujoco.MjSpec()
        self.spec.modelname = robot.body.name or "robot"
        self.spec.compiler.degree = False  # limits of joints are in radians
        option = self.spec.option
        option.timestep = timestep
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = 10.0  # so that what is held by friction does not creep
        option.gravity = (0.0, 0.0, -GRAVITY)
        self.names: dict[str, str] = {}  # of geoms, to what they belong
        self.gripping: list[str] = []  # names of the geoms of arms and hands
        self.pushed: list[str] = []  # and of those of loose things
        parts = rigid_parts(robot.body, robot.meshes, self.repairs)
        self.placed: PlacedParts = placed_parts(robot, parts)
        self.wheels = None if robot.drives is False else find_wheels(self.placed)
        self.driving = self.wheels.names if self.wheels else ()
        self.stands = self.wheels is None and not robot.drives
        if not self.stands:
            ensure_mass(parts[0], robot.body, robot.meshes, self.repairs)
        self.ground = self._ground()
        self.bodies: list[Model] = []

    def _ground(self) -> float:
        """Return the height of the ground in the frame of the base [m]."""
        lowest = self.placed.lowest
        if self.wheels is not None:
            return lowest
        if not self.stands:  # on wheels that are yet to be added
            return min(0.0, lowest - CASTER)
        if lowest > -LEVEL:
            return 0.0
        what = f"it reaches {-lowest:.3g} m below the ground: it is lifted by that"
        self.repairs.append(BodyRepair(self.robot.base_link, what))
        return lowest

    def result(self) -> PhysicsModel:
        self._add_world()
        start = Transform3.from_pose2(self.world.start).compose(Transform3((0.0, 0.0, -self.ground)))
        for index, part in enumerate(self.placed.parts):
            self._add_part(index, part, start)
        if not self.stands:
            self._support()
        if self.cameras:
            self._add_looks()
        self._let_hold()
        add_followers(self.spec, self.placed)
        servos = add_actuators(self.spec, self.robot, self.placed, self.wheels, self.ground)
        model = self._without_overlaps()
        Gains(model, self._at_start(model), self.robot, self.placed, self.repairs).set(self.wheels, servos)
        return self._described(model)

    def _let_hold(self) -> None:
        """Let friction between hands and loose things be as stiff as steps allow.

        It is damping in MuJoCo: with that of other contacts, what is held creeps while the arm accelerates.
        """
        stiff, friction = (2 * self.spec.option.timestep, 1.0), (GRIP, GRIP, 5e-3, 1e-4, 1e-4)
        for hand, thing in product(self.gripping, self.pushed):
            self.spec.add_pair(geomname1=thing, geomname2=hand, condim=3, friction=friction, solreffriction=stiff)

    def _add_world(self) -> None:
        whole, world = self.spec.worldbody, self.world
        plane = whole.add_geom(type=self.mj.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0))
        self._name(plane, GROUND)
        self.floor = plane.name
        grid = world.grid
        rectangles = wall_rectangles(grid)
        middles = grid.to_points((rectangles[:, :2] + rectangles[:, 2:]) / 2)
        sides = (rectangles[:, 2:] - rectangles[:, :2]) * (grid.resolution / 2)
        turn = _wxyz(quaternion_from_yaw(grid.origin.heading))
        for (x, y), (a, b) in zip(middles.tolist(), sides.tolist(), strict=True):
            size, place = (a, b, WALL / 2), (x, y, WALL / 2)
            self._name(whole.add_geom(type=self.mj.mjtGeom.mjGEOM_BOX, size=size, pos=place, quat=turn), MAP)
        shapes = {shape.name: shape for shape in world.shapes}
        for name in self.loose:
            if name not in shapes or shapes[name].path is not None:
                raise ValueError(f"'{name}' is no shape of the world that could be pushed")
        for shape in world.shapes:
            self._add_shape(shape)

    def _add_shape(self, shape: WorldShape) -> None:
        pose = shape.pose_at(0.0)
        place = (pose.x, pose.y, shape.z + shape.solid.height / 2)
        at: dict[str, Any] = {"pos": place, "quat": _wxyz(quaternion_from_yaw(pose.heading))}
        mass = self.loose.get(shape.name)
        if mass is not None:
            holder = self.spec.worldbody.add_body(name=_thing(shape.name), **at)
            holder.add_freejoint(name=_thing(shape.name))
            at = {"mass": mass}
        elif shape.path is not None:
            holder = self.spec.worldbody.add_body(name=_thing(shape.name), mocap=True, **at)
            at = {}
        else:
            holder = self.spec.worldbody
        match shape.solid:
            case WorldBox(size=size):
                half = tuple(side / 2 for side in size)
                self._name(holder.add_geom(type=self.mj.mjtGeom.mjGEOM_BOX, size=half, **at), shape.name)
            case WorldCylinder(radius=radius, height=height):
                round_ = (radius, height / 2, 0.0)
                self._name(holder.add_geom(type=self.mj.mjtGeom.mjGEOM_CYLINDER, size=round_, **at), shape.name)
            case WorldMesh(parts=parts):
                self._add_hulls(holder, shape, parts, at)
            case _:
                raise TypeError(f"'{shape.name}' is a part of a shape")
        at.pop("mass", None)
        for tag in shape.tags if self.cameras else ():
            looks.add_tag(self.spec, holder, tag, shape.solid.height / 2, at)

    def _add_hulls(
        self, holder: Model, shape: WorldShape, parts: Sequence[tuple[float, WorldHull]], at: Mapping[str, Any]
    ) -> None:
        """Add the convex parts of a mesh, among which a mass is shared by their volumes."""
        volumes = np.array([_volume(hull) for _, hull in parts])
        for (low, hull), share in zip(parts, volumes / volumes.sum(), strict=True):
            name = f"mesh {len(self.names)}"
            corners = np.array(hull.corners) + np.array((0.0, 0.0, low - shape.solid.height / 2))
            self.spec.add_mesh(name=name, uservert=corners.ravel(), maxhullvert=MOST_CORNERS)
            options = {**at, "mass": at["mass"] * share} if "mass" in at else at
            geom = holder.add_geom(type=self.mj.mjtGeom.mjGEOM_MESH, meshname=name, **options)
            self._name(geom, shape.name)

    def _name(self, geom: Model, belongs: str, friction: float = SMOOTH) -> None:
        geom.name = f"{len(self.names)}"
        geom.friction[0] = friction
        if friction == GRIP:
            self.gripping.append(geom.name)
        if geom.group == OF_WORLD and belongs in self.loose:
            self.pushed.append(geom.name)
        self.names[geom.name] = belongs

    def _add_part(self, index: int, part: RigidPart, start: Transform3) -> None:
        at = start.compose(self.placed.poses[0]) if part.joint is None else part.origin
        carrier = self.spec.worldbody if part.joint is None else self.bodies[part.parent]
        body = carrier.add_body(name=f"part {index}", pos=at.translation, quat=_wxyz(at.rotation))
        self.bodies.append(body)
        if part.mass > 0.0:
            xx, xy, xz, yy, yz, zz = part.inertia[np.triu_indices(3)].tolist()
            body.mass, body.ipos, body.fullinertia = part.mass, part.centre, (xx, yy, zz, xy, xz, yz)
            body.explicitinertial = True
        if part.joint is not None:
            self._add_joint(body, part.joint)
        elif not self.stands:
            body.add_freejoint(name="base")
        if part.joint is not None and (part.joint.name in self.driving or is_tyre(self.placed, index, self.ground)):
            self._add_tyre(body, part, part.joint)
            return
        for link, solid, pose in part.shapes:
            geom = self._add_solid(body, link, solid, pose)
            self._name(geom, link, SMOOTH if part.joint is None else GRIP)

    def _add_joint(self, body: Model, joint: BodyJoint) -> None:
        kinds = self.mj.mjtJoint
        made = body.add_joint(name=f"joint {joint.name}", axis=joint.axis)
        made.type = kinds.mjJNT_SLIDE if joint.slides else kinds.mjJNT_HINGE
        limits = joint.limits
        if joint.kind != "continuous" and limits is not None and limits.lower is not None and limits.upper is not None:
            if limits.lower < limits.upper:
                made.range, made.limited = (limits.lower, limits.upper), True
            else:
                self.repairs.append(BodyRepair(joint.name, "its limits leave it no range: it has none"))

    def _add_tyre(self, body: Model, part: RigidPart, joint: BodyJoint) -> None:
        """Add the shape of a wheel: an ellipsoid, which touches the ground at one point.

        What touches at several points across its width cannot turn in place without slipping, and a hull of corners
        does not roll.
        """
        points = np.concatenate([apply(pose, solid.points) for _, solid, pose in part.shapes] or [np.zeros((1, 3))])
        axis = np.array(joint.axis)
        along = points @ axis
        radius = float(np.linalg.norm(points - np.outer(along, axis), axis=1).max())
        if not part.shapes or radius < THIN:
            self.repairs.append(BodyRepair(joint.child, "it is a wheel without a shape: it does not touch"))
            return
        half = max(float(np.ptp(along)) / 2, THIN)
        turn = quaternion_between((0.0, 0.0, 1.0), joint.axis)
        geom = body.add_geom(type=self.mj.mjtGeom.mjGEOM_ELLIPSOID, size=(radius, radius, half), quat=_wxyz(turn))
        geom.pos, geom.group, geom.mass = axis * (along.max() + along.min()) / 2, OF_ROBOT, 0.0
        self._name(geom, joint.child, RUBBER)

    def _add_solid(self, body: Model, link: str, solid: PhysicalShape, pose: Transform3) -> Model:
        kinds = self.mj.mjtGeom
        geom = body.add_geom(pos=pose.translation, quat=_wxyz(pose.rotation), group=OF_ROBOT, mass=0.0)
        size = solid.size
        match solid.kind:
            case "box":
                geom.type, geom.size = kinds.mjGEOM_BOX, tuple(side / 2 for side in size)
            case "sphere":
                geom.type, geom.size = kinds.mjGEOM_SPHERE, (size[0], 0.0, 0.0)
            case "hull":
                name = f"mesh {len(self.names)}"
                self.spec.add_mesh(name=name, uservert=solid.points.ravel(), maxhullvert=MOST_CORNERS)
                geom.type, geom.meshname = kinds.mjGEOM_MESH, name
            case kind:
                geom.type = kinds.mjGEOM_CYLINDER if kind == "cylinder" else kinds.mjGEOM_CAPSULE
                geom.size = (size[0], size[1] / 2, 0.0)
        return geom

    def _support(self) -> None:
        """Put the robot on wheels and casters, which are added if it has none."""
        root, base = self.bodies[0], self.robot.base_link
        into_root = self.placed.poses[0].inverse()
        if self.wheels is None:
            self.wheels = self._added_wheels(into_root)
            self.driving = self.wheels.names
        if not is_steady(self.placed, self.ground):
            centre = float(self.placed.centre[0])
            ends = np.concatenate([np.array([[centre, 0.0, 0.0]]), *self.placed.points_of(0)])[:, 0]
            for end, side in ((float(ends.max()), 1.0), (float(ends.min()), -1.0)):
                inside = max(side * end - 2 * CASTER, side * centre + 3 * CASTER)
                place = into_root.apply((side * inside, 0.0, self.ground + CASTER))
                kind, size = self.mj.mjtGeom.mjGEOM_SPHERE, (CASTER, 0.0, 0.0)
                geom = root.add_geom(type=kind, size=size, pos=place, group=OF_ROBOT, mass=0.0)
                self._name(geom, base)
            self.repairs.append(
                BodyRepair(base, "nothing but its wheels carries it: casters in front and behind are added")
            )
        # What slides over the ground without turning is a caster: it does not brake.
        for geom in root.geoms:
            self.spec.add_pair(geomname1=self.floor, geomname2=geom.name, condim=1)

    def _added_wheels(self, into_root: Transform3) -> PhysicsWheels:
        """Add wheels below the base, which touch the ground; what they would touch else is the base itself."""
        robot, root = self.robot, self.bodies[0]
        radius, distance = robot.wheel_radius, robot.wheel_distance
        mass = max(0.02 * sum(part.mass for part in self.placed.parts), 1e-3)
        names = ("left wheel (added)", "right wheel (added)")
        for name, side in zip(names, (1.0, -1.0), strict=True):
            turn = quaternion_between((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
            at = into_root.compose(Transform3((0.0, side * distance / 2, self.ground + radius), turn))
            wheel = root.add_body(name=name, pos=at.translation, quat=_wxyz(at.rotation))
            wheel.add_joint(name=f"joint {name}", type=self.mj.mjtJoint.mjJNT_HINGE, axis=(0.0, 0.0, 1.0))
            geom = wheel.add_geom(type=self.mj.mjtGeom.mjGEOM_ELLIPSOID, size=(radius, radius, 0.01), mass=mass)
            geom.group = OF_ROBOT
            self._name(geom, robot.base_link, RUBBER)
        what = f"it has no joints of wheels: two with a radius of {radius:g} m, {distance:g} m apart, are added"
        self.repairs.append(BodyRepair(robot.base_link, what))
        return PhysicsWheels(names[:1], names[1:], radius, distance)

    def _add_looks(self) -> None:
        """Colour the world, and add what is seen of the robot."""
        colours = dict(zip((shape.name for shape in self.world.shapes), self.world.colours, strict=False))
        for geom in self.spec.worldbody.find_all("geom"):
            belongs = self.names.get(geom.name)
            if belongs is None:  # a tag
                continue
            if belongs == GROUND:
                looks.colour_ground(self.spec, geom)
            elif geom.group == OF_WORLD:
                geom.rgba = (*looks.WALLS, 1.0) if belongs == MAP else looks.colour_of(colours.get(belongs, ""))
        parts = list(zip(self.bodies, self.placed.parts, strict=True))
        looks.add_looks(self.spec, self.robot, parts, self.cameras, self.repairs)
        looks.add_lights(self.spec, self.world.lights)

    def _without_overlaps(self) -> Model:
        """Return the compiled model in which links that overlap at the start do not collide."""
        if self.stands:  # neighbours of what is fixed to the ground collide in MuJoCo, other neighbours do not
            for index in (index for index, part in enumerate(self.placed.parts) if part.parent == 0):
                self.spec.add_exclude(bodyname1="part 0", bodyname2=f"part {index}")
        model = self.spec.compile()
        data = self._at_start(model)
        found: dict[tuple[int, int], tuple[str, str]] = {}
        for contact in data.contact:
            if contact.dist < -OVERLAP and all(model.geom_group[geom] == OF_ROBOT for geom in contact.geom):
                bodies = sorted(int(model.geom_bodyid[geom]) for geom in contact.geom)
                links = sorted(self.names[model.geom(geom).name] for geom in contact.geom)
                found[bodies[0], bodies[1]] = (links[0], links[1])
        for (first, second), (link, other) in sorted(found.items()):
            self.spec.add_exclude(bodyname1=model.body(first).name, bodyname2=model.body(second).name)
            what = f"it overlaps '{other}' at the start: the two do not touch each other"
            self.repairs.append(BodyRepair(link, what))
        return self.spec.compile() if found else model

    def _at_start(self, model: Model) -> Model:
        """Return the state in which all joints are where they start."""
        data = self.mj.MjData(model)
        for joint in (part.joint for part in self.placed.parts if part.joint is not None):
            place = model.joint(f"joint {joint.name}").qposadr[0]
            data.qpos[place] = self.robot.body.position(joint, self.robot.positions)
        self.mj.mj_forward(model, data)
        return data

    def _described(self, model: Model) -> PhysicsModel:
        poses = {
            link: (int(model.body(f"part {index}").id), pose)
            for index, part in enumerate(self.placed.parts)
            for link, pose in part.links.items()
        }
        joints = {}
        signs = {}
        moving = {part.joint.name: index for index, part in enumerate(self.placed.parts) if part.joint is not None}
        driven = {model.actuator(number).name for number in range(model.nu)}
        for name in dict.fromkeys((*moving, *self.driving)):
            made, full = model.joint(f"joint {name}"), f"joint {name}"
            actuator = int(model.actuator(full).id) if full in driven else None
            effort = 0.0 if actuator is None else float(model.actuator_forcerange[actuator, 1])
            joints[name] = JointPlace(int(made.qposadr[0]), int(made.dofadr[0]), actuator, effort)
            if name in self.driving:
                signs[name] = math.copysign(1.0, self.placed.axis_of(moving[name])[1]) if name in moving else 1.0
        moved = [shape.name for shape in self.world.shapes if shape.path is not None or shape.name in self.loose]
        return PhysicsModel(
            model,
            self.robot,
            self.wheels,
            signs,
            poses,
            joints,
            {geom: self.names.get(model.geom(geom).name, "") for geom in range(model.ngeom)},
            {name: int(model.body(_thing(name)).id) for name in moved},
            tuple(dict.fromkeys(self.repairs)),
        )


def _thing(name: str) -> str:
    return f"thing {name}"


def _volume(hull: WorldHull) -> float:
    """Return the volume of a hull [m^3]."""
    corners = np.array(hull.corners)[np.array(hull.triangles)]
    return abs(float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum())) / 6


def _wxyz(rotation: Quaternion) -> Quaternion:
    """Return a quaternion in the order of MuJoCo."""
    x, y, z, w = rotation
    return (w, x, y, z)


def xyzw(rotation: Iterator[float]) -> Quaternion:
    """Return a quaternion of MuJoCo in the order of ours."""
    w, x, y, z = rotation
    return (x, y, z, w)

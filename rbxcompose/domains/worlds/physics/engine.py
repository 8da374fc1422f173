"""A robot and its world in motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import Pose2, Transform3, Velocity2
from rbxcompose.domains.worlds.inertial import ImuReading
from rbxcompose.domains.worlds.physics.conversion import OF_ROBOT, TIMESTEP, PhysicsModel, convert, xyzw
from rbxcompose.domains.worlds.physics.looks import DepthPicture, Eyes, PhysicsCamera
from rbxcompose.domains.worlds.physics.robot import PhysicsRobot
from rbxcompose.domains.worlds.physics.solids import BodyRepair, rotation_matrix
from rbxcompose.domains.worlds.world import SimulatedWorld

HOLDING = 0.05  # [s] in which wheels make up for an angle that they are behind
BEHIND = 0.1  # [m/s] that they turn faster for that, at most


class UnstablePhysicsError(Exception):
    """Raised when a state has become infinite or absurd, or when there are more contacts than memory for them."""


def _no_file(message: str) -> None:
    """Take a warning of MuJoCo, which would write it to a file in the working folder; `step` raises for each."""


class PhysicsWorld:
    """Moves a robot in its world in fixed steps; the same calls lead to the same states, bit for bit.

    Positions and velocities are those after the last step, contacts and efforts those at its end.
    """

    def __init__(
        self,
        robot: PhysicsRobot,
        world: SimulatedWorld,
        loose: Mapping[str, float] = {},
        cameras: Mapping[str, PhysicsCamera] = {},
        *,
        timestep: float = TIMESTEP,
        time: float = 0.0,
    ) -> None:
        """Put the robot at `world.start` at a time [s]; see `convert` for what is raised."""
        import mujoco

        self._mj: Any = mujoco
        mujoco.set_mju_user_warning(_no_file)
        self.converted: PhysicsModel = convert(robot, world, loose, cameras, timestep=timestep)
        self._model = self.converted.model
        self._cameras = cameras
        self._eyes: Eyes | None = None
        self._data: Any = mujoco.MjData(self._model)
        self._data.time = time
        self._moving = [shape for shape in world.shapes if shape.path is not None]
        self._mocaps = [int(self._model.body_mocapid[self.converted.things[shape.name]]) for shape in self._moving]
        self._targets: dict[str, tuple[float, float]] = {}  # and how fast set points move there
        self._placed: dict[str, Pose2] = {}
        self._speeds = dict.fromkeys(self.converted.signs, 0.0)  # of wheels, as wanted [rad/s]
        self._turned = dict.fromkeys(self.converted.signs, 0.0)  # angles where they should be [rad]
        self._owed = 0.0  # time that is shorter than a step [s]
        for name, place in self.converted.joints.items():
            joint = robot.body.joints.get(name)
            if joint is not None:
                self._data.qpos[place.position] = robot.body.position(joint, robot.positions)
                if place.actuator is not None and name not in self.converted.signs:
                    self._data.ctrl[place.actuator] = self._data.qpos[place.position]
        self._move_shapes()
        mujoco.mj_forward(self._model, self._data)

    @property
    def repairs(self) -> tuple[BodyRepair, ...]:
        """Return what was changed in the body."""
        return self.converted.repairs

    @property
    def time(self) -> float:
        """Return the simulated time [s]."""
        return float(self._data.time)

    def step(self, dt: float) -> None:
        """Let time [s] pass; what is shorter than a step of the engine counts next time.

        Raises:
            UnstablePhysicsError: if what the engine has computed is not to be trusted.
        """
        self._owed += dt
        size = float(self._model.opt.timestep)
        count = int(self._owed / size + 1e-6)
        self._owed -= count * size
        self._turn_wheels(count * size)
        while count:
            at_once = 1 if self._moving or self._targets else count
            self._move_shapes()
            self._move_set_points(size)
            self._mj.mj_step(self._model, self._data, at_once)
            count -= at_once
        if (warnings := self._data.warning.number).any():
            names = [self._mj.mjtWarning(kind).name for kind in np.flatnonzero(warnings)]
            raise UnstablePhysicsError(f"'{self.converted.robot.body.name}' at {self.time:.3f} s: {', '.join(names)}")
        self._move_shapes()
        self._mj.mj_kinematics(self._model, self._data)  # so that frames and rays are those after the step
        self._mj.mj_comPos(self._model, self._data)

    def place(self, name: str, pose: Pose2) -> None:
        """Put a shape that has a path elsewhere in `map`, from the next step on and for good; its heading stays."""
        self._placed[name] = pose

    def _turn_wheels(self, dt: float) -> None:
        """Let wheels turn as wanted, and hold the angles that follow from it, as motors with encoders do.

        Without that, an arm that swings would turn the base that carries it.
        """
        wheels = self.converted.wheels
        for name, speed in self._speeds.items():
            angle, within = self.position(name), max(HOLDING, 2 * dt)
            most = BEHIND * within / (wheels.radius if wheels else 1.0)
            behind = min(max(self._turned[name] - angle, -most), most)
            self._data.ctrl[self._actuator(name)] = speed + behind / within
            self._turned[name] = angle + behind + speed * dt

    def _move_shapes(self) -> None:
        for shape, mocap in zip(self._moving, self._mocaps, strict=True):
            pose = self._placed.get(shape.name) or shape.pose_at(self.time)
            self._data.mocap_pos[mocap, :2] = pose.x, pose.y
            if shape.path is not None and shape.path.turns:
                self._data.mocap_quat[mocap] = math.cos(pose.heading / 2), 0.0, 0.0, math.sin(pose.heading / 2)

    def _move_set_points(self, dt: float) -> None:
        """Move set points towards targets, as fast as their servos do."""
        control = self._data.ctrl
        for name, (target, speed) in list(self._targets.items()):
            place = self.converted.joints[name]
            missing = target - control[place.actuator]
            most = speed * dt
            if abs(missing) <= most:
                control[place.actuator] = target
                del self._targets[name]
            else:
                control[place.actuator] += math.copysign(most, missing)

    def drive(self, linear: float, angular: float) -> None:
        """Let the wheels turn for a velocity ahead [m/s] and to the left [rad/s], until the next call.

        Raises:
            ValueError: if the robot has no wheels, or the velocity is not finite.
        """
        wheels = self.converted.wheels
        if not (math.isfinite(linear) and math.isfinite(angular)):
            raise ValueError(f"velocities are finite, not {linear} and {angular}")
        if wheels is None:
            raise ValueError("this robot has no wheels")
        for side, names in ((-1, wheels.left), (1, wheels.right)):
            speed = (linear + side * angular * wheels.distance / 2) / wheels.radius
            for name in names:
                self._speeds[name] = speed * self.converted.signs[name]

    def turn(self, joint: str, speed: float) -> None:
        """Let one wheel turn at a speed [rad/s], positive as its joint is, until the next call or `drive`.

        Raises:
            ValueError: if it is no wheel that drives, or the speed is not finite.
        """
        if joint not in self.converted.signs or not math.isfinite(speed):
            raise ValueError(f"no wheel '{joint}' turns at {speed} rad/s")
        self._speeds[joint] = speed

    def target(self, joint: str, position: float, within: float) -> None:
        """Let a servo move to a position [rad or m], which is cut to its limits, and hold it.

        Its set point is there `within` a time [s].

        Raises:
            ValueError: if nothing holds this joint, or the position is not finite.
        """
        if not math.isfinite(position):
            raise ValueError(f"positions are finite, not {position}")
        number = self._actuator(joint)
        if joint in self.converted.signs:
            raise ValueError(f"'{joint}' is a wheel")
        made = int(self._model.actuator_trnid[number, 0])
        if self._model.jnt_limited[made]:
            low, high = self._model.jnt_range[made].tolist()
            position = min(max(position, low), high)
        speed = abs(position - float(self._data.ctrl[number])) / within if within > 0.0 else math.inf
        self._targets[joint] = position, speed

    def limit(self, joint: str, effort: float) -> None:
        """Set the greatest torque [Nm] or force [N] of a wheel or a servo from now on; 0 lets go.

        A servo that had let go holds its joint where it is then.

        Raises:
            ValueError: if nothing drives this joint, or the effort is negative.
        """
        if not effort >= 0.0:
            raise ValueError(f"an effort is not negative, as {effort} is")
        number = self._actuator(joint)
        if joint not in self.converted.signs and not self._model.actuator_forcerange[number, 1]:
            self._targets.pop(joint, None)
            self._data.ctrl[number] = self.position(joint)
        self._model.actuator_forcerange[number] = -effort, effort

    def _actuator(self, joint: str) -> int:
        place = self.converted.joints.get(joint)
        if place is None or place.actuator is None:
            raise ValueError(f"nothing drives a joint '{joint}'")
        return place.actuator

    def position(self, joint: str) -> float:
        """Return where a joint is [rad or m]."""
        return float(self._data.qpos[self.converted.joints[joint].position])

    def velocity(self, joint: str) -> float:
        """Return how fast a joint moves [rad/s or m/s]."""
        return float(self._data.qvel[self.converted.joints[joint].velocity])

    def effort(self, joint: str) -> float:
        """Return what its servo exerts on a joint [Nm or N]; 0 if it has none."""
        actuator = self.converted.joints[joint].actuator
        return 0.0 if actuator is None else float(self._data.actuator_force[actuator])

    @property
    def wheel_angles(self) -> tuple[float, float]:
        """Return how far the left and the right wheels have turned ahead [rad], whether they slipped or not.

        It is the mean of those at each side, and 0 without wheels.
        """
        wheels, signs = self.converted.wheels, self.converted.signs
        if wheels is None:
            return 0.0, 0.0
        sides = (wheels.left, wheels.right)
        left, right = (sum(self.position(name) * signs[name] for name in side) / len(side) for side in sides)
        return left, right

    @property
    def base_pose(self) -> Pose2:
        """Return where the base really is in `map`, seen from above."""
        return self.pose_of(self.converted.robot.base_link).to_pose2()

    @property
    def base_velocity(self) -> Velocity2:
        """Return how fast the base really moves, in its frame."""
        body, inner = self.converted.links[self.converted.robot.base_link]
        moving = np.zeros(6)
        self._mj.mj_objectVelocity(self._model, self._data, self._mj.mjtObj.mjOBJ_XBODY, body, moving, 1)
        turn = rotation_matrix(inner.rotation)
        ahead = (moving[3:] + np.cross(moving[:3], np.array(inner.translation))) @ turn
        return Velocity2(float(ahead[0]), float((moving[:3] @ turn)[2]))

    def pose_of(self, link: str) -> Transform3:
        """Return the frame of a link in `map`."""
        body, inner = self.converted.links[link]
        return self._body_pose(body).compose(inner)

    def shape_pose(self, name: str) -> Transform3:
        """Return where the middle of a shape is that moves or can be pushed, in `map`."""
        return self._body_pose(self.converted.things[name])

    def _body_pose(self, body: int) -> Transform3:
        x, y, z = self._data.xpos[body].tolist()
        return Transform3((x, y, z), xyzw(iter(self._data.xquat[body].tolist())))

    def touched(self) -> frozenset[str]:
        """Return what the robot touches besides itself: `the ground`, `map`, or shapes of the world."""
        found = set()
        force = np.zeros(6)
        for index in range(self._data.ncon):
            geoms = [int(geom) for geom in self._data.contact[index].geom]
            others = [geom for geom in geoms if self._model.geom_group[geom] != OF_ROBOT]
            if len(others) != 1:
                continue
            self._mj.mj_contactForce(self._model, self._data, index, force)
            if force[0] > 0.0:
                found.add(self.converted.touching[others[0]])
        return frozenset(found)

    def imu(self, link: str) -> ImuReading:
        """Return what an inertial sensor at the origin of a link measures."""
        body, inner = self.converted.links[link]
        self._mj.mj_rnePostConstraint(self._model, self._data)
        moving, changing = np.zeros(6), np.zeros(6)
        kind = self._mj.mjtObj.mjOBJ_XBODY
        self._mj.mj_objectVelocity(self._model, self._data, kind, body, moving, 1)
        self._mj.mj_objectAcceleration(self._model, self._data, kind, body, changing, 1)
        turning, at = moving[:3], np.array(inner.translation)
        felt = changing[3:] + np.cross(changing[:3], at) + np.cross(turning, np.cross(turning, at))
        turn = rotation_matrix(inner.rotation)
        (wx, wy, wz), (ax, ay, az) = (turning @ turn).tolist(), (felt @ turn).tolist()
        return ImuReading(self.pose_of(link).rotation, (wx, wy, wz), (ax, ay, az))

    def picture(self, camera: str) -> DepthPicture:
        """Return what a camera sees. Always call it in the same thread.

        Raises:
            ImportError: without EGL.
            KeyError: if there is no such camera.
        """
        if self._eyes is None:
            self._eyes = Eyes(self._model, self._cameras)
        return self._eyes.picture(self._data, camera)

    def close(self) -> None:
        """Free what the engine holds."""
        if self._eyes is not None:
            self._eyes.close()
            self._eyes = None
        del self._data, self._model

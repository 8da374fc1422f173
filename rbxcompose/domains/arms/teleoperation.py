"""The topics by which people and programs lead the tip of an arm by hand, beside what plans for it.

`TipServo` leads it by velocities that somebody commands now, and stops before it hits something. All that is sent to
the controller ends at rest, and is examined to its end: so the arm comes to rest on a way that is free if commands, or
this program, end. What would not be free is not sent; the last one, which was, goes on to its end.

It slows down where something is ahead: the shapes of the body and the scene, a limit of a joint, or a singularity,
where the joints would have to be fast for a tip that is slow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, conjugate, multiply, rotate
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import Checker, pairs_shown
from rbxcompose.domains.arms.motion.groups import interpolated
from rbxcompose.domains.arms.motion.inverse_kinematics import PoseTarget
from rbxcompose.domains.arms.motion.parametrisation import MARGIN, Trajectory, speeds_of
from rbxcompose.domains.arms.motion.planner import MotionPlanner
from rbxcompose.domains.arms.motion.scene_messages import joint_trajectory
from rbxcompose.domains.arms.motion.trace_planner import TURN
from rbxcompose.msgs.geometry_msgs import PoseStamped, TwistStamped
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.trajectory_msgs import JointTrajectory
from rbxcompose.sdk import In, Out, Port

Wish = Callable[[Array], Array]
"""From positions of joints to the wanted velocity of the tip [m/s, rad/s], of shape (6,), along the root's axes."""

LEAD = 0.04  # [s] from a decision to where it begins, in which it reaches the controller
CRUISE = 0.08  # [s] for which a velocity is led to and kept, before the arm brakes if nothing newer has come
FIRST = 0.04  # [s] to the first velocity, in which joints may also come to where they were measured to be
BRIEFEST = 0.005  # [s] between others
STEP = 0.005  # [rad or m] between examined positions on the way to rest
LOOK_STEP, LEAST_LOOKS = 0.05, 4  # [rad or m] between positions ahead, and how many there are at least
LOOK = 0.5  # [s] ahead that is examined; what is nearer slows down
SHARES = (1.0, 0.5, 0.2)  # of a velocity, which are tried one after the other
SINGULAR = 0.01  # least singular value over the greatest, below which the arm is not led
DAMPING = 0.01  # of the inverse of the Jacobian
SLOWEST = 1e-6  # share of the greatest speeds, below which a joint is at rest
LOST = 0.25  # [rad or m] of the joints from where they were sent, more than servos are behind
ROOM = 0.01  # [rad or m] that is left to limits of joints


@dataclass(frozen=True, slots=True)
class ServoMotion:
    """From `begin` [s] on, velocities that change evenly between its points, and then rest.

    All but the first of its pieces are parts of one straight line.
    """

    begin: float
    way: Trajectory

    @classmethod
    def of(cls, begin: float, position: Array, pieces: Sequence[tuple[float, Array]]) -> ServoMotion:
        """Return a motion from a position; the pieces are velocities, each with the time since the last one [s]."""
        times, velocities = np.cumsum([time for time, _ in pieces]), np.array([array for _, array in pieces])
        moved = (velocities[:-1] + velocities[1:]) / 2 * np.diff(times)[:, None]
        positions = position + np.concatenate((np.zeros((1, len(position))), np.cumsum(moved, axis=0)))
        return cls(begin, Trajectory(times, positions, velocities))

    @classmethod
    def resting(cls, now: float, position: Array) -> ServoMotion:
        """Return an arm at rest."""
        return cls.of(now, position, [(0.0, np.zeros(len(position)))])

    @property
    def is_rest(self) -> bool:
        """Return whether it moves nothing."""
        return not self.way.velocities.any()

    def points(self, step: float) -> Array:
        """Return positions on its way, at most `step` [rad or m] apart in each joint, of shape (m, n)."""
        times, velocities = self.way.times, self.way.velocities
        fastest = float(np.max(np.abs(velocities[:2])))
        shares = np.linspace(0.0, 1.0, 1 + max(1, math.ceil(fastest * (times[1] - times[0]) / step)))
        first = [self.state(self.begin + share * times[1])[0] for share in shares.tolist()]
        return np.concatenate((first, interpolated((first[-1], self.way.positions[-1]), step)[1:]))

    def state(self, now: float) -> tuple[Array, Array]:
        """Return positions and velocities at a time."""
        times, positions, velocities = self.way.times, self.way.positions, self.way.velocities
        at = max(0.0, now - self.begin)
        if at >= times[-1]:
            return positions[-1], velocities[-1]
        index = int(np.searchsorted(times, at, side="right")) - 1
        share = (at - times[index]) / (times[index + 1] - times[index])
        velocity = velocities[index] + (velocities[index + 1] - velocities[index]) * share
        return positions[index] + (velocities[index] + velocity) / 2 * (at - times[index]), velocity


class TipServo:
    """Decides what to send; `state` says in words what it does."""

    def __init__(self, kinematics: ArmKinematics, planner: MotionPlanner) -> None:
        self.state = "idle"
        self._kinematics, self._planner, self._space = kinematics, planner, planner.space
        fast, self._hard = speeds_of(self._space, 1.0, 1.0)
        self._fast = fast * MARGIN
        self._hard = self._hard * MARGIN
        self._weights = np.array((1.0, 1.0, 1.0, TURN, TURN, TURN))  # [1, m/rad] of what the tip does
        self._lower, self._upper = self._space.lower + ROOM, self._space.upper - ROOM
        self._motion: ServoMotion | None = None
        self._is_stopping = False  # the last motion only leads to rest

    @property
    def is_moving(self) -> bool:
        """Return whether something that was sent may still be on its way."""
        return self._motion is not None

    def next(self, now: float, measured: Array, wish: Wish | None) -> ServoMotion | None:
        """Return what to send now, None for nothing; without a wish, the arm comes to rest."""
        if self._motion is not None and np.max(np.abs(self._motion.state(now)[0] - measured)) > LOST:
            self._motion, self.state = None, "halted: the joints do not follow"
            return None
        if self._motion is None and wish is None:
            return None
        last = self._motion or ServoMotion.resting(now, self._space.clamped(measured))
        begin = now + LEAD
        position, velocity = last.state(begin)
        if wish is None:
            if not last.state(now)[1].any() and not velocity.any():
                self._motion = None
                self.state = self.state if self.state.startswith("halted") else "idle"
                return None
            found = self._stopped(begin, position, velocity)
        else:
            found = self._led(begin, position, velocity, wish(position))
        self._motion = found or self._motion
        return found

    def end(self, reason: str) -> None:
        """Forget all, since somebody else stops the arm or leads it."""
        self._motion, self.state = None, reason

    def _led(self, begin: float, position: Array, velocity: Array, twist: Array) -> ServoMotion | None:
        wanted, self.state = self._joints(position, twist), "moving"
        if wanted.any():
            share, ahead = self._room(position, wanted)
            wanted, self.state = wanted * share, ahead or self.state
        if not wanted.any():
            return self._stopped(begin, position, velocity)
        for share in SHARES:
            found = self._towards(begin, position, velocity, wanted * share)
            bad = self._first_bad(found)
            if bad is None:
                self._is_stopping = False
                return found
            self.state = f"halted: {pairs_shown(self._planner.checker.colliding(bad)) or 'a joint is at its limit'}"
        return self._stopped(begin, position, velocity)

    def _stopped(self, begin: float, position: Array, velocity: Array) -> ServoMotion | None:
        """Return the fastest way to rest, unless the arm is on one, or only the last motion is free to its end."""
        last, found = self._motion, self._towards(begin, position, velocity, np.zeros(len(position)))
        if last is None or found.is_rest or self._is_stopping:
            return None
        if self._first_bad(found) is not None and self._first_bad(last) is None:
            return None
        self._is_stopping = True
        return found

    def _joints(self, position: Array, twist: Array) -> Array:
        """Return velocities of joints for one of the tip, by damped least squares, none faster than it may be.

        The turns of an arm of fewer than six joints are what comes of its position, unless some are wanted.
        """
        rows = slice(0, 6 if len(position) >= 6 or twist[3:].any() else 3)
        left, sizes, right = np.linalg.svd(self._jacobian(position)[rows], full_matrices=False)
        damped = sizes / (sizes**2 + (DAMPING * max(float(sizes[0]), DAMPING)) ** 2)
        found = np.asarray(right.T @ (damped * (left.T @ (twist * self._weights)[rows])))
        fastest = float(np.max(np.abs(found) / self._fast))
        return found / max(1.0, fastest) if fastest > SLOWEST else np.zeros(len(position))

    def _jacobian(self, position: Array) -> Array:
        return np.asarray(self._kinematics.tip(position, with_jacobian=True)[2] * self._weights[:, None])

    def _ratio(self, position: Array) -> float:
        """Return the least singular value over the greatest: 0 at a singularity."""
        rows = slice(0, 6 if len(position) >= 6 else 3)
        sizes = np.linalg.svd(self._jacobian(position)[rows], compute_uv=False)
        return float(sizes[-1] / max(sizes[0], DAMPING))

    def _room(self, position: Array, wanted: Array) -> tuple[float, str]:
        """Return which share of a velocity is slow enough for what is ahead, and what that is in words."""
        bounds = np.where(wanted > 0.0, self._upper - position, position - self._lower)
        with np.errstate(divide="ignore", over="ignore"):
            times = np.where(wanted != 0.0, np.maximum(bounds, 0.0) / np.abs(wanted), math.inf)
        share, words = 1.0, ""
        nearest = int(np.argmin(times))
        if times[nearest] < LOOK:
            share, words = float(times[nearest]) / LOOK, f"slowed: '{self._space.names[nearest]}' is near a limit"
        far = wanted * LOOK * share
        count = max(LEAST_LOOKS, math.ceil(float(np.max(np.abs(far))) / LOOK_STEP))
        singular = min(SINGULAR, self._ratio(position))
        for number in range(1, count + 1):
            array, part = position + far * (number / count), (number - 1) / count
            if not self._planner.checker.is_free(array):
                return share * part, f"slowed: {pairs_shown(self._planner.checker.colliding(array))} are ahead"
            if self._ratio(array) < singular:
                return share * part, "slowed: a singularity is ahead"
        return share, words

    def _towards(self, begin: float, position: Array, velocity: Array, wanted: Array) -> ServoMotion:
        """Return a motion with the velocity that is wanted, as near as the limits of acceleration let it come."""
        change = wanted - velocity
        ramp = float(np.max(np.abs(change) / self._hard))
        later = wanted if ramp <= CRUISE else velocity + change * (CRUISE / ramp)
        ramp = min(CRUISE, max(FIRST, ramp))
        brake = float(np.max(np.abs(later) / self._hard))
        pieces = [(0.0, velocity), (ramp, later)]
        if CRUISE - ramp >= BRIEFEST and brake > 0.0:
            pieces.append((CRUISE - ramp, later))
        if brake > 0.0:
            pieces.append((max(BRIEFEST, brake), np.zeros(len(later))))
        return ServoMotion.of(begin, position, pieces)

    def _first_bad(self, motion: ServoMotion) -> Array | None:
        """Return the first positions that collide or are beyond a limit, up to where it comes to rest."""
        points = motion.points(STEP)
        low, high = np.minimum(self._lower, points[0]), np.maximum(self._upper, points[0])
        is_inside = np.all((points >= low) & (points <= high), axis=1)
        checker: Checker = self._planner.checker
        for point, inside in zip(points[1:], is_inside[1:], strict=True):
            if not inside or not checker.is_free(point):
                return np.asarray(point)
        return None


FrameAt = Callable[[Array], Transform3]

TWIST, POSE, STATUS, STREAM = "servo_twist", "servo_pose", "servo_status", "stream"  # its ports
PERIOD = 0.02  # [s] between decisions
TIMEOUT = 0.25  # [s] after the last command, when the arm comes to rest
GAIN = 3.0  # [1/s] by which a distance from a pose becomes a velocity
FASTEST, FASTEST_TURN = 0.2, 1.0  # [m/s], [rad/s] towards a pose


def servo_ports(config: ArmConfig) -> dict[str, Port[Any]]:
    """Return the ports; none if the controller takes no streams. Only news of the status are sent."""
    if not config.stream:
        return {}
    return {
        TWIST: In(TwistStamped, f"{config.name}/servo/twist", qos="command", is_open=True),
        POSE: In(PoseStamped, f"{config.name}/servo/pose", qos="command", is_open=True),
        STATUS: Out(String, f"{config.name}/servo/status", qos="latched"),
        STREAM: Out(JointTrajectory, config.stream),
    }


class ArmServo:
    """Takes commands, and sends what `TipServo` decides. All times are robot time [s]."""

    def __init__(self, works: ArmWorks, bound: Mapping[str, Any]) -> None:
        self.core = TipServo(works.kinematics, works.planner)
        self._works, self._bound, self._names = works, bound, works.space.names
        self._wish: Wish | None = None
        self._until, self._status = -math.inf, ""

    @property
    def is_wanted(self) -> bool:
        """Return whether there is a command, or it may still move the arm."""
        return self.core.is_moving or self._wish is not None

    def take(self, message: TwistStamped | PoseStamped, now: float, stamp: int) -> str:
        """Take a command; return why it is refused, nothing if it is not. `stamp` is now by the clock of headers."""
        sent = to_nanoseconds(message.header.stamp)
        frame, links = message.header.frame_id, self._works.kinematics.body.links
        if sent and stamp - sent > TIMEOUT * 1e9:
            return f"a command is {(stamp - sent) / 1e9:.2f} s old"
        if frame and frame not in links:
            return f"there is no link '{frame}'"
        wish = self._wish_of(message, frame)
        if wish is None:
            return "a command is not finite, or its orientation is no rotation"
        self._wish, self._until = wish, now + TIMEOUT
        return ""

    def _wish_of(self, message: TwistStamped | PoseStamped, frame: str) -> Wish | None:
        kinematics = self._works.kinematics

        def frame_at(values: Array) -> Transform3:
            return kinematics.poses(values)[frame] if frame else Transform3()

        if isinstance(message, TwistStamped):
            return _twist_wish(message, frame_at)
        return _pose_wish(message, frame_at, kinematics.tip_pose)

    def go_on(self, now: float, stamp: int, at: Mapping[str, float]) -> bool:
        """Send what there is to send now; return whether it wants to go on. `at` are positions of all joints."""
        self._works.kinematics.place({name: value for name, value in at.items() if name not in self._names})
        measured = np.array([at[name] for name in self._names])
        if now >= self._until:
            self._wish = None
        found = self.core.next(now, measured, self._wish)
        if found is not None:
            begin = stamp + round((found.begin - now) * 1e9)
            self._bound[STREAM](joint_trajectory(self._names, found.way, stamp=begin))
        self.publish_state()
        return self.is_wanted

    def refuse(self, reason: str) -> None:
        """Report why a command does not count; one that does goes on."""
        self._say(f"refused: {reason}")

    def end(self, reason: str) -> None:
        """Forget the command, since something else leads or stops the arm."""
        self._wish = None
        self.core.end(reason)
        self.publish_state()

    def publish_state(self) -> None:
        """Publish what it does, if that is new."""
        self._say(self.core.state)

    def _say(self, text: str) -> None:
        if text != self._status:
            self._status = text
            self._bound[STATUS](String(data=text))


def _twist_wish(message: TwistStamped, frame_at: FrameAt) -> Wish | None:
    """Return the velocity along the axes of a frame, which may move; None if it is not finite."""
    one, other = message.twist.linear, message.twist.angular
    linear, angular = (one.x, one.y, one.z), (other.x, other.y, other.z)

    def wish(values: Array) -> Array:
        turn = frame_at(values).rotation
        return np.array((*rotate(turn, linear), *rotate(turn, angular)))

    return wish if all(map(math.isfinite, (*linear, *angular))) else None


def _pose_wish(message: PoseStamped, frame_at: FrameAt, tip_at: FrameAt) -> Wish | None:
    """Return the velocity towards a pose in a frame, slower near it; None if it is no pose."""
    at, turn = message.pose.position, message.pose.orientation
    pose = Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
    if PoseTarget(pose).mistake:
        return None

    def wish(values: Array) -> Array:
        wanted, tip = frame_at(values).compose(pose), tip_at(values)
        x, y, z, w = multiply(wanted.rotation, conjugate(tip.rotation))
        angle = 2.0 * math.atan2(math.hypot(x, y, z), abs(w))
        axis = np.array((x, y, z)) * math.copysign(1.0, w) / max(math.hypot(x, y, z), 1e-12)
        away = np.subtract(wanted.translation, tip.translation)
        slower = max(1.0, GAIN * float(np.linalg.norm(away)) / FASTEST, GAIN * angle / FASTEST_TURN)
        return GAIN * np.concatenate((away, axis * angle)) / slower

    return wish

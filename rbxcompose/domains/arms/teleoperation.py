"""The topics by which people and programs lead the tip of an arm by hand, beside what plans for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from rbxcompose.base.geometry import Transform3, conjugate, multiply, rotate
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion.groups import Array
from rbxcompose.domains.arms.motion.inverse_kinematics import PoseTarget
from rbxcompose.domains.arms.motion.scene_messages import joint_trajectory
from rbxcompose.domains.arms.motion.tip_servo import TipServo, Wish
from rbxcompose.msgs.geometry_msgs import PoseStamped, TwistStamped
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.trajectory_msgs import JointTrajectory
from rbxcompose.sdk import In, Out, Port

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

"""The frames of the body, and frames that coincide."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any

from pydantic import AfterValidator

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.body.model import FLOATING, Body, BodyJoint
from rbxcompose.domains.body.urdf import body_of as urdf_body
from rbxcompose.domains.body.urdf import read_text
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk import Capability, Component, Config, In, Out, Port, Setting, WritesFrame, component

PERIOD = 0.1  # [s] after which the frames of all joints are published again
ROUNDING = 1e-6  # of a period
MOST_LAG = 10_000_000_000  # [ns]; a stamp that is further off comes from another clock
JOINT_STATES, TF = "joint_states", "tf"
MOVING: dict[str, Port[Any]] = {
    JOINT_STATES: In(JointState, JOINT_STATES, is_open=True).named(JOINT_STATES),
    TF: Out(TFMessage, "/tf").named(TF),
}


def _checked(urdf: str) -> str:
    """Return a URDF; raise ValueError with the first mistake that keeps it from being one."""
    if urdf and (mistakes := read_text(urdf)[1]):
        raise ValueError(mistakes[0].message)
    return urdf


class TransformsConfig(Config):
    """The frames that coincide, and the body."""

    map: str = "map"
    """Frame of places."""
    odom: str = "odom"
    """Frame of the base's odometry."""
    is_localised: bool = False
    """Whether a component finds the robot in its map; otherwise `odom` coincides with `map`."""
    urdf: Annotated[str, AfterValidator(_checked)] = ""
    """Text of the URDF of a body whose frames it publishes."""


@component("transforms")
class Transforms(Component[TransformsConfig]):
    """Publishes where the links of the body are, and the frames that never move.

    Joints are where `joint_states` has them, from as many sources as there are; one that none has reported is at rest:
    at 0, or at the limit nearest to it. While nothing localises the robot, `odom` coincides with `map`.

    Example:
        frames: {type: transforms, map: building, odom: map}
    """

    made_by = "Every robot runs one."
    tf_static = Out(TFMessage, "/tf_static", qos="latched")

    @classmethod
    def ports(cls, config: TransformsConfig) -> dict[str, Port[Any]]:
        """Return the ports: those for joints only if the body has some that move."""
        return super().ports(config) | (MOVING if body_of(config.urdf).moving else {})

    @classmethod
    def capabilities(cls, config: TransformsConfig) -> tuple[Capability, ...]:
        """Declare the frames that it writes."""
        body = body_of(config.urdf)
        own = [joint for joint in body.joints.values() if joint.kind not in FLOATING]
        joints = [WritesFrame(_port(item), Setting(item.parent), Setting(item.child)) for item in own]
        coinciding = WritesFrame("tf_static", Setting(config.map, "map"), Setting(config.odom, "odom"))
        return tuple(joints) if config.is_localised else (coinciding, *joints)

    def configure(self) -> None:
        """Read the body; no joint has been reported yet."""
        self.body = body_of(self.config.urdf)
        self.positions: dict[str, float] = {}
        self.lags: dict[str, int] = {}  # [ns] by which stamps of joint states are behind ours
        self.reported: set[str] = set()  # joints published since the last wake
        self.moving = [joint for joint in self.body.joints.values() if joint.moves]

    def activate(self) -> None:
        """Publish the fixed frames once; late subscribers receive them, too."""
        fixed = (joint for joint in self.body.joints.values() if joint.kind == "fixed")
        time = to_time(self.stamp)
        coinciding = () if self.config.is_localised else (link(time, self.config.map, self.config.odom, Transform3()),)
        self.tf_static(TFMessage(transforms=(*coinciding, *self.links(fixed, time))))
        if self.moving:  # at first, joints are waited for: what is reported was measured a little earlier
            self.context.wake_at(self.now + PERIOD)

    def on_joint_states(self, message: JointState) -> None:
        """Publish the links that joints have moved, at the time at which these were measured.

        If the message has no stamp, or that of another clock, it is the time at which it came.
        """
        moved = {}
        for name, position in zip(message.name, message.position, strict=False):
            if math.isfinite(position) and (joint := self.body.joints.get(name)) and joint.moves:
                moved[name] = float(position)
        if moved:
            self.positions |= moved
            affected = [item for item in self.moving if (item.mimic.joint if item.mimic else item.name) in moved]
            names, measured = [body_joint.name for body_joint in affected], to_nanoseconds(message.header.stamp)
            lag = self.stamp - measured if measured and abs(self.stamp - measured) <= MOST_LAG else 0
            self.reported.update(names)
            self.lags |= dict.fromkeys(names, lag)
            self.publish(affected, self.stamp - lag)

    def wake(self) -> None:
        """Publish all that moves and was not reported, so that a late subscriber has it soon.

        It goes by the clock of who reported the joint before, so that no later report seems to be older.
        """
        quiet: dict[int, list[BodyJoint]] = {}
        for joint in self.moving:
            if joint.name not in self.reported:
                quiet.setdefault(self.lags.get(joint.name, 0), []).append(joint)
        for lag, joints in quiet.items():
            self.publish(joints, self.stamp - lag)
        self.reported.clear()
        if self.moving:
            # On a grid, like steps, so that the process wakes up once for all that is due.
            self.context.wake_at(PERIOD * (math.floor(self.now / PERIOD + ROUNDING) + 1))

    def publish(self, joints: Iterable[BodyJoint], stamp: int) -> None:
        """Publish where the children of joints are at a time [ns]."""
        self.bound[TF](TFMessage(transforms=tuple(self.links(joints, to_time(stamp)))))

    def links(self, joints: Iterable[BodyJoint], time: Time) -> Iterable[TransformStamped]:
        """Yield where the children of joints are."""
        for joint in joints:
            yield link(time, joint.parent, joint.child, joint.at(self.body.position(joint, self.positions)))


def link(time: Time, parent: str, child: str, at: Transform3) -> TransformStamped:
    """Return the pose of a frame in another one as a message."""
    return TransformStamped(
        header=Header(stamp=time, frame_id=parent),
        child_frame_id=child,
        transform=Transform(translation=Vector3(*at.translation), rotation=Quaternion(*at.rotation)),
    )


def body_of(urdf: str) -> Body:
    """Return the body that a checked URDF describes; one without links for an empty text."""
    return urdf_body(urdf) if urdf else Body("")


def _port(joint: BodyJoint) -> str:
    return TF if joint.moves else "tf_static"

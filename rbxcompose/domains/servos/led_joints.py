"""What controllers take, and the limits of the joints that they lead."""

from __future__ import annotations

from typing import Any

from rbxcompose.domains.body.model import BodyJoint
from rbxcompose.domains.servos.controller import ControllerConfig, controller_type
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.sections.controllers import controllers
from rbxcompose.domains.servos.sections.joints import held_limits, joints
from rbxcompose.manifest.section import Contents
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.trajectory_msgs import JointTrajectory
from rbxcompose.sdk.ports import In, ServesAction


def joint_limits(contents: Contents, joint: BodyJoint) -> dict[str, object]:
    """Return the limits of a joint as an `ArmJointConfig` has them."""
    limits = limits_in(contents, joint)
    return {
        "lower": limits.lower,
        "upper": limits.upper,
        "velocity": limits.velocity,
        "acceleration": limits.acceleration,
        "jerk": limits.jerk,
        "is_continuous": joint.kind == "continuous",
        "slides": joint.slides,
    }


def limits_in(contents: Contents, joint: BodyJoint) -> MotionLimits:
    """Return the limits of a joint: those of the body, and the tighter ones of the joint if it is driven."""
    driven = contents.of(joints).get(joint.name)
    if driven is not None:
        return held_limits(driven, joint)
    outer = joint.limits
    if outer is None or joint.kind == "continuous":
        return MotionLimits()
    return MotionLimits(outer.lower, outer.upper)


def served_topic(name: str, config: ControllerConfig, action: type[Any]) -> str:
    """Return the topic at which a controller serves an action; nothing if it does not."""
    ports = controller_type(config.type).ports(name, config).values()
    return next((port.topic for port in ports if isinstance(port, ServesAction) and port.interface is action), "")


def follow_topic(contents: Contents, controller: str) -> str:
    """Return the topic at which a controller takes trajectories; nothing if it takes none."""
    there = contents.of(controllers).get(controller)
    return served_topic(controller, there, FollowJointTrajectory) if there is not None else ""


def stream_topic(contents: Contents, controller: str) -> str:
    """Return the topic on which a controller takes trajectories; nothing if it takes none."""
    there = contents.of(controllers).get(controller)
    ports = controller_type(there.type).ports(controller, there).values() if there is not None else ()
    return next((port.topic for port in ports if isinstance(port, In) and port.interface is JointTrajectory), "")

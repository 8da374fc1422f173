"""What can be wrong with the joints, the poses and the gripper of an arm."""

from __future__ import annotations

from rbxcompose.findings import kind

NO_CHAIN = kind(
    "RBX2301",
    """The chain of an arm is none

A chain leads from a link that carries the arm to a link at its end, by joints of which at least one moves. So the end
is below the beginning in the tree of links: `rbxcompose body tree` shows it. What is `passive` is on the chain, joints
of `links` carry the last of them, and arms that are made of other arms do not lead back to themselves.

Bad: `chain: {from: arm_tip, to: torso_link}`
Good: `chain: {from: torso_link, to: arm_tip}`
""",
)
NOT_LED = kind(
    "RBX2302",
    """The controller of an arm does not lead all of its joints

An arm moves along trajectories, which its controller follows: it has the action `FollowJointTrajectory` of ROS, as
those of the type `joint_trajectory` do, and leads each joint of the arm.

Bad: `arm: {joints: [lift_joint, elbow_joint], controller: lift}`, where `lift` leads `lift_joint` alone.
Good: `lift: {type: joint_trajectory, joints: [lift_joint, elbow_joint]}` under `controllers:`.
""",
)
NOT_OF_ARM = kind(
    "RBX2303",
    """A pose of an arm names a joint that the arm does not have

The joints of an arm are those that move between both ends of its chain, or those under `joints`. A joint that mimics
another one is not among them.

Bad: `poses: {resting: {head_pan_joint: 0 deg}}` of an arm.
Good: `poses: {resting: {arm_lift_joint: 0 deg}}`
""",
)
BEYOND = kind(
    "RBX2304",
    """An arm cannot take one of its poses

A position is beyond the limits of its joint: those of the body, or the tighter ones under `joints:`. Or it is a length
for a joint that turns, or an angle for one that slides.

Bad: `poses: {up: {arm_lift_joint: -200 deg}}`, where the joint goes from -150 to 150 deg.
Good: `poses: {up: {arm_lift_joint: -145 deg}}`
""",
)
NO_GRIPPER = kind(
    "RBX2305",
    """The gripper of an arm is none

A gripper is a controller that opens and closes something: it has the action `GripperCommand` of ROS, as those of the
type `gripper` do.

Bad: `arm: {..., gripper: arm_controller}`
Good: `arm: {..., gripper: hand}`, where `controllers:` has `hand: {type: gripper, ...}`.
""",
)
GRIPPER_ELSEWHERE = kind(
    "RBX2308",
    """The gripper of an arm is not at its end

The joints of a gripper are carried by the last joint of its arm, and are none of the arm's own: else the arm would
leave what it holds behind, or two controllers would move one joint.

Bad: `left_arm: {..., gripper: right_gripper_controller}`
Good: `right_arm: {..., gripper: right_gripper_controller}`
""",
)
NO_POSE = kind(
    "RBX2357",
    """An arm prefers a pose that it does not have

Where several positions of joints bring the tip to a pose, those nearest to the pose under `kinematics: {prefer: ...}`
are taken. It is one of the `poses` of the same arm.

Bad: `arm: {..., poses: {ready: {...}}, kinematics: {prefer: redy}}`
Good: `arm: {..., poses: {ready: {...}}, kinematics: {prefer: ready}}`
""",
)

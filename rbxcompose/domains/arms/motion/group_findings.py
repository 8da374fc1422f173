"""What can be wrong with the joints, the poses and the gripper of an arm."""

from __future__ import annotations

from rbxcompose.base.findings import kind

NO_CHAIN = kind("RBX2301")
NOT_LED = kind("RBX2302")
NOT_OF_ARM = kind("RBX2303")
BEYOND = kind("RBX2304")
NO_GRIPPER = kind("RBX2305")
GRIPPER_ELSEWHERE = kind("RBX2308")
NO_POSE = kind("RBX2357")

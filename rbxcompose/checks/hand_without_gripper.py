"""Keys of an arm about picking and placing, although it has no gripper."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.sections.arms import arms


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

"""`arm setup --check`: what only the shapes of a body tell of the poses of its arms."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np

from rbxcompose.arm_config import ArmConfig
from rbxcompose.cli.arms.chosen import works_of
from rbxcompose.cli.arms.told_pairs import told_pairs
from rbxcompose.cli.output.console import FINDINGS, tell, tell_report
from rbxcompose.compiler import Compilation
from rbxcompose.findings import Finding, Report, Severity, kind
from rbxcompose.model.robot import Robot
from rbxcompose.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.sections.arms import arms

COLLIDES = kind("RBX9423")
UNWATCHED = kind("RBX9424", Severity.WARNING)


def run_check(robot: Robot, compilation: Compilation, *, is_json: bool) -> int:
    """Examine all poses; tell what collides."""
    found = list(_findings(robot))
    report = Report([one for _, _, _, one in found])
    if is_json:
        keys = ("arm", "pose", "pairs", "code")
        tell(
            json.dumps([dict(zip(keys, (arm, pose, pairs, one.code), strict=True)) for arm, pose, pairs, one in found])
        )
    else:
        tell_report(report, compilation.sources)
    if not found and not is_json:
        count = sum(len(one.model.poses) for one in robot.manifest.contents.of(arms).values())
        tell(f"{count} poses, none of them in collision")
    return FINDINGS if report.has_errors else 0


def _findings(robot: Robot) -> Iterator[tuple[str, str, list[tuple[str, str]], Finding]]:
    contents, description = robot.manifest.contents, robot.manifest.body
    if description is None:
        return
    matrix = description.matrix.pairs if description.matrix is not None else {}
    for name, arm in contents.of(arms).items():
        config = robot.components[name].config
        if not isinstance(config, ArmConfig):
            continue
        works = works_of(robot, config, description, is_fast=False)
        every = MeshChecker(works.kinematics, description.meshes, adjacent_pairs(description.body))
        rest = [description.body.joints[joint].rest for joint in works.space.names]
        for pose in arm.model.poses:
            at = config.poses[pose]
            values = np.array([at.get(joint, still) for joint, still in zip(works.space.names, rest, strict=True)])
            span = robot.value("arms", name, "poses", pose)
            if pairs := works.planner.checker.colliding(values):
                message = f"the pose '{pose}' of '{name}' is in collision: {told_pairs(pairs)}"
                yield name, pose, pairs, COLLIDES.at(span, message)
            if hidden := [one for one in every.colliding(values) if matrix.get(one) in ("never", "user")]:
                reasons = " and ".join(sorted({f"'{matrix[one]}'" for one in hidden}))
                message = (
                    f"links collide in the pose '{pose}' of '{name}' that are there as {reasons}: {told_pairs(hidden)}"
                )
                yield name, pose, hidden, UNWATCHED.at(span, message)

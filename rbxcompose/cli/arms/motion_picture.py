"""Pictures of motions that `arm` tries."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbxcompose.arm_config import ArmWorks
from rbxcompose.cli.bodies.arm_picture import write_picture
from rbxcompose.motion.groups import moved_links
from rbxcompose.motion.planner import MotionPlan
from rbxcompose.motion.reasons import MotionFailure


def draw_motion(
    arguments: argparse.Namespace,
    works: ArmWorks,
    start: NDArray[np.float64],
    goal: NDArray[np.float64],
    found: MotionPlan | MotionFailure | None,
) -> int:
    """Draw a motion, or why there is none; return the exit code."""
    from rbxcompose.motion.picture import ArmPicture, draw_arm  # its libraries take long

    names, failure = works.space.names, found if isinstance(found, MotionFailure) else None
    is_at_start = found is None or (failure is not None and failure.reason.startswith("start"))
    way = works.way(found.waypoints) if isinstance(found, MotionPlan) else ()
    colliding = [] if way else works.planner.checker.colliding(start if is_at_start else goal)
    positions = [dict(zip(names, values.tolist(), strict=True)) for values in (start, goal)]
    shown = ArmPicture(
        works.kinematics.body,
        works.meshes,
        positions[0],
        works.objects,
        {} if is_at_start else positions[1],
        [link for link, joints in moved_links(works.kinematics.body, names).items() if joints],
        way,
        {link for pair in colliding for link in pair},
        f"{arguments.goal}" if found is None else f"{arguments.start or 'at rest'} to {arguments.goal} (green)",
        f"{failure.reason}: {failure.text}" if failure is not None else "",
    )
    return write_picture("arm", Path(arguments.picture), lambda: draw_arm(shown))

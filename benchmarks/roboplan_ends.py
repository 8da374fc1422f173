"""RoboPlan's side of the problems for arms: reads them as JSON from stdin, and writes times and paths as JSON.

It runs in the Python that has RoboPlan, with nothing of ours.
"""

import json
import sys
import time
from itertools import combinations
from typing import Any

import numpy as np


def main() -> None:
    """Plan all problems, and shorten what is found."""
    from roboplan.core import (  # type: ignore[import-not-found]
        Box,
        JointConfiguration,
        PathShortcutter,
        PathShortcuttingOptions,
        Scene,
        loadUrdfSceneDescription,
    )
    from roboplan.rrt import RRT, RRTOptions  # type: ignore[import-not-found]

    given: dict[str, Any] = json.load(sys.stdin)
    names, group, found = given["joints"], given["group"], []
    for problem in given["problems"]:
        scene = Scene("bench", loadUrdfSceneDescription(given["urdf"], [given["packages"]]))
        scene.importSrdf(given["srdf"])
        for number, (size, middle) in enumerate(problem["boxes"]):
            place = np.eye(4, order="F")
            place[:3, 3] = middle
            scene.addBoxGeometry(f"box{number}", given["root"], Box(*size), place, np.ones(4))
        names_of_boxes = [f"box{number}" for number in range(len(problem["boxes"]))]
        scene.setCollisions(list(combinations(names_of_boxes, 2)), False)
        options = RRTOptions(group, max_planning_time=5.0, max_nodes=100_000, rrt_connect=True)
        options.collision_check_step_size = given["step"]
        planner = RRT(scene, options)
        planner.setRngSeed(1)
        ends = [JointConfiguration(names, np.array(problem[one])) for one in ("start", "goal")]
        began = time.process_time()
        try:
            path = planner.plan(*ends)
            shortcutter = PathShortcutter(scene, PathShortcuttingOptions(group, max_step_size=given["step"], seed=1))
            path = shortcutter.shortcut(path)
            points = [np.asarray(one).tolist() for one in path.positions]
        except RuntimeError as error:
            sys.stderr.write(f"{problem['scenario']}: {error}\n")
            points = []
        found.append({"time": time.process_time() - began, "path": points})
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()

"""RoboPlan's side of the problems for arms: reads them as JSON from stdin, and writes times and paths as JSON.

It runs in the Python that has RoboPlan, with nothing of ours.
"""

import json
import sys
import time
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np

WORLD = "universe"  # in whose frame the root stands; what is attached to a link counts as that link for pairs


def main() -> None:
    """Plan all problems, and shorten what is found."""
    from roboplan.core import (  # type: ignore[import-not-found]
        Box,
        Cylinder,
        JointConfiguration,
        PathShortcutter,
        PathShortcuttingOptions,
        Scene,
        Sphere,
        loadUrdfSceneDescription,
    )
    from roboplan.rrt import RRT, RRTOptions  # type: ignore[import-not-found]

    given: dict[str, Any] = json.load(sys.stdin)
    names, group, found = given["joints"], "arm", []
    joints = "".join(f'<joint name="{name}"/>' for name in names)
    for problem in given["problems"]:
        with NamedTemporaryFile("w", suffix=".urdf", encoding="utf-8") as urdf:
            urdf.write(given["urdf"])
            urdf.flush()
            scene = Scene("bench", loadUrdfSceneDescription(urdf.name, []))
        scene.importSrdf(f'<robot name="{scene.getName()}"><group name="{group}">{joints}</group></robot>')
        for name, kind, sizes, pose in problem["shapes"]:
            place = np.eye(4, order="F")
            place[:3] = pose
            if kind == "box":
                scene.addBoxGeometry(name, WORLD, Box(*sizes), place, np.ones(4))
            elif kind == "cylinder":
                scene.addCylinderGeometry(name, WORLD, Cylinder(*sizes), place, np.ones(4))
            else:
                scene.addSphereGeometry(name, WORLD, Sphere(*sizes), place, np.ones(4))
        scene.setCollisions(problem["off"], False)
        whole = scene.getCurrentJointPositions().copy()
        for name in set(problem["others"]) & set(scene.getJointNames()):
            whole[scene.getJointPositionIndices([name])] = problem["others"][name]
        scene.setJointPositions(whole)
        options = RRTOptions(group, max_planning_time=5.0, max_nodes=100_000, rrt_connect=True)
        options.collision_check_step_size = given["step"]
        planner = RRT(scene, options)
        planner.setRngSeed(1)
        ends = [JointConfiguration(names, np.array(problem[text])) for text in ("start", "goal")]
        began = time.process_time()
        try:
            path = planner.plan(*ends)
            shortcutter = PathShortcutter(scene, PathShortcuttingOptions(group, max_step_size=given["step"], seed=1))
            path = shortcutter.shortcut(path)
            points = [np.asarray(position).tolist() for position in path.positions]
        except RuntimeError as error:
            sys.stderr.write(f"{problem['scenario']}: {error}\n")
            points = []
        found.append({"time": time.process_time() - began, "path": points})
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()

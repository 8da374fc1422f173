"""Bodies: where all links are, beside two libraries, and what a body adds to `check`."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import pinocchio
import yaml
import yourdfpy

from benchmarks.measuring import COMMAND, ROOT, Row, in_turns, program
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.pinocchio_model import PinocchioModel
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf

MEASURES = ("rbxcompose/compiler", "rbxcompose/domains/body")

ROBOT = ROOT / "robots" / "box_robot"
TIMES, ROUNDS, CHECKS, JOINTS = 200, 15, 5, 7
JOINT = """<link name="link{0}"/><joint name="joint{0}" type="revolute">
  <origin xyz="0 {1} 0.2" rpy="{1} 0 1.5"/><axis xyz="0 0 1"/><parent link="{2}"/><child link="link{0}"/>
  <limit lower="-3" upper="3" effort="10" velocity="2"/>
</joint>
"""


def rows() -> list[Row]:
    """Return the figures of bodies."""
    box = compile_robot(str(ROBOT), environment={}).robot
    description = box.manifest.contents.of(body) if box else None
    if description is None:
        raise ValueError("robots/box_robot has no body")
    return [*_kinematics("box_robot", description), *_kinematics("an arm of 7 joints", _arm()), *_checks()]


def _arm() -> Description:
    joints = [JOINT.format(index, index / 10, f"link{index - 1}") for index in range(1, JOINTS + 1)]
    text = f'<robot name="arm"><link name="link0"/>{"".join(joints)}</robot>'
    root = read_urdf(text, "arm.urdf")
    if not isinstance(root, XmlElement):
        raise ValueError(root.message)
    return Description(text, read_body(root)[0])


def _kinematics(name: str, description: Description) -> list[Row]:
    body = description.body
    at = [{joint.name: 0.001 * step for joint in body.moving} for step in range(TIMES)]
    jobs = (lambda: [body.poses(entry) for entry in at], _by_yourdfpy(description, at), _by_pinocchio(description, at))
    ours, slow, fast = (TIMES / samples.median for samples in in_turns(*jobs, rounds=ROUNDS))
    what = f"forward kinematics of {name}, all {len(body.links)} links"
    how = "`Body.poses` from positions by name, beside"
    peer = f"{how} `update_cfg` and `get_transform` of each link"
    core = f"{how} `framesForwardKinematics` alone, in C++ and from its own vector"
    return [
        Row(what, "per s", peer, ours, peer=slow, against="yourdfpy", least_ratio=5),
        Row(what, "per s", core, ours, peer=fast, against="Pinocchio"),
    ]


def _by_yourdfpy(description: Description, at: list[dict[str, float]]) -> Callable[[], object]:
    robot = yourdfpy.URDF.load(io.BytesIO(description.text.encode()), load_meshes=False)
    links, root = list(description.body.links), description.body.root

    def run() -> object:
        for entry in at:
            robot.update_cfg(entry)
            poses = [robot.get_transform(link, root) for link in links]
        return poses

    return run


def _by_pinocchio(description: Description, at: list[dict[str, float]]) -> Callable[[], object]:
    built = PinocchioModel(description)
    found = [built.q(entry) for entry in at]
    return lambda: [pinocchio.framesForwardKinematics(built.model, built.data, q) for q in found]


def _checks() -> list[Row]:
    with TemporaryDirectory() as folder:
        commands = [[*COMMAND, "check", str(_copy(Path(folder), has_body))] for has_body in (True, False)]
        whole, bare = in_turns(*map(program, commands), rounds=CHECKS, clock=_time_of_programs)
    how = "processor time from start to exit, with that of the processes that expand the xacro files"
    beside = f"{how}, beside a robot with the same components and no body"
    more = 1e3 * (whole.median - bare.median)
    return [
        Row(
            "`check` of a robot with a body",
            "ms",
            beside,
            1e3 * whole.median,
            peer=1e3 * bare.median,
            against="without",
        ),
        Row("what a body adds to `check`", "ms", how, more, most=300),
    ]


def _time_of_programs() -> float:
    """Return the processor time of the programs that have ended [s], without what they waited for on a busy machine."""
    times = os.times()
    return times.children_user + times.children_system


def _copy(folder: Path, has_body: bool) -> Path:
    """Write the robot, with or without its body."""
    tree = yaml.safe_load((ROBOT / "robot.yaml").read_text(encoding="utf-8"))
    del tree["diagnostics"]  # it groups statuses of the body
    if not has_body:
        tree["include"] = {"base": "rbx:parts/base.yaml", "teleop": tree["include"]["teleop"]}
    own = folder / str(has_body)
    shutil.copytree(ROBOT, own)
    (own / "robot.yaml").write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
    return own / "robot.yaml"

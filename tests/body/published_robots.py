"""Tries published robots: `python -m tests.body.published_robots URDF` prints what came of one, as JSON.

The robots are those of the package `example-robot-data`, which is used where it is installed. Each has a process of its
own, whose memory is measured.
"""

from __future__ import annotations

import json
import random
import resource
import statistics
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import TypeVar

import numpy as np

from rbxcompose.base.findings import Finding, Span
from rbxcompose.domains.body.description import BodyPart, Description, describe
from rbxcompose.domains.body.files import BodyFile
from rbxcompose.domains.body.picture import draw
from rbxcompose.domains.body.pinocchio_model import PinocchioModel
from tests.body.kinematics import matrix

ROOT = Path(__file__).parents[2]
PACKAGE = "example-robot-data"
HERE = Span("robot.yaml", 1, 1, 1, 1)
POSITIONS, ROUNDS = 20, 5
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Tried:
    """What came of a robot: what is wrong with it, the time to read and check it, and how far Pinocchio is away."""

    robot: str
    loads: bool
    links: int
    findings: dict[str, int]
    reading: float  # [ms]
    difference: float | None = None
    refused: str = ""  # by Pinocchio
    drawn: str = "no"
    drawing: float = 0.0  # [s]
    memory: int = 0  # [MB], with all libraries


def folder() -> Path | None:
    """Return the folder of the package, None if it is not installed."""
    try:
        found = Path(str(metadata.distribution(PACKAGE).locate_file("cmeel.prefix/share/example-robot-data")))
    except metadata.PackageNotFoundError:
        return None
    return found if found.is_dir() else None


def robots() -> list[Path]:
    """Return the URDF file of each robot."""
    return sorted((there / "robots").rglob("*.urdf")) if (there := folder()) else []


def read(path: Path) -> tuple[Description | None, list[Finding]]:
    """Read and check a robot, as the section `body` of a manifest would."""
    there = folder()
    packages = {PACKAGE: there} if there else {}
    return describe("robot", path.parent, [BodyPart("", BodyFile(path, HERE, packages=packages), None, HERE, HERE)], {})


def tried_alone(path: Path) -> Tried:
    """Try a robot in a process of its own."""
    command = [sys.executable, "-m", "tests.body.published_robots", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=300)
    if done.returncode:
        raise ValueError(f"{path.name}: {done.stderr[-2000:]}")
    return Tried(**json.loads(done.stdout.splitlines()[-1]))


def tried(path: Path) -> Tried:
    """Read, check, place and draw a robot."""
    name = f"{path.relative_to(path.parents[2]).parts[0].removesuffix('_description')}/{path.stem}"
    (description, findings), seconds = _timed(lambda: read(path), ROUNDS)
    codes = dict(sorted(Counter(finding.code for finding in findings).items()))
    links = len(description.body.links) if description else 0
    difference, refused, drawn, drawing = None, "", "no", 0.0
    if description:
        difference, refused = _difference(description)
        started = time.process_time()
        drawn = _drawn(description)
        drawing = time.process_time() - started
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    return Tried(
        name, description is not None, links, codes, 1000 * seconds, difference, refused, drawn, drawing, memory
    )


def _timed(job: Callable[[], T], rounds: int) -> tuple[T, float]:
    times = []
    for _ in range(rounds):
        started = time.process_time()
        done = job()
        times.append(time.process_time() - started)
    return done, statistics.median(times)


def _difference(description: Description) -> tuple[float | None, str]:
    """Return by how much the pose of a link differs from that of Pinocchio at most, or why Pinocchio refuses it."""
    try:
        model = PinocchioModel(description)
    except ValueError as error:
        return None, str(error)
    chance, largest = random.Random(7), 0.0
    for _ in range(POSITIONS):
        positions = {joint.name: chance.uniform(-3.0, 3.0) for joint in description.body.moving}
        theirs = model.poses(positions)
        for link, pose in description.body.poses(positions).items():
            largest = max(largest, float(np.abs(matrix(pose) - matrix(theirs[link])).max()))
    return largest, ""


def _drawn(description: Description) -> str:
    try:
        draw(description.body, {}, description.meshes)
    except ValueError as error:
        return str(error)
    return "yes"


if __name__ == "__main__":
    sys.stdout.write(json.dumps(asdict(tried(Path(sys.argv[1])))) + "\n")

"""A test of a mission, made from a dry run: it must end in the same way, by the same steps."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from rbxcompose.base.expressions.values import is_named_pose
from rbxcompose.base.requests import Refused
from rbxcompose.commands.new_files import write_new
from rbxcompose.tools.mission_tests.model import RUNS
from rbxcompose.tools.mission_tests.record import Done, TrialRecord

MOST_STEPS = 20
TESTS = "missions/tests"


def make_test(project: Path, robot: Path, mission: str, record: TrialRecord) -> Path:
    """Write a test of a mission into a project, and return its file.

    Raises:
        Refused: if the run has not come to an end, or there is such a file.
    """
    if record.outcome == RUNS or record.trouble:
        raise Refused("a test needs a run that has ended: the mission runs on")
    path = project / f"{TESTS}/{mission}.test.yaml"
    if not robot.is_relative_to(project):
        raise Refused("the robot belongs to the library: make one of your own with 'rbxcompose new robot NAME'")
    text = "\n".join(_lines(Path(os.path.relpath(robot, path.parent)).as_posix(), mission, record))
    if (finding := write_new(project, {f"{TESTS}/{mission}.test.yaml": f"{text}\n"})) is not None:
        raise Refused(finding.message)
    return path


def _lines(robot: str, mission: str, record: TrialRecord) -> Iterator[str]:
    yield from ("rbx: 1", "kind: Test", f"name: {mission}", "about: As in a dry run.")
    yield from (f"robot: {robot}", f"mission: {mission}", "expect:", f"  outcome: {record.outcome}")
    steps = [step for step in record.steps if step.ended != RUNS]
    if steps:
        yield "  steps:"
        for step in steps[:MOST_STEPS]:
            yield from (f"    - {step.name}:{_argument(step)}", f"      ended: {step.ended}")


def _argument(step: Done) -> str:
    """Return the place to which a step went; other arguments may differ from run to run."""
    values = [*step.arguments.values()]
    return f" {values[0].name}" if len(values) == 1 and is_named_pose(values[0]) and values[0].name else ""

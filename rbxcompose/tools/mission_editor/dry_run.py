"""A mission on the simulated robot and the stepped clock, as tests of missions run it: what came of it, and the story.

Nothing of the robot that is up takes part: its bus, its devices and its mission are not touched. A dry run can become a
test of the mission: it must end in the same way, by the same steps.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rbxcompose.base.expressions.values import is_named_pose
from rbxcompose.base.findings import Severity
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Refused
from rbxcompose.commands.new_files import write_new
from rbxcompose.commands.targets import tests_of
from rbxcompose.compiler.compile import Compilation, robot_for_mission
from rbxcompose.manifest.files import shown_name
from rbxcompose.missions.engine.inputs import bind_texts
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.outcomes import IDLE, NAMES, RUNNING
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames
from rbxcompose.sdk.capabilities import RunsProgram
from rbxcompose.sdk.registry import declared
from rbxcompose.tools.mission_editor.outline import MissionOutline
from rbxcompose.tools.mission_editor.yaml_places import Path as TextPath
from rbxcompose.tools.mission_tests.coverage import SeenWays
from rbxcompose.tools.mission_tests.model import RUNS, Expectations, Trial
from rbxcompose.tools.mission_tests.record import Done, TrialRecord
from rbxcompose.tools.mission_tests.runner import RobotRun

LONGEST = 600.0  # [s] of robot time
MOST_LINES = 500  # of the story
MOST_TESTS = 50
TESTING = 80.0  # [s]
SAMPLE = 0.25  # [s] of robot time between two poses
MOST_CHANGES = 4000  # of statuses that are told
SAMPLER = "dry run"
MOST_STEPS = 20  # of a test
TESTS = "missions/tests"
_OF_PLACE = ("name", "x", "y", "heading", "colour")
TARGET_FRAME, ROBOT_FRAME = "map", "base_footprint"


class _Watching(SeenWays):
    """Observes when each node begins and ends, and where the robot is."""

    def __init__(self) -> None:
        super().__init__()
        self.last: dict[int, int] = {}
        self.changes: list[tuple[float, int, int]] = []  # time [s], number of a node, its status
        self.track: list[tuple[float, float, float, float]] = []  # time [s], x [m], y [m], heading [rad] in `map`
        self.now: Callable[[], float] = lambda: 0.0

    def started(self, number: int, /) -> None:
        """Handle the start of a node."""
        self._became(number, RUNNING)

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """Handle the end of a node; one that was halted has not ended."""
        self._became(number, RUNNING if status == IDLE else status)

    def follow(self, run: RobotRun) -> None:
        """Note from now on where the robot is, if its frames tell."""
        self.now, frames = (lambda: run.now), run.bench.host.frames

        def look(dt: float) -> None:
            found = frames.lookup(TARGET_FRAME, ROBOT_FRAME) if frames is not None else None
            if found is not None:
                pose = found.to_pose2()
                self.track.append((run.now, pose.x, pose.y, pose.heading))

        run.bench.scheduler.every(SAMPLE, SAMPLER, look)

    def _became(self, number: int, status: int) -> None:
        self.last[number] = status
        if len(self.changes) < MOST_CHANGES:
            self.changes.append((self.now(), number, status))


def tried(made: Compilation, mission: str) -> tuple[TrialRecord, _Watching, Program, RobotNames]:
    """Run a mission of a compiled robot; return what happened, with the mission and the names that it sees.

    Raises:
        Refused: if the robot or the mission has errors, or starts programs.
    """
    found = robot_for_mission(made, mission) if made.robot is not None and mission in made.robot.missions else None
    if found is None:
        errors = [one for one in made.report if one.severity is Severity.ERROR]
        raise Refused(f"it cannot run yet: {errors[0].message}" if errors else "it cannot run yet")
    robot, plan = found
    started = [one.name for one in plan.instances if declared(one.type, one.config, RunsProgram)]
    if started:
        raise Refused(f"'{started[0]}' would start a program: try it with 'rbxcompose test'")
    program, names = robot.missions[mission].program, robot.names
    linked, seen = link(program, names.missions), _Watching()
    inputs, missing = bind_texts(program, {}, robot.missions[mission].inputs, names.places)
    if missing:
        raise Refused(f"it cannot run yet: {missing[0].message}; a 'default' would do")
    expect = Expectations(until=LONGEST)
    trial = Trial("dry run", mission, program, linked, robot, plan, inputs, {}, (), expect, is_complete=False)
    run = RobotRun(trial, seen)
    run.record.name_by(lambda number: run.executive.missions.runs[mission].heading(number))
    seen.follow(run)
    return run.run(), seen, linked, names


def dry_run(made: Compilation, mission: str, path: Path, text: str) -> dict[str, Any]:
    """Run a mission of a compiled robot, and return its `outcome`, the `story`, and the `statuses` of its blocks.

    `changes` are the statuses in the order in which blocks got them, `track` is where the robot was, with the times.

    Raises:
        Refused: if the robot or the mission has errors, or starts programs.
    """
    record, seen, linked, names = tried(made, mission)
    outcome = "" if record.outcome == RUNS else record.outcome
    lines = record.lines[-MOST_LINES:]
    blocks = _blocks(MissionOutline(text), shown_name(path), linked.nodes)
    changes = [(time, blocks[number], NAMES[status]) for time, number, status in seen.changes if number in blocks]
    return {
        "outcome": outcome,
        "why": record.trouble or ("" if outcome else f"it has not ended after {LONGEST:g} s of robot time"),
        "time": record.now,
        "left_out": len(record.lines) - len(lines),
        "story": [{"time": line.time, "text": line.text, "is_bad": line.level is not Level.OK} for line in lines],
        "statuses": [
            {"path": list(path), "status": NAMES[seen.last[number]]}
            for number, path in blocks.items()
            if number in seen.last
        ],
        "changes": [{"time": time, "path": list(path), "status": status} for time, path, status in changes],
        "track": [[round(value, 3) for value in at] for at in seen.track],
        "places": [{key: getattr(place, key) for key in _OF_PLACE} for place in names.places.values()],
    }


def _blocks(outline: MissionOutline, file: str, nodes: Sequence[MissionNode]) -> dict[int, TextPath]:
    """Return the path of the block of each node that has one, by the node's number; the innermost node counts."""
    found: dict[TextPath, int] = {}
    for node in nodes:
        block = outline.written_at(node.span.line, node.span.column) if node.span.file == file else None
        if block is not None:
            found[block.path] = node.number
    return {number: path for path, number in found.items()}


def run_tests(project: Path, mission: str, unsaved: Mapping[Path, str]) -> str:
    """Run the tests of a mission with coverage, as `rbxcompose test` does, and return its report in JSON.

    `unsaved` are texts that count in place of files. The tests run in a process of their own, for a limited time.

    Raises:
        Refused: if there are none, or they take too long.
    """
    folder = project / "missions"
    named = re.compile(rf"^mission:\s*['\"]?{re.escape(mission)}['\"]?\s*(#.*)?$", re.MULTILINE)
    files = [file for file in (tests_of([folder]) if folder.is_dir() else ()) if named.search(_text(file))]
    if not files:
        raise Refused(f"there are no tests of '{mission}' in 'missions/'")
    given = {str(path): text for path, text in unsaved.items()}
    verb = ["test", "--coverage", "--json", "--unsaved", "-"]
    command = [sys.executable, "-m", "rbxcompose", *verb, *map(str, files[:MOST_TESTS])]
    try:
        done = subprocess.run(
            command, input=json.dumps(given), capture_output=True, text=True, timeout=TESTING, check=False, cwd=project
        )
    except subprocess.TimeoutExpired as error:
        raise Refused(f"the tests take more than {TESTING:g} s: run 'rbxcompose test'") from error
    if not done.stdout.startswith("{"):
        raise Refused(done.stderr.strip()[-500:] or "the tests did not run")
    return done.stdout


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


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
    text = "\n".join(_lines_of_test(Path(os.path.relpath(robot, path.parent)).as_posix(), mission, record))
    if (finding := write_new(project, {f"{TESTS}/{mission}.test.yaml": f"{text}\n"})) is not None:
        raise Refused(finding.message)
    return path


def _lines_of_test(robot: str, mission: str, record: TrialRecord) -> Iterator[str]:
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

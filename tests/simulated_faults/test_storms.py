"""Whole robots in storms: whatever fails, each run is safe, and ends. A seed that once failed is tried in each run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveCore
from rbxcompose.runtime.recording.files import RecordingWriter
from rbxcompose.runtime.recording.reader import RecordingReader
from rbxcompose.runtime.recording.topics import Recorded
from rbxcompose.runtime.supervision.members import Phase
from rbxcompose.testing import check_file
from tests.simulated_faults.network import Calm
from tests.simulated_faults.safety import SentVelocity, events_of, laws_of, violations
from tests.simulated_faults.storms import Storm
from tests.simulated_faults.whole_robot import WholeRobot
from tests.soak import Soak, rare

ROBOT = Path(__file__).parents[2] / "robots/turtlebot/robot.yaml"
BATCHES = 5
QUICK, MANY = 1, 1_000  # seeds
HARD = (97, *rare(33, 63, 71, 129, 717))  # a stop or restart while something hangs


@dataclass
class Count:
    """What was tried."""

    seeds: int = 0
    seconds: float = 0.0
    faults: int = 0
    unsafe: list[int] = field(default_factory=list)

    def add(self, storm: Storm) -> None:
        """Count a storm that was run, and require that it was safe."""
        self.seeds, self.seconds = self.seeds + 1, self.seconds + storm.robot.clock.now()
        self.faults += len(storm.faults)
        found = storm.violations()
        if found:
            self.unsafe.append(storm.seed)
        assert not found, "\n".join([*map(str, found[:5]), str(storm)])
        assert storm.robot.conductor.phase is Phase.ENDED, storm
        assert not storm.robot.processes, storm


@pytest.fixture(scope="module")
def plan() -> Plan:
    return check_file(ROBOT).plan


@pytest.fixture(scope="module")
def count(soak: Soak) -> Iterator[Count]:
    count = Count()
    yield count
    note = f"{count.seconds / 3600:.1f} hours of robots, with {count.faults:,} faults"
    soak.tell("storms over simulated robots", count.seeds, len(count.unsafe), note)


@pytest.mark.timeout(300)
@pytest.mark.parametrize("batch", [*range(QUICK), *rare(*range(QUICK, BATCHES))])
def test_a_robot_is_safe_whatever_fails(plan: Plan, soak: Soak, count: Count, batch: int) -> None:
    for seed in range(batch, soak.examples(QUICK, MANY), BATCHES):
        storm = Storm(plan, seed)
        storm.run()
        count.add(storm)


@pytest.mark.parametrize("seed", HARD)
def test_a_robot_is_safe_where_it_was_not_once(plan: Plan, count: Count, seed: int) -> None:
    storm = Storm(plan, seed)
    storm.run()
    count.add(storm)


@pytest.mark.soak  # what it is about is how these tests are made
def test_a_storm_is_the_same_each_time(plan: Plan) -> None:
    first, second = Storm(plan, 8), Storm(plan, 8)
    first.run()
    second.run()
    assert (first.faults, first.robot.texts) == (second.faults, second.robot.texts)
    assert first.robot.told == second.robot.told


def test_a_story_is_the_same_when_it_is_read_from_a_recording(plan: Plan, tmp_path: Path) -> None:
    robot = WholeRobot(plan, Calm())
    robot.advance(2.0)
    messages = [one for one in robot.told if isinstance(one, Recorded)]
    with (tmp_path / "run.mcap").open("w+b") as file:
        writer = RecordingWriter(file)
        for message in messages:
            writer.add(message)
        writer.finish()
        file.seek(0)
        recorded = list(events_of(laws_of(plan), RecordingReader(file).messages()))
    assert recorded == list(events_of(laws_of(plan), messages))
    assert not violations(laws_of(plan), recorded)


def test_without_faults_the_robot_drives_its_patrol_over_the_network(plan: Plan) -> None:
    robot = WholeRobot(plan, Calm())
    robot.advance(12.0)
    assert sum("success" in text for text in robot.texts) == 2
    assert any(
        isinstance(event, SentVelocity) and event.topic == "/odom" and not event.is_rest for event in robot.story
    )


def test_a_base_that_outlives_its_deadline_is_found(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    brake = DiffDriveCore.brake
    monkeypatch.setattr(DiffDriveCore, "brake", lambda self: brake(self) if self.at_rest else None)
    storm = Storm(plan, 0)
    storm.run()
    assert "unwarranted motion" in {violation.law for violation in storm.violations()}, storm

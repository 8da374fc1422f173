"""Tests of missions in which something goes wrong with the servos of the robot."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from rbxcompose.commands.formats.text import render_text
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.mission_tests.reader import TrialReader
from rbxcompose.tools.mission_tests.runner import run_trial

ROBOT = """
buses:
  servos: {type: dynamixel}
include:
  head: {part: rbx:parts/pan_tilt.yaml, with: {bus: servos}}
diagnostics:
  analyzers:
    motion: {match: [servos]}
values:
  motion: diagnostics.motion
missions:
  watch: watch.yaml
"""
MISSION = """
do:
  - wait_for: $motion == error
    timeout: 20 s
  - log: It has stopped
  - wait_for: $motion == ok
    timeout: 20 s
"""
FAULTY = """
    events:
      - at: 3 s
        fault: {joint: head_pan_joint, fault: power_off, for: 5 s}
    expect:
      outcome: success
      reports: [It has stopped]
"""
PULLED = FAULTY.replace("joint: head_pan_joint, fault: power_off", "bus: servos, fault: unplug")
WRONG = """
    events:
      - at: 1 s
        fault: {joint: head_pan_jiont, fault: mute}
      - at: 2 s
        fault: {joint: head_pan_joint, fault: overheet}
      - at: 3 s
        fault: {fault: mute}
      - at: 4 s
        fault: {joint: head_pan_joint, fault: unplug}
      - at: 5 s
        fault: {bus: wheels, fault: unplug}
    expect:
      outcome: success
"""
ALONE = """
    events:
      - at: 1 s
        set: {motion: error}
        fault: {joint: head_pan_joint, fault: mute}
    expect:
      outcome: failure
"""


class Watched:
    """A robot with two servos, and a mission that watches them."""

    def __init__(self, folder: Path, robot: str = ROBOT, mission: str = MISSION, name: str = "watch") -> None:
        self.folder, self.reader, self.mission = folder, TrialReader({}), name
        (folder / "robot.yaml").write_text(f"rbx: 1\nkind: Robot\nname: head\n{robot}", encoding="utf-8")
        (folder / f"{name}.yaml").write_text(f"rbx: 1\nkind: Mission\nname: {name}\n{mission}", encoding="utf-8")

    def written(self, text: str) -> Path:
        path = self.folder / "tried.test.yaml"
        head = f"rbx: 1\nkind: Test\nname: tried\nrobot: robot.yaml\nmission: {self.mission}\n"
        path.write_text(head + textwrap.dedent(text), encoding="utf-8")
        return path

    def problems(self, text: str) -> list[str]:
        trial, report = self.reader.read(self.written(text))
        assert trial is not None, render_text(report, self.reader.sources)
        verdict = run_trial(trial)
        return [problem.message for problem in verdict.problems]

    def findings(self, text: str) -> str:
        return render_text(self.reader.read(self.written(text))[1], self.reader.sources)


RESTS = """
buses: {servos: {type: dynamixel}}
include:
  head: {part: rbx:parts/pan_tilt.yaml, with: {bus: servos}}
safety:
  thermal: {limit: 60 degC, resume: 45 degC, rest: 5 s, scope: bus}
diagnostics:
  analyzers:
    head: {match: [servos]}
values:
  head: diagnostics.head
missions:
  look: look.yaml
"""
LOOK = """
interrupts:
  too_hot:
    when: $head == error
    do:
      - log: The head rests
      - wait_for: $head == ok
        timeout: 3 min
      - log: The head is ready again
do:
  repeat: 5
  do:
    for: angle
    in: [40 deg, -40 deg]
    do:
      head_controller: {head_pan_joint: $angle, duration: 2 s}
      attempts: 2
      attempt_pause: 1 s
"""
HOT = """
    events:
      - at: 3 s
        fault: {joint: head_pan_joint, fault: overheat, for: 2 s}
    expect:
      outcome: success
      reports: [The head rests, The head is ready again]
"""


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Watched:
    return Watched(tmp_path_factory.mktemp("head"))


@pytest.mark.parametrize("text", [FAULTY, PULLED], ids=["a servo without power", "a bus that is unplugged"])
def test_a_mission_notices_the_fault_and_its_end(watched: Watched, text: str) -> None:
    assert watched.problems(text) == []


@pytest.mark.soak
def test_a_group_with_a_servo_that_is_too_hot_rests_and_the_mission_goes_on_when_it_has_cooled(tmp_path: Path) -> None:
    assert Watched(tmp_path, RESTS, LOOK, "look").problems(HOT) == []


def test_without_the_fault_nothing_happens(watched: Watched) -> None:
    assert "failure" in " ".join(watched.problems("expect: {outcome: success}"))


def test_faults_of_what_is_not_there_are_told(
    watched: Watched, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.chdir(watched.folder)
    golden.check("faults_of_servos.txt", f"{watched.findings(WRONG)}\n{watched.findings(ALONE)}")

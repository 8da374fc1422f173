"""Runs a test in the way that it needs, and judges the result."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.mission_tests.coverage import SeenWays
from rbxcompose.mission_tests.judge import UnmetExpectation, judge
from rbxcompose.mission_tests.model import Trial
from rbxcompose.mission_tests.record import TrialRecord
from rbxcompose.mission_tests.stage import TrialStage


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of a test: what happened, what was not as expected, and which paths its mission took."""

    trial: Trial
    record: TrialRecord
    problems: list[UnmetExpectation]
    seen: SeenWays

    @property
    def passed(self) -> bool:
        """Return whether all was as expected."""
        return not self.problems


def run_trial(trial: Trial) -> Verdict:
    """Run a test: the mission alone if the test answers everything that it needs, else the whole robot."""
    seen = SeenWays()
    if trial.is_complete:
        record = TrialStage(trial, seen).run()
    else:
        from rbxcompose.mission_tests.robot_run import RobotRun  # not every test needs a robot

        record = RobotRun(trial, seen).run()
    types = {name: datum.type for name, datum in trial.program.data.items()}
    return Verdict(trial, record, judge(trial.expect, record, types), seen)

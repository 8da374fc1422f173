"""Whatever process of a patrolling robot is killed or stopped: it stays safe, and goes on or ends in order."""

from __future__ import annotations

import signal
from itertools import count
from pathlib import Path

import pytest

from tests.faults.patrol import MISSION, PARENT, ROBOT, WORLD, Patrol
from tests.faults.rounds import Fault, Findings, in_turn, run
from tests.soak import Soak, rare

SEED, ROUNDS = 1, 200


def rounds(folder: Path, faults: list[Fault], findings: Findings, names: count[int], *, times: int = 1) -> None:
    """Do rounds, with as many robots as that takes; each goes around so many times."""
    while faults:
        home = folder / str(next(names))
        home.mkdir()
        with Patrol(home, times=times) as patrol:
            faults = run(patrol, faults, findings)


@pytest.mark.parametrize("fault", [Fault(ROBOT, signal.SIGSTOP), *rare(Fault(MISSION, signal.SIGKILL))], ids=str)
def test_what_died_or_hung_comes_back_and_the_mission_succeeds(fault: Fault, tmp_path: Path) -> None:
    findings = Findings()
    rounds(tmp_path, [fault], findings, count())
    assert (findings.rounds, findings.wrong) == (1, [])
    assert findings.stops or fault.process == MISSION


@pytest.mark.parametrize("fault", [Fault(WORLD, signal.SIGSTOP), *rare(Fault(PARENT, signal.SIGSTOP))], ids=str)
def test_without_what_cannot_come_back_the_robot_comes_to_rest_and_ends(fault: Fault, tmp_path: Path) -> None:
    findings = Findings()
    rounds(tmp_path, [fault], findings, count())
    assert findings.wrong == []


@pytest.mark.timeout(2 * 3600)
@pytest.mark.soak
def test_many_rounds(soak: Soak, tmp_path: Path) -> None:
    findings, names = Findings(), count()
    for faults in in_turn(SEED, ROUNDS):
        rounds(tmp_path, faults, findings, names, times=2)
        print(findings.summary)  # noqa: T201 - it takes long
    soak.tell("faults of processes", findings.rounds, len(findings.wrong), findings.summary)
    assert findings.wrong == []

"""Projects made to do harm end as findings, within time and memory: one row of the table of limits after the other."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.hostile.projects import PROJECTS, Project, write
from tests.hostile.test_hostile_manifests import HOSTILE, WORST
from tests.soak import Soak, rare

ROOT = Path(__file__).parents[2]
DEADLINE = 15.0  # [s] of processor time: several times what it may take, since machines differ by as much
RESIDENT = 200_000  # [kB]
PLACELESS = {"RBX1103", "RBX1301"}  # what is wrong with a whole file, before there is a text to point into
# A process counts the memory of the one that it was forked from, so a small one comes between.
LAUNCHER = """
import json, os, subprocess, sys
child = subprocess.Popen(sys.argv[1:], stderr=subprocess.STDOUT)
_, status, used = os.wait4(child.pid, 0)
told = {"seconds": used.ru_utime + used.ru_stime, "resident": used.ru_maxrss}
sys.stderr.write(json.dumps(told | {"exit": os.waitstatus_to_exitcode(status)}))
sys.stderr.flush()
os._exit(0)
"""
LONG = {
    "2,000 names near 99 arguments",
    "900 missions that are missing in a folder of 900",
    "600 parts",
    # each of a kind of which another one is tried
    "many large parts",
    "a part of 5,000 values included 100 times",
    "a long variable in many texts",
    "5,000 unknown skills, each another",
    "30 texts with 7,000 names each",
    "30,000 values in a mission",
    "spaces in a quantity",
    "dollars",
    "5,000 unknown keys",
    "many anchors",
    "doubling parts",
    "parts that bring 8,000 components",
    "aliases that double in a part",
    "stored nodes that run all stored nodes",
    "a mission of 9,000 values listed 400 times",
    "2,000 loops over 8,900 places",
    "900 states in a row",
    "9,000 misspelt names",
    "10,000 unknown skills",
    "20 profiles over 19,000 values",
    "many attributes in a URDF",
    "a long argument in many texts",
    "5,000 interrupts",
    "100 missions that each use all later ones",
    "3,000 stored nodes run in 1,400 places",
    "10,000 patterns for 900 components",
    "many quotes",
    "many lines",
    "3,000 branches that need the base",
    "a loop over 19,000 items",
    "200,000 elements of a URDF",
    "components that start after each other",
    "180,000 keys",
    "many comments",
    "90,000 unknown keys",
    "50,000 items inside each other",
    "10,000 states",
    "one long text",
    "an element of 3 MB that never ends",
}
ALL = PROJECTS | {name: Project(code, {"robots/bad/robot.yaml": text}) for name, (text, code) in WORST.items()}
THE_WORST = ("500,000 nodes", "doubling parts", "20 MB", "doubling aliases", "a long list filled in many times")
WORST_OF_ALL = (*THE_WORST, "5,000 interrupts")


@pytest.fixture(scope="module")
def compiler() -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "tests.hostile.child"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        yield process
        assert process.stdin
        process.stdin.close()


def told_of(compiler: subprocess.Popen[str], path: Path, environment: dict[str, str]) -> Any:
    assert compiler.stdin
    assert compiler.stdout
    compiler.stdin.write(json.dumps({"path": str(path), "environment": environment}) + "\n")
    compiler.stdin.flush()
    return json.loads(compiler.stdout.readline())


@pytest.mark.parametrize("name", [*(name for name in ALL if name not in LONG), *rare(*sorted(LONG))])
def test_a_hostile_project_ends_in_a_finding_within_time_and_memory(
    compiler: subprocess.Popen[str], name: str, tmp_path: Path
) -> None:
    project = ALL[name]
    told = told_of(compiler, write(project, tmp_path), dict(project.environment))
    assert told["exit"] == 0
    assert project.code in told["codes"]
    assert set(told["nowhere"]) <= PLACELESS
    assert told["controls"] == []
    assert told["seconds"] < DEADLINE


@pytest.mark.parametrize("name", [WORST_OF_ALL[0], *rare(*WORST_OF_ALL[1:])])
def test_the_command_itself_stays_within_time_and_memory(name: str, tmp_path: Path) -> None:
    project = ALL[name]
    path = write(project, tmp_path)
    command = [sys.executable, "-c", LAUNCHER, sys.executable, "-m", "rbxcompose", "check", str(path)]
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(ROOT), **project.environment}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    used = json.loads(done.stderr)
    assert used["exit"] == 1
    assert f"[{project.code}]" in done.stdout
    assert used["seconds"] < DEADLINE
    assert used["resident"] < RESIDENT


def test_every_row_of_the_limits_is_tried(soak: Soak) -> None:
    cases = len(ALL) + len(HOSTILE)
    soak.tell("hostile manifests", cases, 0, f"all refused; {len(WORST_OF_ALL)} of them by the command itself as well")
    assert cases >= 60

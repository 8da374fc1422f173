"""Each call that a writer makes of the system fails once, in each way: nothing is torn or lost, and it is told."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.io.faulty_disk import faulty_disks
from tests.io.writers import WRITERS, Run
from tests.loops import for_all
from tests.soak import Soak


@pytest.fixture(scope="module")
def rounds(soak: Soak) -> Iterator[list[str]]:
    tried: list[str] = []
    yield tried
    soak.tell("disks that fail", len(tried), 0, f"at each call of {len(WRITERS)} writers")


@for_all("name", WRITERS)
def test_a_disk_that_fails_costs_nothing_and_leaves_nothing_open(
    name: str, tmp_path: Path, rounds: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    writer = WRITERS[name]
    failures, before = 0, set(os.listdir("/proc/self/fd"))
    for number, disk in enumerate(faulty_disks()):
        run = Run(tmp_path / str(number) / "folder")
        run.folder.mkdir(parents=True)
        writer.prepare(run)
        with disk.spun():
            writer.act(run)
        try:
            writer.judge(run, disk.failed)
        except AssertionError as error:
            raise AssertionError(f"{disk}, told {run.told}, left {sorted(run.names)}") from error
        failures += bool(disk.failed)
        rounds.append(disk.fault)
    assert failures >= 5
    assert set(os.listdir("/proc/self/fd")) <= before

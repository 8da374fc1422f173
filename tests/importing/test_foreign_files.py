"""Driver files of ArbotiX that are not ours become robots; they are not part of this project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rbxcompose.base.findings import Severity
from tests.body.test_ros1_xacro import FOLDER
from tests.importing.imports import import_files
from tests.soak import Soak


@pytest.mark.timeout(0)
def test_the_driver_files_of_a_ros_1_package_become_robots(soak: Soak) -> None:
    files = sorted(Path(os.environ.get(FOLDER, "/nowhere")).rglob("arbotix/*.yaml"))
    if not files:
        pytest.skip(f"{FOLDER} names no package with files 'arbotix/*.yaml'")
    joints = 0
    for file in files:
        found = import_files([file])
        assert [finding for finding in found.report if finding.severity is Severity.ERROR] == [], found.words
        joints += len(found.data.get("joints", {}))
    soak.tell("driver files of ArbotiX", len(files), 0, f"all become robots, with {joints} joints")
    assert joints

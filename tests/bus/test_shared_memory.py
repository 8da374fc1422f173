from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rbxcompose.bus.shared_memory import POOL, YOUNG, problem, remove_orphans
from rbxcompose.bus.zenoh_session import peer_settings
from rbxcompose.msgs.rcl_interfaces import ParameterValue
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Network
from tests.bus.lone_camera import SIZES, picture


def segment(folder: Path, name: str) -> Path:
    path = folder / f"{name}.zenoh"
    path.write_bytes(bytes(100))
    return path


@pytest.fixture
def later(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is made now is not young any more."""
    now = time.time()
    monkeypatch.setattr(time, "time", lambda: now + 2 * YOUNG)


@pytest.mark.usefixtures("later")
def test_files_that_nobody_uses_are_removed_and_those_in_use_stay(tmp_path: Path) -> None:
    orphan, used, foreign = segment(tmp_path, "1"), segment(tmp_path, "2"), tmp_path / "sem.other"
    foreign.write_bytes(b"")
    with used.open("rb") as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        assert remove_orphans(tmp_path) == 1
        assert (orphan.exists(), used.exists(), foreign.exists()) == (False, True, True)
    assert remove_orphans(tmp_path) == 1
    assert not used.exists()


def test_a_file_that_was_just_made_stays(tmp_path: Path) -> None:
    young = segment(tmp_path, "1")
    assert remove_orphans(tmp_path) == 0
    assert young.exists()


def test_a_file_that_was_just_made_goes_as_well_if_there_is_time(tmp_path: Path) -> None:
    young, used = segment(tmp_path, "1"), segment(tmp_path, "2")
    with used.open("rb") as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        assert remove_orphans(tmp_path, waits=True) == 1
    assert (young.exists(), used.exists()) == (False, True)


@pytest.mark.usefixtures("later")
def test_a_link_is_not_followed(tmp_path: Path) -> None:
    target = tmp_path / "precious"
    target.write_bytes(b"")
    (tmp_path / "1.zenoh").symlink_to(target)
    assert remove_orphans(tmp_path) == 0
    assert target.exists()


def test_without_a_folder_or_room_the_reason_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert problem(tmp_path / "none") == f"there is no {tmp_path}/none"
    room = os.statvfs(tmp_path)
    full = os.statvfs_result((room.f_bsize, room.f_frsize, room.f_blocks, 0, 0, *tuple(room)[5:10]))
    monkeypatch.setattr(os, "statvfs", lambda folder: full)
    assert problem(tmp_path) == f"{tmp_path} has 0.0 MB free, {POOL / 1e6:.1f} MB are needed"
    monkeypatch.setattr(os, "access", lambda folder, mode: False)
    assert problem(tmp_path) == f"{tmp_path} cannot be written"


@pytest.mark.parametrize("reason", ["", "there is no /dev/shm"])
def test_a_session_shares_memory_unless_it_cannot(monkeypatch: pytest.MonkeyPatch, reason: str) -> None:
    monkeypatch.setattr("rbxcompose.bus.shared_memory.problem", lambda: reason)
    assert peer_settings("tcp/127.0.0.1:1")["transport/shared_memory/enabled"] is not reason


def mapped(pid: int) -> set[Path]:
    """Return the files of shared memory that a process has."""
    lines = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8").splitlines()
    return {Path(line.split()[5]) for line in lines if ".zenoh" in line}


@pytest.mark.skipif(problem() != "", reason="needs shared memory")
def test_pictures_come_whole_from_another_process_and_nothing_is_left_of_it_when_it_is_killed(network: Network) -> None:
    got: dict[int, ParameterValue] = {}

    def take(parameter_value: ParameterValue) -> None:
        got[len(parameter_value.byte_array_value)] = parameter_value

    viewer = network.process()
    viewer.bus.subscribe("viewer", "image", ParameterValue, Qos.BULK, take)
    camera = subprocess.Popen([sys.executable, "-m", "tests.bus.lone_camera", str(network.port)])
    try:
        network.until(lambda: len(got) == len(SIZES), within=15.0)
        files = mapped(camera.pid)
    finally:
        camera.kill()
        camera.wait()
    for size in SIZES:
        assert got[size] == picture(size)
    numbers = got[SIZES[-1]].double_array_value
    assert not numbers.flags.writeable
    assert not numbers.flags.owndata  # it is a view of what came
    own = files - mapped(os.getpid())
    assert own
    network.until(lambda: remove_orphans() >= 0 and not any(path.exists() for path in own), within=2 * YOUNG + 1.0)

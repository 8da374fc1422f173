from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from rbxcompose.runtime import folder as folders
from rbxcompose.runtime.folder import BrokenStateError, ComponentState, RobotFolder, RobotState, UnsafeFolderError
from rbxcompose.runtime.processes import Process, boot_id


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RobotFolder:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    made = RobotFolder.of("toys")
    made.make()
    return made


def state(process: Process | None = None, boot: str | None = None) -> RobotState:
    process = process or Process.of(os.getpid())
    component = ComponentState("base", "toy", "active", "robot", process.pid, 2)
    return RobotState("toys", "/toys.yaml", process, {"robot": process}, (component,), "tcp/x", boot or boot_id())


def test_the_folder_is_this_users_alone(folder: RobotFolder) -> None:
    for path in (folder.path, folder.path.parent):
        assert stat.S_IMODE(path.stat().st_mode) == 0o700


def test_a_folder_that_others_may_open_is_not_used(folder: RobotFolder) -> None:
    folder.path.chmod(0o750)
    with pytest.raises(UnsafeFolderError, match="0700"):
        folder.make()


def test_a_link_in_the_place_of_the_folder_is_not_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "rbxcompose").mkdir(mode=0o700)
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    (tmp_path / "rbxcompose" / "toys").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UnsafeFolderError):
        RobotFolder.of("toys").make()


def test_without_a_runtime_folder_the_users_own_temporary_one_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    assert folders.base_folder().name == f"rbxcompose-{os.getuid()}"


def test_the_lock_is_held_by_one(folder: RobotFolder) -> None:
    first = folder.lock()
    assert first is not None
    assert folder.lock() is None
    os.close(first)
    again = folder.lock()
    assert again is not None
    os.close(again)


def test_a_lock_that_was_removed_is_no_lock(folder: RobotFolder) -> None:
    first = folder.lock()
    assert first is not None
    folder.clear()
    second = folder.lock()
    assert second is not None
    os.close(first)
    assert folder.lock() is None
    os.close(second)


def test_a_state_comes_back_as_it_was_written(folder: RobotFolder) -> None:
    assert folder.read_state() is None
    folder.write_state(state())
    assert folder.read_state() == state()
    assert [path.name for path in folder.path.iterdir()] == [folders.STATE]


def test_a_state_that_was_changed_is_not_believed(folder: RobotFolder) -> None:
    folder.write_state(state())
    path = folder.path / folders.STATE
    path.write_text(path.read_text().replace("toys", "boys"))
    with pytest.raises(BrokenStateError, match="checksum"):
        folder.read_state()


def test_processes_of_another_boot_or_another_life_are_not_alive() -> None:
    us = Process.of(os.getpid())
    assert state().alive() == {"robot": us}
    assert state(boot="another").alive() == {}
    assert state(Process(us.pid, us.started - 1)).alive() == {}


def test_an_ended_supervisor_supervises_nothing() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        process = Process.of(child.pid)
        assert state(process).is_supervised
        child.communicate(b"\n")
    assert not state(process).is_supervised


def test_only_the_log_stays(folder: RobotFolder) -> None:
    folder.write_state(state())
    for name in ("log.jsonl", "log.1.jsonl", "lock", "control.sock", "robot.out", "state.json.77.new"):
        (folder.path / name).touch()
    folder.clear()
    assert sorted(path.name for path in folder.path.iterdir()) == ["log.1.jsonl", "log.jsonl"]


def test_robots_are_found_by_their_state(folder: RobotFolder) -> None:
    assert folders.all_folders() == []
    folder.write_state(state())
    assert folders.all_folders() == [folder]

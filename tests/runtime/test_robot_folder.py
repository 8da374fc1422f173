from __future__ import annotations

import hashlib
import os
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
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
    assert [path for path in folder.path.iterdir() if path.is_file()] == [folder.path / folders.STATE]


def test_a_state_that_was_changed_is_not_believed(folder: RobotFolder) -> None:
    folder.write_state(state())
    path = folder.path / folders.STATE
    path.write_text(path.read_text().replace("toys", "boys"))
    with pytest.raises(BrokenStateError, match="checksum"):
        folder.read_state()


TITLED = "import setproctitle; setproctitle.setproctitle(title); print(); input()"


@contextmanager
def process_with(title: str) -> Iterator[Process]:
    """A process that calls itself so, until the end of the block."""
    arguments = [sys.executable, "-c", f"title = {title!r}; {TITLED}"]
    with subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        yield Process.of(child.pid)
        child.communicate(b"\n")


def test_processes_of_another_boot_or_another_life_are_not_alive() -> None:
    with process_with("rbxcompose toys: robot") as process:
        assert state(process).alive() == {"robot": process}
        assert state(process, boot="another").alive() == {}
        assert state(Process(process.pid, process.started - 1)).alive() == {}


def test_a_process_that_does_not_call_itself_one_of_the_robot_is_none() -> None:
    us = Process.of(os.getpid())
    assert state(us).alive() == {}
    assert not state(us).is_supervised
    with process_with("rbxcompose boys: robot") as other:
        assert state(other).alive() == {}


def test_an_ended_supervisor_supervises_nothing() -> None:
    with process_with("rbxcompose toys: supervisor") as process:
        assert state(process).is_supervised
    assert not state(process).is_supervised


def test_only_the_log_stays(folder: RobotFolder) -> None:
    folder.write_state(state())
    for name in ("log.jsonl", "log.1.jsonl", "lock", "control.sock", "robot.out", "state.json.77.new"):
        (folder.path / name).touch()
    folder.clear()
    assert sorted(path.name for path in folder.path.iterdir()) == ["log.1.jsonl", "log.jsonl"]


@pytest.mark.parametrize("mode", [0o644, 0o620, 0o606])
def test_a_state_that_others_may_open_is_not_believed(folder: RobotFolder, mode: int) -> None:
    folder.write_state(state())
    (folder.path / folders.STATE).chmod(mode)
    with pytest.raises(BrokenStateError, match="another user"):
        folder.read_state()


def test_a_state_of_somebody_else_is_not_believed(folder: RobotFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    folder.write_state(state())
    monkeypatch.setattr(os, "getuid", lambda: 4711)
    with pytest.raises(BrokenStateError, match="another user"):
        folder.read_state()
    with pytest.raises(UnsafeFolderError, match="0700"):
        folders.all_folders()


@pytest.mark.parametrize("kind", ["fifo", "folder", "link"])
def test_a_state_that_is_no_file_is_not_read(folder: RobotFolder, kind: str) -> None:
    path = folder.path / folders.STATE
    if kind == "fifo":
        os.mkfifo(path, 0o600)
    elif kind == "folder":
        path.mkdir(0o700)
    else:
        path.symlink_to("/etc/hostname")
    with pytest.raises(BrokenStateError):
        folder.read_state()


@pytest.mark.parametrize("body", ["[]", "{}", '{"version": 1}', '{"version": 1, "supervisor": 7}', "[" * 100_000])
def test_a_state_of_another_form_is_not_believed(folder: RobotFolder, body: str) -> None:
    path = folder.path / folders.STATE
    path.touch(0o600)
    path.write_text(f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}")
    with pytest.raises(BrokenStateError):
        folder.read_state()


def test_a_robot_whose_state_was_removed_is_found_by_its_lock(folder: RobotFolder) -> None:
    lock = folder.lock()
    assert lock is not None
    assert folders.all_folders() == [folder]
    os.close(lock)
    assert folders.all_folders() == []


def test_files_of_a_running_robot_that_are_gone_are_noticed(folder: RobotFolder) -> None:
    lock = folder.lock()
    assert lock is not None
    folder.write_state(state())
    (folder.path / folders.SOCKET).touch()
    assert not folder.has_lost(lock)
    for name in (folders.STATE, folders.SOCKET, folders.LOCK):
        path = folder.path / name
        path.rename(path.with_suffix(".kept"))
        assert folder.has_lost(lock)
        path.with_suffix(".kept").rename(path)
    assert not folder.has_lost(lock)
    os.close(lock)


def test_robots_are_found_by_their_state(folder: RobotFolder) -> None:
    assert folders.all_folders() == []
    folder.write_state(state())
    assert folders.all_folders() == [folder]

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from rbxcompose.runtime.folder import RobotFolder, RobotState
from rbxcompose.runtime.processes import (
    Process,
    boot_id,
    describe_exit,
    longest_wait,
    titled,
    wait_until_ended,
    waits_of,
)
from rbxcompose.runtime.supervision.leftovers import end_leftovers


@pytest.fixture
def child() -> Iterator[subprocess.Popen[bytes]]:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        yield process
        process.kill()


def wait_until_stopped(process: Process) -> None:
    deadline = time.monotonic() + 5.0
    while not process.is_stopped:
        assert time.monotonic() < deadline


def test_a_process_is_its_id_and_its_start(child: subprocess.Popen[bytes]) -> None:
    process = Process.of(child.pid)
    assert process.is_running
    assert not process.is_stopped
    assert not Process(process.pid, process.started + 1).is_running


def test_another_process_with_the_same_id_is_never_signalled(child: subprocess.Popen[bytes]) -> None:
    other = Process(child.pid, Process.of(child.pid).started - 1)
    assert not other.send_signal(signal.SIGKILL)
    assert child.poll() is None


def test_there_is_no_process_without_an_entry() -> None:
    with pytest.raises(ProcessLookupError):
        Process.of(2**22 - 1)


def test_waiting_ends_with_the_process(child: subprocess.Popen[bytes]) -> None:
    process = Process.of(child.pid)
    assert wait_until_ended([process], 0.01) == [process]
    assert process.send_signal(signal.SIGKILL)
    assert wait_until_ended([process], 5.0) == []
    assert not process.send_signal(signal.SIGKILL)


def test_what_keeps_a_processor_busy_makes_others_on_it_wait() -> None:
    one = next(iter(os.sched_getaffinity(0)))
    words = [sys.executable, "-c", "print(flush=True)\nwhile True: pass"]
    some = [subprocess.Popen(words, stdout=subprocess.PIPE) for _ in range(3)]
    try:
        for process in some:
            os.sched_setaffinity(process.pid, {one})
        for process in some:
            assert process.stdout is not None
            process.stdout.readline()
        before, deadline = [waits_of(process.pid) for process in some], time.monotonic() + 30.0
        while min(longest_wait(b, waits_of(p.pid)) for b, p in zip(before, some, strict=True)) < 0.2:
            assert time.monotonic() < deadline
    finally:
        for process in some:
            process.kill()
            process.communicate()
    assert waits_of(some[0].pid) == {}


def test_a_wait_is_that_of_one_thread_and_new_threads_count_from_their_start() -> None:
    assert longest_wait({"1": 1.0, "2": 5.0}, {"1": 1.5, "2": 5.25, "3": 0.75}) == 0.75
    assert longest_wait({"1": 1.0}, {}) == 0.0


def test_a_zombie_has_ended(child: subprocess.Popen[bytes]) -> None:
    process = Process.of(child.pid)
    child.stdin.close() if child.stdin else None
    assert wait_until_ended([process], 5.0) == []
    assert not process.is_running


def test_processes_are_found_by_title(child: subprocess.Popen[bytes]) -> None:
    assert Process.of(child.pid) in list(titled(sys.executable))


def test_exits_are_told_in_words() -> None:
    assert describe_exit(signal.SIGKILL) == "was killed by SIGKILL"
    assert describe_exit(3 << 8) == "ended with status 3"


def test_a_stopped_process_that_was_left_behind_is_killed(
    child: subprocess.Popen[bytes], tmp_path: os.PathLike[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(Process, "is_titled", lambda self, prefix: prefix == "rbxcompose toys: ")
    folder = RobotFolder.of("toys")
    folder.make()
    process = Process.of(child.pid)
    folder.write_state(RobotState("toys", "", process, {"robot": process}, (), None, boot_id()))
    child.send_signal(signal.SIGSTOP)
    wait_until_stopped(process)
    assert end_leftovers(folder) == ["processes left behind were killed: robot"]
    assert not process.is_running


def test_a_process_that_only_a_file_calls_ours_is_not_signalled(
    child: subprocess.Popen[bytes], tmp_path: os.PathLike[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = RobotFolder.of("evil")
    folder.make()
    process = Process.of(child.pid)
    folder.write_state(RobotState("evil", "", process, {"robot": process}, (), None, boot_id()))
    assert end_leftovers(folder) == []
    assert process.is_running


ALLOCATES = """
import sys
from rbxcompose.runtime.processes import Process, give_back_large_memory
import os

if sys.argv[1] == "gives back":
    give_back_large_memory()
before = Process.of(os.getpid()).usage[1]
for _ in range(4):
    data = b"x" * 20_000_000
    del data
print(Process.of(os.getpid()).usage[1] - before)
"""


def test_memory_of_large_messages_is_given_back() -> None:
    words = [sys.executable, "-c", ALLOCATES]
    kept, given_back = (
        int(subprocess.run([*words, mode], capture_output=True, check=True).stdout) for mode in ("keeps", "gives back")
    )
    assert given_back < 4_000_000 < kept

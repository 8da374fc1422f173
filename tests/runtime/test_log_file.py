from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.diagnostics.levels import Level
from rbxcompose.runtime.follow import Follower, read_log
from rbxcompose.runtime.log import NAME, PREVIOUS, LogFile, start_new
from rbxcompose.runtime.records import Record


def record(number: int, text: str = "text") -> Record:
    return Record(float(number), Level.OK, "base", text)


def test_what_is_written_can_be_read_at_once(tmp_path: Path) -> None:
    log, follower = LogFile(tmp_path / NAME), Follower(tmp_path / NAME)
    assert follower.read() == []
    log.write(record(1))
    assert follower.read() == [record(1)]
    log.write(record(2))
    log.write(record(3))
    assert follower.read() == [record(2), record(3)]
    log.close()
    follower.close()


@given(st.text())
def test_any_text_is_one_line(text: str) -> None:
    line = record(1, text).to_json()
    assert "\n" not in line
    assert Record.from_json(line).text == text


def test_a_torn_last_line_waits_and_is_skipped_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / NAME
    line = record(1).to_json().encode()
    path.write_bytes(line + b"\n" + line[:10])
    follower = Follower(path)
    assert follower.read() == [record(1)]
    with path.open("ab") as file:
        file.write(line[10:] + b"\n" + line[:5])
    assert follower.read() == [record(1)]
    assert follower.skipped == 0
    follower.close()
    assert follower.skipped == 1


def test_foreign_lines_are_skipped_and_counted(tmp_path: Path) -> None:
    path = tmp_path / NAME
    path.write_bytes(b"hello\n\xff\xfe\n[1]\n" + record(1).to_json().encode() + b"\n")
    follower = Follower(path)
    assert follower.read() == [record(1)]
    assert follower.skipped == 3
    follower.close()


def test_a_follower_goes_on_with_the_next_run(tmp_path: Path) -> None:
    first = start_new(tmp_path)
    follower = Follower(tmp_path / NAME)
    first.write(record(1))
    assert follower.read() == [record(1)]
    first.write(record(2))
    second = start_new(tmp_path)
    second.write(record(3))
    assert follower.read() == [record(2), record(3)]
    assert read_log(tmp_path / PREVIOUS) == [record(1), record(2)]
    for one in (first, second, follower):
        one.close()


def test_a_log_that_is_not_there_holds_nothing(tmp_path: Path) -> None:
    assert read_log(tmp_path / NAME) == []


def test_several_processes_never_tear_each_others_lines(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from rbxcompose.runtime.log import LogFile\n"
        "from rbxcompose.runtime.records import Record; from rbxcompose.diagnostics.levels import Level\n"
        "log = LogFile(Path(sys.argv[1]))\n"
        "for n in range(300): log.write(Record(n, Level.OK, 'x', 'y' * (n * 20)))"
    )
    path = tmp_path / NAME
    children = [subprocess.Popen([sys.executable, "-c", script, str(path)]) for _ in range(2)]
    assert [child.wait(10) for child in children] == [0, 0]
    follower = Follower(path)
    assert len(follower.read()) == 600
    follower.close()
    assert follower.skipped == 0


def test_a_full_disk_costs_lines_and_is_told_when_there_is_room(tmp_path: Path) -> None:
    path = tmp_path / NAME
    log = LogFile(path)
    previous = resource.getrlimit(resource.RLIMIT_FSIZE)
    log.write(record(1))
    size = os.path.getsize(path)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + 5, previous[1]))
    try:
        log.write(record(2))
        log.write(record(3))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, previous)
    log.write(record(4))
    log.close()
    lost = Record(4.0, Level.WARN, "robot", "2 lines of the log could not be written")
    assert read_log(path) == [record(1), lost, record(4)]

from __future__ import annotations

import fcntl
import os
import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.runtime.log import NAME, PARTS, PREVIOUS, Follower, LogFile, Record, start_new
from tests.runtime.real_robot import read_log


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
    assert follower.read() == []
    follower.close()


def test_foreign_lines_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / NAME
    path.write_bytes(b"hello\n\xff\xfe\n[1]\n" + record(1).to_json().encode() + b"\n")
    follower = Follower(path)
    assert follower.read() == [record(1)]
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
    for file in (first, second, follower):
        file.close()


def test_a_log_that_is_not_there_holds_nothing(tmp_path: Path) -> None:
    assert read_log(tmp_path / NAME) == []


def test_several_processes_never_tear_each_others_lines(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from rbxcompose.runtime.log import LogFile\n"
        "from rbxcompose.runtime.log import Record; from rbxcompose.base.levels import Level\n"
        "log = LogFile(Path(sys.argv[1]))\n"
        "for n in range(300): log.write(Record(n, Level.OK, 'x', 'y' * (n * 20)))"
    )
    path = tmp_path / NAME
    children = [subprocess.Popen([sys.executable, "-c", script, str(path)]) for _ in range(2)]
    assert [child.wait(10) for child in children] == [0, 0]
    follower = Follower(path)
    assert len(follower.read()) == len(path.read_bytes().splitlines()) == 600
    follower.close()


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


def parts(folder: Path) -> dict[str, list[Record]]:
    """Return the records of each file by itself."""
    found = {}
    for path in sorted(folder.iterdir()):
        found[path.name] = [Record.from_json(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return found


def test_a_file_that_is_full_is_set_aside_and_the_oldest_goes(tmp_path: Path) -> None:
    log = LogFile(tmp_path / NAME, largest=1)
    descriptor = log.fileno()
    for number in range(PARTS + 3):
        log.write(record(number))
    log.close()
    assert log.fileno() == descriptor
    assert parts(tmp_path) == {
        NAME: [record(PARTS + 2)],
        **{f"{NAME}.{age}": [record(PARTS + 2 - age)] for age in range(1, PARTS + 1)},
    }
    assert read_log(tmp_path / NAME) == [record(number) for number in range(2, PARTS + 3)]


def test_a_follower_goes_on_across_any_number_of_files_and_misses_nothing(tmp_path: Path) -> None:
    log, follower = LogFile(tmp_path / NAME, largest=1), Follower(tmp_path / NAME)
    found: list[Record] = []
    for number in range(30):
        log.write(record(number))
        if number % (PARTS + 1) == 0:
            found += follower.read()
    found += follower.read()
    log.close()
    follower.close()
    assert found == [record(number) for number in range(30)]


def test_several_writers_go_on_to_the_same_file_whoever_sets_the_full_one_aside(tmp_path: Path) -> None:
    size = len(record(0).to_json()) + 1
    logs = [LogFile(tmp_path / NAME, largest=4 * size) for _ in range(3)]
    for number in range(12):
        logs[number % 3].write(record(number))
    assert read_log(tmp_path / NAME) == [record(number) for number in range(12)]
    assert len(parts(tmp_path)[NAME]) == 4
    for log in logs:
        log.close()


def test_a_process_that_was_stopped_while_it_set_a_file_aside_does_not_hold_up_the_others(tmp_path: Path) -> None:
    path = tmp_path / NAME
    log = LogFile(path, largest=1)
    log.write(record(1))
    with path.open("rb") as stopped:
        fcntl.flock(stopped, fcntl.LOCK_EX)
        log.write(record(2))
        assert parts(tmp_path) == {NAME: [record(1), record(2)]}
    log.write(record(3))
    log.close()
    assert parts(tmp_path)[NAME] == [record(3)]


def test_the_log_of_the_run_before_is_kept_whole(tmp_path: Path) -> None:
    for run in range(3):
        log = start_new(tmp_path)
        log.close()
        log = LogFile(tmp_path / NAME, largest=1)
        for number in range(3 - run):
            log.write(record(10 * run + number))
        log.close()
    assert read_log(tmp_path / PREVIOUS) == [record(10), record(11)]
    assert read_log(tmp_path / NAME) == [record(20)]


def test_several_processes_and_many_files_lose_no_line(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from rbxcompose.runtime.log import LogFile\n"
        "from rbxcompose.runtime.log import Record; from rbxcompose.base.levels import Level\n"
        "log = LogFile(Path(sys.argv[1]), largest=20_000)\n"
        "for n in range(150): log.write(Record(n, Level.OK, sys.argv[2], 'y' * 100))"
    )
    path = tmp_path / NAME
    children = [subprocess.Popen([sys.executable, "-c", script, str(path), f"writer_{n}"]) for n in range(3)]
    assert [child.wait(10) for child in children] == [0, 0, 0]
    counted = Counter(one.source for one in read_log(path))
    assert counted == {"writer_0": 150, "writer_1": 150, "writer_2": 150}
    assert path.stat().st_size < 21_000

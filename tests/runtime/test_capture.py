"""What components and the packages they use print and log comes into the robot's log, line by line."""

from __future__ import annotations

import logging
import os
import sys
import threading
import warnings
from pathlib import Path

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.runtime.process_group.group import Capture, take_printed

Told = list[tuple[Level, str]]


@pytest.fixture
def told() -> Told:
    return []


def capture(told: Told) -> Capture:
    return Capture(lambda level, text, detail: told.append((level, text)))


def test_each_line_is_told_once_it_is_whole(told: Told) -> None:
    with capture(told):
        print("hello", end=" ")  # noqa: T201
        assert told == []
        print("world\n\nsecond")  # noqa: T201
        assert told == [(Level.OK, "hello world"), (Level.OK, "second")]
        sys.stdout.write("no end")
    assert told[-1] == (Level.OK, "no end")


def test_standard_error_is_a_warning(told: Told) -> None:
    with capture(told):
        sys.stderr.write("oh\n")
    assert told == [(Level.WARN, "oh")]


def test_lines_of_two_threads_are_not_mixed(told: Told) -> None:
    with capture(told):
        sys.stdout.write("one ")
        other = threading.Thread(target=lambda: print("two"))  # noqa: T201
        other.start()
        other.join()
        sys.stdout.write("three\n")
    assert [text for _, text in told] == ["two", "one three"]


def test_loggers_of_other_packages_are_told_with_name_and_level() -> None:
    told: list[tuple[Level, str, str]] = []
    with Capture(lambda *one: told.append(one)):
        log = logging.getLogger("some.package")
        log.debug("nothing")
        log.info("ready after %d s", 3)
        log.warning("hot")
        try:
            raise OSError("no such device")
        except OSError:
            log.exception("broken")
    assert [row[:2] for row in told] == [
        (Level.OK, "some.package: ready after 3 s"),
        (Level.WARN, "some.package: hot"),
        (Level.ERROR, "some.package: broken"),
    ]
    assert "OSError: no such device" in told[-1][2]


def test_pythons_warnings_are_told(told: Told) -> None:
    with capture(told), warnings.catch_warnings():
        warnings.simplefilter("always")
        logging.captureWarnings(True)
        warnings.warn("old", UserWarning, stacklevel=1)
        logging.captureWarnings(False)
    assert [(level, "UserWarning: old" in text) for level, text in told] == [(Level.WARN, True)]


def test_afterwards_all_is_as_before(told: Told) -> None:
    before = sys.stdout, sys.stderr, logging.getLogger().level, list(logging.getLogger().handlers)
    with capture(told):
        assert sys.stdout is not before[0]
    assert (sys.stdout, sys.stderr, logging.getLogger().level, list(logging.getLogger().handlers)) == before


def test_what_telling_prints_does_not_go_in_circles(capfd: pytest.CaptureFixture[str]) -> None:
    with Capture(lambda level, text, detail: print(f"told {text}")):  # noqa: T201
        print("once")  # noqa: T201
    assert capfd.readouterr().err == "told once\n"


def test_what_is_printed_past_python_is_taken_once(tmp_path: Path) -> None:
    kept = os.dup(1)
    output = os.open(tmp_path / "robot.out", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    try:
        os.dup2(output, 1)
        os.write(1, b"from C\n\nmore \xff\n")
        first, second = take_printed(), take_printed()
        os.write(1, b"later\n")
        third = take_printed()
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(output)
    assert (first, second, third) == (["from C", "more \ufffd"], [], ["later"])

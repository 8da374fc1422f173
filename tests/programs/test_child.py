"""A program and its keeper, with real small programs: what is told, and that nothing is left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

import pytest

from rbxcompose.domains.programs import child as module
from rbxcompose.domains.programs.child import LONGEST_LINE, Child, Event, StartOrder
from rbxcompose.domains.programs.components.program import is_suspended
from rbxcompose.runtime.processes import Process

MOST = 20.0  # [s] that any of these may take on a busy machine
KILLED, TERMINATED = ("ended", int(signal.SIGKILL)), ("ended", int(signal.SIGTERM))
Run = Callable[..., Child]


class Mark:
    """An entry of the environment by which a test knows all that its program has started."""

    def __init__(self) -> None:
        self.value = uuid4().hex

    def processes(self) -> list[int]:
        """Return what runs with it; what has ended and was not collected yet has no environment any more."""
        found = []
        for path in Path("/proc").glob("[0-9]*/environ"):
            with suppress(OSError):
                if self.value.encode() in path.read_bytes():
                    found.append(int(path.parent.name))
        return found


@pytest.fixture
def mark() -> Iterator[Mark]:
    made = Mark()
    yield made
    left = made.processes()
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    assert left == []


@pytest.fixture
def run(mark: Mark, tmp_path: Path) -> Iterator[Run]:
    """Start a program in a folder of its own."""
    made: list[Child] = []

    def start(*command: str, patience: float = MOST, folder: str = "", **limits: int | tuple[int, ...]) -> Child:
        environment = {"PATH": os.environ["PATH"], "MARK": mark.value}
        order = StartOrder(command, folder or str(tmp_path), environment, signal.SIGTERM, patience, **limits)  # type: ignore[arg-type]
        made.append(Child(order))
        return made[-1]

    yield start
    for child in made:
        child.close()


def shell(script: str) -> tuple[str, ...]:
    return "sh", "-c", script


def python(script: str) -> tuple[str, ...]:
    return sys.executable, "-c", script


def until(child: Child, holds: Callable[[list[Event]], bool]) -> list[Event]:
    """Return what happens until something holds."""
    events, deadline = list[Event](), time.monotonic() + MOST
    while not holds(events):
        assert time.monotonic() < deadline, events
        child.wait(0.05)
        events += child.events()
    return events


def eventually(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + MOST
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def to_its_end(child: Child) -> list[Event]:
    """Return all that happens."""
    events = until(child, lambda events: child.is_over)
    return [*events, *child.events()]


def without_start(events: list[Event]) -> list[Event]:
    return [event for event in events if event[0] != "started"]


def has_said(text: str) -> Callable[[list[Event]], bool]:
    return lambda events: ("line", text) in events


def test_it_is_told_what_it_writes_and_how_it_ends_in_this_order(run: Run) -> None:
    first, *rest = to_its_end(run(*shell("echo one; echo two >&2; exit 3")))
    assert first[0] in ("line", "started")
    assert without_start([first, *rest]) == [("line", "one"), ("line", "two"), ("ended", 3 << 8)]


def test_it_gets_the_folder_the_environment_and_the_limits(run: Run, tmp_path: Path, mark: Mark) -> None:
    child = run(*shell("pwd; echo $MARK; ulimit -n; nice"), open_files=64, nice=3)
    lines = [event[1] for event in to_its_end(child) if event[0] == "line"]
    assert lines == [str(tmp_path), mark.value, "64", str(os.nice(0) + 3)]


@pytest.mark.parametrize(
    ("script", "number"),
    [
        ("sleep 100 & exit 0", 1),
        ("sleep 100 & sleep 100 & exit 0", 2),
        ("setsid sh -c 'setsid sleep 100 & exit 0' & wait; exit 0", 1),
        ("nohup setsid sh -c 'sleep 100; true' >/dev/null 2>&1 & exit 0", 2),
    ],
    ids=["a child", "two", "a daemon", "a daemon with a child of its own"],
)
def test_what_it_leaves_in_the_background_is_ended_and_counted(run: Run, mark: Mark, script: str, number: int) -> None:
    events = without_start(to_its_end(run(*shell(script))))
    assert events[0] == ("ended", 0)
    assert events[1:] in ([("left", number)], [("left", 1)])  # what has not run its command yet is one
    assert mark.processes() == []


def test_all_that_it_has_started_is_asked_with_it_and_has_the_same_time(run: Run) -> None:
    child = run(
        *shell("(trap 'sleep 0.3; echo ended in order; exit' TERM; echo ready; while :; do sleep 0.02; done) & wait")
    )
    until(child, has_said("ready"))
    child.ask_to_end()
    events = to_its_end(child)
    assert ("line", "ended in order") in events
    assert events[-1] == TERMINATED


@pytest.mark.parametrize("where", ["the program", "what it started"])
def test_who_ignores_the_signal_is_killed_after_its_time_and_told_once(run: Run, where: str) -> None:
    ignoring = "trap '' TERM; echo ready; while :; do sleep 0.02; done"
    child = run(*shell(ignoring if where == "the program" else f"({ignoring}) & wait"), patience=0.3)
    until(child, has_said("ready"))
    began = time.monotonic()
    child.ask_to_end()
    child.ask_to_end()
    events = to_its_end(child)
    how = KILLED if where == "the program" else TERMINATED
    assert sorted(map(repr, without_start(events))) == sorted(map(repr, [("deaf", None), how]))
    assert time.monotonic() - began > 0.3


def test_who_is_suspended_is_killed_after_its_time(run: Run) -> None:
    child = run(*shell("echo ready; exec sleep 100"), patience=0.2)
    until(child, lambda events: child.pid is not None and has_said("ready")(events))
    assert child.pid is not None
    assert not is_suspended(child.pid)
    Process.of(child.pid).send_signal(signal.SIGSTOP)
    eventually(lambda: is_suspended(child.pid))
    child.ask_to_end()
    assert without_start(to_its_end(child)) == [("deaf", None), KILLED]
    assert not is_suspended(child.pid)


def test_a_kill_is_told_as_such(run: Run) -> None:
    child = run("sleep", "100")
    until(child, lambda events: child.pid is not None)
    assert child.pid is not None
    os.kill(child.pid, signal.SIGKILL)
    assert to_its_end(child) == [KILLED]
    assert child.pid is None


def test_one_that_cannot_be_run_says_why_in_one_sentence(run: Run, tmp_path: Path) -> None:
    for name, text in {"plain": "echo", "orphan": "#!/no/such/shell\n", "text": "echo hello\n"}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        (tmp_path / name).chmod(0o644 if name == "plain" else 0o755)
    (tmp_path / "inner").mkdir()
    wrong = {
        ("no_such_program",): "there is no executable 'no_such_program' in PATH",
        ("./missing",): f"there is no file {tmp_path}/missing",
        ("./inner",): f"{tmp_path}/inner is a folder",
        ("./plain",): f"{tmp_path}/plain is not executable",
        ("./orphan",): f"{tmp_path}/orphan is to be run by /no/such/shell, which is not there",
        ("./text",): f"{tmp_path}/text: the first line of a script names what runs it: '#!/bin/sh'",
        ("sh", "-c\0"): "embedded null byte",
    }
    for command, why in wrong.items():
        assert to_its_end(run(*command)) == [("failed", why)]
    assert to_its_end(run("sh", folder="/no/such/folder")) == [("failed", "there is no folder /no/such/folder")]


def test_a_limit_that_cannot_be_kept_is_told_by_its_name(run: Run) -> None:
    (first,) = to_its_end(run("true", cores=(4095,)))
    assert first == ("failed", "'limits.cores' cannot be kept here: Invalid argument")
    (second,) = to_its_end(run("true", open_files=2**40))
    assert second[0] == "failed"
    assert second[1].startswith("'limits.open_files' cannot be kept here: ")


def test_half_a_line_is_told_when_it_ends(run: Run) -> None:
    """Its pipe may close before its parent has waited for it."""
    found = without_start(to_its_end(run("printf", "half")))
    assert sorted(found, key=str) == [("ended", 0), ("line", "half")]


def test_a_line_without_end_is_cut_and_what_follows_is_not(run: Run) -> None:
    script = "import sys; sys.stdout.write('x' * 10_000_000 + '\\nand on\\n')"
    lines = [event[1] for event in to_its_end(run(*python(script))) if event[0] == "line"]
    assert lines == ["x" * LONGEST_LINE, "and on"]


def test_bytes_that_are_no_text_are_no_error(run: Run) -> None:
    lines = [event for event in to_its_end(run(*shell("head -c 100000 /dev/urandom"))) if event[0] == "line"]
    assert lines


@pytest.mark.soak
def test_a_flood_is_taken_in_pieces_so_that_its_component_can_do_other_things(run: Run) -> None:
    child = run("yes")
    longest = 0
    for _ in range(20):
        child.wait(1.0)
        longest = max(longest, sum(len(event[1]) + 1 for event in child.events() if event[0] == "line"))
    child.ask_to_end()
    to_its_end(child)
    assert 0 < longest <= module.MOST_READ + 65536


def test_one_that_closes_its_output_does_not_keep_its_component_awake(run: Run) -> None:
    child = run(*shell("exec >&- 2>&-; exec sleep 100"))
    until(child, lambda events: bool(child._silent))
    before = time.process_time()
    child.wait(0.3)
    assert time.process_time() - before < 0.1


def test_memory_is_that_of_all_its_processes(run: Run) -> None:
    holding = (
        f"""{sys.executable} -c 'held = b"x" * 40_000_000; print("ready", flush=True); import time; time.sleep(100)'"""
    )
    child = run(*shell(f"{holding} & {holding} & wait"))
    until(child, lambda events: events.count(("line", "ready")) == 2)
    assert 80_000_000 < child.memory < 250_000_000


@pytest.mark.parametrize("where", ["killed", "closed"])
def test_nothing_is_left_when_its_keeper_is(run: Run, mark: Mark, where: str) -> None:
    child = run(*shell("trap '' TERM; sleep 100 & setsid sh -c 'setsid sleep 100 &'; echo ready; wait; sleep 100"))
    until(child, has_said("ready"))
    eventually(lambda: len(mark.processes()) >= 3)
    if where == "killed":
        child._keeper.kill()
        assert not [event for event in to_its_end(child) if event[0] == "ended"]
    child.close()
    assert mark.processes() == []


HOST = """
import os, signal, sys, time
from rbxcompose.domains.programs.components.program import is_suspended
from rbxcompose.domains.programs.child import Child, StartOrder
script = "setsid sh -c 'setsid sleep 100 &'; trap '' TERM; echo ready; sleep 100 & wait; sleep 100"
child = Child(StartOrder(("sh", "-c", script), ".", dict(os.environ), signal.SIGTERM, 20.0))
while True:
    child.wait(1.0)
    print(list(child.events()), flush=True)
"""


def test_nothing_is_left_when_the_process_of_its_component_is_killed(mark: Mark) -> None:
    environment = {**os.environ, "MARK": mark.value}
    with subprocess.Popen([sys.executable, "-c", HOST], stdout=subprocess.PIPE, env=environment, text=True) as host:
        assert host.stdout is not None
        assert any("ready" in line for line in host.stdout)
        host.kill()
    eventually(lambda: mark.processes() == [])


def test_others_cannot_see_its_environment(run: Run, mark: Mark) -> None:
    child = run(*shell("echo ready; exec sleep 100"))
    until(child, has_said("ready"))
    shown = b""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            shown += path.read_bytes()
    assert b"sleep" in shown
    assert mark.value.encode() not in shown

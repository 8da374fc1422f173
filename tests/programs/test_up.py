"""Real robots with programs: what `up` does with them, in real time."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.runtime.log import NAME, Record
from rbxcompose.runtime.processes import Process
from tests.forked import RBXCOMPOSE, Forked
from tests.programs.foreign import PATROL, patrol
from tests.programs.foreign import robot as manifest
from tests.runtime.real_robot import PATIENCE, ROOT, Robot, eventually, read_log

SECRET = "a_secret_of_the_test"
TALKER = [sys.executable, str(Path(__file__).with_name("bare_talker.py"))]


class Foreign(Robot):
    """A robot of programs, written down in a folder of its own."""

    def __init__(self, name: str, base: Path) -> None:
        super().__init__(name, base)
        self.files = base / "robot"
        self.files.mkdir()

    def write(self, text: str, **others: str) -> None:
        """Write the robot's file, and others by name."""
        for file, content in {"robot": text, **others}.items():
            (self.files / f"{file}.yaml").write_text(content, encoding="utf-8")

    def up(self, *options: str, **config: object) -> subprocess.Popen[str]:
        """Start it; the process is that of the foreground."""
        words = [*RBXCOMPOSE, "up", str(self.files / "robot.yaml"), *options]
        environment = {**self.environment, "RBX_SECRET_TOKEN": SECRET}
        pipe = subprocess.PIPE
        process = Forked(words, env=environment, stdout=pipe, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
        self.started.append(process)
        return process

    def up_until(self, text: str) -> subprocess.Popen[str]:
        """Start it, and wait until something is logged."""
        process = self.up()
        eventually(lambda: process.poll() is not None or self.has_logged(text))
        assert process.poll() is None, process.communicate()[0]
        return process

    def records(self, source: str) -> list[Record]:
        return [record for record in read_log(self.folder.path / NAME) if record.source == source]

    def time_of(self, source: str, text: str) -> float:
        """Return when something was logged first [s]."""
        return next(record.time for record in self.records(source) if text in record.text)

    def program(self, *words: str) -> list[int]:
        """Return the processes of a program of this robot."""
        mark = f"RBXCOMPOSE_ROBOT={self.name}\0".encode()
        found = []
        for path in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                command = (path / "cmdline").read_bytes()
                if mark in (path / "environ").read_bytes() and all(word.encode() in command for word in words):
                    found.append(int(path.name))
        return found


@pytest.fixture
def foreign(request: pytest.FixtureRequest) -> Iterator[Foreign]:
    """A robot of which nothing may be left at the end."""
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Foreign(f"foreign_{os.getpid()}_{abs(hash(request.node.name)) % 10**6}", base)
    yield made
    for process in made.started:
        with suppress(ProcessLookupError):
            process.kill()
        with suppress(ValueError):  # what it has printed was read
            process.communicate()
    left = [*made.program(), *(one.pid for one in made.processes())]
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    shutil.rmtree(base)
    assert left == []


def test_a_base_that_is_killed_on_the_way_comes_back_and_the_goal_ends_as_its_place_is_lost(foreign: Foreign) -> None:
    foreign.write(patrol(foreign.name), patrol=PATROL.replace("{go_to: b}", "{go_to: b, attempts: 2}"))
    process = foreign.up_until("go_to a")
    (base,) = foreign.program("bare_base")
    Process.of(base).send_signal(signal.SIGKILL)
    told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, told
    texts = foreign.texts("base")
    assert texts == [
        "the base is there",
        "was killed by SIGKILL",
        "restarted",
        "the base is there",
        "ended with status 0",
    ]
    assert "the odometry of the base has jumped, so its position is not known any more" in told
    over, ended = foreign.time_of("mission", "mission patrol: success"), foreign.time_of("base", "ended with status 0")
    assert ended - over > 0.4  # it was asked to end only when it had had the time to brake by itself


@pytest.mark.soak  # as a process of ours does
def test_a_program_that_dies_again_and_again_ends_the_robot(foreign: Foreign) -> None:
    dying = {"type": "program", "command": ["sh", "-c", "printf 'no device'; sleep 0.05; exit 3"]}
    foreign.write(manifest(foreign.name, components={"dying": dying}))
    process = foreign.up()
    told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 4, told
    assert "'dying' failed too often: ended with status 3" in told
    assert foreign.texts("dying").count("no device") == 5


def program(script: str, **options: Any) -> dict[str, Any]:
    return {"type": "program", "command": ["sh", "-c", script], **options}


GROWS = """
import time
held = [b"x" * 60_000_000]
print("grown", flush=True)
time.sleep(100)
"""
COMPONENTS = {
    "prepare": program("sleep 0.3; echo prepared > done", ready={"ended": True}),
    "writer": program(
        "cat done; echo '[WARN] warm'; printf $$TOKEN | wc -c; echo it is ready; exec sleep 100",
        ready={"output": "is ready$"},
        starts_after=["prepare"],
        secrets={"TOKEN": "${secret.token}"},
    ),
    "talker": {
        "type": "program",
        "command": TALKER,
        "publishes": {"chatter": "std_msgs/String"},
        "serves": {"wave": "std_srvs/Trigger"},
        "ready": {"token": "talker/*"},
        "starts_after": ["writer"],
    },
    "hog": {
        "type": "program",
        "command": [sys.executable, "-c", GROWS],
        "limits": {"memory": 50},
        "restart": {"when": "never"},
    },
    "deaf": program("trap '' TERM; sleep 100; sleep 100", stop={"within": "0.3 s"}),
}
MISSION = "rbx: 1\nkind: Mission\nname: wave\ndo: [{wave: }, {wait: 2.5 s}]\n"


def test_several_programs_start_in_order_are_watched_and_are_ended(foreign: Foreign) -> None:
    text = manifest(foreign.name, components=COMPONENTS, missions={"wave": "wave.yaml"}, start="wave")
    assert SECRET not in text
    foreign.write(text, wave=MISSION)
    process = foreign.up_until("wave")
    shown = b""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            shown += path.read_bytes()
    assert SECRET.encode() not in shown
    told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, told
    assert foreign.texts("writer")[:3] == ["prepared", "[WARN] warm", str(len(SECRET))]
    assert foreign.texts("talker").count("waved") == 1
    wrong = [
        "publishes '/chatter' as std_msgs/msg/Empty, declared as std_msgs/msg/String",
        "publishes '/rogue', which 'publishes' does not declare",
    ]
    assert sorted(text for text in foreign.texts("talker") if "declare" in text) == wrong
    assert [text.partition(" MB")[2] for text in foreign.texts("hog") if "MB" in text] == [", and may use 50"]
    assert "stays failed: it is never restarted" in foreign.texts("hog")
    assert "did not end within 0.3 s of SIGTERM, and was killed" in foreign.texts("deaf")
    assert foreign.time_of("writer", "prepared") <= foreign.time_of("writer", "it is ready")


@pytest.mark.soak  # as during the start of components
def test_an_interrupt_does_not_wait_for_a_program_that_is_not_ready(foreign: Foreign) -> None:
    slow = program("echo begun; exec sleep 100", ready={"output": "never", "within": "100 s"})
    foreign.write(manifest(foreign.name, components={"slow": slow}))
    process = foreign.up_until("begun")
    process.send_signal(signal.SIGINT)
    told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "left behind" not in told


def test_a_program_that_cannot_be_started_is_a_finding_before_anything_starts(foreign: Foreign) -> None:
    foreign.write(manifest(foreign.name, components={"one": {"type": "program", "command": ["./one"]}}))
    process = foreign.up()
    told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1
    assert "error[RBX9427]: 'one' cannot be started: there is no file" in told
    assert not foreign.folder.path.exists()


def test_robot_time_of_programs_cannot_be_stepped(foreign: Foreign) -> None:
    foreign.write(patrol(foreign.name), patrol=PATROL)
    process = foreign.up("--rate", "max")
    told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert "'base' runs a program, which keeps real time, so --rate cannot be given" in told

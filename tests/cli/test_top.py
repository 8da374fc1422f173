"""`top`: pictures as lines, and on a robot in real processes."""

from __future__ import annotations

import json
import os
import pty
import select
import shutil
import signal
import subprocess
import tempfile
import termios
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.base.printable import FORBIDDEN, columns
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.top import TopData, lines_of
from tests.commands import command
from tests.forked import RBXCOMPOSE, Forked, run_command
from tests.soak import rare
from tests.third_party.places import put

ROOT = Path(__file__).parents[2]
STRANGERS = Path(__file__).parents[1] / "checks" / "strangers.py"
PATIENCE = 20.0  # [s]


def component(name: str, type_: str, state: str, process: str, restarts: int, *heard: Any) -> TopData:
    rate, level, message = heard or (None, None, "")
    facts = {"process": process, "restarts": restarts, "rate": rate, "level": level, "message": message}
    return {"name": name, "type": type_, "state": state, **facts}


def group(name: str, level: str, message: str) -> TopData:
    return {"group": name, "level": level, "message": message}


COMPONENTS = [
    component("battery", "battery_sim", "active", "world", 0, 1.0, "WARN", "Medium battery"),
    component("base", "diff_drive_sim", "active", "world", 0, 99.8, "OK", "active"),
    component("go_to", "go_to", "dead", "robot", 3),
    component("mission", "mission", "active", "mission", 0, 0.0, "OK", "running patrol"),
]
LOADS = [
    {"process": "supervisor", "pid": 100, "cpu": 0.001, "memory": 33_000_000},
    {"process": "world", "pid": 104, "cpu": None, "memory": 58_000_000},
]
RUNNING = ["▶ repeat", "  ▶ for corner in $route", "    ▶ go_to $corner  (retry 2)"]
PICTURE: TopData = {
    "robot": "turtlebot",
    "is_supervised": True,
    "router": "tcp/127.0.0.1:7447",
    "mission": "running patrol",
    "missions": [{"mission": "patrol", "state": "running", "running": RUNNING}],
    "batteries": {"battery": "48.2 %"},
    "components": COMPONENTS,
    "processes": LOADS,
    "diagnostics": [
        group("power", "WARN", "battery: Medium battery"),
        group("motion", "OK", "OK"),
        group("Other", "OK", "OK"),
    ],
    "warnings": [
        {"time": 61.25, "level": "WARN", "source": "battery", "text": "Medium battery: 50 %"},
        {"time": 70.0, "level": "ERROR", "source": "go_to", "text": "died"},
    ],
}
DEAD: TopData = {"is_supervised": False, "router": None, "mission": "", "batteries": {}, "diagnostics": []}


def text_of(picture: TopData, width: int, height: int) -> str:
    return "".join(f"{line}\n" for line in lines_of(picture, width, height))


@pytest.mark.parametrize(
    ("name", "picture"),
    [
        ("top.txt", PICTURE),
        ("top_missions.txt", {**PICTURE, "components": COMPONENTS[:1], "processes": LOADS[:1], "warnings": []}),
        (
            "top_many.txt",
            {**PICTURE, "components": [{**COMPONENTS[1], "name": f"wheel_{index}"} for index in range(40)]},
        ),
        ("top_dead.txt", {**PICTURE, **DEAD}),
    ],
)
def test_a_picture_is_its_golden_text(name: str, picture: TopData, golden: Golden) -> None:
    golden.check(name, text_of(picture, 80, 24))


words = st.text(max_size=30)
components = st.builds(
    component, words, words, words, words, st.integers(0, 9), st.none() | st.floats(0, 1e6), st.none(), words
)
groups = st.builds(group, words, st.sampled_from([level.name for level in Level]), words)


@given(st.lists(components, max_size=8), st.lists(groups, max_size=4), st.integers(4, 200), st.integers(1, 60))
def test_a_picture_fits_whatever_it_shows(shown: list[TopData], health: list[TopData], width: int, height: int) -> None:
    lines = lines_of({**PICTURE, "components": shown, "diagnostics": health}, width, height)
    assert len(lines) <= height
    assert all(columns(line) <= width for line in lines)
    assert not any(FORBIDDEN.search(line) for line in lines)


def test_colours_change_nothing_but_the_colour() -> None:
    painted = "\n".join(lines_of(PICTURE, 80, 24, colour=True))
    assert "\x1b[33mbattery" in painted
    assert "\x1b[31mgo_to" in painted
    for colour in (0, 1, 2, 31, 33, 35):
        painted = painted.replace(f"\x1b[{colour}m", "")
    assert painted == "\n".join(lines_of(PICTURE, 80, 24))


class Robot:
    """A base, two batteries, one of them from somebody else's package, and what every robot has."""

    def __init__(self, base: Path) -> None:
        site = base / "site"
        put(site, "strange-robots", {"component.toy_cell": "strangers"}, {"strangers.py": STRANGERS.read_text("utf-8")})
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(base), "NO_COLOR": "1"}
        self.environment["PYTHONPATH"] = os.pathsep.join([str(ROOT), str(site)])
        self.file = base / "robot.yaml"
        self.file.write_text(
            "rbx: 1\nkind: Robot\nname: topped\nbus: {port: 7990}\n"
            "components:\n  battery: {type: battery_sim, runtime: 1 h}\n  base: {type: diff_drive_sim}\n"
            "  cell: {type: toy_cell, lasts: 1 h}\n",
            encoding="utf-8",
        )

    def command(self, *words: str) -> list[str]:
        return [*RBXCOMPOSE, *words]

    def do(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command in this process, but for `up`, which needs the package of somebody else."""
        if words[0] == "up":
            return run_command(words, self.environment, PATIENCE)
        return command(*words, environment=self.environment, folder=ROOT)

    def seen(self) -> Any:
        """Return what `top` sees."""
        done = self.do("top", "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base)
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_without_a_terminal_one_picture_is_shown(robot: Robot) -> None:
    shown = robot.seen()
    deadline = time.monotonic() + PATIENCE
    while len(shown["batteries"]) < 2 and time.monotonic() < deadline:  # right after the start they tell nothing yet
        shown = robot.seen()
    components = {component["name"]: component for component in shown["components"]}
    assert 20.0 < components["base"]["rate"] < 200.0  # twice 50 Hz: odom and tf
    assert {process["process"] for process in shown["processes"]} >= {
        "supervisor",
        "parent",
        "router",
        "world",
        "robot",
    }
    assert all(process["memory"] > 1e6 and process["cpu"] is not None for process in shown["processes"])
    assert shown["batteries"].keys() == {"battery", "cell"}
    assert shown["batteries"]["cell"] == "62.5 %"
    assert "topped: router tcp/127.0.0.1:" in robot.do("top", str(robot.file)).stdout


@pytest.mark.parametrize("end", ["q", *rare("interrupt")])
def test_on_a_terminal_it_is_live_and_leaves_the_terminal_as_it_was(robot: Robot, end: str) -> None:
    ours, theirs = pty.openpty()
    assert os.get_terminal_size(theirs) == (0, 0)  # as some terminals say, too
    before = termios.tcgetattr(theirs)
    with Forked(
        robot.command("top"), env=robot.environment, cwd=ROOT, stdin=theirs, stdout=theirs, stderr=theirs
    ) as process:
        seen = b""
        while seen.count(b"\x1b[H") < 2:
            assert select.select([ours], [], [], PATIENCE)[0], seen
            seen += os.read(ours, 65536)
        if end == "q":
            os.write(ours, b"q")
        else:
            process.send_signal(signal.SIGINT)
        while not seen.endswith(b"\x1b[?25h\x1b[?1049l"):
            assert select.select([ours], [], [], PATIENCE)[0], seen
            seen += os.read(ours, 65536)
        assert process.wait(PATIENCE) == 0
    assert seen.startswith(b"\x1b[?1049h\x1b[?25l")
    assert b"battery_sim" in seen
    assert termios.tcgetattr(theirs) == before
    os.close(ours)
    os.close(theirs)


def test_the_doctor_looks_at_a_robot_that_is_up(robot: Robot) -> None:
    done = robot.do("doctor", "topped", "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(done.stdout)
    fine = {entry["examination"] for entry in told if entry["level"] == "ok"}
    assert {"ports", "clashes", "leftovers", "permissions", "limits"} <= fine
    (alone,) = (entry for entry in told if entry["examination"] == "wires" and entry["level"] == "warning")
    assert alone["message"] == "/base of 'topped' subscribes to /cmd_vel, which has no publisher"


def test_the_doctor_examines_the_machine_also_if_the_robot_is_not_up(robot: Robot) -> None:
    done = robot.do("doctor", "topper")
    assert (done.returncode, "did you mean 'topped'?" in done.stdout) == (1, True)
    found = json.loads(robot.do("doctor", "topper", "--json").stdout)
    assert {entry["examination"] for entry in found if entry["level"] == "error"} == {"robots"}
    assert {"clocks", "devices", "limits", "permissions", "versions"} <= {entry["examination"] for entry in found}

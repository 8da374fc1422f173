"""Parameters on the command line, of a robot in real processes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.sdk.parameters import from_message
from rbxcompose.tools.parameters.changes import value_of
from tests.commands import command
from tests.forked import run_command
from tests.loops import for_all

ROOT = Path(__file__).parents[2]
PATIENCE = 20.0  # [s]
MANIFEST = """
rbx: 1
kind: Robot
name: parameters
bus: {port: 7920, namespace: left}
args:
  speed: {type: speed, default: 0.3 m/s, max: 0.4 m/s}
components:
  battery: {type: battery_sim, runtime: 45 s}
  base: {type: diff_drive_sim}
  go_to: {type: go_to, speed: "${args.speed}"}
  second: {type: go_to, turn_rate: 45 deg/s, connect: {go_to: go_second}}
muxes:
  cmd_vel:
    inputs:
      first: {from: go_to, priority: 1, timeout: 0.5 s}
      second: {from: second, priority: 2, timeout: 0.5 s}
    handover: {linear: 1 m/s^2}  # gentle
"""

Do = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def base() -> Iterator[Path]:
    """A folder with the robot's file, whose path is short enough for sockets."""
    folder = Path(tempfile.mkdtemp(prefix="rbx"))
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def environment(base: Path) -> dict[str, str]:
    return {**os.environ, "XDG_RUNTIME_DIR": str(base), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}


@pytest.fixture(scope="module")
def do(base: Path, environment: dict[str, str]) -> Iterator[Do]:
    """Run a command on a robot that is up."""
    (base / "robot.yaml").write_text(MANIFEST, encoding="utf-8")

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return command(*words, environment=environment, folder=ROOT)

    up = run_command(("up", "-d", str(base / "robot.yaml")), environment, PATIENCE)
    assert up.returncode == 0, up.stderr
    yield run
    assert run("down").returncode == 0


def test_all_parameters_of_all_components_are_listed(do: Do) -> None:
    listed = json.loads(do("param", "ls", "--json").stdout)
    found = {(item["node"], item["name"]): (item["value"], item["read_only"]) for item in listed}
    assert found["/left/battery", "runtime"] == (45.0, False)
    assert found["/left/battery", "initial"] == (1.0, True)
    assert found["/left/base", "max_speed"] == (0.5, False)
    shown = do("param", "get", "battery").stdout
    assert shown == do("param", "ls", "battery").stdout
    assert [line.split()[:4] for line in shown.splitlines()][:2] == [
        ["component", "parameter", "value", "about"],
        ["/left/battery", "runtime", "45", "s"],
    ]


def test_a_parameter_is_set_with_its_unit_and_holds_at_once(do: Do) -> None:
    done = do("param", "set", "battery", "runtime", "1 min")
    assert (done.returncode, done.stdout) == (0, "1 min\n"), done.stderr
    assert do("param", "get", "/left/battery", "runtime", "--json").stdout == "60.0\n"
    assert "set: runtime = 60 s" in do("logs").stdout


def test_values_are_shown_as_a_person_writes_them(do: Do) -> None:
    rows = [line.split()[1:4] for line in do("param", "ls", "second").stdout.splitlines()]
    assert ["turn_rate", "45", "deg/s"] in rows
    assert do("param", "get", "second", "turn_rate").stdout == "45 deg/s\n"
    assert do("param", "ls", "cmd_vel").stdout.count("0.5 s") == 2


@pytest.mark.parametrize("text", ["0.2 m/s", "20 cm/s"])
def test_the_answer_has_the_unit_in_which_the_value_was_given(do: Do, text: str) -> None:
    done = do("param", "set", "second", "speed", text)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{text}\n", "")
    assert do("param", "set", "second", "speed", "0.3").stdout == "0.3 m/s\n"


def test_what_check_refuses_is_refused_while_the_robot_runs(do: Do) -> None:
    done = do("param", "set", "second", "speed", "0.7 m/s")
    assert (done.returncode, done.stdout) == (1, "")
    assert "'base' can do 0.5 m/s at most (RBX3503)" in done.stderr, done.stderr
    assert do("param", "get", "second", "speed").stdout == "0.3 m/s\n"


def test_a_rule_is_checked_with_the_values_that_other_components_have_now(do: Do) -> None:
    assert do("param", "set", "base", "max_speed", "0.8 m/s").returncode == 0
    assert do("param", "set", "second", "speed", "0.7 m/s").returncode == 0
    assert "RBX3503" in do("param", "set", "base", "max_speed", "0.5 m/s").stderr
    assert do("param", "set", "second", "speed", "0.3 m/s").returncode == 0
    assert do("param", "set", "base", "max_speed", "0.5 m/s").returncode == 0


def test_the_limit_of_an_argument_holds_for_live_values_too(do: Do) -> None:
    reason = "'speed' must be at most 0.4 m/s: the argument 'speed' of the robot says so"
    assert reason in do("param", "set", "go_to", "speed", "0.45 m/s").stderr
    assert do("param", "set", "go_to", "speed", "0.4 m/s").stdout == "0.4 m/s\n"


def test_the_services_of_the_component_know_the_limit_of_an_argument(do: Do) -> None:
    request = "{parameters: [{name: speed, value: {type: 3, double_value: 0.45}}]}"
    done = do("service", "call", "left/go_to/set_parameters", request)
    assert "must be at most 0.4 m/s" in done.stdout, done.stdout + done.stderr


def test_rules_of_the_whole_robot_hold_for_tools_of_ros_too(do: Do) -> None:
    request = "{parameters: [{name: speed, value: {type: 3, double_value: 0.7}}, {name: tolerance, value: {type: 1}}]}"
    told = do("service", "call", "left/second/set_parameters", request).stdout.replace("''", "'")
    assert "'base' can do 0.5 m/s at most (RBX3503); make 'speed' of 'second' at most 0.5 m/s" in told, told
    assert "'tolerance' must be a length" in told
    assert do("param", "get", "second", "speed").stdout == "0.3 m/s\n"


def test_several_are_set_or_none(do: Do) -> None:
    done = do("param", "set", "battery.warn=60%", "second.speed=0.2 m/s")
    assert (done.returncode, done.stdout) == (0, "left/battery.warn = 60 %\nleft/second.speed = 0.2 m/s\n")
    late = do("param", "set", "battery.warn=70%", "second.speed=0.7 m/s")
    assert (late.returncode, "RBX3503" in late.stderr) == (1, True)
    wrong = do("param", "set", "battery.warn=70%", "second.speed=0.1 s")
    assert (wrong.returncode, "this is a time" in wrong.stderr) == (1, True)
    assert do("param", "get", "battery", "warn").stdout == "60 %\n"
    assert do("param", "undo").stdout == "left/battery.warn = 50 %\nleft/second.speed = 0.3 m/s\n"


def test_the_history_tells_who_changed_what_and_undo_walks_back(do: Do) -> None:
    do("param", "set", "battery", "error", "10 %")
    do("param", "set", "battery", "error", "5 %")
    *_, first, second = json.loads(do("param", "history", "battery", "--json").stdout)
    assert [(entry["name"], entry["before"], entry["after"]) for entry in (first, second)] == [
        ("error", 0.2, 0.1),
        ("error", 0.1, 0.05),
    ]
    assert first["by"].endswith(", param set")
    refused = do("param", "undo", "--change", first["change"])
    assert (refused.returncode, f"take back '{second['change']}' first" in refused.stderr) == (1, True)
    assert do("param", "undo").returncode == do("param", "undo").returncode == 0
    assert do("param", "get", "battery", "error").stdout == "20 %\n"


def test_what_is_dumped_is_loaded_without_a_change(do: Do, tmp_path: Path) -> None:
    file = tmp_path / "values.yaml"
    before = do("param", "history").stdout
    file.write_text(do("param", "dump").stdout)
    assert do("param", "load", str(file)).returncode == 0
    assert (do("param", "dump").stdout, do("param", "history").stdout) == (file.read_text(), before)
    do("param", "set", "battery.error=7%", "second.tolerance=3.3 cm")
    assert do("param", "load", str(file)).returncode == 0
    assert do("param", "dump").stdout == file.read_text()


def test_a_file_of_values_that_cannot_be_read_is_told_with_the_place(do: Do, tmp_path: Path) -> None:
    file = tmp_path / "values.yaml"
    file.write_text("battery:\n  runtime: 30 s\nsecond: 3\n")
    done = do("param", "load", str(file))
    assert (done.returncode, f"{file}:3:9" in done.stderr) == (1, True), done.stderr


def test_a_change_is_seen_by_who_watches(do: Do, environment: dict[str, str]) -> None:
    with ThreadPoolExecutor() as pool:
        seen = pool.submit(run_command, ("param", "watch", "battery", "-n", "1", "--json"), environment, PATIENCE)
        while not seen.done():
            do("param", "set", "battery.error=11%")
            do("param", "set", "battery.error=20%")
        told = json.loads(seen.result().stdout)
    assert (told["component"], told["name"]) == ("battery", "error")


def test_live_values_are_saved_at_their_places_reset_and_compared(do: Do, base: Path) -> None:
    file = base / "robot.yaml"
    before = file.read_text()
    do("param", "set", "battery.runtime=30 s", "second.tolerance=4 cm")
    diff = do("param", "diff")
    assert (diff.returncode, "battery.runtime: 45 s -> 30 s  # " in diff.stdout) == (1, True), diff.stdout
    assert do("param", "save", "battery", "--dry-run").returncode == 0
    assert file.read_text() == before
    assert do("param", "save", "battery").returncode == 0
    assert file.read_text() == before.replace("45 s", "30 s")
    assert do("param", "reset", "second.tolerance").stdout == "left/second.tolerance = 0.05 m\n"
    assert do("param", "reset").returncode == 0
    assert "changed live" not in do("apply", str(file), "--dry-run").stdout
    file.write_text(before)
    assert "runtime: 30 s -> 45 s" in do("apply", str(file), "--yes").stdout
    assert (do("param", "get", "battery", "runtime").stdout, do("param", "diff").returncode) == ("45 s\n", 0)


def test_apply_lists_the_values_that_stay_as_they_were_set_live(do: Do, base: Path) -> None:
    file = base / "robot.yaml"
    before = file.read_text()
    do("param", "set", "battery.runtime=30 s", "second.tolerance=4 cm")
    line = "battery.runtime stays at 30 s as set live; the files have 45 s: 'rbxcompose param reset battery.runtime'"
    assert line in do("apply", str(file), "--yes").stdout
    assert "stays" not in do("apply", str(file), "--dry-run", "--json").stdout
    file.write_text(before.replace("45 s", "50 s"))
    shown = do("apply", str(file), "--dry-run").stdout  # which would change one of them
    assert ("battery.runtime stays" in shown, "second.tolerance stays at 0.04 m" in shown) == (False, True), shown
    file.write_text(before)
    assert do("param", "reset").returncode == 0
    assert "stays" not in do("apply", str(file), "--yes").stdout


def test_only_what_a_dry_run_showed_is_saved_if_that_is_wanted(do: Do, base: Path) -> None:
    file = base / "robot.yaml"
    before = file.read_text()
    do("param", "set", "battery.runtime=33 s")
    told = json.loads(do("param", "save", "--dry-run", "--json").stdout)
    removed, added = (line for line in told["difference"] if line[0] in "+-")
    assert added == removed.replace("-", "+", 1).replace("45 s", "33 s")
    file.write_text(f"{before}# edited meanwhile\n")
    done = do("param", "save", "--only-as", told["hash"])
    assert (done.returncode, "have changed since they were shown" in done.stderr) == (1, True), done.stderr
    assert file.read_text() == f"{before}# edited meanwhile\n"
    file.write_text(before)
    assert do("param", "save", "--only-as", told["hash"]).returncode == 0
    assert file.read_text() == before.replace("45 s", "33 s")
    file.write_text(before)
    assert do("param", "reset").returncode == 0


def test_a_setting_in_a_group_is_treated_as_any_other(do: Do, base: Path, tmp_path: Path) -> None:
    file = base / "robot.yaml"
    before = file.read_text()
    assert do("param", "set", "cmd_vel", "handover.linear", "2 m/s^2").stdout == "2 m/s^2\n"
    assert "'handover.linear' must be greater than 0" in do("param", "set", "cmd_vel.handover.linear=0").stderr
    assert do("param", "get", "cmd_vel", "handover.linear").stdout == "2 m/s^2\n"
    assert "group     handover" in do("param", "describe", "cmd_vel", "handover.linear").stdout
    values = tmp_path / "values.yaml"
    values.write_text(do("param", "dump", "cmd_vel").stdout)
    assert do("param", "undo").stdout == "left/cmd_vel.handover.linear = 1 m/s^2\n"
    assert do("param", "load", str(values)).returncode == 0
    assert do("param", "save", "cmd_vel.handover.linear").returncode == 0
    assert file.read_text() == before.replace("1 m/s^2", "2 m/s^2")
    file.write_text(before)
    assert do("param", "reset").stdout == "left/cmd_vel.handover.linear = 1 m/s^2\n"


def test_a_file_that_was_edited_meanwhile_is_not_written_over(do: Do, base: Path) -> None:
    file = base / "robot.yaml"
    before = file.read_text()
    do("param", "set", "battery.runtime=31 s")
    file.write_text(before.replace("45 s", "52 s"))
    done = do("param", "save")
    assert (done.returncode, "'battery.runtime' is 52 s in the file now" in done.stderr) == (1, True), done.stderr
    assert do("param", "reset").stdout == "left/battery.runtime = 52 s\n"
    file.write_text(before)


@for_all(
    "words, reason",
    [
        (("set", "battery.runtime"), "write COMPONENT PARAMETER VALUE"),
        (("save", "baterry"), "did you mean 'battery'?"),
        (("undo", "--change", "battery:999"), "no change 'battery:999' is known"),
        (("describe", "battery", "runtme"), "did you mean 'runtime'?"),
        (("set", "battery", "initial", "0.5"), "'initial' cannot change while the robot runs"),
        (("set", "battery", "runtime", "3 m"), "'runtime' must be a time, such as '5 s'"),
        (("set", "battery", "runtme", "3"), "did you mean 'runtime'?"),
        (("get", "battery", "runtme"), "did you mean 'runtime'?"),
        (("get", "baterry", "runtime"), "did you mean 'left/battery'?"),
    ],
)
def test_what_cannot_be_done_is_told_with_the_reason(do: Do, words: tuple[str, ...], reason: str) -> None:
    done = do("param", *words)
    assert (done.returncode in (1, 2), reason in done.stderr) == (True, True), done.stderr


@for_all(
    "text, value",
    [
        ("0.5", 0.5),
        ("3", 3),
        ("true", True),
        ("30 s", "30 s"),
        ("", ""),
        ("null", "null"),
        ("[1, 2]", (1, 2)),
        ("{a: 1}", "{a: 1}"),
        ("[1, x]", "[1, x]"),
        ("a: [", "a: ["),
    ],
)
def test_a_value_is_read_as_yaml_and_is_text_if_it_is_nothing_else(text: str, value: Any) -> None:
    assert from_message(value_of(text)) == value

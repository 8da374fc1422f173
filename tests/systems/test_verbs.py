"""Verbs for robots of a system: what is for all and what for one, and whom they reach while files have errors."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from rbxcompose.commands import hosts
from rbxcompose.commands.console import ReportedError
from rbxcompose.commands.hosts import Remote, SystemCommand, compiled
from rbxcompose.commands.main import main
from rbxcompose.commands.verbs import load, parser_of, verbs
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.model import System
from rbxcompose.manifest.system_file import HostModel
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.tools import system_runs

ROBOT = "rbx: 1\nkind: Robot\nname: r\ncomponents: {battery: {type: battery_sim, runtime: 1 min}}\n"
SYSTEM = """rbx: 1
kind: System
name: s
hosts: {here: {}}
robots: {a: {robot: r.yaml}, b: {robot: r2.yaml}}
"""
FAR = SYSTEM.replace("{here: {}}", "{far: {ssh: far, address: 10.0.0.2}, near: {ssh: near, address: 10.0.0.3}}")
BOTH = {("here", "a"), ("here", "b")}
FOR_ALL = (
    "stop, ps, down, logs, doctor, mission pause, mission cancel, mission ls, mux lock, param get battery, topic ls, "
    "diag tree, controller ls"
)
FOR_ONE = (
    "release, mission resume, mission run patrol, mission step, mission log -f, param set battery.runtime=9, "
    "param undo, diag watch, mux unlock, mux select teleop, topic pub /a std_msgs/Empty, service call /a, "
    "controller speed arm 1, scene remove box, tf echo map odom"
)


@pytest.fixture(autouse=True)
def _robots_that_repeat(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Have each host print its name and what it is asked."""

    def script(self: Remote, words: Sequence[str], *, folder: str = "", has_terminal: bool = False) -> list[str]:
        return [sys.executable, "-S", "-c", "import sys; print(*sys.argv[1:])", self.name, *words]

    monkeypatch.setattr(Remote, "rbxcompose", script)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.chdir(tmp_path)
    for name, text in (("r.yaml", ROBOT), ("r2.yaml", ROBOT), ("s.yaml", SYSTEM)):
        Path(name).write_text(text, encoding="utf-8")


def told(written: str, robots: Sequence[str]) -> int:
    """Return the exit code of a command for robots, each on a host of its own."""
    words = [*written.split(), "--robot", "s.yaml"]
    verb = load(name := words[0])
    shares = {(f"host_{robot}", robot): Remote(f"host_{robot}", HostModel()) for robot in robots}
    arguments = parser_of(name, verb).parse_args(words[1:])
    return SystemCommand(System(), "s.yaml", robots, shares, words, "s.yaml", arguments).run(verb)


@pytest.mark.parametrize("written", FOR_ALL.split(", "))
def test_what_looks_or_holds_is_for_all_robots(written: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert told(written, ["a", "b"]) == 0
    out = capfd.readouterr().out
    assert all(f"host_{robot} {written} --robot {robot}" in out for robot in "ab")


@pytest.mark.parametrize("written", FOR_ONE.split(", "))
def test_what_lets_move_or_changes_or_lasts_is_for_one_robot(written: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert told(written, ["a", "b"]) == 1
    out, error = capfd.readouterr()
    assert "error[RBX6121]" in error
    assert "--robot s.yaml:a or s.yaml:b" in error
    assert not out, "nobody is asked"
    if "watch" not in written and "-f" not in written:
        assert told(written, ["a"]) == 0
        assert f"host_a {written} --robot a" in capfd.readouterr().out


def test_what_is_for_all_is_an_action_of_its_verb() -> None:
    for name in verbs():
        for action in getattr(verb := load(name), "FOR_ALL", ()):
            parser_of(name, verb).parse_args([action, *(["x"] if (name, action) in NAMED else [])])


NAMED = {("topic", "show"), ("param", "get"), ("param", "describe")}


@pytest.mark.parametrize(
    ("written", "asked"),
    [
        ("logs s.yaml:a battery -n 3", "here | here logs a battery -n 3"),
        ("logs --robot s.yaml:a", "here | here logs --robot a"),
        ("down s.yaml:a --json", '"text": "here down a --json"'),
        ("down --robot s.yaml:a", "here down --robot a"),
        ("doctor s.yaml:a", "here doctor a"),
        ("ps s.yaml:a", "here ps a"),
    ],
)
def test_a_robot_is_named_behind_a_colon(written: str, asked: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(written.split()) == 0
    assert capfd.readouterr().out.strip().endswith((asked, f"{asked}}}}}]}}"))


def up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bring the system up, without its processes."""
    monkeypatch.setattr(system_runs, "run_plan", lambda *_, **__: 0)
    assert main(["up", "-d", "s.yaml"]) == 0


def test_one_that_is_down_beside_others_that_are_up_is_started_by_its_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    up(monkeypatch)
    (folder := RobotFolder.of("b")).make()
    lock = folder.lock()
    assert lock is not None
    try:
        assert main(["up", "-d", "s.yaml"]) == 1
        error = capsys.readouterr().err
        assert "error[RBX9001]: already up: 'b'\n  = help: add --robot a, to start what is down" in error
        assert main(["up", "-d", "s.yaml", "--robot", "a"]) == 0
    finally:
        os.close(lock)


@pytest.mark.parametrize("is_unit", [False, True])
def test_a_unit_waits_for_what_its_machine_has_not_yet(
    is_unit: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lacking = [system_runs.OTHER_MACHINE.at(None, "there is no address yet")] * 3
    waits, started, marks = list[float](), list[str](), list[bool]()
    monkeypatch.setattr(system_runs, "_address_problem", lambda *_: lacking.pop() if lacking else None)
    monkeypatch.setattr("time.sleep", waits.append)

    def start(plan: Plan, *_: object, **__: object) -> int:
        started.append(plan.robot)
        return 0

    monkeypatch.setattr(system_runs, "run_plan", start)
    monkeypatch.setattr(system_runs, "mark_start", lambda *, is_over=False: marks.append(is_over))
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    if is_unit:
        monkeypatch.setenv("NOTIFY_SOCKET", "/run/systemd/notify")
    assert main(["up", "s.yaml", "--host", "here", "--robot", "a"]) == (0 if is_unit else 1)
    assert (len(waits), started) == ((2, ["a"]) if is_unit else (0, []))
    error = capsys.readouterr().err
    assert error.count("error[RBX6111]: there is no address yet") == 1
    assert ("it starts as soon as this is mended" in error) is is_unit
    assert marks == ([True, False] if is_unit else []), "'down' does not wait for who waits"


def test_over_ssh_only_the_robot_that_is_named_is_started(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(hosts, "reached", lambda *_: {"far": ""})
    Path("s.yaml").write_text(SYSTEM.replace("here: {}", "far: {ssh: far, address: 10.0.0.2}"), encoding="utf-8")
    assert main(["up", "-d", "s.yaml", "--robot", "b"]) == 0
    (line,) = capfd.readouterr().out.splitlines()
    assert line.endswith("--host far --robot b -d")
    assert main(["up", "-d", "s.yaml", "--robot", "c"]) == 1
    assert "error[RBX6121]: the system has no robot 'c'" in capfd.readouterr().err


def test_shares_that_are_down_are_started_beside_those_that_are_up(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    code = """import sys
words = sys.argv[1:]
if words[0] == "up":
    print("starts", words[words.index("--robot") + 1]); sys.exit("a" in words)
print('{"supervisor": {"pid": 7}}' if words[1] in NAMES else '{"error": "no robot is up"}')
"""
    monkeypatch.setattr(hosts, "reached", lambda *_: {"far": ""})
    Path("s.yaml").write_text(SYSTEM.replace("here: {}", "far: {ssh: far, address: 10.0.0.2}"), encoding="utf-8")
    for names, result in (("a", 0), ("ab", 1), ("", 1)):
        script = [sys.executable, "-S", "-c", code.replace("NAMES", repr(names))]
        monkeypatch.setattr(Remote, "rbxcompose", lambda self, words, script=script, **options: [*script, *words])
        assert main(["up", "-d", "s.yaml"]) == result
        out, error = capfd.readouterr()
        if names:  # else a fails, which may end b before that has said anything
            assert ("starts b" in out) is (names == "a")
        assert ("starts a" in out) is (names == "")
        assert ("already up: 'a' on 'far'\n" in out) is (names == "a")
        assert ("error[RBX9001]: already up: 'a' on 'far', 'b' on 'far'" in error) is (names == "ab")


def shares(**options: bool) -> set[tuple[str, str]]:
    """Return the host and the robot of each share that is asked."""
    return set(compiled("s.yaml", argparse.Namespace(profile=[], ssh_config=None), **options)[1])


HALF, UNKNOWN = "places: {x: {\n", "places: {x: {z: 1}}\n"


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("r.yaml", ROBOT + HALF),
        ("r.yaml", ROBOT + UNKNOWN),
        ("r.yaml", None),
        ("s.yaml", SYSTEM + HALF),
        ("s.yaml", SYSTEM.replace("robot: r2", "robt: r2")),
        ("s.yaml", ""),
        ("s.yaml", None),
    ],
)
def test_robots_that_are_up_can_be_stopped_whatever_is_edited(
    file: str, text: str | None, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    up(monkeypatch)
    Path(file).unlink() if text is None else Path(file).write_text(text, encoding="utf-8")
    assert shares(needs_all=False) == BOTH
    with pytest.raises(ReportedError):
        shares()
    capfd.readouterr()
    assert main(["stop", "--robot", "s.yaml"]) == 0
    out, error = capfd.readouterr()
    assert all(f"here stop --robot {robot}" in out for robot in "ab")
    words = "'s.yaml' has errors, which 'check' shows; its robots were brought up, or may be, on: here"
    is_readable = file == "r.yaml"
    assert error == f"{words}{'' if is_readable else '; others that it may have are not reached'}\n"


def test_a_robot_with_errors_that_was_not_brought_up_from_here_is_asked_for_on_each_host() -> None:
    Path("s.yaml").write_text(FAR, encoding="utf-8")
    Path("r.yaml").write_text(ROBOT + HALF, encoding="utf-8")
    assert shares(needs_all=False) == {(host, robot) for host in ("far", "near") for robot in "ab"}


def test_of_a_system_that_cannot_be_read_only_what_was_brought_up_from_here_is_known(
    capfd: pytest.CaptureFixture[str],
) -> None:
    remote = Remote("far", HostModel(ssh="pi@far", command="/opt/rbxcompose"))
    hosts.remember("s.yaml", {("far", "a"): remote})
    hosts.remember("s.yaml", {("far", "b"): remote})
    assert hosts.recalled("s.yaml", None) == {("far", "a"): remote, ("far", "b"): remote}
    Path("other.yaml").write_text(SYSTEM + HALF, encoding="utf-8")
    assert main(["stop", "--robot", "other.yaml"]) == 1
    assert "error[RBX1102]" in capfd.readouterr().err


ONE = SYSTEM.replace(", b: {robot: r2.yaml}", "")


def test_what_an_edit_takes_away_is_stopped_with_the_system_until_it_has_been_brought_down(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    up(monkeypatch)
    Path("s.yaml").write_text(ONE, encoding="utf-8")
    assert shares(needs_all=False) == BOTH
    assert shares() == {("here", "a")}
    for verb, after in (("stop --robot", BOTH), ("down", {("here", "a")})):
        capfd.readouterr()
        assert main([*verb.split(), "s.yaml"]) == 0
        out = capfd.readouterr().out
        assert all(f"here {verb} {robot}" in out for robot in "ab")
        assert shares(needs_all=False) == after


def answer_like_a_host_without(monkeypatch: pytest.MonkeyPatch, absent: str) -> None:
    """Have each host do what it is asked, but for one robot, which is not up there."""
    code = f"import sys; print('error[RBX9002]' if '{absent}' in sys.argv else ''); sys.exit('{absent}' in sys.argv)"
    script = [sys.executable, "-S", "-c", code]
    monkeypatch.setattr(Remote, "rbxcompose", lambda self, words, **options: [*script, *words])


@pytest.mark.parametrize("verb", ["stop --robot", "ps", "logs", "fleet ls"])
def test_what_an_edit_takes_away_need_not_be_up(
    verb: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    up(monkeypatch)
    answer_like_a_host_without(monkeypatch, "b")
    if verb == "ps":
        assert main(["ps", "s.yaml"]) == 1
        assert "here b:" in capfd.readouterr().out
    Path("s.yaml").write_text(ONE, encoding="utf-8")
    assert main([*verb.split(), "s.yaml"]) == (verb == "fleet ls")  # whose host gives no answer for the other one
    out = capfd.readouterr().out
    assert "here b:" not in out
    assert "down" not in out


def test_while_an_up_is_on_its_way_down_asks_hosts_again_that_lack_a_robot(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    code = """
import sys
file = open(sys.argv[2], "a+"); file.write("."); file.seek(0)
is_up = len(file.read()) == (2 if sys.argv[2] == "b" else 1)
print(sys.argv[2], "is down" if is_up else "error[RBX9002]"); sys.exit(not is_up)
"""
    monkeypatch.setattr(Remote, "rbxcompose", lambda self, words, **options: [sys.executable, "-S", "-c", code, *words])
    starts = iter((True, False))
    monkeypatch.setattr(hosts, "is_starting", lambda: next(starts))
    assert main(["down", "s.yaml"]) == 0
    out = capfd.readouterr().out
    assert ("a is down" in out, "b is down" in out, "RBX9002" in out) == (True, True, False)


@pytest.mark.parametrize("last_words", ["print('begins')", ""])
def test_a_start_on_several_hosts_is_over_once_each_has_said_something(last_words: str) -> None:
    begun: list[bool] = []
    texts = {"one": "print('begins')", "two": last_words}
    commands = {host: [sys.executable, "-S", "-c", text] for host, text in texts.items()}
    assert hosts.follow_commands(commands, begun=lambda: begun.append(True)) == 0
    assert any(begun) is bool(last_words)


def test_who_only_shows_goes_on_on_the_other_hosts_if_one_fails(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    flag = tmp_path / "flag"
    flag.touch()
    texts = {
        "lost": "import os, sys; os.remove(sys.argv[1]); sys.exit(255)",
        "whole": "import os, sys\nwhile os.path.exists(sys.argv[1]): pass\nprint('goes on')",
    }
    commands = {host: [sys.executable, "-S", "-c", text, str(flag)] for host, text in texts.items()}
    assert hosts.follow_commands(commands, ends_all=False) == 255
    assert "whole | goes on" in capfd.readouterr().out


def test_down_names_each_host_also_where_the_end_of_another_one_came_first(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    up(monkeypatch)
    answer_like_a_host_without(monkeypatch, "b")
    assert main(["down", "s.yaml"]) == 0
    assert "here b:\n  is not up\n" in capfd.readouterr().out

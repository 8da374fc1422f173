"""The command line without a robot: usage, help, findings; and with one that is only written down."""

from __future__ import annotations

import argparse
import ast
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose import __version__
from rbxcompose.base.levels import Level
from rbxcompose.base.plugins import file_of
from rbxcompose.commands import main as command
from rbxcompose.commands import verbs
from rbxcompose.runtime.folder import STATE, ComponentState, RobotFolder, RobotState, StopState
from rbxcompose.runtime.log import NAME, LogFile, Record, start_new
from rbxcompose.runtime.processes import Process, boot_id
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.commands import down
from tests.loops import for_all

ROOT = Path(__file__).parents[2]
RUNNING = ["ps", "down", "stop", "release", "logs"]


@pytest.fixture(autouse=True)
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def written(name: str, stop: StopState | None = None, supervisor: Process | None = None) -> RobotFolder:
    """Write down a robot whose supervisor has gone."""
    folder = RobotFolder.of(name)
    folder.make()
    component = ComponentState("base", "toy", "active", "robot", 77, 1)
    gone = supervisor or Process(os.getpid(), 1)
    file = f"/robots/{name}/robot.yaml"
    folder.write_state(RobotState(name, file, gone, {"robot": gone}, (component,), boot=boot_id(), stop=stop))
    return folder


def test_a_robot_of_another_version_is_shown_as_such_and_not_changed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Process, "is_titled", lambda self, prefix: True)
    folder = written("turtlebot", supervisor=Process.of(os.getpid()))
    state = folder.read_state()
    assert state is not None
    folder.write_state(replace(state, package_version="0.0.9"))
    words = f"'turtlebot' runs rbxcompose 0.0.9, and {__version__} is installed: 'down', then 'up', starts that"
    assert command.main(["ps"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == words
    assert command.main(["apply", str(ROOT / "robots/turtlebot"), "--yes"]) == 1
    assert f"error[RBX9004]: {words}" in capsys.readouterr().err
    folder.write_state(state)
    assert command.main(["ps"]) == 0
    assert "installed" not in capsys.readouterr().out


def test_without_a_command_it_shows_its_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main([]) == 2
    assert command.main(["--help"]) == 0
    assert capsys.readouterr().out.startswith("usage: rbxcompose COMMAND")


def test_the_help_has_one_line_for_each_verb_under_what_one_wants(
    capsys: pytest.CaptureFixture[str], golden: Golden
) -> None:
    command.main(["--help"])
    text = capsys.readouterr().out
    golden.check("help.txt", text)
    assert sorted(line.split()[0] for line in text.splitlines() if line.startswith("  ")) == verbs.verbs()
    assert len(verbs.in_groups()[verbs.MOST_USED]) == 10
    assert all(verbs.load(verb).GROUP in verbs.GROUPS for verb in verbs.verbs())


def test_an_unknown_command_is_wrong_usage_with_a_hint(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["dwon"]) == 2
    assert "did you mean 'down'?" in capsys.readouterr().err


@for_all(
    "written, usual",
    [
        ("action", "action ls"),
        ("arm", "arm ls"),
        ("arm robots/mini --json", "arm ls robots/mini --json"),
        ("body mini.urdf", "body show mini.urdf"),
        ("controller", "controller ls"),
        ("diag", "diag tree"),
        ("diag -v", "diag tree -v"),
        ("fleet", "fleet ls"),
        ("mission --robot mini", "mission ls --robot mini"),
        ("map --topic costmap", "map show --topic costmap"),
        ("msg std_msgs/Bool", "msg show std_msgs/Bool"),
        ("mux", "mux ls"),
        ("param", "param ls"),
        ("scene", "scene ls"),
        ("security systems/two.yaml", "security audit systems/two.yaml"),
        ("service", "service ls"),
        ("servo --port /dev/ttyUSB0", "servo scan --port /dev/ttyUSB0"),
        ("tf --timeout 1s", "tf tree --timeout 1s"),
        ("topic -a", "topic ls -a"),
        ("topic list -a", "topic ls -a"),
        ("topic info /odom", "topic show /odom"),
        ("action list", "action ls"),
        ("udev", "udev scan"),
        ("world robots/house", "world show robots/house"),
    ],
)
def test_without_an_action_the_most_common_one_is_meant(written: str, usual: str) -> None:
    verb, *words = written.split()
    parser = verbs.parser_of(verb, verbs.load(verb))
    assert parser.parse_args(words) == parser.parse_args(usual.split()[1:])


def test_the_name_of_a_robot_that_is_up_is_no_misspelt_action(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = RobotFolder.of("turtlebot")
    folder.make()
    (folder.path / STATE).touch()
    parser = verbs.parser_of("diag", verbs.load("diag"))
    assert parser.parse_args(["turtlebot"]) == parser.parse_args(["tree", "--robot", "turtlebot"])


def parsers() -> Iterator[argparse.ArgumentParser]:
    """Yield the parsers of all verbs and actions."""
    waiting: list[argparse.ArgumentParser] = [verbs.parser_of(verb, verbs.load(verb)) for verb in verbs.verbs()]
    while waiting:
        yield (parser := waiting.pop())
        for action in parser._actions:
            waiting += action.choices.values() if isinstance(action, argparse._SubParsersAction) else ()


def test_where_an_answer_is_written_is_called_o_and_out_everywhere() -> None:
    names = {"-o", "--out", "--output"}
    found = {
        parser.prog.removeprefix("rbxcompose "): {*action.option_strings}
        for parser in parsers()
        for action in parser._actions
        if names & {*action.option_strings}
    }
    assert found.keys() >= {"record", "graph", "body picture", "import mux", "export", "mission show", "arm setup"}
    assert found.pop("record") == names
    assert {*map(frozenset, found.values())} == {frozenset({"-o", "--out"})}


def test_a_misspelt_action_is_no_argument_of_the_usual_one(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        command.main(["diag", "treee"])
    assert caught.value.code == 2
    assert "invalid choice: 'treee' (choose from 'tree', 'watch'" in capsys.readouterr().err


@pytest.mark.parametrize("verb", RUNNING)
def test_without_a_robot_that_is_a_finding(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main([verb]) == 1
    assert "error[RBX9002]: no robot is up" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["stop", "release"])
def test_with_several_robots_one_must_be_named(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    written("a")
    written("b")
    assert command.main([verb]) == 1
    assert "error[RBX9003]: several robots are up: a, b" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["stop", "release"])
@pytest.mark.parametrize("words", [["--robot", "turtelbot"], ["turtelbot"]])
def test_a_misspelt_robot_gets_a_hint(verb: str, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    written("turtlebot")
    assert command.main([verb, *words]) == 1
    assert "did you mean 'turtlebot'?" in capsys.readouterr().err


@pytest.mark.parametrize("words", ["stop", "release", "mission ls", "topic ls", "top --once", "record --for 1s"])
def test_a_robot_whose_supervisor_has_died_is_a_finding_that_says_so(
    words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    written("a")
    assert command.main(words.split()) == 1
    error = capsys.readouterr().err
    assert "error[RBX9005]: 'a' does not answer: its supervisor has died" in error
    assert "'rbxcompose down a' ends what is left of it" in error


def test_ps_shows_what_a_dead_supervisor_last_wrote(capsys: pytest.CaptureFixture[str]) -> None:
    written("a")
    assert command.main(["ps", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "robot": "a",
        "supervisor": {"pid": None},
        "version": __version__,
        "router": {"endpoint": None},
        "stop": None,
        "real": False,
        "clocks": {},
        "components": [
            {"name": "base", "type": "toy", "state": "dead", "process": "robot", "pid": None, "restarts": 1}
        ],
    }
    assert command.main(["ps"]) == 0
    out = capsys.readouterr().out
    assert "base  toy   dead   robot    -    1" in out
    assert "its supervisor has died" in out.splitlines()[-1]
    assert "'rbxcompose down a', or the next 'up', cleans up" in out


def test_ps_lists_all_robots_that_are_up(capsys: pytest.CaptureFixture[str]) -> None:
    written("a")
    written("b")
    assert command.main(["ps"]) == 0
    heads = [line.partition(":")[0] for line in capsys.readouterr().out.splitlines() if "supervisor dead" in line]
    assert heads == ["a", "b"]
    assert command.main(["ps", "--json"]) == 0
    assert [robot["robot"] for robot in json.loads(capsys.readouterr().out)["robots"]] == ["a", "b"]
    assert command.main(["ps", "b", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["robot"] == "b"


@pytest.mark.parametrize(
    ("holds", "line"),
    [
        ({}, "'release' allows motion again"),
        ({"estop": "'estop' is pressed"}, "'release' is refused, because of 'estop': 'estop' is pressed"),
    ],
)
def test_ps_shows_who_has_stopped_a_robot(holds: dict[str, str], line: str, capsys: pytest.CaptureFixture[str]) -> None:
    written("a", StopState("the command 'stop'", 12.34, holds))
    assert command.main(["ps"]) == 0
    assert capsys.readouterr().out.splitlines()[1:3] == ["STOPPED at 12.3 s by the command 'stop'", line]
    assert command.main(["ps", "--json"]) == 0
    expected = {"by": "the command 'stop'", "time": 12.34, "holds": holds}
    assert json.loads(capsys.readouterr().out)["stop"] == expected


def test_down_says_what_failed_at_the_end_and_not_what_did_before(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log = LogFile(written("a").path / NAME)

    def say(level: Level, text: str) -> list[str]:
        log.write(Record(1.0, level, "servos", text))
        return []

    say(Level.ERROR, "something else")
    monkeypatch.setattr(down, "_end", lambda folder: say(Level.ERROR, "servo 1 may still turn") + say(Level.WARN, "so"))
    assert command.main(["down", "a"]) == 0
    assert capsys.readouterr().out == "servos: servo 1 may still turn\na is down\n"
    log.close()


@pytest.mark.parametrize("wanted", ["a", "/robots/a/robot.yaml", "/robots/a"])
def test_down_clears_what_is_left_by_name_or_by_file(wanted: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder = written("a")
    written("b")
    assert command.main(["down", wanted]) == 0
    assert capsys.readouterr().out == "a is down\n"
    assert list(folder.path.iterdir()) == []


def test_a_state_that_cannot_be_read_is_told_and_cleared(capsys: pytest.CaptureFixture[str]) -> None:
    folder = written("a")
    (folder.path / "state.json").write_text("nonsense")
    assert command.main(["down", "a"]) == 0
    assert "its checksum is wrong" in capsys.readouterr().out
    assert list(folder.path.iterdir()) == []


def test_a_path_behind_undo_is_wrong_usage_with_a_hint(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        command.main(["apply", "--undo", "robots/tb", "--yes"])
    assert "a path stands first: 'apply robots/tb --undo'" in capsys.readouterr().err


def test_logs_shows_the_last_run_also_when_the_robot_is_down(capsys: pytest.CaptureFixture[str]) -> None:
    folder = RobotFolder.of("a")
    folder.make()
    log = start_new(folder.path)
    for number in range(3):
        log.write(Record(float(number), Level.OK, "base", f"text {number}"))
    log.close()
    assert command.main(["logs", "-n", "2"]) == 0
    assert capsys.readouterr().out.splitlines() == ["    1.00  base   text 1", "    2.00  base   text 2"]
    assert command.main(["logs", "-n", "0", "a"]) == 0
    assert capsys.readouterr().out == ""
    with pytest.raises(SystemExit, match="2"):
        command.main(["logs", "-n", "-5"])
    assert "'-5' is not a whole number of at least 0" in capsys.readouterr().err


def test_logs_shows_who_is_asked_for_from_the_level_that_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    folder = written("a")
    log = start_new(folder.path)
    for source, level in (("base", Level.OK), ("arm", Level.WARN), ("robot", Level.ERROR), ("base", Level.WARN)):
        log.write(Record(1.0, level, source, "text"))
    log.close()

    def shown(*words: str) -> list[str]:
        assert command.main(["logs", *words]) == 0
        return [line.split(maxsplit=1)[1] for line in capsys.readouterr().out.splitlines()]

    assert shown("base") == ["base   text", "base   warn: text"]
    assert shown("a", "arm", "base", "--level", "warn") == ["arm    warn: text", "base   warn: text"]
    assert shown("--robot", "a", "--level", "error") == ["robot  error: text"]
    assert shown("base", "-n", "1") == ["base   warn: text"]
    assert command.main(["logs", "arm", "--json"]) == 0
    assert capsys.readouterr().out == '{"t": 1.0, "level": "WARN", "source": "arm", "text": "text"}\n'


def test_logs_of_somebody_who_is_not_there_is_a_finding_with_a_hint(capsys: pytest.CaptureFixture[str]) -> None:
    written("a")
    assert command.main(["logs", "bse"]) == 1
    shown = capsys.readouterr().err
    assert "error[RBX9002]: 'bse' is neither a robot that is up nor a component in the log of 'a'" in shown
    assert "did you mean 'base'?" in shown


def test_following_a_log_ends_at_an_interrupt_without_a_word(base: Path) -> None:
    folder = RobotFolder.of("a")
    folder.make()
    log = start_new(folder.path)
    words = [sys.executable, "-m", "rbxcompose", "logs", "-f"]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        log.write(Record(1.0, Level.OK, "base", "first"))
        assert process.stdout
        assert process.stdout.readline() == b"    1.00  base   first\n"
        log.write(Record(2.0, Level.OK, "base", "second"))
        assert process.stdout.readline() == b"    2.00  base   second\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(5.0) == 130
        assert process.stderr
        assert process.stderr.read() == b""
    log.close()


def test_a_reader_that_goes_away_is_no_error_of_ours() -> None:
    folder = RobotFolder.of("a")
    folder.make()
    log = start_new(folder.path)
    for number in range(5000):
        log.write(Record(float(number), Level.OK, "base", "x" * 100))
    log.close()
    words = [sys.executable, "-m", "rbxcompose", "logs"]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr
        assert process.stderr.read() == b""
        process.wait(5.0)


def in_shell(line: str, **environment: str) -> tuple[int, bytes, bytes]:
    """Run a line of a shell with `rbxcompose` in it; return its exit code, stdout and stderr."""
    line = line.replace("rbxcompose", f"'{sys.executable}' -m rbxcompose", 1)
    done = subprocess.run(line, shell=True, cwd=ROOT, capture_output=True, env={**os.environ, **environment})
    return done.returncode, done.stdout, done.stderr


def test_output_that_cannot_be_written_is_said_in_a_line() -> None:
    words = b"rbxcompose explain: the output cannot be written: No space left on device\n"
    assert in_shell("rbxcompose explain RBX1304 > /dev/full") == (2, b"", words)


def test_a_stream_that_is_closed_changes_no_exit_code() -> None:
    assert in_shell("rbxcompose check robots/turtlebot >&- 2>&-") == (0, b"", b"")


def test_a_reader_that_has_gone_is_no_finding() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        words = [sys.executable, "-m", "rbxcompose", "explain", "RBX1304"]
        done = subprocess.run(words, cwd=ROOT, stdout=writing, stderr=subprocess.PIPE)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


def test_what_an_encoding_lacks_is_escaped() -> None:
    line = "rbxcompose expand robots/turtlebot --set about='\u00e9\U0001f916'"
    code, out, err = in_shell(line, PYTHONIOENCODING="latin-1")
    assert (code, err) == (0, b"")
    assert b"about: \xe9\\U0001f916 " in out


def test_a_command_to_a_running_robot_imports_nothing_heavy() -> None:
    verbs = ["ps", "stop", "down", "logs", "mission"]
    script = f"import sys; import rbxcompose.commands.verbs as m; [*map(m.load, {verbs})]; print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not {"pydantic", "numpy", "zenoh", "yaml", "rosbags"} & set(found.stdout.split())


INTERRUPTING = """
import os, signal, sys
class Interrupted:
    def find_spec(self, name, *others):
        if name == "rbxcompose.base.dataclass":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupted())
from rbxcompose.__main__ import main
main()
"""


def test_an_interrupt_while_the_command_is_imported_ends_it_silently() -> None:
    found = subprocess.run([sys.executable, "-c", INTERRUPTING], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (found.returncode, found.stdout, found.stderr) == (-signal.SIGINT, "", "")


def test_check_imports_nothing_heavy_that_the_robot_does_not_need() -> None:
    script = "import sys; from rbxcompose.commands.main import main; main(sys.argv[1:]); print(*sys.modules)"
    command = [sys.executable, "-c", script, "check", "robots/turtlebot"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    needless = {"numpy", "zenoh", "xacro", "mcap", "jinja2", "urllib.request"}
    assert "turtlebot is fine" in found.stdout
    assert not needless & set(found.stdout.split())


def test_each_verb_says_what_it_does_in_one_line() -> None:
    for verb in verbs.verbs():
        text = Path(file_of(verbs.module_of(verb))).read_text(encoding="utf-8")
        first = (ast.get_docstring(ast.parse(text)) or "").splitlines()[0]
        assert first.endswith(".")
        assert len(first) <= 100


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("rbxcompose ")

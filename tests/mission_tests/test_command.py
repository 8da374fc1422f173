"""The command `test`, and the tests of the missions that ship."""

from __future__ import annotations

import json
import os
from pathlib import Path
from unittest.mock import Mock
from xml.etree import ElementTree

import pytest

from rbxcompose.commands.main import main as command
from rbxcompose.missions.view.tested import keep_tested, read_tested
from rbxcompose.tools.commands import test as verb
from rbxcompose.tools.mission_tests.reader import TrialReader
from tests.conftest import ROOT
from tests.mission_tests.trying import Trying
from tests.soak import Soak

SOAKED = {  # of each there is another one, or what they do is tried in `tests/navigation` and `tests/components`
    f"{name}.test.yaml"
    for name in (
        "alternate_runtime",
        "arm_and_head",
        "around_obstacles",
        "carry_a_tool",
        "carry_upright",
        "deliver",  # in `tests/controllers/test_rover.py`
        "draw_triangle",
        "fast_and_slow",
        "fetch_and_carry",
        "find_dock",
        "follow_me",
        "follow_with_the_hand",
        "lead_by_hand",
        "look_around",
        "look_at_target",
        "pedestal_pick_what_is_seen",
        "pick_and_place",
        "pick_tagged",
        "pick_what_is_seen",
        "porter_follow_with_the_hand",
        "porter_pick_what_is_seen",
        "poses_and_gripper",
        "reach_and_shift",
        "reach_out",
        "return_to_where_it_was",
        "seen_nothing",
        "seen_too_wide",
        "stretch_out",
        "tuck",
        "tucked_patrol",
        "wander",
        "words_by_turns",
    )
}
PATROL = "missions/tests/patrol.test.yaml"


@pytest.mark.timeout(600)
def test_all_tests_of_the_missions_pass(
    repository: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, soak: Soak
) -> None:
    """On the robot that each names first; further robots, and those of `SOAKED`, are tried under `--soak` alone."""
    if not soak.is_on:
        every = TrialReader.every
        monkeypatch.setattr(TrialReader, "every", lambda self, path: every(self, path)[: path.name not in SOAKED])
    assert command(["test", "--json"]) == 0, capsys.readouterr().out
    told = json.loads(capsys.readouterr().out)
    files = [file for file in (ROOT / "missions").rglob("*.test.yaml") if soak.is_on or file.name not in SOAKED]
    assert {test["file"] for test in told["tests"]} == {str(file.relative_to(ROOT)) for file in files}
    assert all(test["passed"] for test in told["tests"])


def test_a_filter_chooses_by_name(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["test", "missions", "--filter", "after_a_stop"]) == 0
    out = capsys.readouterr().out
    assert "1 passed" in out
    assert "goes_on_after_a_stop" in out
    assert command(["test", "missions", "--filter", "nothing_like_that"]) == 2


def broken(folder: Path, *names: str) -> Path:
    """Write a robot with one mistake and tests of it, return the folder of the tests."""
    (folder / "robot.yaml").write_text("rbx: 1\nkind: Robot\nname: broken\ncomponents:\n  base:\n    type: bass\n")
    for name in names:
        head = f"rbx: 1\nkind: Test\nname: {name}\nrobot: robot.yaml\nmission: patrol\n"
        (folder / f"{name}_file.yaml").write_text(head + "expect:\n  outcome: success\n")
    return folder


def test_a_filter_finds_a_test_whose_robot_has_mistakes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(broken(tmp_path, "first", "second"))
    assert command(["test", folder, "--filter", "irst"]) == 1
    captured = capsys.readouterr()
    assert "FAILED  first" in captured.out
    assert "second" not in captured.out
    assert "a type that does not exist: 'bass'" in captured.err
    assert "no test has" not in captured.err
    assert command(["test", folder, "--filter", "third"]) == 2
    captured = capsys.readouterr()
    assert captured.err == "rbxcompose test: no test has 'third' in its name\n"


def test_a_filter_that_finds_nothing_tells_which_files_it_could_not_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = broken(tmp_path, "first")
    (folder / "torn.yaml").write_text('rbx: 1\nkind: Test\nname: "third\n')
    assert command(["test", str(folder), "--filter", "third"]) == 2
    error = capsys.readouterr().err
    assert "torn.yaml:3" in error
    assert "no test has 'third' in its name" in error


@pytest.mark.parametrize("verb", ["test", "check"])
def test_a_mistake_of_a_robot_is_told_once_for_all_of_its_tests(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = broken(tmp_path, "first", "second", "third")
    assert command([verb, *map(str, sorted(folder.glob("*_file.yaml")))]) == 1
    captured = capsys.readouterr()
    told = captured.err + captured.out
    assert told.count("a type that does not exist: 'bass'") == 1
    assert told.count("RBX4203") == 1
    assert "has errors, so 3 tests cannot run" in told
    assert command(["test", str(folder), "--json"]) == 1
    tests = json.loads(capsys.readouterr().out)["tests"]
    assert [len(test["problems"]) for test in tests] == [1, 1, 1]  # each test has its own reason


def test_a_mission_with_a_mistake_keeps_only_its_own_tests_from_running(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    texts = {
        "robot": "kind: Robot\nname: two\nmissions: {good: good.yaml, bad: bad.yaml, both: both.yaml}\nstart: bad\n",
        "good": "kind: Mission\nname: good\ndo: {wait: 1 s}\n",
        "bad": "kind: Mission\nname: bad\ndo: {wiat: 1 s}\n",
        "both": "kind: Mission\nname: both\ndo: [{use: good}, {use: bad}]\n",
    }
    for name in ("good", "bad", "both"):
        texts[f"{name}.test"] = (
            f"kind: Test\nname: of_{name}\nrobot: robot.yaml\nmission: {name}\nexpect: {{outcome: success}}\n"
        )
    for name, text in texts.items():
        (tmp_path / f"{name}.yaml").write_text(f"rbx: 1\n{text}")
    assert command(["test", str(tmp_path), "--json"]) == 1
    captured = capsys.readouterr()
    passed = {test["file"].rpartition("/")[2]: test["passed"] for test in json.loads(captured.out)["tests"]}
    assert passed == {"good.test.yaml": True, "bad.test.yaml": False, "both.test.yaml": False}
    assert "wiat" in captured.err


def test_traces_coverage_and_junit(
    repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    file = tmp_path / "out.xml"
    assert command(["test", PATROL, "-v", "--coverage", "--junit", str(file)]) == 0
    out = capsys.readouterr().out
    assert "interrupt battery_low" in out
    assert "patrol: 4 of 7 paths taken" in out
    suite = ElementTree.parse(file).getroot().find("testsuite")
    assert suite is not None
    assert suite.attrib["failures"] == "0"
    kept = read_tested("turtlebot", "patrol")
    assert kept is not None
    assert (kept["ways"], len(kept["missing"])) == (7, 3)


def test_results_that_cannot_be_written_are_told_before_any_test_runs(
    repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "reports/out.xml"
    assert command(["test", PATROL, "--junit", str(file)]) == 2
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", f"rbxcompose test: '{file}' cannot be written: No such file or directory\n")


def test_older_results_stay_until_there_are_new_ones(
    trying: Trying, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trying.read("expect:\n  outcome: failure\n", "ending")
    words, file = ["test", str(trying.folder / "tried.test.yaml"), "--junit"], tmp_path / "out.xml"
    assert command([*words, str(file), "--filter", "nothing"]) == 2
    assert not file.exists()
    file.write_text("<old/>")
    with monkeypatch.context() as patched:
        patched.setattr(verb, "run_trial", Mock(side_effect=KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            command([*words, str(file)])
    assert file.read_text() == "<old/>"
    assert command([*words, str(file)]) == 0
    assert "<testsuites" in file.read_text()


def test_results_for_a_full_disk_are_told(trying: Trying, capsys: pytest.CaptureFixture[str]) -> None:
    trying.read("expect:\n  outcome: failure\n", "ending")
    assert command(["test", str(trying.folder / "tried.test.yaml"), "--junit", "/dev/full"]) == 2
    told = capsys.readouterr()
    assert "1 passed" in told.out
    assert told.err.endswith("rbxcompose test: '/dev/full' cannot be written: No space left on device\n")


def test_a_test_has_the_same_names_in_junit_when_it_cannot_run(trying: Trying, tmp_path: Path) -> None:
    file, found = tmp_path / "out.xml", []
    for outcome in ("failure", "failur"):
        trying.read(f"expect:\n  outcome: {outcome}\n", "ending")
        command(["test", str(trying.folder / "tried.test.yaml"), "--junit", str(file)])
        case = next(ElementTree.parse(file).iter("testcase"))
        found.append((case.get("classname"), case.get("name"), [child.tag for child in case]))
    assert found == [("ending", "tried", []), ("ending", "tried", ["error"])]


def test_a_damaged_file_of_what_was_tested_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert read_tested("rover", "look") is None
    keep_tested("rover", {"look": {"ways": 1}})
    keep_tested("rover", {"dock": {"ways": 2}})
    assert (read_tested("rover", "look"), read_tested("rover", "dock")) == ({"ways": 1}, {"ways": 2})
    (file,) = tmp_path.rglob("rover.json")
    file.write_text("{")
    assert read_tested("rover", "look") is None
    keep_tested("rover", {"look": {"ways": 3}})
    assert read_tested("rover", "look") == {"ways": 3}


def test_a_failure_and_a_mistake_are_exit_code_1(trying: Trying, capsys: pytest.CaptureFixture[str]) -> None:
    trying.read("mocks:\n  go_to: failure\nexpect:\n  outcome: success\n", "states")
    path = trying.folder / "tried.test.yaml"
    assert command(["test", str(path)]) == 1
    assert "expected outcome success" in capsys.readouterr().out
    trying.read("mocks:\n  go: failure\nexpect:\n  outcome: success\n", "states")
    assert command(["test", str(path)]) == 1
    assert "RBX4201" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["no_such_folder"], ["robots"], [PATROL, "--filter"]])
def test_wrong_usage_is_exit_code_2(repository: Path, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    try:
        code = command(["test", *words])
    except SystemExit as exit_:
        code = exit_.code  # type: ignore[assignment]
    assert code == 2
    assert capsys.readouterr().err


def test_a_mission_is_explored(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["mission", "explore", "patrol", "robots/turtlebot", "--states", "100"]) == 0
    assert "can end with failure" in capsys.readouterr().out
    assert command(["mission", "explore", "patrol", "robots/turtlebot", "--depth", "9", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["found"] == []
    assert 0 < told["deepest"] <= 9
    assert command(["mission", "explore", "patrl", "robots/turtlebot"]) == 1
    assert "did you mean 'patrol'?" in capsys.readouterr().err


def test_check_takes_a_test(repository: Path, trying: Trying, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["check", PATROL]) == 0
    assert "the test recharges_and_resumes is fine" in capsys.readouterr().out
    trying.read("mocks:\n  go: failure\nexpect:\n  outcome: success\n", "states")
    assert command(["check", str(trying.folder / "tried.test.yaml")]) == 1
    assert "RBX4201" in capsys.readouterr().out


def test_what_only_looks_like_a_file_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "pipe.test.yaml")
    (tmp_path / "zero.test.yaml").symlink_to("/dev/zero")
    (tmp_path / "loop.test.yaml").symlink_to("loop.test.yaml")
    (tmp_path / ".#opened.test.yaml").symlink_to("nowhere")  # an editor's mark
    assert command(["test", str(tmp_path)]) == 1
    captured = capsys.readouterr()
    assert captured.err.count("error[RBX1301]") == 3
    assert "opened" not in captured.out + captured.err


def test_a_file_that_is_called_a_test_and_is_none_is_a_mistake(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cut.test.yaml").touch()
    (tmp_path / "slip.test.yaml").write_text("rbx: 1\nkind: test\nname: a\n")
    (tmp_path / ".#slip.test.yaml").touch()
    assert command(["test", str(tmp_path)]) == 1
    captured = capsys.readouterr()
    assert [captured.err.count(code) for code in ("error[RBX1102]", "error[RBX1304]", "error[")] == [1, 1, 2]
    assert "did you mean 'Test'?" in captured.err


def test_nothing_that_a_user_wrote_reaches_the_terminal_raw(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.test.yaml").write_text('rbx: 1\nkind: Test\nname: "\\e[31mred"\nrobot: robot.yaml\nmission: m\n')
    junit = tmp_path / "junit.xml"
    assert command(["test", str(tmp_path), "--junit", str(junit)]) == 1
    assert command(["test", str(tmp_path), "--filter", "\x1b[31m"]) == 1
    assert command(["test", str(tmp_path), "--filter", "\x1b[32m"]) == 2
    assert command(["test", "\x1b[31m"]) == 2
    captured = capsys.readouterr()
    assert "\x1b" not in captured.out + captured.err
    assert "FAILED  \\x1b[31mred" in captured.out
    assert "?[31mred" in junit.read_text()


def test_one_file_may_test_several_robots(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trying = Trying(tmp_path)
    (tmp_path / "second.yaml").write_text((tmp_path / "robot.yaml").read_text())
    (tmp_path / "third").mkdir()
    broken(tmp_path / "third")
    test = "expect:\n  outcome: success\n"
    head = "rbx: 1\nkind: Test\nname: opens\nrobot: robot.yaml\nmission: patrol\nmocks: {go_to: , recharge: }\n"
    head += "events: [{at: 0 s, set: {battery: 100 %, door: false}}]\n"
    file = tmp_path / "tried.test.yaml"
    file.write_text(f"{head}also: [second.yaml]\n{test}")
    command(["test", "--json", str(file)])
    told = json.loads(capsys.readouterr().out)["tests"]
    assert [entry["name"] for entry in told] == ["opens", "opens (second)"]
    assert len({entry["passed"] for entry in told}) == 1
    file.write_text(f"{head}also: [second.yaml, third/robot.yaml]\n{test}")
    assert command(["test", "--json", str(file)]) == 1
    assert [entry["name"] for entry in json.loads(capsys.readouterr().out)["tests"]][2] == "opens (third)"
    assert trying.reading.read(file)[1].has_errors
    file.write_text(f"{head}also: second.yaml\n{test}")
    assert [finding.message for finding in trying.reading.read(file)[1]] == ["'also' must be a list of robots"]

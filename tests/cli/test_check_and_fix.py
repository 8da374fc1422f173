"""`check`: which robots it looks at, what counts, how it is written, and what `--fix` does to the files."""

from __future__ import annotations

import json
import os
import shutil
import stat
from collections.abc import Iterable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Finding, Fix, Sources, safe_fixes
from rbxcompose.commands import main as command
from rbxcompose.tools.commands import check as fixes
from tests.soak import rare

ROOT = Path(__file__).parents[2]
ROBOT, MISSION = Path("robots/bot/robot.yaml"), Path("missions/patrol.yaml")
SLIPS = {
    "type: charger": "type: chargr",
    "reach: 20 cm": "rech: 20 cm",
    "dock: dock": "dock: dok",
    "start: patrol": 'start: "patrl"',
    "battery.battery_level": "batery.battery_level",
    "${args.speed}": "${args.sped}",
    "match: [battery, ": "match: [batery, ",
}
HEAD = "rbx: 1\nkind: Mission\nname: patrol\n"


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with one robot and its mission, as the current folder."""
    for source, target in ((ROOT / "robots/turtlebot/robot.yaml", ROBOT), (ROOT / MISSION, MISSION)):
        (tmp_path / target).parent.mkdir(parents=True)
        shutil.copy(source, tmp_path / target)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def slip(text: str) -> str:
    for right, wrong in SLIPS.items():
        assert right in text
        text = text.replace(right, wrong)
    return text


def change(path: Path, right: str, wrong: str) -> str:
    text = path.read_text(encoding="utf-8")
    assert right in text
    path.write_text(text.replace(right, wrong), encoding="utf-8")
    return text


def output(capsys: pytest.CaptureFixture[str], *words: str, code: int) -> str:
    assert command.main(["check", *words]) == code
    return capsys.readouterr().out


def test_without_a_path_all_robots_here_are_checked(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    second = project / "robots/other.yaml"
    second.write_text((project / ROBOT).read_text().replace("name: turtlebot", "name: other").replace("../../", "../"))
    lines = output(capsys, code=0).splitlines()
    assert [line.split()[0] for line in lines] == ["turtlebot", "other"]
    assert output(capsys, "robots", code=0).splitlines() == lines


def test_a_mission_is_checked_with_the_robots_that_use_it(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(project / MISSION, "go_to: dock", "go_to: harbour")
    assert f"{MISSION}:" in output(capsys, str(MISSION), code=1)
    (project / "missions/draft.yaml").write_text(HEAD + "do: nothing\n")
    told = output(capsys, "missions/draft.yaml", code=0)
    assert "warning[RBX9007]: no robot of the project uses 'missions/draft.yaml'" in told


def test_an_overlay_alone_is_told_to_name_a_robot(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "careful.yaml").write_text("rbx: 1\nkind: Overlay\nname: careful\nargs: {speed: 0.2 m/s}\n")
    told = output(capsys, "careful.yaml", code=0)
    assert "warning[RBX9007]: 'careful.yaml' is an overlay, and does not say for which robot" in told
    assert "name the robot, too: 'rbxcompose check ROBOT -f careful.yaml'" in told
    assert "is fine" in output(capsys, "-f", "careful.yaml", str(ROBOT), "careful.yaml", code=0)


def test_an_overlay_is_checked_on_the_robot_beside_it(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    night = ROBOT.with_name("night.yaml")
    night.write_text("rbx: 1\nkind: Overlay\nname: night\ncomponents:\n  batery: {warn: 40 %}\n")
    told = output(capsys, str(night), str(ROBOT), code=1)
    assert "error[RBX1302]" in told
    assert f"{night}:5:3" in told
    change(night, "batery", "battery")
    assert "is fine" in output(capsys, str(night), "--strict", code=0)
    assert "fixed" not in output(capsys, str(night), "--fix", code=0)


NO_MANIFESTS = {
    "missions/draft.yaml": (HEAD + "do: [\n", "error[RBX1102]: a value is missing"),
    "parts/lamp.yaml": ("rbx: 1\nkind: Part\nname: lamp\ncomponents: [\n", "error[RBX1102]: a value is missing"),
    "robots/bad.yaml": ("a: [\n", "error[RBX1102]: a value is missing"),
    "missions/other.yaml": ("rbx: 1\nkind: Route\nname: other\n", "there is no manifest of kind 'Route'"),
}


@pytest.mark.parametrize("name", NO_MANIFESTS)
def test_what_no_robot_uses_is_read_all_the_same(name: str, project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, wrong = NO_MANIFESTS[name]
    (project / name).parent.mkdir(exist_ok=True)
    (project / name).write_text(text)
    told = output(capsys, name, code=1)
    assert wrong in told
    assert f"--> {name}:" in told
    assert "RBX9007" not in told


MISSPELT = {
    "robots/bot/night.yaml": "rbx: 1\nkind: Overlai\nname: night\nargs: {speed: 0.2 m/s}\n",
    "robots/bot/robot.yaml": "rbx: 1\nkind: Robto\nname: bot\nplaces: {}\n",
    "missions/draft.yaml": "rbx: 1\nkind: Missoin\nname: draft\ndo: recharge\n",
    "missions/one.test.yaml": "rbx: 1\nkind: Tset\nname: one\nmission: patrol\nrobot: ../robots/bot/robot.yaml\n"
    "expect: {outcome: success}\n",
}


@pytest.mark.parametrize("name", MISSPELT)
def test_a_misspelt_kind_is_found_and_fixed(name: str, project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / name).write_text(MISSPELT[name])
    folder = str(Path(name).parent)
    for path in (name, folder) if "test" in name or "robot.yaml" in name else (name,):
        told = output(capsys, path, code=1)
        assert f"error[RBX1304]: {'there' if 'draft' in name else 'this'} is no" in told
        assert f"--> {name}:2:7" in told
    assert f"fixed {name}:2:7: " in output(capsys, "--fix", name, code=0)


DATA = {
    "config/params.yaml": "/**:\n  ros__parameters: {start: 1}\n",
    "lab.yaml": "image: lab.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n",
}
MEANT = {
    "robots/bot/second.yaml": "rbx: 1\nname: second\n",
    "robots/third.yaml": "name: third\ncomponents: {}\n",
    "robots/new/robot.yaml": "a: 1\n",
}


def test_data_in_the_folder_of_a_robot_mean_the_robot(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in DATA.items():
        (project / "robots/bot" / name).parent.mkdir(exist_ok=True)
        (project / "robots/bot" / name).write_text(text)
    paths = [f"robots/bot/{name}" for name in DATA]
    assert len(output(capsys, *paths, "--strict", code=0).splitlines()) == 1
    change(project / ROBOT, "type: charger", "type: chargr")
    assert "chargr" in output(capsys, paths[0], code=1)


@pytest.mark.parametrize("name", MEANT)
def test_a_robot_without_its_kind_is_told(name: str, project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / name).parent.mkdir(exist_ok=True)
    (project / name).write_text(MEANT[name])
    assert "needs the key 'kind'" in output(capsys, name, code=1)


def test_a_robot_that_is_named_twice_is_told_once(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(project / MISSION, "go_to: dock", "go_to: harbour")
    assert "1 error\n" in output(capsys, str(ROBOT), str(ROBOT), str(MISSION), code=1)


def test_what_is_not_there_is_a_finding(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "error[RBX1301]" in output(capsys, "robots/nobody", code=1)
    (project / "empty").mkdir()
    assert "error[RBX1301]" in output(capsys, "empty", code=1)


TEST = "rbx: 1\nkind: Test\nname: {0}\nmission: patrol\nrobot: ../../robots/bot/robot.yaml\nexpect:\n  outcome: {1}\n"


def test_a_folder_of_tests_means_each_of_them(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "missions/tests/more").mkdir(parents=True)
    for name, outcome in (("tests/one", "success"), ("tests/more/two", "sucess")):
        text = TEST.format(name.rsplit("/", 1)[-1], outcome).replace("../../", "../" * (name.count("/") + 1))
        (project / f"missions/{name}.test.yaml").write_text(text)
    told = output(capsys, "missions/tests", code=1)
    assert "missions/tests/more/two.test.yaml:7:12" in told
    assert "1 error" in told
    change(project / "missions/tests/more/two.test.yaml", "sucess", "success")
    assert output(capsys, "missions/tests", code=0).splitlines() == ["the test two is fine", "the test one is fine"]


def test_a_project_means_its_tests_too(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "missions/tests").mkdir()
    (project / "missions/tests/a.test.yaml").write_text(TEST.format("a", "sucess"))
    assert "missions/tests/a.test.yaml:7:12" in output(capsys, ".", code=1)
    assert output(capsys, "robots", code=0).splitlines() == ["turtlebot is fine: 9 components in 3 processes"]


BROKEN = {
    "empty": b"",
    "of another kind": b"rbx: 1\nkind: Mission\nname: bot\n",
    "of a kind that is none": b"rbx: 1\nkind: Cart\n",
    "without a kind": b"rbx: 1\nname: bot\n",
    "in another encoding": "rbx: 1\nkind: Robot\n".encode("utf-16"),
    "a list": b"- rbx: 1\n",
    "a link to nothing": None,
}


@pytest.mark.parametrize("folder", ["robots/other", "robots/on/the/second/floor"])
def test_a_robot_whose_file_is_broken_is_not_passed_over(
    folder: str, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = project / folder / "robot.yaml"
    file.parent.mkdir(parents=True)
    for content in BROKEN.values():
        file.unlink(missing_ok=True)
        if content is None:
            file.symlink_to("nowhere")
        else:
            file.write_bytes(content)
        assert f"{folder}/robot.yaml" in output(capsys, code=1)


def test_a_system_that_has_lost_its_kind_is_not_passed_over(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "systems").mkdir()
    (project / "systems/two.yaml").write_text("rbx: 1\nname: two\n")
    assert "systems/two.yaml" in output(capsys, code=1)


def test_warnings_count_only_under_strict(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(project / ROBOT, "about: Patrols a square", "about: Room #3")
    assert "1 warning" in output(capsys, str(ROBOT), code=0)
    assert "1 warning" in output(capsys, str(ROBOT), "--strict", code=1)


@pytest.mark.parametrize("form", ["json", "sarif"])
def test_a_format_for_programs_is_whole_also_without_findings(
    form: str, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    json.loads(output(capsys, "--format", form, code=0))


def test_fix_cures_what_is_certain_and_leaves_the_rest_of_the_text_alone(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    right = (project / ROBOT).read_text(encoding="utf-8").replace("start: patrol", 'start: "patrol"')
    raw = ("\ufeff" + slip(right.replace('"patrol"', "patrol"))).replace("\n", "\r\n")
    (project / ROBOT).write_bytes(raw.encode())
    told = output(capsys, "--fix", str(ROBOT), code=0)
    assert (project / ROBOT).read_bytes().decode() == ("\ufeff" + right).replace("\n", "\r\n")
    fixed = [line for line in told.splitlines() if line.startswith("fixed ")]
    assert f"fixed {ROBOT}:42:11: 'chargr' -> 'charger'" in fixed
    assert len(fixed) == len(SLIPS)
    assert told.endswith("turtlebot is fine: 9 components in 3 processes\n")


@settings(
    max_examples=max(2, settings().max_examples // 30), suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(wrong=st.sets(st.sampled_from(sorted(SLIPS))), where=st.integers(0, 10**6), comment=st.text("#x ", max_size=5))
def test_fix_changes_only_the_lines_that_are_told(project: Path, wrong: set[str], where: int, comment: str) -> None:
    right = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8").splitlines()
    right.insert(where % len(right), f"# {comment}")
    text = "\n".join(right) + "\n"
    for name in sorted(wrong - {"start: patrol"}):
        text = text.replace(name, SLIPS[name])
    (project / ROBOT).write_text(text, encoding="utf-8")
    assert command.main(["check", "--fix", str(ROBOT)]) == 0
    assert (project / ROBOT).read_text(encoding="utf-8") == "\n".join(right) + "\n"


MISSIONS = {
    "a step without its colon": ("do:\n  - recharge\n    timeout: 9 s\n", "do:\n  - recharge:\n    timeout: 9 s\n"),
    "two steps in one": ("do:\n  - go_to: dock\n    recharge:\n", "do:\n  - go_to: dock\n  - recharge:\n"),
    "three steps in one": (
        "do:\n  - go_to: dock\n    timeout: 9 s\n    recharge:\n    wait: 1 s\n",
        "do:\n  - go_to: dock\n    timeout: 9 s\n  - recharge:\n  - wait: 1 s\n",
    ),
    "tabs": ("do:\n\t- go_to: dock\n\t- recharge\n", "do:\n  - go_to: dock\n  - recharge\n"),
    "a colon in a text": ("about: So: it goes\ndo: recharge\n", 'about: "So: it goes"\ndo: recharge\n'),
    "a kind": ("do:\n  repeet: 2\n  do: recharge\n", "do:\n  repeat: 2\n  do: recharge\n"),
    "a skill": ("do: rechrge\n", "do: recharge\n"),
    "a place in an expression": ("do:\n  - go_to: dok\n", "do:\n  - go_to: dock\n"),
    "a name": ("do:\n  - wait_for: $batery > 9 %\n", "do:\n  - wait_for: $battery > 9 %\n"),
    "a name without its dollar": ("do:\n  - wait_for: battery > 9 %\n", "do:\n  - wait_for: $battery > 9 %\n"),
    "a place with a dollar": ("do:\n  - go_to: $dock\n", "do:\n  - go_to: dock\n"),
    "an item with a dollar": (
        "do:\n  for: $place\n  in: [dock]\n  do:\n    go_to: $place\n",
        "do:\n  for: place\n  in: [dock]\n  do:\n    go_to: $place\n",
    ),
}


LIKE_OTHERS = {"three steps in one", "a skill", "a place with a dollar"}


@pytest.mark.parametrize("name", [*(name for name in MISSIONS if name not in LIKE_OTHERS), *rare(*sorted(LIKE_OTHERS))])
def test_fix_cures_missions(name: str, project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong, right = MISSIONS[name]
    (project / MISSION).write_text(HEAD + wrong, encoding="utf-8")
    told = output(capsys, "--fix", str(ROBOT), code=0)
    assert (project / MISSION).read_text(encoding="utf-8") == HEAD + right, told


LEFT_ALONE = {
    "a key that is written twice": "do: recharge\ndo: recharge\n",
    "a setting that may belong to either step": "do:\n  - go_to: dock\n    recharge:\n    timeout: 9 s\n",
    "tabs beside spaces": "do:\n  - go_to: dock\n\t- recharge\n",
    "a text that goes on": "about: So: it\n  goes\ndo: recharge\n",
    "a place of another number": "do:\n  - go_to: corner_7\n",
}


@pytest.mark.parametrize("name", LEFT_ALONE)
def test_fix_never_guesses(name: str, project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = HEAD + LEFT_ALONE[name]
    (project / MISSION).write_text(text, encoding="utf-8")
    told = output(capsys, "--fix", str(ROBOT), code=1)
    assert (project / MISSION).read_text(encoding="utf-8") == text
    assert "fixed" not in told


def test_fix_never_writes_what_comes_from_the_command_line(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "--set").write_text("start=patrl")
    assert "error" in output(capsys, "--fix", str(ROBOT), "--set", "start=patrl", "--profile", "tird", code=1)
    assert (project / "--set").read_text() == "start=patrl"


def test_fix_never_writes_outside_of_the_project(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(project / ROBOT, "../../missions/patrol.yaml", "rbx:missions/patrol.yaml")
    change(project / ROBOT, "  corner_3:", "  corner3:")
    library = ROOT / MISSION
    before = library.read_bytes()
    told = output(capsys, "--fix", str(ROBOT), code=1)
    assert "did you mean 'corner3'?" in told
    assert "fix" not in told
    assert library.read_bytes() == before


ARBOTIX = "port: /dev/ttyUSB0\njoints:\n\tpan_joint: {id: 1, max_angle: 90}\n"


@pytest.mark.parametrize(
    ("text", "is_written"),
    [
        (ARBOTIX.replace("\t", "  "), False),  # it would get 'rbx: 1' as its first line
        (ARBOTIX, False),  # and spaces for its tabs
        (f"kind: Deployment\n{ARBOTIX}", False),
        ("name: bot\nplaces: {}\n", False),
        ("kind: Robot\nname: bot\nplaces: {}\n", True),
        ("rbx: 1\nkind: Robto\nname: bot\nplaces: {}\n", True),
        ('{kind: Robot, rbx: 1, name: bot, "start": patrol, missions: {patrol: ../../missions/patrl.yaml}}\n', True),
    ],
)
def test_fix_writes_only_files_of_a_kind_that_it_knows(
    text: str, is_written: bool, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ROBOT.write_text(text, encoding="utf-8")
    command.main(["check", "robots/bot", "--fix"])
    assert (ROBOT.read_text(encoding="utf-8") != text) == is_written, capsys.readouterr().out


def test_fix_never_writes_what_ships_with_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    before = (ROOT / "robots/turtlebot/robot.yaml").read_bytes()
    output(capsys, "--fix", "rbx:robots/turtlebot", code=0)
    assert (ROOT / "robots/turtlebot/robot.yaml").read_bytes() == before


def test_a_file_that_changed_meanwhile_is_left_as_it_is(
    project: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    change(project / ROBOT, "type: charger", "type: chargr")

    def meanwhile(found: Iterable[Finding], sources: Sources) -> list[Fix]:
        with (project / ROBOT).open("a") as file:
            file.write("# saved by an editor\n")
        return safe_fixes(found, sources)

    monkeypatch.setattr(fixes, "safe_fixes", meanwhile)
    told = output(capsys, "--fix", str(ROBOT), code=1)
    assert f"left {ROBOT} as it is: it has changed since it was read" in told
    assert "type: chargr" in (project / ROBOT).read_text()


def test_a_file_that_may_not_be_written_is_left_as_it_is(
    project: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    change(project / ROBOT, "type: charger", "type: chargr")
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert f"left {ROBOT} as it is: it is not writable" in output(capsys, "--fix", str(ROBOT), code=1)


def test_what_was_fixed_does_not_stand_in_output_for_programs(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change(project / ROBOT, "type: charger", "type: chargr")
    assert command.main(["check", "--fix", "--format", "json", str(ROBOT)]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out) == []
    assert told.err == f"fixed {ROBOT}:42:11: 'chargr' -> 'charger'\n"


def test_a_file_is_replaced_whole_with_its_mode_and_nothing_is_left_beside_it(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("old")
    file.chmod(0o640)
    replace_file(file, b"new")
    assert (file.read_text(), stat.S_IMODE(file.stat().st_mode)) == ("new", 0o640)
    assert list(tmp_path.iterdir()) == [file]


def test_a_replacement_that_fails_leaves_everything_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("old")

    def refuse(*_: object) -> None:
        raise OSError(28, "no space")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(OSError):
        replace_file(file, b"new")
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]

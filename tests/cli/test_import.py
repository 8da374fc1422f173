"""The command `import`: a manifest on stdout or in a new file, findings on stderr, all of it as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbxcompose.base.plugins import BrokenPluginError
from rbxcompose.commands import main as command
from rbxcompose.commands.importing.importer import PLUGINS

HEAD = "joints: {pan: {id: 1}}\n"
WRONG = "joints: {pan: {id: 1, nuetral: 5}}\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "My-head.yaml").write_text(HEAD)
    (tmp_path / "wrong.yaml").write_text(WRONG)
    return tmp_path


def test_the_manifest_goes_to_stdout_and_findings_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["import", "arbotix", "My-head.yaml"]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("# Made by `rbxcompose import arbotix` from My-head.yaml.\nrbx: 1\nkind: Robot\n")
    assert "\nname: my_head\n" in captured.out
    assert "warning[RBX2234]" in captured.err
    assert "My-head.yaml:1:1" in captured.err


def test_a_new_file_is_written_and_none_is_overwritten(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["import", "arbotix", "My-head.yaml", "--name", "head", "--out", "robots/head/robot.yaml"]
    assert command.main(words) == 0
    assert capsys.readouterr().out == "wrote robots/head/robot.yaml\n"
    made = folder / "robots/head/robot.yaml"
    before = made.read_text()
    assert "\nname: head\n" in before
    assert command.main([*words, "--name", "other"]) == 1
    captured = capsys.readouterr()
    assert "error[RBX9101]: 'robots/head/robot.yaml' already exists" in captured.err
    assert "choose another file with '--out'" in captured.err
    assert captured.out == ""
    assert made.read_text() == before


@pytest.mark.parametrize("target", ["tb", "tb/", "robots/tb", "."])
def test_a_target_without_an_ending_is_a_folder(target: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["import", "arbotix", "My-head.yaml", "-o", target]) == 0
    made = folder / target / "robot.yaml"
    assert capsys.readouterr().out == f"wrote {made.relative_to(folder)}\n"
    assert "\nkind: Robot\n" in made.read_text()


def test_errors_decide_the_exit_code_and_the_rest_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["import", "arbotix", "wrong.yaml", "nowhere.yaml"]) == 1
    captured = capsys.readouterr()
    assert "pan_servo" in captured.out
    assert "error[RBX1001]: unknown key 'nuetral' in joint 'pan'" in captured.err
    assert "did you mean 'neutral'?" in captured.err
    assert "error[RBX1301]: 'nowhere.yaml' does not exist" in captured.err
    assert "--fix" not in captured.err  # which corrects manifests


def test_json_has_the_manifest_and_the_findings(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["import", "arbotix", "My-head.yaml", "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    told = json.loads(captured.out)
    assert "pan_servo" in told["manifest"]
    assert told["file"] is None
    assert [finding["code"] for finding in told["findings"]] == ["RBX2234", "RBX2239"]
    assert command.main(["import", "arbotix", "My-head.yaml", "--json", "--out", "head.yaml"]) == 0
    assert json.loads(capsys.readouterr().out)["file"] == "head.yaml"


def test_a_name_that_no_robot_can_have_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["import", "arbotix", "My-head.yaml", "--name", "My-head"]) == 1
    assert "did you mean 'my_head'?" in capsys.readouterr().err


def test_a_program_that_is_not_known_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        command.main(["import", "arbotics", "My-head.yaml"])
    assert caught.value.code == 2


def test_a_broken_importer_of_another_package_is_told_and_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    load_ours = PLUGINS.load

    def load(name: str) -> bool:
        if name == "lamp":
            raise BrokenPluginError("the importer 'lamp' cannot be used")
        return load_ours(name)

    monkeypatch.setitem(vars(PLUGINS), "third_party", {"lamp": ()})
    monkeypatch.setattr(PLUGINS, "load", load)
    assert command.main(["import", "arbotix", "My-head.yaml"]) == 0
    assert "warning[RBX9302]: the importer 'lamp' cannot be used" in capsys.readouterr().err

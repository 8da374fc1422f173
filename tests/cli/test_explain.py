"""`explain` tells what a code means, with nothing but the package."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from rbxcompose.base.findings import KINDS
from rbxcompose.commands import finding_pages
from rbxcompose.commands import main as command
from rbxcompose.commands.finding_pages import all_kinds


@pytest.mark.parametrize("written", ["RBX1001", "rbx1001", "1001"])
def test_a_code_has_a_page_with_indented_examples(written: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["explain", written]) == 0
    page = capsys.readouterr().out
    assert page.startswith("RBX1001: Unknown key\n(error; keys and values; fix: automatic ('check --fix'))\n")
    assert "\n      max_sped: 0.5 m/s\n" in page
    assert "```" not in page


def test_without_a_code_all_are_listed_by_family(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["explain"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert {line.split()[0] for line in lines if line.startswith("  ")} == set(KINDS)
    assert {"keys and values:", "missions:"} <= set(lines)


def test_an_unknown_code_is_wrong_usage_with_a_hint_of_its_family(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["explain", "RBX1099"]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "there is no code 'RBX1099'; did you mean 'RBX10" in told.err


def test_the_page_that_nobody_has_written_yet_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(finding_pages, "page_folder", lambda: tmp_path)
    assert command.main(["explain", "RBX1001"]) == 1
    missing = tmp_path / "RBX1001.md"
    assert f"RBX1001 has no page: there is no file '{missing}'\n  = help: write it\n" in capsys.readouterr().err


def test_programs_get_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["explain", "--json"]) == 0
    assert [entry["code"] for entry in json.loads(capsys.readouterr().out)] == sorted(all_kinds())
    assert command.main(["explain", "RBX1110", "--json"]) == 0
    page = json.loads(capsys.readouterr().out)
    assert (page["severity"], page["family"], page["is_fixable"]) == ("warning", "YAML", False)


def test_a_page_imports_what_declares_its_code_and_not_the_compiler() -> None:
    script = "import sys; from rbxcompose.commands.main import main; main(['explain', 'RBX1301']); print(*sys.modules)"
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert told.startswith("RBX1301: ")
    assert "rbxcompose.manifest.reader" in told
    assert "rbxcompose.compiler.check_runner" not in told

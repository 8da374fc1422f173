"""The example of an import is what the import makes."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from tests.docs.examples import ROOT, blocks_of
from tests.importing.imports import import_files

PAGE = (ROOT / "docs/how_to.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    return PAGE.partition(f"## {title}\n")[2].partition("\n## ")[0]


def test_the_page_shows_what_the_import_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, _, made = (block.text for block in blocks_of(section("From ArbotiX files to a robot"), "how_to.md"))
    monkeypatch.chdir(tmp_path)
    Path("head.yaml").write_text(old, encoding="utf-8")
    found = import_files([Path("head.yaml")], "head")
    assert found.text.replace("# body:", "body:") == made
    assert not found.report.has_errors


def test_the_page_shows_what_becomes_of_a_launch_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    old, call, made = (block.text for block in blocks_of(section("From a launch file"), "how_to.md"))
    monkeypatch.chdir(tmp_path)
    Path("cart.launch.xml").write_text(old, encoding="utf-8")
    assert command.main(call.split("\n")[0].split()[1:]) == 0
    assert capsys.readouterr().out == made


def test_the_page_shows_what_becomes_of_parameters_of_nav2(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, _, made = (block.text for block in blocks_of(section("From parameters of Nav2 to a robot"), "how_to.md"))
    monkeypatch.chdir(tmp_path)
    Path("nav2_params.yaml").write_text(old, encoding="utf-8")
    found = import_files([Path("nav2_params.yaml")], "nav2_params", "nav2")
    assert (found.text, list(found.report)) == (made, [])

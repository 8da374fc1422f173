"""The page for contributors to the letter: its files pass ruff and mypy, and in a copy of the package they work."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import SEVERAL
from tests.docs.examples import ROOT, blocks_of

pytestmark = pytest.mark.timeout(300)  # mypy without its cache
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
BLOCKS = [block for block in blocks_of(PAGE, "CONTRIBUTING.md") if block.language == "python"]
FILES = {block.words[1]: block.text for block in BLOCKS}
DOMAIN = "rbxcompose/domains/sirens"
SITE = """rbx: 1
kind: Robot
name: site
components:
  base: {type: diff_drive_sim}
sirens:
  front: base
  back: {driver: base, after: [front]}
"""


def run(*words: str, cwd: Path, path: Path) -> str:
    """Return what a Python module or script prints, also if it fails."""
    command = [sys.executable, *(() if words[0] == "-c" else ("-m",)), *words]
    environment = {**os.environ, "PYTHONPATH": str(path), "MYPYPATH": str(path), "NO_COLOR": "1"}
    done = subprocess.run(
        command, cwd=cwd, env=environment, stdout=-1, stderr=subprocess.STDOUT, text=True, check=False
    )
    return done.stdout


def written(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).unlink(missing_ok=True)  # a link to the file of somebody who follows the page
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def linked(there: Path, here: Path, inside: set[str]) -> None:
    """Link what is in a folder, except for those folders in which there are new files: they are made."""
    here.mkdir()
    for path in there.iterdir():
        name = path.relative_to(ROOT).as_posix()
        if any(f"{file}/".startswith(f"{name}/") for file in inside):
            linked(path, here / path.name, inside)
        elif path.name != "__pycache__":
            (here / path.name).symlink_to(path)


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project that has the files of the page."""
    home = tmp_path_factory.mktemp("contributed") / "copy"
    home.mkdir()
    for path in ROOT.iterdir():
        if path.name in ("rbxcompose", "tests"):
            linked(path, home / path.name, {os.path.dirname(file) for file in FILES})
        elif not path.name.startswith("."):
            (home / path.name).symlink_to(path)
    packages = {str(Path(file).parent / "__init__.py"): "" for file in FILES if file.startswith(DOMAIN)}
    return written(home, {**FILES, **packages})


def test_every_block_of_code_is_a_file() -> None:
    assert len(FILES) == len(BLOCKS) == 8


def test_its_code_passes_ruff(tmp_path: Path) -> None:
    written(tmp_path, FILES)
    options = ("--no-cache", "--config", str(ROOT / "pyproject.toml"), ".")
    assert run("ruff", "check", *options, cwd=tmp_path, path=ROOT) == "All checks passed!\n"
    assert (
        run("ruff", "format", "--check", *options, cwd=tmp_path, path=ROOT) == f"{len(FILES)} files already formatted\n"
    )


@pytest.mark.soak
def test_its_code_passes_mypy(tmp_path: Path) -> None:
    """What lies in `rbxcompose` is in `contributed` here, so that mypy uses what it remembers of our package."""
    own = {
        file.replace("rbxcompose/", "contributed/").replace("tests/", "tried/"): text for file, text in FILES.items()
    }
    own = {file: text.replace("rbxcompose.domains.sirens", "contributed.domains.sirens") for file, text in own.items()}
    written(tmp_path, own)
    files = [str(tmp_path / file) for file in own]
    assert run("mypy", *files, cwd=ROOT, path=tmp_path) == f"Success: no issues found in {len(files)} source files\n"


@pytest.fixture(scope="module")
def said(copy: Path) -> list[str]:
    """What commands say of a robot with sirens; last, what pytest says of the tests, in the same process."""
    site = written(copy, {"site/robot.yaml": SITE, "circle/robot.yaml": SITE.replace("[front]", "[back]")}) / "site"
    commands = [["--help"], ["siren"], ["check"], ["check", "../circle"], ["up", "--rate", "max", "--for", "1s"]]
    tests = [file for file in FILES if file.startswith("tests/")]
    script = f"{SEVERAL}import os, pytest\nos.chdir({str(copy)!r})\npytest.main({['-q', '-n', '0', *tests]!r})\n"
    return run("-c", script, json.dumps(commands), cwd=site, path=copy).split("\f")


def test_its_tests_pass(said: list[str]) -> None:
    assert "2 passed" in said[-1]


def test_its_domain_has_a_section_a_component_a_check_and_a_command(said: list[str]) -> None:
    helped, listed, checked, circle, up, _ = said
    assert "List the sirens of a robot" in helped
    assert listed.splitlines()[-2:] == ["front  base", "back   base"]
    assert "'front' needs '/base/alarm', which nothing in the robot provides" in checked
    assert "siren 'back' waits for itself" in circle
    assert "site is up" in up, up

"""The tutorial is walked through as it stands: its commands are run, its files are changed, its output is seen."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from rbxcompose.testing import check_file
from tests.commands import command
from tests.docs.examples import ROOT, Block, blocks_of
from tests.forked import Forked, run_command

PAGE = ROOT / "docs/tutorial.md"
BLOCKS = list(blocks_of(PAGE.read_text(encoding="utf-8"), PAGE.name))
ROBOT = "robots/cart/robot.yaml"
SKIPS = "..."
LONGEST = 60.0  # [s] of a command
NO_PLUGINS = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # of pytest, which a reader has not installed either


def with_section(text: str, section: str) -> str:
    """Return a manifest with a section in the place of the one of its name, or at its end."""
    name = section.partition(":")[0]
    there = re.compile(rf"^{name}:.*\n(?:[ \t]+\S.*\n)*", re.MULTILINE)
    return there.sub(lambda _: section, text) if there.search(text) else f"{text}\n{section}"


def run_script(
    script: Path, words: list[str], environment: dict[str, str], folder: Path
) -> subprocess.CompletedProcess[str]:
    """Run Python with a script, in a process that has imported the package."""
    order, pipe = [sys.executable, str(script), *words], subprocess.PIPE
    with Forked(order, cwd=folder, env=environment, stdin=-3, stdout=pipe, stderr=pipe, text=True) as process:
        out, err = process.communicate(timeout=LONGEST)
    return subprocess.CompletedProcess(order, process.returncode, out, err)


@dataclass
class Reader:
    """Does what the page says, in a folder of its own; `shown` is what was seen since the last text of the page."""

    folder: Path
    shown: str = ""

    def follow(self, block: Block) -> None:
        if block.language == "sh":
            self.run(block)
        elif block.language == "text":
            self.see(block)
        else:
            self.edit(block)

    def run(self, block: Block) -> None:
        if "pip install" in block.text:
            return  # it is installed
        for line in block.text.splitlines():
            done = self.done(line)
            self.shown += done.stdout
            is_refused = "error[RBX" in done.stdout
            assert done.returncode == (1 if is_refused else 0), f"{block}: {done.stdout}{done.stderr}"

    def done(self, line: str) -> subprocess.CompletedProcess[str]:
        """Run a line of the shell; what starts a robot, and what is not ours, has a process."""
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path, "XDG_RUNTIME_DIR": str(self.folder)}
        program, *words = shlex.split(line, comments=True)
        if program == "rbxcompose" and words[0] == "up":
            return run_command(tuple(words), environment, LONGEST, self.folder)
        if program == "rbxcompose":
            return command(*words, environment=environment, folder=self.folder)
        if line.startswith("python -m pytest "):
            return run_script(
                Path(pytest.__file__).with_name("__main__.py"), words[2:], {**environment, **NO_PLUGINS}, self.folder
            )
        return subprocess.run(["bash", "-c", line], cwd=self.folder, env=environment, capture_output=True, text=True)

    def see(self, block: Block) -> None:
        """Find the lines of a block, in their order; what `...` stands for may lie between."""
        at = 0
        for line in block.text.splitlines():
            if line == SKIPS:
                continue
            found = self.shown.find(line, at)
            assert found >= 0, f"{block}: '{line}' does not come in\n{self.shown[at:]}"
            at = found + len(line)
        self.shown = ""

    def edit(self, block: Block) -> None:
        path = self.folder / block.words[1]
        path.write_text(with_section(path.read_text(encoding="utf-8"), block.text), encoding="utf-8")
        codes = check_file(self.folder / ROBOT).codes
        assert codes == ([block.wrong] if block.wrong else []), str(block)


@pytest.mark.timeout(250)
def test_who_follows_the_page_sees_what_it_tells(tmp_path: Path) -> None:
    reader = Reader(tmp_path)
    for block in BLOCKS:
        reader.follow(block)
    assert check_file(tmp_path / ROBOT, profiles=["tired"]).codes == []

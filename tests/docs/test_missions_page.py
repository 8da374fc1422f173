"""The page for authors of missions: who follows it sees what it tells, and no kind of step is left out."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.testing import check_file, run_robot
from tests.docs.examples import ROOT, Block, blocks_of
from tests.forked import run_command

TEXT = (ROOT / "docs/missions.md").read_text(encoding="utf-8")
BLOCKS = list(blocks_of(TEXT, "missions.md"))
ROBOT = Path("robots/cart/robot.yaml")
TRIED = Path("missions/play.yaml")  # in which the page tells its reader to try the examples
ENDS = ("success", "failure", "running")
LONGEST = 500.0  # [s] of robot time
LOW = 45.0  # [s] of robot time: the battery of a robot that begins with little is low once in it
SKIPS = "..."


@dataclass
class Reader:
    """Does what the page says, in a folder of its own, and compares what is shown there with what the page shows."""

    capsys: pytest.CaptureFixture[str]
    shown: str = ""  # by the last commands
    lent: str = ""  # the robot before lines that the page lets its reader take out again after one mission

    def follow(self, block: Block) -> None:
        if block.language == "sh":
            self.shown = "".join(self.run(line) for line in block.text.splitlines())
        elif block.language == "text":
            self.see(block)
        else:
            self.write(block)
            found = check_file(ROBOT)
            assert found.codes == ([block.wrong] if block.wrong else []), f"{block}: {found.text}"
            if "mission" in block.words:
                self.try_out(block)

    def see(self, block: Block) -> None:
        """Find lines in their order; what `...` stands for may lie between."""
        at = 0
        for line in block.text.splitlines():
            if line != SKIPS:
                found = self.shown.find(line, at)
                assert found >= 0, f"{block}: '{line}' does not come in\n{self.shown[at:]}"
                at = found + len(line)

    def run(self, line: str) -> str:
        """Return what a command prints; what is not ours, and `up`, which starts processes, have a process."""
        program, *words = shlex.split(line)
        if program == "rbxcompose" and words[0] != "up":
            command.main(words)
            return self.capsys.readouterr().out
        if program == "rbxcompose":
            environment = {**os.environ, "XDG_RUNTIME_DIR": str(Path.cwd())}
            done = run_command(tuple(words), environment, 60.0, Path.cwd())
        else:
            call = line.replace("PATH_TO_THIS_REPOSITORY", shlex.quote(str(ROOT)))
            done = subprocess.run(["bash", "-c", call], capture_output=True, text=True, check=False)
        is_told = "error: mission play: failure" in done.stdout
        assert done.returncode == 0 or is_told, f"{line}: {done.stdout}{done.stderr}"
        return done.stdout

    def write(self, block: Block) -> None:
        """Write a whole file, or steps below the head of a mission, or lines below a section of the robot."""
        if "robot" in block.words:
            self.lent = ROBOT.read_text(encoding="utf-8")
            section = f"\n{block.text.partition(':')[0]}:\n"
            assert self.lent.count(section) == 1
            ROBOT.write_text(self.lent.replace(section, f"\n{block.text}"), encoding="utf-8")
        elif "mission" in block.words:
            head, about, rest = TRIED.read_text(encoding="utf-8").partition("\nabout:")
            first = rest.partition("\n")[0]
            TRIED.write_text(f"{head}{about}{first}\n{block.text}", encoding="utf-8")
        else:
            path = Path(block.words[1])
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")

    def try_out(self, block: Block) -> None:
        """Let the robot do an example, which ends in success if its fence says nothing else."""
        wanted = next((word for word in block.words if word in ENDS), "success")
        goes_on = wanted == "running"
        sets = ["start=play", *(["battery.initial=31 %"] if goes_on else [])]
        ran = run_robot(check_file(ROBOT, sets=sets).plan, most=LOW if goes_on else LONGEST)
        assert ran.outcome == wanted, f"{block}: {ran.log}"
        if self.lent:
            ROBOT.write_text(self.lent, encoding="utf-8")
            self.lent = ""


@pytest.mark.timeout(250)
def test_who_follows_it_sees_what_it_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All of the page, from its first line to its last, in one folder, as a reader has it."""
    monkeypatch.chdir(tmp_path)
    reader = Reader(capsys)
    for block in BLOCKS:
        reader.follow(block)


def test_every_block_of_the_page_is_one_that_the_walk_knows() -> None:
    """Nothing that is shown goes by untried, as a language that is misspelt would."""
    assert {block.language for block in BLOCKS} == {"sh", "text", "yaml"}
    manifests = [block for block in BLOCKS if block.language == "yaml"]
    assert [str(block) for block in manifests if len(block.words) < 2] == []


def test_the_whole_mission_is_told_line_by_line() -> None:
    """What the table quotes stands in the file, in its order, and nothing that the robot does is left out."""
    mission = (ROOT / "missions/clean_house.yaml").read_text(encoding="utf-8")
    table = TEXT.partition("## 11.")[2].partition("## 12.")[0]
    quoted = [
        piece for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE) for piece in re.findall(r"`(.+?)`", row)
    ]
    assert [piece for piece in quoted if piece not in mission] == []
    body = [line.partition("#")[0].strip(" -") for line in mission.partition("interrupts:")[2].splitlines()]
    words = [line for line in body if line and line != "do:"]
    assert [line for line in words if not any(line in piece for piece in quoted)] == []


def test_every_mission_after_the_book_is_in_its_table() -> None:
    page = (ROOT / "docs/book.md").read_text(encoding="utf-8")
    told = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\|[^|]*\|([^|]*)\|", page, re.MULTILINE))))
    there = {path.stem for path in (ROOT / "missions").glob("*.yaml")}
    assert told == there - {"deliver", "fetch", "haul", "look_around", "random_rooms", "reach_out", "recover", "wave"}

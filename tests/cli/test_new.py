"""The command `new`: what it writes passes `check --strict`, its tests pass, and it runs."""

from __future__ import annotations

import os
import pty
import select
import subprocess
import sys
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.testing import check_file, run_robot
from tests.forked import RBXCOMPOSE, Forked

CART = ["robots/cart/robot.yaml", "missions/cart.yaml", "tests/test_cart.py"]


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_a_robot_a_part_and_a_mission_make_a_project_whose_tests_pass(project: Path) -> None:
    assert command.main(["new", "robot", "cart", "--yes"]) == 0
    assert command.main(["new", "mission", "lap", "--yes"]) == 0
    assert command.main(["new", "part", "pack", "--yes"]) == 0
    assert command.main(["check", "--strict"]) == 0
    (project / "run.py").write_text("import pytest\npytest.main(['-q', '-p', 'no:cacheprovider', 'tests'])\n")
    words = [sys.executable, str(project / "run.py")]
    lean = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # our own plug-ins take longer than its tests
    with Forked(words, stdout=subprocess.PIPE, text=True, env=lean, cwd=project) as process:
        told, _ = process.communicate()
    assert "6 passed" in told, told


def test_what_was_written_is_told_with_what_to_do_next(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["new", "robot", "cart", "--yes"]) == 0
    out = capsys.readouterr().out
    assert [f"wrote {file}" for file in CART] == out.splitlines()[:3]
    assert "  rbxcompose check robots/cart\n" in out


def test_options_say_what_questions_ask(project: Path) -> None:
    words = ["--place", "shelf=3,1", "--place", "door=1 m,-50 cm,90 deg", "--about", "Carries: things"]
    assert command.main(["new", "robot", "cart", *words, "--into", "work", "--yes"]) == 0
    found = check_file(project / "work/robots/cart/robot.yaml")
    assert found.text == ""
    assert found.compilation.robot
    assert list(found.compilation.robot.manifest.places) == ["dock", "shelf", "door"]
    assert found.compilation.robot.manifest.about == "Carries: things"
    assert run_robot(found.plan).outcome == "success"


def test_nothing_is_ever_overwritten(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "missions").mkdir()
    (project / "missions/cart.yaml").write_text("mine")
    assert command.main(["new", "robot", "cart", "--yes"]) == 1
    assert "error[RBX9101]: 'missions/cart.yaml' already exists" in capsys.readouterr().err
    assert files(project) == ["missions/cart.yaml"]


@pytest.mark.parametrize("what", ["robot", "part", "world", "component"])
def test_a_wrong_name_is_a_finding(what: str, project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["new", what, "../Cart", "--yes"]) == 1
    assert "error[RBX9102]" in capsys.readouterr().err
    assert files(project) == []


@pytest.mark.parametrize("words", [["--place", "x"], ["--base", "mux"], ["--about", ""], ["--place", "dock=1,1"]])
def test_so_is_a_wrong_answer(words: list[str], project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["new", "robot", "cart", *words]) == 1
    assert "error[RBX910" in capsys.readouterr().err
    assert files(project) == []


def test_a_mission_is_added_to_the_robot_and_nothing_else_changes(project: Path) -> None:
    command.main(["new", "robot", "cart", "--yes"])
    robot = project / CART[0]
    before = robot.read_bytes()
    assert command.main(["new", "mission", "lap", "--robot", "robots/cart", "--yes"]) == 0
    entry = b"  lap: ../../missions/lap.yaml\n"
    assert robot.read_bytes() == before.replace(b"\nmissions:\n", b"\nmissions:\n" + entry)
    assert check_file(robot).text == ""


def test_or_it_is_told_how(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command.main(["new", "robot", "cart", "--yes"])
    before = (project / CART[0]).read_bytes()
    assert command.main(["new", "mission", "lap", "--no-add", "--yes"]) == 0
    assert (
        "write into robots/cart/robot.yaml:\n  missions:\n    lap: ../../missions/lap.yaml" in capsys.readouterr().out
    )
    assert (project / CART[0]).read_bytes() == before


def test_a_robot_that_is_written_otherwise_is_left_alone(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command.main(["new", "robot", "cart", "--yes"])
    robot = project / CART[0]
    text = robot.read_text().replace(
        "missions:\n  cart: ../../missions/cart.yaml", "missions: {cart: ../../missions/cart.yaml}"
    )
    robot.write_text(text)
    assert command.main(["new", "mission", "lap", "--yes"]) == 0
    assert "it could not be added to robots/cart/robot.yaml safely" in capsys.readouterr().out
    assert robot.read_text() == text


def test_a_mission_needs_one_robot(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["new", "mission", "lap", "--yes"]) == 1
    assert "there is no robot below 'robots/'" in capsys.readouterr().err
    command.main(["new", "robot", "a", "--yes"])
    command.main(["new", "robot", "b", "--yes"])
    assert command.main(["new", "mission", "lap", "--yes"]) == 1
    assert "name it with '--robot': robots/a, robots/b" in capsys.readouterr().err
    assert command.main(["new", "mission", "lap", "--robot", "robots/c"]) == 1
    assert command.main(["new", "mission", "lap", "--robot", "rbx:robots/turtlebot"]) == 1
    assert command.main(["new", "mission", "a", "--robot", "robots/a"]) == 1
    assert "'a' cannot be the name of the mission, it is taken" in capsys.readouterr().err


def test_a_robot_with_mistakes_gets_no_mission(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command.main(["new", "robot", "cart", "--yes"])
    robot = project / CART[0]
    robot.write_text(robot.read_text().replace("max_speed", "max_sped"))
    assert command.main(["new", "mission", "lap", "--yes"]) == 1
    assert "error[RBX1001]" in capsys.readouterr().err
    assert not (project / "missions/lap.yaml").exists()


def test_one_that_cannot_drive_gets_one_that_waits(project: Path) -> None:
    (project / "robots/box").mkdir(parents=True)
    (project / "robots/box/robot.yaml").write_text("rbx: 1\nkind: Robot\nname: box\n")
    assert command.main(["new", "mission", "lap", "--yes"]) == 0
    found = check_file(project / "robots/box/robot.yaml", sets=["start=lap"])
    assert found.text == ""
    assert run_robot(found.plan).outcome == "success"


class Terminal:
    """The command at a terminal of its own."""

    def __init__(self, *words: str) -> None:
        self.ours, theirs = pty.openpty()
        self.process = Forked(
            [*RBXCOMPOSE, *words],
            env=os.environ,
            cwd=Path.cwd(),
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            start_new_session=True,
        )
        os.close(theirs)

    def answer(self, prompt: str, text: str) -> str:
        """Wait for a prompt, write the answer, and return what was shown before."""
        shown = ""
        while not shown.endswith(prompt):
            assert select.select([self.ours], [], [], 15.0)[0], shown
            shown += os.read(self.ours, 4096).decode(errors="replace")
        os.write(self.ours, text.encode())
        return shown

    def end(self) -> tuple[int, str]:
        shown = b""
        while True:
            try:
                piece = os.read(self.ours, 4096)
            except OSError:  # the other end is closed
                break
            if not piece:
                break
            shown += piece
        os.close(self.ours)
        return self.process.wait(15.0), shown.decode(errors="replace")


def test_at_a_terminal_it_asks_and_asks_again_after_a_wrong_answer(project: Path) -> None:
    terminal = Terminal("new", "robot", "cart")
    terminal.answer("when the battery is low.]: ", "\n")
    terminal.answer("[diff_drive_sim]: ", "diff_drive\n")
    assert "did you mean 'diff_drive_sim'?" in terminal.answer("[diff_drive_sim]: ", "\n")
    place = "or nothing to go on: "
    terminal.answer(place, "shelf=3,1\n")
    terminal.answer(place, "shelf=1,1\n")
    assert "it is taken" in terminal.answer(place, "door=1,-1,90 deg\n")
    terminal.answer(place, "\n")
    code, shown = terminal.end()
    assert code == 0, shown
    assert files(project) == sorted(CART)
    found = check_file(project / CART[0])
    assert found.compilation.robot
    assert list(found.compilation.robot.manifest.places) == ["dock", "shelf", "door"]


def test_ctrl_d_ends_the_questions_and_writes_nothing(project: Path) -> None:
    terminal = Terminal("new", "robot", "cart")
    terminal.answer("]: ", "\x04")
    assert terminal.end()[0] == 130
    assert files(project) == []


def test_a_key_that_sends_no_text_is_a_wrong_letter(project: Path) -> None:
    terminal = Terminal("new", "part", "pack")
    terminal.answer("]: ", "")
    os.write(terminal.ours, b"A \xff pack\n")
    code, shown = terminal.end()
    assert code == 0, shown
    assert 'about: "A \N{REPLACEMENT CHARACTER} pack"' in (project / "parts/pack.yaml").read_text(encoding="utf-8")

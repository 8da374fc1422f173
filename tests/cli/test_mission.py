"""`mission` and its verbs on a robot whose executive answers within this process."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rbxcompose.base.requests import Request, as_data, from_data, to_data
from rbxcompose.commands import main as command
from rbxcompose.missions.execution.requests import CancelMission, ListedSnapshot, LookAtMission, ShowPicture
from rbxcompose.missions.view.picture import picture_from_data
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.requests import ReleaseRobot
from rbxcompose.sdk.bound import Outcome
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.mission_view import lines_of
from tests.executive.fake_robot import Robot
from tests.inspection.pictures import undrawn

ROUNDS = """
name: rounds
about: Looks at the corner again and again.
data:
  round: 0
  seen: []
interrupts:
  low:
    when: $battery < 20 %
    do: recharge
machine:
  start: look
  states:
    look:
      do:
        - set:
            round: $round + 1
        - if: $round > 1
          then:
            go_to: corner
            timeout: 30 s
          else:
            name: linger
            wait: 2 s
      next:
        success: report
        failure: failed
    report:
      do:
        say: looked
      next: look
"""
REST = "name: rest\nabout: Rests a while.\ndo:\n  wait: 1 s"


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """A robot in the second round of a mission; `mission` commands and `release` reach it."""
    made = Robot(ROUNDS, rest=REST)
    made.level(80.0)
    made.start()
    made.advance(3.0)

    def ask(folder: RobotFolder, request: Request[Any], *, timeout: float) -> Any:
        if request == ReleaseRobot():
            return "released"
        there = made.mission.requests().from_data(json.loads(json.dumps(as_data(request))))
        return from_data(request.answer_type(), json.loads(json.dumps(to_data(made.mission.handle(there)))))

    monkeypatch.setattr("rbxcompose.commands.lookup.ask", ask)
    monkeypatch.setattr("rbxcompose.commands.lookup.all_folders", lambda: [RobotFolder(tmp_path / "bot")])
    return made


def arrive(robot: Robot) -> None:
    """Be at the corner."""
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)


def told(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    """Return what a command prints, and what it complains about."""
    assert command.main(["mission", *words]) == code
    found = capsys.readouterr()
    return found.out + found.err


def test_each_verb_tells_what_a_person_wants_to_know(
    robot: Robot, capsys: pytest.CaptureFixture[str], golden: Golden
) -> None:
    lines: list[str] = []
    for words, code in (
        ("ls", 0),
        ("status", 0),
        ("watch", 0),
        ("show test", 0),
        ("log rest", 0),
        ("log test", 0),
        ("run rest", 0),
        ("pause test", 0),
        ("ls", 0),
        ("resume test", 0),
        ("cancel test", 0),
        ("ls", 0),
        ("status rest", 0),
        ("pause test", 1),
        ("run rset", 1),
    ):
        lines.append(f"$ mission {words}\n{told(capsys, *words.split(), code=code)}")
        robot.advance(0.0)
    golden.check("mission.txt", "\n".join(lines))
    assert told(capsys) == told(capsys, "ls")


def test_a_release_names_the_resume_only_while_a_mission_is_paused(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = []
    for verb in "pause", "resume":
        assert command.main(["release"]) == 0
        answers.append(capsys.readouterr().out.strip())
        told(capsys, verb, "test")
        robot.advance(0.0)
        assert command.main(["release"]) == 0
        answers.append(capsys.readouterr().out.strip())
    paused = "released; 'mission resume' continues"
    assert answers == ["released", paused, paused, "released"]


@pytest.mark.parametrize("ending", ["mermaid", "dot", "html"])
def test_a_mission_that_runs_is_drawn_with_how_its_nodes_stand(
    ending: str, robot: Robot, capsys: pytest.CaptureFixture[str], golden: Golden
) -> None:
    golden.check(f"mission_live.{ending}", undrawn(told(capsys, "show", "test", "--format", ending)))


def test_the_tree_of_watch_is_coloured_by_status(robot: Robot, golden: Golden) -> None:
    picture = picture_from_data(robot.mission.handle(ShowPicture("test")))
    lines = lines_of(picture, robot.mission.handle(LookAtMission("test")), 60, colour=True)
    golden.check("mission_colours.txt", "".join(f"{line}\n" for line in lines).replace("\x1b", "ESC"))


def test_watch_tells_programs_the_whole_and_then_what_changes(
    robot: Robot, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[Callable[[], object]] = [
        lambda: None,
        lambda: arrive(robot),
        lambda: robot.mission.handle(CancelMission()),
    ]
    step = SimpleNamespace(sleep=lambda seconds: steps.pop(0)())
    monkeypatch.setattr("rbxcompose.tools.mission_view.time", step)  # there alone: other threads sleep, too
    lines = [json.loads(line) for line in told(capsys, "watch", "--json").splitlines()]
    assert [(line["whole"], line["state"]) for line in lines] == [
        (True, "running"),
        (False, "running"),
        (False, "halted"),
    ]
    assert len(lines[1]["statuses"]) < len(lines[0]["statuses"])


def test_a_run_that_did_not_end_is_listed_with_its_time_and_what_can_be_done(
    robot: Robot, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for changed, ways in (("", "'mission resume rest --from-snapshot' goes on with it, "), ("the mission 'rest'", "")):
        left = {"rest": ListedSnapshot("rest", 1_800_000_000.0, "wait", {}, changed)}
        monkeypatch.setattr(robot.mission, "left_over", left.get)
        line = told(capsys, "ls").splitlines()[-1]
        assert re.sub(r"\d", "0", line) == (
            f"a run of rest did not end (0000-00-00 00:00): {ways}'mission forget rest' drops it"
        )


def test_programs_are_answered_in_json(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    assert [entry["state"] for entry in json.loads(told(capsys, "ls", "--json"))] == ["running", "idle"]
    assert json.loads(told(capsys, "status", "--json"))["data"] == {"round": 2, "seen": []}
    assert json.loads(told(capsys, "pause", "--json"))["answer"] == "mission test paused"


def test_a_mission_is_debugged_from_the_command_line(
    robot: Robot, capsys: pytest.CaptureFixture[str], golden: Golden
) -> None:
    lines: list[str] = []
    for words, code in (
        ("break", 0),
        ("break report", 0),
        ("break mission.yaml:18 --mission test", 0),
        ("break repotr", 1),
        ("break", 0),
        ("set round=5", 0),
        ("set round", 1),
        ("force mission.yaml:20 success", 0),
        ("ls", 0),
        ("status test", 0),
        ("step", 0),
        ("force mission.yaml:20 success", 1),
        ("jump look", 0),
        ("jump nowhere", 1),
        ("status test", 0),
        ("break report --clear", 0),
        ("break --clear", 0),
        ("break --clear", 1),
    ):
        lines.append(f"$ mission {words}\n{told(capsys, *words.split(), code=code)}")
        robot.advance(0.0)
    golden.check("debugging.txt", "\n".join(lines))

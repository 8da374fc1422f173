"""What viewers are told of missions: news while somebody watches, from which they know what is there."""

from __future__ import annotations

import pytest

from rbxcompose.base.requests import Command, Refused
from rbxcompose.missions.execution.requests import CancelMission, ListMissions, LookAtAll, PauseMission, RunMission
from rbxcompose.missions.view.replica import Replica, joined
from tests.executive.fake_robot import FakeWindow, Robot

COUNT = """
data:
  round: 0
do:
  repeat: 3
  do:
    - set:
        round: $round + 1
    - wait: 1 s
"""


def watched(robot: Robot) -> FakeWindow:
    window = robot.windows["missions/test"]
    window.is_watched = True
    return window


def test_nothing_is_put_together_while_nobody_watches(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot(COUNT)
    monkeypatch.setattr(
        "rbxcompose.missions.execution.mission_run.Mirror.look", lambda *_: pytest.fail("looked for nobody")
    )
    robot.start()
    robot.advance(10.0)
    assert robot.windows["missions/test"].news == []


def test_news_are_what_changed_and_add_up_to_what_is_there() -> None:
    robot = Robot(COUNT)
    window = watched(robot)
    robot.start()
    robot.advance(10.0)
    known = joined({}, window.news[0])
    for entry in window.news[1:]:
        assert not entry["whole"]
        known = joined(known, entry)
    whole = robot.mission.handle(LookAtAll("test"))
    assert known["state"] == "success"
    own = ("picture", "shown", "whole", "version")
    seen, there = ({key: one for key, one in each.items() if key not in own} for each in (known, whole))
    assert seen == there
    assert [one["data"] for one in window.news[1:4]] == [{"round": 2}, {"round": 3}, {}]
    assert "transitions" not in window.news[1]


def test_who_comes_in_the_middle_hears_what_was_not_told_before() -> None:
    robot = Robot(COUNT)
    robot.start()
    robot.advance(1.5)
    window = watched(robot)
    robot.advance(1.0)
    assert [entry["data"] for entry in window.news] == [{"round": 3}]


@pytest.mark.parametrize(("command", "state"), [(PauseMission(), "paused"), (CancelMission(), "halted")])
def test_what_people_do_is_told_at_once(command: Command, state: str) -> None:
    robot = Robot(COUNT)
    window = watched(robot)
    robot.start()
    robot.mission.handle(command)
    assert window.news[-1]["state"] == state


def test_another_run_begins_with_a_whole() -> None:
    robot = Robot(COUNT)
    window = watched(robot)
    robot.start()
    robot.advance(10.0)
    told = len(window.news)
    robot.mission.handle(RunMission("test"))
    robot.advance(0.0)
    assert window.news[told]["whole"]
    assert window.news[told]["data"] == {"round": 1}


def test_the_whole_has_all_that_a_viewer_needs() -> None:
    robot = Robot(COUNT)
    question = robot.windows["missions/test"].question
    with pytest.raises(Refused, match="has not been running"):
        robot.mission.handle(question)
    robot.start()
    replica = Replica()
    replica.answered({"source": "s", "sequence": 0, "value": robot.mission.handle(question)})
    assert (replica.seen["mission"], replica.seen["state"], replica.seen["data"]) == ("test", "running", {"round": 1})
    assert replica.seen["picture"]["count"] == len(replica.seen["statuses"])
    assert robot.windows["missions"].question == ListMissions()

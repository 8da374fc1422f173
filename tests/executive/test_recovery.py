"""Missions that go on after their process has crashed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.missions.engine.logbook import OtherInterventionError, replay
from rbxcompose.missions.execution.requests import (
    CancelMission,
    ForgetMission,
    ListMissions,
    ListSnapshots,
    PauseMission,
    RestoreMission,
    ResumeMission,
    RunMission,
    SetBreakpoint,
)
from rbxcompose.sdk import Outcome
from rbxcompose.sdk.component import BusAddress
from tests.executive.fake_robot import Robot
from tests.executive.test_live_edits import change, config_of

PATROL = """
data:
  rounds: 0
do:
  repeat: forever
  do:
    - go_to: corner
    - set: {rounds: $rounds + 1}
    - go_to: dock
    - wait: 10 s
"""
FILE = "rbxcompose/snapshots/robot/test.json"


class Real(Robot):
    """A fake robot whose clock is not stepped, as far as its missions can see."""

    def __init__(self, text: str = PATROL, policy: str = "restart", at: float = 0.0, **others: str) -> None:
        self.policy = policy
        super().__init__(text, **others)
        self.mission.config.after_crash["test"] = policy
        self.stepped.advance_to(at)

    @property
    def address(self) -> BusAddress:
        return BusAddress("robot", "tcp/127.0.0.1:7447", 0, "", "jazzy")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def crashed() -> None:
    """Leave behind what a robot does that crashes on its way to the dock."""
    robot = Real()
    robot.start()
    robot.advance(2.0)
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(2.0)
    assert len(robot.go_to.goals) == 2


def goals(robot: Robot) -> list[float]:
    return [goal.request.pose.pose.position.x for goal in robot.go_to.goals]


def state(robot: Robot) -> str:
    return next(one.state for one in robot.mission.handle(ListMissions()) if one.name == "test")


def test_a_snapshot_is_written_once_per_second_at_most_and_only_if_something_changed(folder: Path) -> None:
    robot = Real()
    robot.start()
    first = (folder / FILE).read_bytes()
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.5)
    assert (folder / FILE).read_bytes() == first
    robot.advance(0.5)
    second = (folder / FILE).stat()
    assert json.loads((folder / FILE).read_bytes())["state"]["runs"][0]["data"]["map"]["rounds"] == 1.0
    robot.advance(60.0)
    assert (folder / FILE).stat() == second


def test_a_mission_that_should_continue_goes_on_at_its_leaf() -> None:
    crashed()
    robot = Real(policy="continue", at=1.0)
    robot.start()
    assert (goals(robot), robot.mission.missions.runs["test"].engine.data["rounds"]) == ([0.5], 1.0)
    assert robot.lines == [
        "1 mission test is restored from its snapshot; it goes on as soon as its values have arrived",
        "1 1.1.3 Go to dock",
    ]
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(10.0)
    assert goals(robot) == [0.5, 1.0]


def test_a_mission_that_should_ask_is_paused_until_it_is_resumed() -> None:
    crashed()
    robot = Real(policy="ask")
    robot.start()
    robot.advance(5.0)
    assert (state(robot), goals(robot)) == ("paused", [])
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    assert goals(robot) == [0.5]


def test_a_mission_starts_again_unless_it_says_otherwise_and_can_still_be_restored() -> None:
    crashed()
    robot = Real()
    robot.start()
    assert goals(robot) == [1.0]
    with pytest.raises(Refused, match="mission test is running: cancel it first"):
        robot.mission.handle(RestoreMission())
    robot.mission.handle(CancelMission())
    robot.mission.handle(RestoreMission("test"))
    robot.advance(0.0)
    assert goals(robot) == [1.0, 0.5]


def test_what_a_person_began_goes_on_too() -> None:
    crashed()
    robot = Real(policy="continue")
    robot.mission.handle(RunMission("test", is_repeated=True))
    robot.advance(0.0)
    assert goals(robot) == [0.5]
    robot.mission.handle(CancelMission())
    robot.mission.handle(RunMission("test"))
    robot.advance(0.0)
    assert goals(robot) == [0.5, 1.0]


@pytest.mark.parametrize("end", ["cancel", "brake"])
def test_a_mission_that_has_ended_leaves_no_snapshot(end: str, folder: Path) -> None:
    robot = Real()
    robot.start()
    assert (folder / FILE).exists()
    if end == "cancel":
        robot.mission.handle(CancelMission())
    else:
        robot.mission.brake()
    assert not (folder / FILE).exists()
    with pytest.raises(Refused, match="there is no snapshot"):
        robot.mission.handle(RestoreMission())


def test_a_changed_mission_starts_again_and_says_what_has_changed() -> None:
    crashed()
    robot = Real(PATROL.replace("10 s", "20 s"), policy="continue")
    robot.start()
    assert goals(robot) == [1.0]
    assert robot.lines[0] == (
        "0 mission test cannot go on from its snapshot: the mission '' changed since; it starts again"
    )


def test_a_mission_that_was_changed_while_it_ran_goes_on_at_its_leaf_too() -> None:
    robot = Real()
    robot.start()
    robot.advance(2.0)
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(2.0)
    changed = PATROL.replace("10 s", "20 s")
    assert change(robot, config_of(robot, changed)) == ["mission test goes on where it is"]
    again = Real(changed, policy="continue")
    again.start()
    assert goals(again) == [0.5]


@pytest.mark.parametrize("text", ['{"version": 1', "[]", '{"version": 2}'])
def test_a_broken_snapshot_is_none_and_the_log_says_so(folder: Path, text: str) -> None:
    crashed()
    (folder / FILE).write_text(text)
    robot = Real(policy="continue")
    robot.start()
    assert goals(robot) == [1.0]
    assert [line for line in robot.lines if f"the snapshot '{folder / FILE}' cannot be used: " in line]


def test_a_mission_that_was_stopped_at_a_breakpoint_is_so_again() -> None:
    robot = Real()
    robot.mission.handle(SetBreakpoint("mission.yaml:9"))
    robot.start()
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(2.0)
    assert (state(robot), goals(robot)) == ("paused", [1.0])
    again = Real(policy="continue")
    again.start()
    again.advance(5.0)
    assert (state(again), goals(again)) == ("paused", [])
    again.mission.handle(ResumeMission())
    again.advance(0.0)
    assert goals(again) == [0.5]


def test_a_replay_says_that_it_lacks_the_snapshot() -> None:
    crashed()
    robot = Real(policy="continue")
    robot.start()
    records = [json.loads(json.dumps(record)) for record in robot.mission.missions.since(0).records]
    config = robot.mission.config
    with pytest.raises(OtherInterventionError, match="it goes on from a snapshot, which the log does not hold"):
        replay(records, config.programs["test"], config.names)


def test_a_robot_on_a_stepped_clock_keeps_no_snapshots(folder: Path) -> None:
    robot = Robot(PATROL)
    robot.start()
    robot.advance(5.0)
    assert not list(folder.iterdir())


WATCHFUL = "interrupts:\n  low:\n    when: $battery < 20 %\n    do: {log: low}\n" + PATROL.lstrip()


@pytest.mark.parametrize("how", ["values", "pause", "stop"])
def test_it_goes_on_only_with_its_values_and_unless_it_is_held_meanwhile(how: str) -> None:
    first = Real(WATCHFUL)
    first.start()
    first.level(80.0)
    first.advance(2.0)
    robot = Real(WATCHFUL, policy="continue")
    robot.start()
    robot.advance(5.0)
    assert (state(robot), goals(robot)) == ("paused", [])
    if how == "pause":
        robot.mission.handle(PauseMission())
    elif how == "stop":
        robot.is_stopped = True
        robot.mission.stop()
    robot.level(80.0)
    robot.advance(1.0)
    assert goals(robot) == ([1.0] if how == "values" else [])


def test_a_mission_that_was_paused_stays_paused() -> None:
    first = Real()
    first.start()
    first.advance(2.0)
    first.mission.handle(PauseMission())
    first.advance(2.0)
    robot = Real(policy="continue")
    robot.start()
    robot.advance(1.0)
    assert (state(robot), goals(robot)) == ("paused", [])


def left(robot: Robot) -> list[tuple[str, str, bool]]:
    return [(one.doing, one.changed, one.waits) for one in robot.mission.handle(ListSnapshots())]


def test_people_see_what_did_not_end_until_it_goes_on() -> None:
    crashed()
    robot = Real(policy="ask")
    robot.start()
    assert left(robot) == [("go_to dock", "", True)]
    assert robot.mission.handle(ListSnapshots())[0].at > 1e9
    robot.mission.handle(ResumeMission())
    robot.advance(2.0)
    assert left(robot) == []


def test_a_run_that_was_replaced_by_another_one_can_go_on_once() -> None:
    crashed()
    robot = Real()
    robot.start()
    robot.advance(2.0)
    assert left(robot) == [("go_to dock", "", False)]
    robot.mission.handle(CancelMission())
    robot.mission.handle(RestoreMission())
    robot.advance(2.0)
    assert left(robot) == []
    robot.mission.handle(CancelMission())
    assert left(robot) == []


def test_what_did_not_end_can_be_forgotten(folder: Path) -> None:
    crashed()
    robot = Real()
    robot.start()
    robot.advance(2.0)
    assert robot.mission.handle(ForgetMission()) == "the run of mission test that did not end is forgotten"
    assert left(robot) == []
    assert (folder / FILE).exists()  # that of the run that goes on
    with pytest.raises(Refused, match="there is no snapshot"):
        robot.mission.handle(ForgetMission("test"))
    again = Real()
    assert left(again) == [("go_to corner", "", False)]
    again.mission.handle(ForgetMission("test"))
    assert (left(again), (folder / FILE).exists()) == ([], False)


def test_people_see_what_has_changed_since_and_which_inputs_there_were() -> None:
    crashed()
    robot = Real(PATROL.replace("10 s", "20 s"), policy="ask")
    robot.start()
    assert left(robot) == [("", "the mission ''", False)]
    text = "inputs:\n  place: {type: place}\n  room: {type: text, default: hall}\ndo: {go_to: $place}"
    first = Real(other=text)
    first.mission.handle(RunMission("other", {"place": "corner"}))
    first.advance(2.0)
    again = Real(other=text, policy="ask")
    assert again.mission.handle(ListSnapshots())[-1].inputs == {"place": "corner", "room": "hall"}

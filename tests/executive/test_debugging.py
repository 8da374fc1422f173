"""Breakpoints and other interventions, as people ask a running robot for them."""

from __future__ import annotations

import json
from typing import Any

import pytest

from rbxcompose.base.requests import Command, Refused
from rbxcompose.missions.engine.logbook import INPUTS, OtherInterventionError, replay
from rbxcompose.missions.execution.breakpoints import Breakpoints
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.requests import (
    CancelMission,
    ClearBreakpoints,
    ForceNode,
    JumpMission,
    ListBreakpoints,
    ListData,
    ListMissions,
    ListOutcomes,
    LookAtAll,
    LookAtMission,
    PauseMission,
    ResumeMission,
    RunMission,
    SetBreakpoint,
    SetMissionData,
    ShowPicture,
    StepMission,
)
from rbxcompose.sdk import Outcome
from tests.executive.fake_robot import Robot, program_of
from tests.loops import for_all

PATROL = """
data:
  rounds: 0
  corners: [corner, dock]
  goal: dock
  mode: slow
machine:
  start: away
  states:
    away:
      do:
        - go_to: corner
          timeout: 10 s
        - set: {rounds: $rounds + 1}
      next:
        success: home
        failure: failed
    home:
      do:
        name: go_home
        go_to: dock
      next:
        success: finished
        failure: failed
"""
REST = "name: rest\ndo:\n  - wait: 1 s\n  - {name: nap, wait: 2 s}\n  - log: awake\n"


def robot_at(*requests: Command) -> Robot:
    robot = Robot(PATROL, rest=REST)
    for request in requests:
        robot.mission.handle(request)
    robot.start()
    robot.level(80.0)
    return robot


def arrive(robot: Robot) -> None:
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)


def state(robot: Robot, name: str = "test") -> tuple[str, str]:
    return next((one.state, one.at) for one in robot.mission.handle(ListMissions()) if one.name == name)


def records(robot: Robot) -> list[dict[str, Any]]:
    return [json.loads(json.dumps(record)) for record in robot.mission.missions.since(0).records]


def is_reproducible(robot: Robot) -> bool:
    found = records(robot)
    again = replay(found, robot.mission.config.programs["test"], robot.mission.config.names)
    before = [record for record in found if record["event"] not in INPUTS]
    own = [{key: value for key, value in record.items() if key not in ("mission", "run", "step")} for record in before]
    return bool(own == json.loads(json.dumps(again)))


def test_a_breakpoint_pauses_the_mission_and_says_where() -> None:
    robot = robot_at(SetBreakpoint("go_home"))
    arrive(robot)
    assert state(robot) == ("paused", "mission.yaml:21")
    seen = robot.mission.missions.seen("test")
    assert seen["stopped_at"] == [{"node": 6, "place": "mission.yaml:21", "text": "go_home", "after": ""}]
    assert len(robot.go_to.goals) == 1
    robot.advance(60.0)
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    arrive(robot)
    assert robot.lines[-1] == "60 mission test: success"
    assert "0 stopped at mission.yaml:21, before 1.2.1 go_home: Go to dock" in robot.lines
    assert is_reproducible(robot)


def test_a_timeout_stands_still_while_a_mission_is_stopped_and_what_moved_is_sent_again() -> None:
    robot = robot_at()
    robot.advance(9.0)
    robot.mission.handle(PauseMission())
    robot.mission.handle(StepMission())
    robot.advance(0.5)
    assert len(robot.go_to.goals) == 2
    arrive(robot)
    assert state(robot) == ("paused", "mission.yaml:14")
    robot.advance(60.0)
    robot.mission.handle(StepMission())
    robot.advance(0.0)
    assert state(robot) == ("paused", "mission.yaml:10")
    assert robot.lines[-1] == "69.5 stopped at mission.yaml:10, after 1.1 State away: success, on to home"
    assert is_reproducible(robot)


def test_a_breakpoint_stays_for_the_next_run_and_over_a_crash_until_it_is_cleared() -> None:
    robot = robot_at(SetBreakpoint("mission.yaml:14"))
    arrive(robot)
    robot.mission.handle(CancelMission())
    robot.mission.handle(RunMission("test", is_repeated=True))
    robot.advance(0.0)
    arrive(robot)
    assert state(robot) == ("paused", "mission.yaml:14")
    assert robot.repeated == (SetBreakpoint("mission.yaml:14", "test"), RunMission("test", is_repeated=True))
    other = robot_at(*robot.repeated[:1])
    arrive(other)
    assert state(other) == ("paused", "mission.yaml:14")
    other.mission.handle(ClearBreakpoints("mission.yaml:14"))
    assert other.repeated == ()
    assert other.mission.handle(ListBreakpoints()) == ()
    assert state(other)[0] == "paused"
    other.mission.handle(ResumeMission())
    other.advance(0.0)
    assert len(other.go_to.goals) == 2


def test_a_mission_that_is_stopped_stops_no_other() -> None:
    robot = robot_at(SetBreakpoint("go_home"))
    robot.mission.handle(RunMission("rest"))
    arrive(robot)
    robot.advance(5.0)
    assert state(robot)[0] == "paused"
    assert state(robot, "rest")[0] == "success"


def test_breakpoints_are_listed_with_what_is_there() -> None:
    robot = robot_at(SetBreakpoint("away->home"), SetBreakpoint("nap"))
    listed = robot.mission.handle(ListBreakpoints())
    assert [(one.mission, one.place, one.text) for one in listed] == [
        ("test", "mission.yaml:16", "away->home"),
        ("rest", "mission.yaml:4", "nap"),
    ]


def test_all_that_people_do_is_told_and_a_replay_repeats_it() -> None:
    robot = robot_at()
    robot.mission.handle(SetMissionData({"rounds": "3", "corners": "[dock]", "mode": "fast"}))
    robot.mission.handle(ForceNode("mission.yaml:12", "success"))
    robot.advance(0.0)
    robot.mission.handle(JumpMission("away"))
    robot.advance(0.5)
    robot.mission.handle(ForceNode("away", "failure"))
    robot.advance(0.0)
    run = robot.mission.missions.runs["test"]
    assert run.engine.data == {"rounds": 4.0, "corners": ["dock"], "goal": "dock", "mode": "fast"}
    assert [line for line in robot.lines if "by hand" in line] == [
        "0 by hand: rounds = 3; the run cannot be reproduced without this",
        "0 by hand: corners = dock; the run cannot be reproduced without this",
        "0 by hand: mode = fast; the run cannot be reproduced without this",
        "0 by hand: mission.yaml:12, go_to corner ends in success; the run cannot be reproduced without this",
        "0 go_to corner: halted (0 s): ended by hand",
        "0 by hand: mission.yaml:7, jump to state away; the run cannot be reproduced without this",
        "0 go_to dock: halted (0 s): ended by hand",
        "0.5 by hand: mission.yaml:10, away ends in failure; the run cannot be reproduced without this",
        "0.5 go_to corner: halted (0.5 s): ended by hand",
        "0.5 mission test: failure: mission.yaml:10: ended by hand",
    ]
    assert is_reproducible(robot)


def test_a_replay_says_what_a_changed_mission_cannot_repeat() -> None:
    robot = robot_at()
    robot.mission.handle(SetMissionData({"rounds": "3"}))
    changed = Robot(PATROL.replace("rounds", "laps")).mission.config
    with pytest.raises(OtherInterventionError, match="the mission has no data 'rounds'"):
        replay(records(robot), changed.programs["test"], changed.names)


@for_all(
    "request_, reason",
    [
        (SetBreakpoint("go_hone"), r"there is no 'go_hone'; did you mean 'go_home'\?"),
        (SetBreakpoint("mission.yaml:99"), "nothing begins in line 99 of 'mission.yaml'"),
        (SetBreakpoint("go_home", "tset"), "the robot has no mission 'tset'"),
        (ClearBreakpoints("go_home"), "there is no breakpoint at 'go_home'"),
        (StepMission("rest"), "mission rest is not running"),
        (ForceNode("nap", "success", "rest"), "mission rest is not running"),
        (ForceNode("go_home", "success"), "'go_home' does not run now"),
        (ForceNode("away", "lost"), "away at mission.yaml:10 cannot end in 'lost'; it may end in: success, failure"),
        (SetMissionData({"rounds": "many"}), "'rounds' must be a whole number"),
        (SetMissionData({"round": "1"}), "the mission has no data 'round'; did you mean 'rounds'"),
        (
            SetMissionData({"mode": "fast", "corners": "[1, 2]"}),
            "'corners' must be a list, each a text; this is a list, each a count",
        ),
        (JumpMission("hom"), "there is no state 'hom'; did you mean 'home'"),
    ],
)
def test_what_cannot_be_done_is_refused_and_the_mission_is_unharmed(request_: Command, reason: str) -> None:
    robot = robot_at()
    with pytest.raises(Refused, match=reason):
        robot.mission.handle(request_)
    arrive(robot)
    arrive(robot)
    assert robot.lines[-1] == "0 mission test: success"
    assert robot.mission.missions.runs["test"].engine.data["mode"] == "slow"
    assert is_reproducible(robot)


def test_there_is_no_state_to_leave_where_no_machine_runs() -> None:
    robot = Robot(REST.replace("name: rest\n", ""))
    robot.start()
    with pytest.raises(Refused, match="no machine runs now"):
        robot.mission.handle(JumpMission("home"))


def test_nothing_can_be_done_to_a_mission_that_has_not_begun() -> None:
    robot = Robot("do:\n  wait_for: $battery > 10 %\n")
    robot.start()
    with pytest.raises(Refused, match="mission test has not begun"):
        robot.mission.handle(StepMission())


def test_a_viewer_sees_where_breakpoints_are_and_sets_them_by_the_numbers_that_it_sees() -> None:
    robot = robot_at(SetBreakpoint("6", "test"), SetBreakpoint("1->home", "test"), SetBreakpoint("mission.yaml:14"))
    listed = robot.mission.handle(ListBreakpoints())
    assert [(one.where, one.spots) for one in listed] == [
        ("6", ((6, None),)),
        ("1->home", ((1, "success"),)),
        ("mission.yaml:14", ((4, None),)),
    ]


def test_a_viewer_sees_on_which_side_of_a_node_a_mission_was_stopped_and_how_often_people_changed_it() -> None:
    robot = robot_at(SetBreakpoint("away->home"))
    robot.mission.handle(SetMissionData({"rounds": "3", "mode": "fast"}))
    arrive(robot)
    seen = robot.mission.missions.seen("test")
    assert seen["stopped_at"] == [{"node": 1, "place": "mission.yaml:10", "text": "away", "after": "success"}]
    assert seen["by_hand"] == 2


def test_a_viewer_sees_how_nodes_may_be_forced_to_end_and_where_breakpoints_may_be_before_the_first_run() -> None:
    robot = robot_at()
    assert robot.mission.handle(ListOutcomes("test"))["3"] == ("success", "failure")
    assert robot.mission.handle(ShowPicture("rest"))["count"] == 4
    with pytest.raises(Refused, match="mission rest is not running"):
        robot.mission.handle(ListOutcomes("rest"))


def test_what_is_listed_of_the_data_can_be_written_back() -> None:
    text = PATROL.replace("mode: slow", "mode: slow\n  left: 25 %\n  seen: {hall: 2 m, kitchen: 30 cm}\n  said: 'a: b'")
    robot = Robot(text)
    robot.start()
    before = dict(robot.mission.missions.runs["test"].engine.data)
    listed = robot.mission.handle(ListData("test"))
    given = {one.name: one.text for one in listed if one.text is not None}
    assert given == {
        "rounds": "0",
        "corners": "[corner, dock]",
        "goal": "dock",
        "mode": "slow",
        "left": "25 %",
        "seen": "{hall: 2 m, kitchen: 0.3 m}",
        "said": "a: b",
    }
    robot.mission.handle(SetMissionData(given))
    assert robot.mission.missions.runs["test"].engine.data == before
    for look in (LookAtMission("test"), LookAtAll("test")):
        shown = robot.mission.handle(look)["shown"]
        assert (shown["left"], shown["seen"]) == ("25 %", "hall: 2 m, kitchen: 0.3 m")


@pytest.mark.parametrize("text", ["1e30", "99999999999999999999", "1e15"])
def test_a_count_cannot_be_set_to_what_expressions_refuse(text: str) -> None:
    robot = Robot(PATROL)
    robot.start()
    with pytest.raises(Refused, match="'rounds' must be below 1e15"):
        robot.mission.handle(SetMissionData({"rounds": text}))


def test_data_keep_their_types_within_lists_and_maps_and_places_stay_places() -> None:
    robot = Robot(
        "data: {seen: {hall: 2 m}, stops: [dock], goal: corner, said: [a]}\n"
        "do: [{for: stop, in: $stops, do: {go_to: $stop}}, {go_to: $goal}]"
    )
    robot.start()
    abouts = {one.name: one.about for one in robot.mission.handle(ListData("test"))}
    assert (abouts["goal"], abouts["said"]) == ("a place", "a list, each a text")
    for name, text, reason in (
        ("seen", "{hall: 5 s}", "'seen' must be a map, each a length; this is a map, each a time"),
        ("stops", "[3]", "'stops' must be a list, each a text; this is a list, each a count"),
        ("stops", "[dock, nowhere]", "there is no place 'nowhere'"),
        ("goal", "nowhere", "there is no place 'nowhere'"),
    ):
        with pytest.raises(Refused, match=reason):
            robot.mission.handle(SetMissionData({name: text}))
    robot.mission.handle(SetMissionData({"seen": "{bath: 1 cm}", "stops": "[corner]", "said": "[nowhere]"}))


@pytest.mark.parametrize(
    ("where", "reason"),
    [
        ("missions/rest.yaml:1", "nothing begins in line 1 of 'missions/rest.yaml'; lines near it are 3, 4, 5"),
        ("missions/none.yaml:1", "no node of a mission in 'missions/none.yaml'; its files: missions/patrol.yaml, "),
    ],
)
def test_a_line_in_which_nothing_begins_is_refused_by_the_mission_of_its_file_whatever_runs(
    where: str, reason: str
) -> None:
    texts = {"patrol": PATROL, "rest": REST}
    programs = {name: program_of(text, f"missions/{name}.yaml") for name, text in texts.items()}
    for active in [], ["patrol"]:
        with pytest.raises(Refused, match=reason):
            Breakpoints(MissionConfig(programs=programs)).add(where, "", active)

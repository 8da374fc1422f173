"""Triggers of a robot that runs: from the manifest to the missions that they start, in virtual time."""

from __future__ import annotations

import textwrap
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.requests import CancelMission, ListMissions, ListTriggers, ResumeMission, RunMission
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.msgs.std_msgs import Bool, Empty, Float32
from rbxcompose.sdk import Component, Config, ServesAction, component
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, check_text
from tests.loops import for_all

DAY = 86400.0


@component("toy_worker")
class Worker(Component[Config]):
    """Works until it is cancelled."""

    work = ServesAction(Recharge, "work", claims="base")
    rate = 10.0

    def step(self, dt: float) -> None:
        goal = self.bound["work"].current
        if goal is not None and goal.cancel_requested:
            goal.canceled()


ROBOT = """
rbx: 1
kind: Robot
name: one
components:
  worker: {type: toy_worker}
places:
  dock: {x: 1 m, y: 0 m}
values:
  battery: {topic: level, unit: "%", type: ratio}
  door: {topic: door, type: flag, event: true}
missions:
  clean: clean.yaml
  home: home.yaml
  greet: greet.yaml
  fail: fail.yaml
"""
MISSIONS = {
    "clean": "do: work",
    "home": "do: work",
    "greet": "inputs: {times: {type: count, default: 1}}\ndo: [{log: Hello $times}, {wait: 10 s}]",
    "fail": "do: [{wait: 1 s}, {end: failure}]",
}


class Triggered:
    """A robot with triggers, that runs; or its executive alone, which takes less time for weeks."""

    def __init__(self, folder: Path, triggers: str, more: str = "", *, is_alone: bool = False) -> None:
        others = {f"{name}.yaml": f"rbx: 1\nkind: Mission\nname: {name}\n{text}\n" for name, text in MISSIONS.items()}
        text = f"{ROBOT.lstrip()}{more}triggers:\n{textwrap.indent(textwrap.dedent(triggers).strip(), '  ')}\n"
        checked = check_text(text, folder, others=others)
        assert not checked.compilation.report.has_errors, checked.text
        executive = [one for one in checked.plan.instances if one.name == "mission"]
        self.bench = Bench(*executive) if is_alone else Bench(plan=checked.plan)

    @property
    def running(self) -> list[str]:
        listed = self.bench.component("mission").handle(ListMissions())
        return [one.name for one in listed if one.state in ("running", "paused")]

    @property
    def told(self) -> list[str]:
        return [f"{one.time:g} {one.text}" for one in self.bench.records if one.source == "mission"]

    def ask(self, request: RunMission | CancelMission | ResumeMission) -> None:
        self.bench.component("mission").handle(request)
        self.bench.advance(0.0)

    def battery(self, percent: float) -> None:
        self.bench.publish("level", Float32(data=percent))
        self.bench.advance(2.0)


@pytest.mark.timeout(100)
def test_a_time_of_day_starts_a_mission_on_its_days_and_the_list_has_the_next_and_the_last_one(tmp_path: Path) -> None:
    nightly = 'nightly: {at: "00:10", on: [thu, fri], mission: greet, with: {times: 2}}'
    robot = Triggered(tmp_path, nightly, is_alone=True)
    for day in (0.0, DAY):  # the first day of virtual time is a Thursday
        robot.bench.clock.advance_to(day + 500)
        robot.bench.advance(400)
    begun = [float(line.split()[0]) for line in robot.told if "starts" in line]
    assert begun == [600, DAY + 600]
    assert robot.told[:2] == ["600 trigger nightly (at 00:10 on thu, fri) starts mission greet", "600 Hello 2"]
    [listed] = robot.bench.component("mission").handle(ListTriggers())
    assert (listed.next, listed.last) == ("Thu 1970-01-08 00:10", "Fri 1970-01-02 00:10")


def test_the_list_has_what_came_of_the_last_time_and_why_one_is_off(tmp_path: Path) -> None:
    triggers = """
    empty: {when: $battery < 15 %, mission: home}
    begin: {at_start: true, mission: clean}
    after: {ends: clean, mission: greet, running: queue}
    """
    robot = Triggered(tmp_path, triggers, is_alone=True)
    robot.bench.advance(1.0)
    robot.battery(10.0)
    mission = robot.bench.component("mission")
    assert [(one.came, one.off) for one in mission.handle(ListTriggers())] == [
        ("not started: mission clean is in the way", ""),
        ("mission clean started", ""),
        ("", ""),
    ]
    assert mission.handle(ListTriggers())[0].fired == "Thu 1970-01-01 00:00"
    robot.bench.host.stop()
    assert mission.handle(ListTriggers())[0].off == "the robot is stopped"


def test_a_value_starts_one_that_interrupts_and_the_other_does_not_go_on(tmp_path: Path) -> None:
    robot = Triggered(
        tmp_path, "empty: {when: $battery < 15 %, mission: home, priority: 10, running: interrupt}", "start: clean\n"
    )
    robot.battery(50.0)
    assert robot.running == ["clean"]
    robot.battery(14.0)
    assert robot.running == ["home"]
    robot.battery(13.0)  # no edge
    robot.ask(CancelMission("home"))
    robot.battery(12.0)
    assert robot.running == []
    robot.battery(40.0)
    robot.battery(10.0)
    assert robot.running == ["home"]
    assert "2 trigger empty ends mission clean" in robot.told


def test_a_message_and_an_event_start_one_each_time(tmp_path: Path) -> None:
    robot = Triggered(
        tmp_path,
        """
        visitor: {message: door_bell, type: std_msgs/Empty, mission: greet}
        opened: {when: $door, mission: fail}
        """,
    )
    for _ in range(2):
        robot.bench.publish("door_bell", Empty(), Qos.EVENT)
        robot.bench.publish("door", Bool(data=True))
        assert robot.running == ["greet", "fail"]
        robot.bench.advance(20.0)
        assert robot.running == []


def test_the_start_and_the_end_of_a_mission_start_others(tmp_path: Path) -> None:
    robot = Triggered(
        tmp_path,
        """
        morning: {at_start: true, mission: fail}
        after: {ends: fail, outcome: failure, mission: greet}
        never: {ends: fail, outcome: success, mission: clean}
        """,
    )
    assert robot.running == ["fail"]
    robot.bench.advance(2.0)
    assert robot.running == ["greet"]


def test_one_that_queues_starts_when_the_other_has_ended(tmp_path: Path) -> None:
    robot = Triggered(
        tmp_path, "visitor: {message: door_bell, type: std_msgs/Empty, mission: home, running: queue}", "start: clean\n"
    )
    robot.bench.publish("door_bell", Empty(), Qos.EVENT)
    assert robot.running == ["clean"]
    [listed] = robot.bench.component("mission").handle(ListTriggers())
    assert listed.waits
    robot.ask(CancelMission("clean"))
    assert robot.running == ["home"]


def test_after_a_stop_nothing_starts_late(tmp_path: Path) -> None:
    robot = Triggered(
        tmp_path,
        """
        daily: {at: "00:10", mission: greet}
        empty: {when: $battery < 15 %, mission: home}
        """,
    )
    robot.bench.host.stop()
    robot.battery(10.0)
    robot.bench.advance(700.0)
    robot.bench.host.release()
    robot.battery(9.0)
    assert robot.running == []
    robot.battery(30.0)
    robot.battery(9.0)
    assert robot.running == ["home"]
    assert [line.partition(" ")[2] for line in robot.told if "does not start" in line] == [
        "trigger empty does not start mission home: the robot is stopped",
        "trigger daily does not start mission greet: the robot is stopped",
    ]


def test_after_a_release_a_paused_mission_is_in_the_way_like_one_that_runs(tmp_path: Path) -> None:
    robot = Triggered(tmp_path, "visitor: {message: door_bell, type: std_msgs/Empty, mission: home}", "start: clean\n")
    robot.bench.host.stop()
    robot.bench.host.release()
    robot.bench.publish("door_bell", Empty(), Qos.EVENT)
    assert robot.running == ["clean"]
    robot.ask(ResumeMission("clean"))
    assert robot.told[-3:] == [
        "0 trigger visitor does not start mission home: mission clean is in the way",
        "0 mission clean resumed",
        "0 1 Work",
    ]


@for_all(
    "trigger, reason",
    [
        ("{mission: home}", "needs one of at, cron, when, message, at_start, ends"),
        ('{at: "22:00", at_start: true, mission: home}', "it has 'at' and 'at_start'"),
        ("{at_start: true, on: [mon], mission: home}", "has 'on', which belongs to 'at'"),
        ('{at: "22:00", on: [], mission: home}', "'on' must have at least 1 entry"),
        ('{at: "25:00", mission: home}', "must be a time of day"),
        ("{cron: 0 22 * *, mission: home}", "must have 5 fields"),
        ("{when: $battery < 15 s, mission: home}", "RBX4106"),
        ("{when: $battery <, mission: home}", "RBX4111"),
        ('{at: "22:00", mission: greet, with: {times: many}}', "RBX4113"),
        ('{at: "22:00", mission: greet, with: {times: [1]}}', "a trigger cannot give the input 'times' a list"),
        ("{message: bell, type: std_msgs/Emty, mission: home}", "RBX4193"),
    ],
)
def test_what_is_wrong_with_a_trigger_is_told(tmp_path: Path, trigger: str, reason: str) -> None:
    with pytest.raises(AssertionError, match=reason):
        Triggered(tmp_path, f"wrong: {trigger}")


def test_a_condition_reads_back_as_it_was_written(tmp_path: Path) -> None:
    from rbxcompose.compiler.composition.dump import dump_robot

    text = ROBOT.lstrip() + "triggers:\n  empty: {when: $battery < 15 %, mission: home}\n"
    others = {f"{name}.yaml": f"rbx: 1\nkind: Mission\nname: {name}\n{one}\n" for name, one in MISSIONS.items()}
    robot = check_text(text, tmp_path, others=others).compilation.robot
    assert robot is not None
    assert 'when: "$battery < 15 %"' in dump_robot(robot.manifest)


AGAIN = """
begin: {at_start: true, mission: greet}
empty: {when: $battery < 15 %, mission: home}
"""


def starts(robot: Triggered) -> list[str]:
    return [text.split()[2] for text in robot.told if " starts mission " in text]


def low(robot: Triggered) -> None:
    robot.bench.advance(20.0)
    robot.battery(10.0)
    assert starts(robot) == ["begin", "empty"]
    robot.ask(CancelMission("home"))


def test_an_executive_that_failed_does_not_start_again_what_it_had_started(tmp_path: Path) -> None:
    robot = Triggered(tmp_path, AGAIN)
    low(robot)
    robot.bench.host.failed("mission", RuntimeError("broken"))
    robot.bench.advance(5.0)
    robot.battery(10.0)
    assert starts(robot) == ["begin", "empty"]
    robot.battery(30.0)
    robot.battery(10.0)
    assert starts(robot) == ["begin", "empty", "empty"]


def test_an_executive_that_replaces_another_one_starts_only_what_is_new(tmp_path: Path) -> None:
    robot = Triggered(tmp_path, AGAIN)
    low(robot)
    hosted = robot.bench.host.hosted["mission"].instance
    config = hosted.config
    assert isinstance(config, MissionConfig)
    empty = config.triggers["empty"]
    more = {**config.triggers, "other": replace(empty, name="other", mission="greet", cause="another one")}
    made = replace(hosted, config=config.model_copy(update={"triggers": more}))
    robot.bench.host.prepare([made])
    robot.bench.host.activate(["mission"])
    robot.bench.advance(1.0)
    assert starts(robot) == ["begin", "empty"]
    robot.battery(10.0)
    assert starts(robot) == ["begin", "empty", "other"]
    listed = {one.name: one.came for one in robot.bench.component("mission").handle(ListTriggers())}
    assert [listed[name] for name in ("begin", "empty", "other")] == [
        "mission greet started",
        "mission home started",
        "mission greet started",
    ]

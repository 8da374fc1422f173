"""Skills that are topics, on whole robots in virtual time: how orders end, are given up, get lost and come back."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

from rbxcompose.missions.execution.requests import CancelMission, PauseMission, ResumeMission
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.sdk.component import MissionOver
from rbxcompose.testing import Bench, check_text
from tests.executive.toy_gripper import GripEnd, Gripper

ROBOT = """
rbx: 1
kind: Robot
name: hand
components:
  gripper: {type: toy_gripper}
missions: {test: test.yaml}
start: test
"""
Make = Callable[..., "Hand"]


class Hand:
    """A robot with a gripper that runs a mission."""

    def __init__(self, folder: Path, mission: str, robot: str = ROBOT) -> None:
        text = f"rbx: 1\nkind: Mission\nname: test\n{textwrap.dedent(mission)}"
        found = check_text(robot, folder, others={"test.yaml": text})
        assert not found.compilation.report.has_errors, found.text
        self.bench, self._folder = Bench(plan=found.plan), folder

    @property
    def gripper(self) -> Gripper:
        """Return the component that runs now."""
        made = self.bench.component("gripper")
        assert isinstance(made, Gripper)
        return made

    @property
    def lines(self) -> list[str]:
        """Return what the executive logged, with the time."""
        return [f"{record.time:.1f} {record.text}" for record in self.bench.records if record.source == "mission"]

    @property
    def end(self) -> str:
        """Return how the last mission ended, with the reason; empty while it runs."""
        ends = [event for event in self.bench.events if isinstance(event, MissionOver)]
        return f"{ends[-1].outcome} {ends[-1].message}".strip().replace(f"{self._folder}/", "") if ends else ""

    def lose_gripper(self) -> None:
        """Have the gripper's process die."""
        self.bench.host.hosted["gripper"].close()

    def bring_gripper_back(self) -> None:
        """Start it again, in the state of one that was never used."""
        self.bench.host.hosted["gripper"].configure()
        self.bench.host.hosted["gripper"].activate()


@pytest.fixture
def make(tmp_path: Path) -> Make:
    return lambda mission, robot=ROBOT: Hand(tmp_path, mission, robot)


@pytest.mark.parametrize(
    ("width", "end"),
    [
        ("0.02", "success"),
        ("0", "failure test.yaml:5: empty"),
        ("0.1", "failure test.yaml:5: too wide"),
        ("0.2", "failure test.yaml:5: the skill 'grip' ended with an outcome that it does not declare: 'slippery'"),
    ],
    ids=["success", "outcome", "failure", "undeclared"],
)
def test_an_order_ends_as_the_message_tells(make: Make, width: str, end: str) -> None:
    hand = make(f"do:\n  grip: {width}")
    hand.bench.advance(0.9)
    assert hand.end == ""
    hand.bench.advance(0.2)
    assert hand.end == end
    assert hand.gripper.heard == [f"0.0 grip {float(width):g}"]


def test_what_an_end_tells_can_be_kept(make: Make) -> None:
    hand = make("do:\n  - grip: 0.02\n    save: found\n  - log: with $found.force N")
    hand.bench.advance(2.0)
    assert [line for line in hand.lines if "with" in line] == ["1.0 with 5 N"]


def test_an_order_without_an_end_has_succeeded_once_it_was_sent(make: Make) -> None:
    hand = make("do:\n  - beep: hello\n  - beep:\n      data: again")
    hand.bench.advance(0.0)
    assert hand.end == "success"
    assert hand.gripper.heard == ["0.0 beep hello", "0.0 beep again"]


def test_topics_follow_their_wires(make: Make) -> None:
    wires = "connect: {grip: left/grip, gripped: left/ended, let_go: left/halt}"
    hand = make("do:\n  grip: 0.02\n  timeout: 0.5 s", ROBOT.replace("toy_gripper", f"toy_gripper, {wires}"))
    hand.bench.advance(2.0)
    assert hand.gripper.heard == ["0.0 grip 0.02", "0.5 halt"]
    wired = {
        wire.topic for instance in hand.bench.plan.instances for wire in instance.wires if instance.name == "mission"
    }
    assert {"/left/grip", "/left/ended", "/left/halt"} <= wired


def test_two_runs_are_the_same(make: Make) -> None:
    def run() -> list[str]:
        hand = make(
            "do:\n  repeat: 3\n  do:\n    - grip: 0.02\n      timeout: 0.7 s\n      attempts: 2\n    - beep: hello"
        )
        hand.bench.advance(10.0)
        return [*hand.lines, *hand.gripper.heard]

    assert run() == run()


# Orders that are given up


def test_a_deadline_gives_the_order_up(make: Make) -> None:
    hand = make("do:\n  fallback:\n    - grip: 0.02\n      timeout: 0.4 s\n    - beep: late")
    hand.bench.advance(2.0)
    assert hand.gripper.heard == ["0.0 grip 0.02", "0.4 halt", "0.4 beep late"]
    assert hand.end == "success"


def test_a_pause_gives_it_up_and_the_resume_sends_it_again(make: Make) -> None:
    hand = make("do:\n  grip: 0.02")
    hand.bench.advance(0.5)
    hand.bench.host.ask("mission", PauseMission())
    hand.bench.advance(4.5)
    assert hand.end == ""
    hand.bench.host.ask("mission", ResumeMission())
    hand.bench.advance(1.1)
    assert hand.gripper.heard == ["0.0 grip 0.02", "0.5 halt", "5.0 grip 0.02"]
    assert hand.end == "success"


def test_a_stop_of_the_robot_is_a_pause(make: Make) -> None:
    hand = make("do:\n  grip: 0.02")
    hand.bench.advance(0.5)
    hand.bench.host.stop()
    hand.bench.advance(2.5)
    assert hand.gripper.heard == ["0.0 grip 0.02", "0.5 halt"]
    hand.bench.host.release()
    hand.bench.host.ask("mission", ResumeMission())
    hand.bench.advance(1.1)
    assert hand.gripper.heard[2:] == ["3.0 grip 0.02"]
    assert hand.end == "success"


def test_a_robot_that_is_stopped_takes_no_order_that_claims_a_part_of_it(make: Make) -> None:
    hand = make("do:\n  wait: 1 s")
    hand.bench.host.stop()
    hand.bench.publish("grip", Float64(data=0.02))
    hand.bench.advance(0.1)
    assert hand.gripper.heard == []
    assert "gripper: an order to grip is not carried out: the robot is stopped" in hand.bench.texts()


def test_a_mission_that_is_cancelled_gives_its_order_up(make: Make) -> None:
    hand = make("do:\n  grip: 0.02")
    hand.bench.advance(0.5)
    hand.bench.host.ask("mission", CancelMission())
    hand.bench.advance(0.0)
    assert hand.gripper.heard == ["0.0 grip 0.02", "0.5 halt"]


@pytest.mark.parametrize(("tells", "again"), [("true", "0.4"), ("false", "0.6")], ids=["told", "silent"])
def test_the_end_of_an_order_that_was_given_up_does_not_end_the_next_one(make: Make, tells: str, again: str) -> None:
    robot = ROBOT.replace("toy_gripper", f"toy_gripper, tells_halts: {tells}")
    hand = make("do:\n  fallback:\n    - grip: 0.02\n      timeout: 0.4 s\n    - grip: 0.03", robot)
    hand.bench.advance(1.3)
    assert hand.gripper.heard == ["0.0 grip 0.02", "0.4 halt", f"{again} grip 0.03"]
    assert hand.end == ""
    hand.bench.advance(0.4)
    assert hand.end == "success"


def test_an_end_without_an_order_is_nobody_s(make: Make) -> None:
    hand = make("do:\n  - wait: 1 s\n  - grip: 0.02")
    hand.gripper.gripped(GripEnd(message="of nothing"))
    hand.bench.advance(2.2)
    assert hand.end == "success"


def test_a_newer_order_takes_the_place_of_one_that_is_under_way(make: Make) -> None:
    hand = make(
        """
        do:
          parallel:
            first:
              grip: 0.02
            second:
              - wait: 0.5 s
              - press: 0.03
          succeed_when: any
          fail_when: all
        """
    )
    hand.bench.advance(2.0)
    assert hand.gripper.heard == ["0.0 grip 0.02", "0.5 halt", "0.7 grip 0.03"]
    assert any("replaced by a newer order" in line for line in hand.lines)
    assert hand.end == "success"


# Nobody listens


def test_an_order_to_which_nobody_listens_fails_after_five_seconds(make: Make) -> None:
    hand = make("do:\n  - wait: 1 s\n  - grip: 0.02")
    hand.lose_gripper()
    hand.bench.advance(5.8)
    assert hand.end == ""
    hand.bench.advance(0.5)
    assert hand.end == "failure test.yaml:6: nothing subscribes to /grip"


def test_that_somebody_looks_on_carries_nothing_out(make: Make) -> None:
    hand = make("do:\n  - wait: 1 s\n  - grip: 0.02")
    hand.bench.collect("grip", Float64)
    hand.lose_gripper()
    hand.bench.advance(7.0)
    assert hand.end.endswith("nothing subscribes to /grip")


def test_an_order_that_was_lost_is_sent_again_to_who_is_back(make: Make) -> None:
    hand = make("do:\n  grip: 0.02")
    hand.bench.advance(0.5)
    hand.lose_gripper()
    hand.bench.advance(2.0)
    hand.bring_gripper_back()
    hand.bench.advance(1.3)
    assert hand.end == "success"
    assert "0.5 nothing subscribes to /grip any more; waiting for up to 5 s" in hand.lines
    assert [line.split(" ", 1)[1] for line in hand.gripper.heard] == ["grip 0.02"]


def test_one_who_is_back_at_the_same_instant_has_lost_the_order_too(make: Make) -> None:
    hand = make("do:\n  grip: 0.02")
    hand.bench.advance(0.5)
    hand.lose_gripper()
    hand.bring_gripper_back()
    hand.bench.advance(1.4)
    assert hand.end == "success"


@pytest.mark.parametrize("skill", ["grip", "press"], ids=["never back", "cannot be restarted"])
def test_an_order_that_is_lost_for_good_is_a_failure(make: Make, skill: str) -> None:
    hand = make(f"do:\n  {skill}: 0.02")
    hand.bench.advance(0.5)
    hand.lose_gripper()
    hand.bench.advance(0.0 if skill == "press" else 5.2)
    assert hand.end == "failure test.yaml:5: its server is gone"


def test_a_gripper_that_breaks_at_an_order_gets_it_again(make: Make) -> None:
    hand = make("do:\n  grip: -1")
    hand.bench.advance(0.05)
    hand.bench.advance(1.0)
    told = [text for text in hand.bench.texts() if "no such width" in text]
    assert len(told) > 1

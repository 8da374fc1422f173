"""Controllers are switched all at once or not at all, and no joint is ever led by two."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.requests import Refused
from rbxcompose.domains.servos.controller_manager import (
    ControllerManager,
    ControllerState,
    ListControllers,
    ScaleMotion,
    SwitchControllers,
)
from rbxcompose.domains.servos.controllers.joint_trajectory import JointTrajectoryConfig
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.testing import Bench, instance

JOINTS = {"head": ("pan", "tilt"), "gaze": ("pan",), "nod": ("tilt",), "arm": ("lift",)}


class Idle:
    """A controller that only claims."""

    leads, note = True, ""

    def __init__(self, name: str, start: str) -> None:
        self.name = name
        self.config = JointTrajectoryConfig.model_validate({"joints": list(JOINTS[name]), "start": start})
        self.ended: list[str] = []

    def halt(self, now: float, reason: str) -> None:
        self.ended.append(reason)


def managed() -> ControllerManager:
    one: Any = ControllerManager({name: Idle(name, "active" if name == "head" else "inactive") for name in JOINTS})  # type: ignore[misc]
    assert isinstance(one, ControllerManager)
    return one


names = st.lists(st.sampled_from([*JOINTS, "nobody"]), max_size=3)


@given(st.lists(st.tuples(names, names), max_size=8))
def test_no_joint_is_led_by_two_whatever_is_switched(wanted: list[tuple[list[str], list[str]]]) -> None:
    manager = managed()
    for on, off in wanted:
        before = [controller.name for controller in manager.active]
        if manager.objection(on, off):
            assert [controller.name for controller in manager.active] == before
            continue
        list(manager.switch(on, off, 0.0))
        led = [joint for controller in manager.active for joint in controller.config.claimed]
        assert len(led) == len(set(led))
        assert set(on) <= {controller.name for controller in manager.active}
        assert not set(off) & {controller.name for controller in manager.active}


def test_what_gives_way_must_be_named() -> None:
    manager = managed()
    assert (
        manager.objection(["gaze"], []) == "controllers 'head' and 'gaze' both lead joint 'pan': switch one of them off"
    )
    assert list(manager.switch(["gaze", "nod"], ["head"], 1.0)) == [
        "controller 'head' is inactive",
        "controller 'gaze' is active",
        "controller 'nod' is active",
    ]
    assert manager.leader("pan") == "gaze"


LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 1.5, "acceleration": 8.0}
CONFIG = {
    "twin": "ideal",
    "joints": {
        name: {**LIMITS, "servos": [{"id": id_, "model": "AX-12"}]} for id_, name in enumerate(("pan", "tilt"), 1)
    },
    "controllers": {
        "head": {"type": "joint_trajectory", "settings": {"type": "joint_trajectory", "joints": ["pan", "tilt"]}},
        "gaze": {
            "type": "joint_trajectory",
            "settings": {"type": "joint_trajectory", "joints": ["pan"], "start": "inactive"},
        },
    },
}


def test_a_controller_is_held_and_goes_on_by_the_word_of_a_person() -> None:
    robot = Bench(instance("servos", "servo_bus", CONFIG), start=False)
    ended: list[Ended[MoveJoints.Result]] = []
    head = robot.bus.action_client("me", "/head/move", MoveJoints)
    robot.advance(0.2)
    bus: Any = robot.component("servos")
    assert bus.handle(ScaleMotion("servos", "head", 0.0)) == "'head' holds: the speed is 0 %"
    head(MoveJoints.Goal(joints=("pan",), positions=np.array([1.0])), ended.append)
    robot.advance(8.0)
    assert not ended
    assert bus.handle(ListControllers("servos"))[0].note == "held: the speed is 0 %"
    assert bus.handle(ScaleMotion("servos", "head", 1.0)) == "'head' follows goals at 100% of the speed"
    robot.advance(3.0)
    assert [item.outcome for item in ended] == [Outcome.SUCCEEDED]
    for name, share, words in (("nobody", 1.0, "no controller 'nobody'"), ("head", 2.0, "from 0 % to 100 %")):
        with pytest.raises(Refused, match=words):
            bus.handle(ScaleMotion("servos", name, share))


def test_a_controller_that_is_switched_off_ends_its_goal_and_refuses_others() -> None:
    robot = Bench(instance("servos", "servo_bus", CONFIG), start=False)
    ended: list[Ended[MoveJoints.Result]] = []
    head, gaze = (robot.bus.action_client("me", f"/{name}/move", MoveJoints) for name in ("head", "gaze"))
    goal = MoveJoints.Goal(joints=("pan",), positions=np.array([1.0]))
    robot.advance(0.2)
    head(goal, ended.append)
    gaze(goal, ended.append)
    robot.advance(0.2)
    assert [item.outcome for item in ended] == [Outcome.REJECTED]
    bus: Any = robot.component("servos")
    with pytest.raises(Refused, match="both lead joint 'pan'"):
        bus.handle(SwitchControllers("servos", ("gaze",)))
    told = bus.handle(SwitchControllers("servos", ("gaze",), ("head",)))
    assert told == "controller 'head' is inactive; controller 'gaze' is active"
    robot.advance(0.5)
    assert ended[1].outcome is Outcome.ABORTED
    assert ended[1].result == MoveJoints.Result(message="controller 'head' was switched off")
    gaze(goal, ended.append)
    robot.advance(3.0)
    assert ended[2].outcome is Outcome.SUCCEEDED
    assert bus.handle(ListControllers("servos")) == (
        ControllerState("head", "joint_trajectory", False, ("pan", "tilt")),
        ControllerState("gaze", "joint_trajectory", True, ("pan",)),
    )

"""An arm whose driver dies, whose supervisor dies, whose cable is pulled: torque follows what was declared."""

from __future__ import annotations

import signal
from pathlib import Path

from tests.faults.arm import Arm

UP = 2048 + 652  # [ticks] of 1 rad


def lifted(arm: Arm) -> None:
    """Lift the arm, and wait until it is up."""
    assert arm.moves("lift_joint", 1.0, lambda: abs(arm.tick() - UP) <= 1)
    assert arm.torque() == [1, 0]


def killed(arm: Arm, process: str = "servos") -> None:
    """Kill a process, and wait until it has come back."""
    before = arm.send(process, signal.SIGKILL)
    assert arm.wait_for(lambda: arm.process(process) not in (None, before))


def test_joints_that_are_to_hold_hold_while_their_driver_comes_back(tmp_path: Path) -> None:
    with Arm(tmp_path, "{on_shutdown: hold}") as arm:
        lifted(arm)
        killed(arm)
        arm.line.received.clear()
        assert arm.wait_for(lambda: len(arm.line.received) > 100)  # the new driver has run for a while
        assert arm.torque() == [1, 0]
        assert abs(arm.tick() - UP) <= 1
        arm.do("release")
        assert arm.moves("lift_joint", 0.0, lambda: abs(arm.tick() - 2048) <= 1)
        arm.do("down")
        assert arm.torque() == [1, 0]


def test_joints_are_parked_before_they_are_relaxed_at_the_end_and_when_the_supervisor_dies(tmp_path: Path) -> None:
    with Arm(tmp_path, "{on_shutdown: park, park: {lift_joint: -60 deg, flex_joint: 30 deg}}") as arm:
        lifted(arm)
        arm.send("supervisor", signal.SIGKILL)
        assert arm.wait_for(lambda: arm.torque() == [0, 0])
        assert abs(arm.tick() - (2048 - 683)) <= 1
        assert arm.tick(2) == 2048  # it had no torque


def test_a_cable_is_plugged_in_again_and_a_killed_driver_leaves_joints_that_the_next_one_relaxes(
    tmp_path: Path,
) -> None:
    with Arm(tmp_path) as arm:
        lifted(arm)
        driver = arm.process("servos")
        arm.port.unplug()
        assert arm.wait_for(lambda: "gone" in arm.do("logs"))
        arm.port.replug()
        assert arm.wait_for(lambda: arm.torque() == [0, 0])
        assert arm.process("servos") == driver
        assert arm.moves("lift_joint", 0.5, lambda: abs(arm.tick() - (2048 + 326)) <= 1)
        assert arm.torque() == [1, 0]
        killed(arm)
        assert arm.wait_for(lambda: arm.torque() == [0, 0])


def test_servos_stop_by_themselves_when_their_driver_hangs(tmp_path: Path) -> None:
    with Arm(tmp_path, "{start_speed: 20 deg/s}") as arm:
        assert arm.moves("lift_joint", 1.5, lambda: arm.tick() > 2048 + 50)
        arm.send("servos", signal.SIGSTOP)
        assert arm.wait_for(lambda: arm.line[1].get("bus_watchdog") == -1)

"""A client that others wrote has the arm of `pi_robot` move as clients of MoveIt do, over a real router."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.msgs.moveit_msgs import MoveGroup, MoveItErrorCodes
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.runtime.process_group.host import Host
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Connected, Network, network
from tests.conftest import ROOT
from tests.interop.test_independent_client import Sdk

__all__ = ["network"]

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("zenoh_ros2_sdk") is None, reason="needs the package zenoh-ros2-sdk"
)
TYPES = ("arm", "servo_bus", "scene", "move_group")
LIFT = "right_arm_shoulder_lift_joint"


@pytest.fixture
def theirs(network: Network, tmp_path: Path) -> Iterator[Sdk]:
    made = Sdk(network, tmp_path)
    yield made
    made.close()


@pytest.fixture
def robot(network: Network) -> Iterator[Connected]:
    """Run the arm, its simulated servos and its scene in real time."""
    plan = compile_robot(str(ROOT / "robots/pi_robot"), environment={}).plan
    assert plan
    plan = plan.in_one_process()
    ours = network.process()
    chosen = tuple(instance for instance in plan.instances if instance.type in TYPES)
    host = Host(plan, chosen, ours.scheduler, ours.clock, ours.bus, lambda record: None, lambda event: None)
    host.configure()
    host.activate([instance.name for instance in chosen])
    host.start()
    yield ours
    host.shutdown()


@pytest.mark.timeout(120)
def test_their_client_moves_the_arm(network: Network, robot: Connected, theirs: Sdk) -> None:
    states: list[JointState] = []
    robot.bus.subscribe("me", "joint_states", JointState, Qos.STATE, states.append)
    for part, interface in (("send_goal", MoveGroup.SendGoal), ("get_result", MoveGroup.GetResult)):
        theirs.ask("client", f"/move_action/_action/{part}", interface.TYPE, interface.HASH)
    constraint = {"joint_name": LIFT, "position": -0.5, "tolerance_above": 1e-4, "tolerance_below": 1e-4, "weight": 1.0}
    request: dict[str, Any] = {
        "group_name": "right_arm",
        "num_planning_attempts": 1,
        "allowed_planning_time": 5.0,
        "max_velocity_scaling_factor": 1.0,
        "goal_constraints": [{"joint_constraints": [constraint]}],
    }
    goal_id = {"uuid": list(range(16))}
    sent = theirs.ask("call", "/move_action/_action/send_goal", {"goal_id": goal_id, "request": request})
    assert sent["accepted"] is True
    ended = theirs.ask("call", "/move_action/_action/get_result", {"goal_id": goal_id})
    assert ended["error_code"]["val"] == MoveItErrorCodes.SUCCESS, ended["error_code"]["message"]
    points = ended["planned_trajectory"]["joint_trajectory"]["points"]
    assert points[-1]["positions"][ended["planned_trajectory"]["joint_trajectory"]["joint_names"].index(LIFT)] == -0.5
    newest = states[-1]
    assert newest.position[newest.name.index(LIFT)] == pytest.approx(-0.5, abs=0.03)

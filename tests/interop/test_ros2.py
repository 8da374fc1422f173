"""The exchange with ROS 2 itself, where it is installed; and that its steps fit the robot that they are for."""

from __future__ import annotations

import re

import pytest

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.model import Plan
from tests.interop.run_ros2 import NEEDS, ROBOT, ROOT, STEPS, main, missing


@pytest.mark.skipif(bool(missing()), reason=f"needs ROS 2 with rmw_zenoh_cpp: {missing()}")
@pytest.mark.timeout(600)
def test_ros2_sees_and_drives_the_robot() -> None:
    assert main() == 0


@pytest.fixture(scope="module")
def plan() -> Plan:
    compilation = compile_robot(str(ROOT / ROBOT), environment={})
    assert compilation.plan
    return compilation.plan


def test_each_name_in_the_steps_is_one_of_the_robot(plan: Plan) -> None:
    known = {f"/{one.name}" for one in plan.instances} | {
        wire.topic for instance in plan.instances for wire in instance.wires
    }
    known |= {f"/{instance.name}/{verb}_parameters" for instance in plan.instances for verb in ("get", "set")}
    known |= {"/rosout"}
    said = {word.split(" ")[0] for step in STEPS for word in (*step.words, *step.expected) if word.startswith("/")}
    assert said - known == set()


def test_each_type_in_the_steps_is_one_of_the_robot(plan: Plan) -> None:
    known = {wire.type for instance in plan.instances for wire in instance.wires}
    said = {word for step in STEPS for word in step.words if re.fullmatch(r"\w+/(msg|srv|action)/\w+", word)}
    assert said
    assert said - known == set()


def test_what_a_step_needs_belongs_to_a_step() -> None:
    assert set(NEEDS) <= {step.name for step in STEPS}

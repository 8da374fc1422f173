"""The robot with a lift, an arm of seven joints and a parallel gripper picks and places as another robot does."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.servos.bus_config import ServoBusConfig
from rbxcompose.domains.servos.controllers.gripper import GripperConfig, model_of
from rbxcompose.testing.bench import Ran, run_robot
from tests.body.described import described
from tests.conftest import ROOT
from tests.soak import Soak, rare

SEEDS, TWINS = 20, ("servo", "ideal")


@cache
def compiled(*profiles: str) -> Compilation:
    return compile_robot(str(ROOT / "robots/porter"), profiles=profiles, environment={})


def ran(plan: Plan, mission: str, seed: int, twin: str) -> Ran:
    """Run a mission with another seed of the planner, and other simulated servos."""

    def changed(name: str, config: Any) -> Any:
        match name:
            case "mission":
                return config.model_copy(update={"start": mission})
            case "right_arm":
                return config.model_copy(update={"planner": config.planner.model_copy(update={"seed": seed})})
            case "servos":
                return config.model_copy(update={"twin": twin})
        return config

    instances = tuple(replace(instance, config=changed(instance.name, instance.config)) for instance in plan.instances)
    return run_robot(replace(plan, instances=instances), most=120.0)


@pytest.mark.parametrize("profiles", [("table",), *rare((), ("home",), ("tables",))])
def test_it_has_no_findings(profiles: tuple[str, ...]) -> None:
    assert list(compiled(*profiles).report) == []


@pytest.mark.timeout(900)
@pytest.mark.soak
def test_it_picks_and_places_with_every_seed(soak: Soak) -> None:
    plan = compiled("table").plan
    assert plan
    runs = {(seed, twin): ran(plan, "pick_and_place", seed, twin) for seed in range(SEEDS) for twin in TWINS}
    failures = {key: run.log for key, run in runs.items() if run.outcome != "success"}
    soak.tell("pick and place with seven joints", len(runs), len(failures))
    assert not failures


@pytest.mark.timeout(300)
@pytest.mark.soak
def test_it_picks_and_places_with_ideal_servos_too() -> None:
    plan = compiled("table").plan
    assert plan
    run = ran(plan, "pick_and_place", 1, "ideal")  # tests of missions run with servos like real ones
    assert run.outcome == "success", run.log


def test_its_fingers_are_as_far_apart_as_its_gripper_is_told() -> None:
    out = compiled()
    assert out.plan
    assert out.robot
    body = described(out.robot.manifest).body
    [bus] = [instance.config for instance in out.plan.instances if isinstance(instance.config, ServoBusConfig)]
    hand = bus.controllers["right_gripper_controller"].config
    assert isinstance(hand, GripperConfig)
    model = model_of(hand)
    for opening in (0.0, 0.04, 0.1):
        poses = body.poses({"right_gripper_left_finger_joint": model.angles(opening)[0]})
        ends = [poses[f"right_gripper_{side}_finger_link"].translation for side in ("left", "right")]
        assert math.dist(*ends) == pytest.approx(opening)

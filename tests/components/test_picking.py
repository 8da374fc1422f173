"""An arm with simulated servos picks and places, and the scene knows what it holds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs.rbxcompose_msgs import AttachObject, DetachObject, PickObject, PlaceObject
from rbxcompose.sdk.bound import Outcome
from rbxcompose.testing import Bench
from tests.shipped import robot_and_plan
from tests.soak import Soak

SEEDS = 20
TYPES = ("arm", "servo_bus", "scene")


@pytest.fixture(scope="module")
def plan() -> Plan:
    return robot_and_plan("pi_robot", "table")[1]


def robot(plan: Plan, seed: int) -> Bench:
    """Return the arm, its servos and its scene."""
    instances: dict[str, Any] = {instance.type: instance for instance in plan.instances if instance.type in TYPES}
    config = instances["arm"].config
    seeded = config.model_copy(update={"planner": config.planner.model_copy(update={"seed": seed})})
    return Bench(*(instances | {"arm": replace(instances["arm"], config=seeded)}).values())


def ended(bench: Bench, action: Any, topic: str, goal: Any) -> Any:
    ends: list[Any] = []
    bench.bus.action_client("me", topic, action)(goal, ends.append)
    for _ in range(600):
        bench.advance(0.1)
        if ends:
            return ends[0]
    raise AssertionError("it does not end")


@pytest.mark.timeout(900)
@pytest.mark.soak
def test_it_picks_and_places_with_every_seed(plan: Plan, soak: Soak) -> None:
    failures = []
    for seed in range(SEEDS):
        bench = robot(plan, seed)
        bench.advance(1.0)
        for action, topic, goal in (
            (PickObject, "/right_arm/pick", PickObject.Goal(object="target")),
            (PlaceObject, "/right_arm/place", PlaceObject.Goal(spot="table_right")),
        ):
            end = ended(bench, action, topic, goal)
            if end.outcome is not Outcome.SUCCEEDED:
                failures.append((seed, end.result))
                break
    soak.tell("pick and place on simulated servos", SEEDS, len(failures))
    assert not failures


def test_missions_attach_and_detach_objects_by_services(plan: Plan) -> None:
    bench = Bench(*(instance for instance in plan.instances if instance.type == "scene"))
    replies: list[Any] = []

    def told(service: Any, topic: str, request: Any) -> tuple[bool, str]:
        bench.bus.client("me", topic, service)(request, replies.append)
        bench.advance(0.1)
        response = replies[-1].response
        return response.success, response.message

    attach, detach = "/scene/attach", "/scene/detach"
    link = "right_gripper_link"
    assert told(AttachObject, attach, AttachObject.Request(object="cup", link=link))[0] is False
    assert told(AttachObject, attach, AttachObject.Request(object="target", link="nose")) == (
        False,
        "there is no link 'nose'",
    )
    assert told(AttachObject, attach, AttachObject.Request(object="target", link=link)) == (
        True,
        f"'target' moves with '{link}'",
    )
    assert told(DetachObject, detach, DetachObject.Request(object="target"))[0] is True
    free = told(DetachObject, detach, DetachObject.Request(object="target"))
    assert free == (False, "no link holds 'target'")

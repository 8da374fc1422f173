"""A robot with an arm fetches a block from one room to another, in a physics engine and in virtual time."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.worlds.components.physics import PhysicsSim
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.sdk.component import MissionOver
from rbxcompose.testing import Bench
from tests.conftest import ROOT
from tests.worlds.physical import contacts

pytestmark = pytest.mark.timeout(300)
pytest.importorskip("mujoco", reason="mujoco is not installed")

FINGER = "right_gripper_left_finger_joint"
SPOT = (7.32, 4.2)  # x and y of `on_counter` [m]
COUNTER, HALF = 0.9, 0.06  # height of the counter, and half of that of the block [m]


class Errand:
    """The mission `fetch` of the porter; `shift` moves the block along the table before it begins [m]."""

    def __init__(self, shift: float = 0.0) -> None:
        plan = compile_robot(str(ROOT / "robots/porter"), profiles=["home"], sets=("start=fetch",), environment={}).plan
        assert plan is not None

        def moved(name: str, config: Any) -> Any:
            if name != "world":
                return config
            target = config.objects["target"]
            at = target.at.model_copy(update={"y": target.at.y + shift})
            objects = {**config.objects, "target": target.model_copy(update={"at": at})}
            return config.model_copy(update={"objects": objects})

        parts = tuple(replace(part, config=moved(part.name, part.config)) for part in plan.instances)
        self.bench = Bench(plan=replace(plan, instances=parts))
        self.states = self.bench.collect("/joint_states", JointState)
        self.touched: set[tuple[str, str]] = set()
        self.looked_at = -1.0  # [s]
        self.swayed = 0.0  # how fast the base is at most while the arm works [m/s]
        self.carrying: list[JointState] = []  # while it drives with the block
        self.step, self.seen = "", 0  # of the mission, and how much of the log was read
        self.bench.run_until(self.look, 300.0)

    @property
    def engine(self) -> PhysicsWorld:
        simulator = self.bench.component("physics")
        assert isinstance(simulator, PhysicsSim)
        assert simulator.engine is not None
        return simulator.engine

    @property
    def block(self) -> Transform3:
        return self.engine.shape_pose("target")

    def look(self) -> bool:
        """Take notes of what the robot touches; return whether its mission has ended."""
        if self.engine.time > self.looked_at:
            self.looked_at, known = self.engine.time, self.engine.converted.links
            self.touched |= {(touch.link, touch.what) for touch in contacts(self.engine) if touch.what not in known}
        for record in self.bench.records[self.seen :]:
            if record.source == "mission" and not record.text.endswith(")"):
                self.step = record.text
        self.seen = len(self.bench.records)
        if "right_arm" in self.step:
            self.swayed = max(self.swayed, abs(self.engine.base_velocity.linear))
        elif self.step.endswith(" Go to at counter") and self.states:
            self.carrying.append(self.states[-1])
        return self.outcome != ""

    @property
    def outcome(self) -> str:
        return next((str(event.outcome) for event in self.bench.events if isinstance(event, MissionOver)), "")


@pytest.mark.soak
def test_a_block_is_fetched_from_the_living_room_to_the_kitchen() -> None:
    errand = Errand()
    assert errand.outcome == "success", errand.bench.texts()[-3:]
    x, y, z = errand.block.translation
    assert math.dist((x, y), SPOT) < 0.05
    assert z == pytest.approx(COUNTER + HALF, abs=2e-3)
    qx, qy, _, _ = errand.block.rotation
    assert 2 * math.hypot(qx, qy) < math.radians(2)
    touched = {(link, what) for link, what in errand.touched if what != "the ground"}
    assert touched == {(f"right_gripper_{side}_finger_link", "target") for side in ("left", "right")}
    assert errand.swayed < 0.05
    finger = errand.states[-1].name.index(FINGER)
    held = [message.effort[finger] for message in errand.carrying]
    assert len(held) > 100
    assert max(held) < -0.5


@pytest.mark.soak
def test_a_block_that_is_elsewhere_fails_with_a_reason_and_nothing_is_hit() -> None:
    errand = Errand(shift=-0.2)
    assert errand.outcome == "failure"
    assert any("nothing_grasped" in text for text in errand.bench.texts())
    assert {what for _, what in errand.touched} == {"the ground"}
    errand.bench.advance(1.0)
    assert abs(errand.engine.base_velocity.linear) < 1e-3

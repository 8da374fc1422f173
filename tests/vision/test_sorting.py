"""A robot with an arm finds three things on a table by their shapes and a tag, and sorts them, in virtual time."""

from __future__ import annotations

import math

import pytest

from rbxcompose.domains.worlds.components.physics import PhysicsSim
from rbxcompose.msgs.rbxcompose_msgs import SceneObjects
from rbxcompose.sdk.component import MissionOver
from rbxcompose.testing import Bench
from tests.shipped import ROOT, compiled
from tests.worlds.physical import contacts

pytestmark = pytest.mark.timeout(120)
pytest.importorskip("cv2", reason="OpenCV is not installed")
STOOD = {"tea": (0.64, 0.16, 0.65), "can": (0.62, -0.15, 0.635), "block": (0.64, 0.0, 0.64)}


@pytest.mark.soak
def test_what_carries_a_tag_is_put_to_the_left_and_all_else_to_the_right() -> None:
    path, sets = str(ROOT / "robots/porter"), ("start=sort_table",)
    bench = Bench(plan=compiled(path, profiles=["sorting"], sets=sets, environment={}).plan)
    scenes = bench.collect("/scene", SceneObjects)

    def there() -> dict[str, tuple[float, float, float]]:
        return {
            one.name: (one.pose.position.x, one.pose.position.y, one.pose.position.z)
            for one in scenes[-1].objects
            if one.name != "table" and one.link == "base_footprint"
        }

    bench.run_until(lambda: len(scenes) > 0 and len(there()) == 3, 30.0)
    found = there()
    assert {name for name in found if not name.startswith("thing_")} == {"tea"}
    for where in STOOD.values():
        assert min(math.dist(where, place) for place in found.values()) < 0.005
    kinds = sorted(one.shapes[0].kind for one in scenes[-1].objects if one.name != "table")
    assert kinds == ["box", "box", "cylinder"]
    bench.run_until(lambda: any(isinstance(event, MissionOver) for event in bench.events), 120.0)
    [over] = [event for event in bench.events if isinstance(event, MissionOver)]
    assert over.outcome == "success", over.message
    placed = there()
    assert placed["tea"][1] == pytest.approx(0.4, abs=0.03)
    others = sorted(y for name, (_, y, _) in placed.items() if name != "tea")
    assert others == pytest.approx([-0.42, -0.3], abs=0.03)


@pytest.mark.soak
def test_in_physics_only_the_gripper_touches_things_and_they_end_where_they_belong() -> None:
    pytest.importorskip("mujoco", reason="mujoco is not installed")
    plan = compiled(
        str(ROOT / "robots/porter"), profiles=["heavy", "sorting"], sets=("start=sort_table",), environment={}
    ).plan
    bench, touched = Bench(plan=plan), set[tuple[str, str]]()
    simulator = bench.component("physics")
    assert isinstance(simulator, PhysicsSim)
    engine = simulator.engine
    assert engine is not None

    def is_over() -> bool:
        touched.update((touch.link, touch.what) for touch in contacts(engine) if touch.what in STOOD)
        return any(isinstance(event, MissionOver) for event in bench.events)

    bench.run_until(is_over, 200.0)
    [over] = [event for event in bench.events if isinstance(event, MissionOver)]
    assert over.outcome == "success", over.message
    assert all(link.startswith("right_gripper_") for link, _ in touched)
    for name, y in (("tea", 0.4), ("block", -0.42), ("can", -0.3)):
        place = engine.shape_pose(name).translation
        assert place == pytest.approx((0.64, y, STOOD[name][2]), abs=0.02)

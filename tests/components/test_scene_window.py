"""Viewers of arms and scenes: whoever comes late sees the whole, and changes add up to what is there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.arms.command_watch import WindowViews, line_of
from rbxcompose.domains.arms.scene_view import goal_words
from rbxcompose.msgs.moveit_msgs import CollisionObject
from rbxcompose.msgs.rbxcompose_msgs import MoveArm
from rbxcompose.msgs.shape_msgs import SolidPrimitive
from rbxcompose.runtime.process_group.host import Host
from rbxcompose.sdk.bound import KeyFeed, added, whole
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import instance
from tests.bus.conftest import Network, network
from tests.motion.toy_arm import urdf

__all__ = ["network"]
BOX = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=np.array((0.1, 0.2, 0.3)))
PARTS = st.dictionaries(st.sampled_from("abcd"), st.integers(0, 2))


class Viewer:
    """A window whose viewer comes and goes; who comes is told the whole first."""

    def __init__(self) -> None:
        self.is_watched = False
        self.known: Mapping[str, Any] = {}
        self.sizes: list[int] = []

    def put(self, value: object, /) -> None:
        assert isinstance(value, dict)
        self.known = added(self.known, value)
        self.sizes.append(len(value["changed"]))


@given(st.lists(st.tuples(st.booleans(), PARTS), min_size=1))
def test_changes_add_up_to_what_is_there_whenever_a_viewer_came(steps: list[tuple[bool, dict[str, int]]]) -> None:
    viewer, now = Viewer(), dict[str, int]()
    feed = KeyFeed(viewer)
    for is_watched, parts in steps:
        if is_watched and not viewer.is_watched:
            viewer.known = added({}, whole(now))  # its query
        viewer.is_watched = is_watched
        feed.update(parts)
        now = parts
        if is_watched:
            assert viewer.known == parts


def test_what_has_not_changed_is_not_told_again() -> None:
    viewer = Viewer()
    viewer.is_watched = True
    feed = KeyFeed(viewer)
    feed.update({"a": 1, "b": 2})
    feed.update({"a": 1, "b": 2})
    feed.update({"a": 1, "b": 3})
    assert viewer.sizes == [2, 1]


def test_who_comes_late_sees_the_whole_scene_and_then_what_changes(network: Network) -> None:
    robot, other = network.process(), network.process()
    scene = instance("scene", "scene", {"urdf": urdf()})
    host = Host(
        Plan("toy", "toy.yaml", (scene,)),
        (scene,),
        robot.scheduler,
        robot.clock,
        robot.bus,
        lambda record: None,
        lambda event: None,
    )
    host.configure()
    host.activate(["scene"])
    host.start()
    send = robot.bus.publisher("me", "/collision_object", CollisionObject, Qos.EVENT)
    send(CollisionObject(id="early", primitives=(BOX,)))
    lines: list[str] = []
    views = WindowViews(other, "toy", ("scene",), lambda path, seen: lines.append(line_of(seen)))
    network.until(lambda: "scene" in views.seen and "object early" in views.seen["scene"])
    send(CollisionObject(id="late", primitives=(BOX,)))
    network.until(lambda: "object late" in views.seen["scene"])
    assert views.seen["scene"]["object late"]["shapes"][0]["size"] == [0.1, 0.2, 0.3]
    send(CollisionObject(id="early", operation=CollisionObject.REMOVE))
    network.until(lambda: "object early" not in views.seen["scene"])
    assert lines[-1] == "scene: late"
    host.shutdown()


def test_a_goal_is_told_by_what_is_not_as_usual() -> None:
    assert goal_words(MoveArm.Goal(pose="resting", speed=0.3)) == "MoveArm {pose: resting, speed: 0.3}"
    arm = {"arm": "neck", "state": "moving", "goal": "MoveArm", "duration": 1.25, "problem": ""}
    assert line_of(arm) == "neck: moving, MoveArm, 1.2 s"
    idle = {"arm": "neck", "state": "idle", "goal": "", "outcome": "not_kept", "message": "at the start", "problem": ""}
    assert line_of(idle) == "neck: idle, not_kept: at the start"

"""Pictures of an arm among things: what can be seen in them."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.picture import ArmPicture, draw_arm
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.body import picture
from rbxcompose.domains.body.model import Geometry
from tests.motion.scenes import FLOOR, MESH, OCTREE
from tests.motion.toy_arm import kinematics
from tests.soak import rare

BODY = kinematics().body
SHOWN = ArmPicture(BODY, {}, {"turn": 0.8}, caption="at rest to up")
BALL = PlacedObject("ball", Geometry("sphere", (0.1,)), "ground", Transform3((0.3, -0.4, 0.3)))


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "SIZE", 120)


def shares(shown: ArmPicture) -> list[float]:
    """Return how much of a picture is red, green and blue."""
    from PIL import Image

    pixels = np.asarray(Image.open(io.BytesIO(draw_arm(shown))).convert("RGB")).astype(int)
    others = (np.delete(pixels, channel, axis=2).max(axis=2) for channel in range(3))
    return [float(np.mean(pixels[:, :, channel] > other + 40)) for channel, other in enumerate(others)]


def test_what_collides_is_red_the_goal_green_and_the_way_blue() -> None:
    plain = replace(SHOWN, objects=(BALL,))
    red, *others = shares(plain)
    assert others == [0.0, 0.0]
    assert shares(replace(plain, colliding={"ball"}))[0] > red + 0.005
    goal = replace(plain, goal={"lift": 1.0}, moved=("upper", "fore"), way=((0.4, 0.0, 0.3), (0.4, 0.4, 0.6)))
    red, green, blue = shares(goal)
    assert green > 0.005
    assert blue > 0.0005
    assert shares(replace(goal, problem="goal_in_collision: 'ball' and 'fore' " * 9))[0] > red


@pytest.mark.parametrize(
    "shape", [MESH, OCTREE, *rare(FLOOR, Geometry("cone", (0.1, 0.2)))], ids=lambda shape: shape.kind
)
def test_things_of_all_shapes_are_seen_in_their_colour(shape: Geometry) -> None:
    placed_object = replace(BALL, shape=shape, colour=(0.1, 0.2, 0.9, 1.0))
    assert shares(replace(SHOWN, objects=(placed_object,)))[2] > 0.0005

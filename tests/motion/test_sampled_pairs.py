"""Which pairs of links collide is what other code finds, too; and a pair that was never seen is examined at last."""

from __future__ import annotations

import numpy as np

from rbxcompose.domains.arms.motion.collisions import TOUCH, sampled_matrix, whole_space
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionRequest
from rbxcompose.domains.body.link_pairs import CollisionMatrix
from tests.body.kinematics import description_of
from tests.motion.test_planner import LEFT, RIGHT, sampled
from tests.motion.toy_arm import WALL, ended, gap, planner, urdf


def matrix_of(wall: tuple[float, float, float], samples: int = 300) -> CollisionMatrix:
    return ended(sampled_matrix(description_of(urdf(wall)), samples, 1))


def test_a_pair_is_never_or_at_rest_in_collision_as_other_code_finds() -> None:
    body = description_of(urdf()).body
    gaps = [gap(body, sample) for sample in whole_space(body).samples(300, 1)]
    assert min(gaps) < 0 < max(gaps)
    assert gap(body, np.zeros(3)) < 0
    assert matrix_of(WALL).pairs == {
        ("fore", "upper"): "adjacent",
        ("fore", "ground"): "default",
        ("ground", "upper"): "never",  # the upper arm ends 7 cm before the wall
    }


def test_the_same_seed_gives_the_same_file() -> None:
    assert matrix_of(WALL).text() == matrix_of(WALL).text()


def test_a_link_within_another_one_always_collides() -> None:
    shell = '<collision><geometry><sphere radius="3"/></geometry></collision>'
    text = urdf().replace('<link name="ground">', f'<link name="ground">{shell}')
    pairs = ended(sampled_matrix(description_of(text), 100, 1)).pairs
    assert pairs["fore", "ground"] == pairs["ground", "upper"] == "always"


def test_links_that_nothing_moves_are_known_without_trying() -> None:
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    for x, reason in ((0.1, "always"), (0.3, "never")):
        more = "".join(
            f'<link name="{name}">{ball}</link><joint name="{name}" type="fixed"><origin xyz="{at} 0 0"/>'
            f'<parent link="fore"/><child link="{name}"/></joint>'
            for name, at in (("one", 0.0), ("two", x))
        )
        text = urdf().replace("</robot>", f"{more}</robot>")
        assert ended(sampled_matrix(description_of(text), 0, 1)).pairs["one", "two"] == reason


def test_a_pair_that_is_wrongly_called_unlikely_is_still_not_hit() -> None:
    used = planner()
    used.unlikely = [("fore", "ground"), ("ground", "upper")]
    found = ended(used.plan(MotionRequest(LEFT, RIGHT)))
    assert isinstance(found, MotionPlan)
    assert found.trajectory is not None
    assert found.attempts == 2
    body = description_of(urdf()).body
    assert min(gap(body, one) for one in sampled(found.trajectory, 0.005)) >= -TOUCH

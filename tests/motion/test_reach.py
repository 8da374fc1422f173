"""Where an arm gets: inverse kinematics agrees, other code measures the same, and a picture shows it."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.domains.arms.motion.inverse_kinematics import PoseSearch, PoseTarget, solved
from rbxcompose.domains.arms.motion.picture import ArmPicture
from rbxcompose.domains.arms.motion.reach import (
    DIRECTIONS,
    SCALE,
    Cut,
    ReachMap,
    ReachPicture,
    colours_of,
    directions,
    draw_reach,
    manipulability,
    reached,
)
from rbxcompose.domains.body import picture
from tests.motion.test_inverse_kinematics import ARM, SPACE
from tests.motion.toy_arm import Array, ended, gap, kinematics, planner

TOY, PLANNER = kinematics(), planner()
SIDE = 0.06


def found(seed: int, samples: int = 3_000, cut: Cut | None = None) -> ReachMap:
    made = reached(TOY, PLANNER.space, PLANNER.checker, side=SIDE, samples=samples, seed=seed, cut=cut)
    return list(made)[-1]


@settings(max_examples=settings().max_examples // 2)
@given(st.integers(0, 2**31))
def test_inverse_kinematics_reaches_each_cell_that_is_told_as_reached(seed: int) -> None:
    there = found(seed, 1_500)
    assert len(there.cells) > 50
    for cell, reached_cell in list(there.cells.items())[::30]:
        assert np.abs(np.array(TOY.tip_pose(reached_cell.values).translation) / SIDE - cell).max() <= 0.5
        assert gap(TOY.body, reached_cell.values) > -1e-3
        assert not PLANNER.space.outside(reached_cell.values)
        target = PoseTarget(TOY.tip_pose(reached_cell.values), any_orientation=True)
        answer = ended(
            solved(
                PoseSearch(TOY, PLANNER.space, target, reached_cell.values, PLANNER.checker.is_free, seed=1, enough=1)
            )
        )
        assert answer.free
        assert there.cell_of(np.array(TOY.tip_pose(reached_cell.values).translation)) == cell


@given(st.integers(0, 2**31))
def test_manipulability_is_the_product_of_how_far_the_tip_moves_along_its_main_axes(seed: int) -> None:
    values, step = SPACE.samples(1, seed)[0], 1e-6

    def tip(at: Array) -> Array:
        return np.array(ARM.tip_pose(at).translation)

    columns = [(tip(values + step * one) - tip(values - step * one)) / (2 * step) for one in np.eye(len(values))]
    lengths = np.linalg.svd(np.array(columns).T, compute_uv=False)
    assert manipulability(ARM, values) == pytest.approx(float(np.prod(lengths)), abs=1e-6)


def test_a_layer_has_the_cells_of_the_whole_that_are_in_it() -> None:
    whole, layer = found(3), found(3, cut=Cut(2, 0.55))
    number = round(0.55 / SIDE)
    assert {cell: reached_cell.directions for cell, reached_cell in layer.cells.items()} == {
        cell: reached_cell.directions for cell, reached_cell in whole.cells.items() if cell[2] == number
    }
    assert found(3, 2_500).tried == 2_500


def test_directions_are_even() -> None:
    sphere = directions()
    assert np.allclose(np.linalg.norm(sphere, axis=1), 1.0)
    between = np.arccos(np.clip(sphere @ sphere.T, -1.0, 1.0)) + 9.0 * np.eye(DIRECTIONS)
    assert between.min(axis=1).min() > 0.6 * between.min(axis=1).max()


def test_a_picture_shows_the_cells_in_the_colours_of_its_legend(monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    monkeypatch.setattr(picture, "SIZE", 200)
    robot = ArmPicture(TOY.body, {}, {"turn": 0.8}, caption="two cells")
    cells = {(4, 4, 14): 10.0, (4, -4, 14): 1.0}
    shown = [ReachPicture(robot, each, SIDE, 10.0, "directions", is_layer=True) for each in (cells, {})]
    pictures = [
        np.asarray(Image.open(io.BytesIO(draw_reach(reach_picture))).convert("RGB")).astype(int)
        for reach_picture in shown
    ]
    above = [one[:140] for one in pictures]  # without the legend
    blue, red = (int(np.sum(above[0][..., number] > above[0][..., 2 - number] + 60)) for number in (2, 0))
    assert min(blue, red) > 20
    assert np.abs(above[1] - above[1].mean(2, keepdims=True)).max() < 30  # grey alone
    assert np.allclose(colours_of([0.0, 10.0], 10.0), SCALE[[0, -1]])

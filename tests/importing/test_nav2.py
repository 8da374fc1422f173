"""Parameters of Nav2 and of move_base become the section `navigation`."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.units import DIMENSIONS, to_si
from rbxcompose.domains.navigation.importers import nav2 as nav2_importer
from rbxcompose.domains.navigation.sections.navigation import FootprintModel, NavigationModel
from rbxcompose.domains.worlds.contact import outside_polygon
from rbxcompose.domains.worlds.grid_map import GridMap, map_files
from rbxcompose.domains.worlds.shapes import PolygonFootprint
from rbxcompose.testing import check_text
from rbxcompose.testing.golden import Golden
from tests.importing.imports import EXAMPLES, Imported, import_files, import_texts
from tests.loops import for_all

GOLDEN = {
    "depot": ["depot"],
    "pursuit": ["pursuit"],
    "move_base": ["costmap_common_params", "base_local_planner_params", "amcl"],
}
SHAPE = {"RBX1001", "RBX1002", "RBX1003", "RBX1004", "RBX1005", "RBX1102", "RBX3130", "RBX3138"}


def nav2(folder: Path, *texts: str) -> Imported:
    return import_texts(folder, *texts, program="nav2")


def navigation(found: Imported) -> Any:
    return found.data["navigation"]


def with_map(folder: Path, text: str) -> str:
    """Return a manifest that has a map, and make the one that it names."""
    for name, data in map_files(GridMap(np.zeros((4, 4), np.int8), 0.05), "depot").items():
        (folder / "maps").mkdir(exist_ok=True)
        (folder / "maps" / name).write_bytes(data)
    return text if "\n  map:" in text else text.replace("navigation:\n", "navigation:\n  map: maps/depot.yaml\n")


@pytest.mark.parametrize("name", GOLDEN)
def test_what_is_written_and_what_is_told(name: str, repository: Path, golden: Golden, tmp_path: Path) -> None:
    found = import_files([EXAMPLES / f"nav2/{text}.yaml" for text in GOLDEN[name]], name, "nav2")
    golden.check(f"nav2_{name}.yaml", found.text)
    golden.check(f"nav2_{name}.txt", found.words)
    checked = check_text(with_map(tmp_path, found.text), tmp_path)
    assert checked.plan.robot == name
    assert {instance.type for instance in checked.plan.instances} >= {"map_server", "navigator"}


NODE = "controller_server: {{ros__parameters: {{FollowPath: {{{}}}}}}}\n"


@pytest.mark.parametrize(
    ("keys", "speed"),
    [
        ("desired_linear_vel: 0.7", "0.7 m/s"),
        ("max_linear_vel: 0.7", "0.7 m/s"),
        ("max_vel_x: 0.7", "0.7 m/s"),
        ("vx_max: 0.7", "0.7 m/s"),
        ("max_vel_x: 0.7, max_vel_trans: 0.9", "0.7 m/s"),
    ],
)
def test_each_controller_has_its_own_word_for_the_speed(keys: str, speed: str, tmp_path: Path) -> None:
    assert navigation(nav2(tmp_path, NODE.format(keys))) == {"follower": {"speed": speed}}


@given(st.floats(0.01, 9), st.floats(0.01, 9))
def test_the_slower_one_of_controller_and_smoother_counts(
    tmp_path_factory: pytest.TempPathFactory, controller: float, smoother: float
) -> None:
    text = f"velocity_smoother: {{ros__parameters: {{max_velocity: [{smoother}, 0.0, 1.0]}}}}\n"
    found = navigation(nav2(tmp_path_factory.mktemp("any"), NODE.format(f"max_vel_x: {controller}") + text))
    assert to_si(found["follower"]["speed"], DIMENSIONS["speed"]) == min(controller, smoother)


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=3, max_size=8))
def test_every_corner_of_a_footprint_is_in_what_it_becomes(
    tmp_path_factory: pytest.TempPathFactory, corners: list[tuple[float, float]]
) -> None:
    folder, listed = tmp_path_factory.mktemp("any"), [list(corner) for corner in corners]
    now = nav2(folder, f'global_costmap: {{ros__parameters: {{footprint: "{listed}"}}}}\n')
    before = nav2(folder, f"obstacle_range: 2.0\nfootprint: {listed}\n")
    if max(math.hypot(*corner) for corner in corners) < 1e-6:
        return
    for found in (now, before):
        shape = NavigationModel.model_validate({"footprint": navigation(found)["footprint"]}).footprint
        if isinstance(shape, list):
            assert outside_polygon(PolygonFootprint(tuple(shape)), np.array(corners)).max() <= 1e-4
            assert ("RBX2298" in dict(found.told)) == (len(shape) < len(corners))
        else:
            assert isinstance(shape, FootprintModel)
            assert max(math.hypot(*corner) for corner in corners) <= shape.radius + 1e-6
            assert "RBX2298" in dict(found.told)


COSTMAP = "{ros__parameters: {robot_radius: RADIUS, plugins: [inflation], inflation: {inflation_radius: INFLATION}}}"


def costmap(name: str, radius: float, inflation: float) -> str:
    return f"{name}: {{{name}: {COSTMAP.replace('RADIUS', str(radius)).replace('INFLATION', str(inflation))}}}\n"


def test_the_costmap_on_which_ways_are_planned_counts_and_the_other_one_is_told(tmp_path: Path) -> None:
    found = nav2(tmp_path, costmap("local_costmap", 0.2, 0.3) + costmap("global_costmap", 0.2, 0.5))
    assert navigation(found)["costs"] == {"inflation": {"radius": "500 mm"}}
    assert ("RBX2230", 1) in found.told


LISTED = 'plugins: [{name: o, type: "costmap_2d::VoxelLayer"}, {name: i, type: "costmap_2d::InflationLayer"}], '


@pytest.mark.parametrize(("listed", "names"), [(LISTED, "oi"), ("", ("obstacle_layer", "inflation_layer"))])
def test_only_a_layer_that_inflates_says_how_far(listed: str, names: Sequence[str], tmp_path: Path) -> None:
    layers = ", ".join(
        f"{name}: {{inflation_radius: {radius}}}" for name, radius in zip(names, (0.2, 0.7), strict=True)
    )
    found = nav2(tmp_path, f"global_costmap: {{robot_radius: 0.2, {listed}{layers}}}\n")
    assert navigation(found)["costs"] == {"inflation": {"radius": "700 mm"}}
    assert ("RBX2230", 1) in found.told, "the other radius is told"


@pytest.mark.parametrize(
    ("tracks", "allows", "unknown"),
    [("true", "false", False), ("false", "false", True), ("true", "true", True), (None, "false", True)],
)
def test_ways_lead_through_the_unknown_if_they_did_before(
    tracks: str | None, allows: str, unknown: bool, tmp_path: Path
) -> None:
    tracked = f"track_unknown_space: {tracks}, " if tracks else ""
    text = f"global_costmap: {{ros__parameters: {{{tracked}resolution: 0.05}}}}\n"
    planner = f"planner_server: {{ros__parameters: {{GridBased: {{allow_unknown: {allows}}}}}}}\n"
    assert navigation(nav2(tmp_path, text + planner))["costs"]["unknown"] is unknown


def test_the_robot_starts_where_amcl_was_told_and_only_then(tmp_path: Path) -> None:
    text = "amcl: {ros__parameters: {set_initial_pose: SET, initial_pose: {x: 1.0, y: 2.0, yaw: 0.5}}}\n"
    start = navigation(nav2(tmp_path, text.replace("SET", "true")))["localisation"]["start"]
    assert start == {"x": "1 m", "y": "2 m", "heading": "0.5 rad"}
    unset = nav2(tmp_path, text.replace("SET", "false"))
    assert "start" not in navigation(unset)["localisation"]
    assert [code for code, _ in unset.told].count("RBX2299") == 2  # and no map


@pytest.mark.parametrize(("yaw", "tolerance", "told"), [(3.14, 0.2, []), (-90, 0.2, [1]), (6.28, 10, [2])])
def test_angles_that_look_like_degrees_are_told(yaw: float, tolerance: float, told: list[int], tmp_path: Path) -> None:
    start = f"amcl: {{ros__parameters: {{set_initial_pose: true, initial_pose: {{x: 1, yaw: {yaw}}}}}}}\n"
    checker = f"{{goal_checker: {{yaw_goal_tolerance: {tolerance}}}}}"
    made = nav2(tmp_path, f"{start}controller_server: {{ros__parameters: {checker}}}\n")
    assert [line for code, line in made.told if code == "RBX2023"] == told, made.words
    assert navigation(made)["localisation"]["start"]["heading"] == f"{yaw} rad"


WRONG = {
    "another program": ("talker: {ros__parameters: {rate: 1}}\n", "RBX2231", 1),
    "a list": ("[1, 2]\n", "RBX2231", 1),
    "nothing of use": ("map_server: {ros__parameters: {use_sim_time: false}}\n", "RBX2238", 0),
    "a speed in words": (NODE.format("\n  max_vel_x: fast, acc_lim_x: 1"), "RBX1003", 2),
    "no speed": (NODE.format("\n  max_vel_x: 0.0, acc_lim_x: 1"), "RBX1005", 2),
    "sideways": (NODE.format("max_vel_x: 1,\n  max_vel_y: 0.2"), "RBX2230", 2),
    "a footprint in words": ("robot_radius: 0.2\nfootprint: round\n", "RBX1003", 2),
    "a footprint without end": ("robot_radius: 0.2\nfootprint: [[.inf, 0], [1, 1], [0, 1]]\n", "RBX1003", 2),
    "a node of something else": (NODE.format("max_vel_x: 1") + "talker: {ros__parameters: {a: 1}}\n", "RBX2230", 2),
}


@for_all("name", WRONG)
def test_what_is_wrong_is_told_at_its_place(name: str, tmp_path: Path) -> None:
    text, code, line = WRONG[name]
    assert (code, line) in nav2(tmp_path, text).told


VALUES = st.one_of(
    st.floats(-3, 9), st.booleans(), st.sampled_from(["scan", "a: b", "$x", "", "LaserScan"]), st.none(), st.just([1])
)
KEYS = st.sampled_from(re.findall(r"[a-z]\w+", Path(nav2_importer.__file__).read_text(encoding="utf-8")))
MAPS = st.recursive(VALUES, lambda inner: st.dictionaries(KEYS, inner, max_size=4), max_leaves=12)
NODES = st.sampled_from(sorted(nav2_importer._READERS))


@given(st.dictionaries(NODES, st.dictionaries(KEYS, MAPS, max_size=4), max_size=3))
def test_whatever_a_file_says_what_is_written_can_be_read(
    tmp_path_factory: pytest.TempPathFactory, nodes: dict[str, Any]
) -> None:
    folder = tmp_path_factory.mktemp("any")
    text = "".join(f"{name}: {{ros__parameters: {keys}}}\n" for name, keys in nodes.items())
    found = nav2(folder, text.replace("None", "null").replace("True", "true").replace("False", "false"))
    if found.text:
        assert not set(check_text(with_map(folder, found.text), folder).codes) & SHAPE

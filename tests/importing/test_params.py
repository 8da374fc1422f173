"""Files of parameters become arguments, or components that are known: what they say is written with its place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.testing import check_text
from rbxcompose.testing.golden import Golden
from tests.importing.imports import EXAMPLES, Imported, import_files, import_texts
from tests.loops import for_all

DUMP = "!!python/object/new:dynamic_reconfigure.encoding.Config"


def params(folder: Path, *texts: str) -> Imported:
    return import_texts(folder, *texts, program="params")


def defaults(found: Imported) -> dict[str, Any]:
    return {name: entry["default"] for name, entry in found.data.get("args", {}).items()}


@pytest.mark.parametrize("name", ["nodes", "battery"])
def test_what_is_written_and_what_is_told(name: str, repository: Path, golden: Golden, tmp_path: Path) -> None:
    found = import_files([EXAMPLES / f"params/{name}.yaml"], name, "params")
    golden.check(f"params_{name}.yaml", found.text)
    golden.check(f"params_{name}.txt", found.words)
    assert check_text(found.text, tmp_path).plan.robot == name


def test_a_dump_says_the_same_without_its_python(tmp_path: Path) -> None:
    text = (EXAMPLES / "params/battery.yaml").read_text(encoding="utf-8")
    plain = "battery_runtime: 45\ndischarge: 0.25\nis_simulated: true\nlabel: pack 1\n"
    assert defaults(params(tmp_path, text)) == defaults(params(tmp_path, plain)) == yaml.safe_load(plain)


@pytest.mark.parametrize(
    "tag", ["!!python/object/apply:os.system", "!!python/name:os.system", "!!python/object/new:os.Popen", "!mine"]
)
def test_no_object_of_a_file_is_made(tag: str, tmp_path: Path) -> None:
    found = params(tmp_path, f"a: 1\nevil: {tag} [touch, {tmp_path}/made]\n")
    assert found.told[0][0] == ("RBX2292" if "python" in tag else "RBX1107")
    assert not (tmp_path / "made").exists()


def test_several_files_make_one_robot_and_the_first_one_counts(tmp_path: Path) -> None:
    found = params(tmp_path, "n: {ros__parameters: {a: 1, b: 2}}\n", "n:\n  ros__parameters: {a: 1, b: 3, c: 4}\n")
    assert defaults(found) == {"a": 1, "b": 2, "c": 4}
    assert found.told == [("RBX2232", 2)]


def test_nodes_in_namespaces_and_dots_in_names_are_read_as_ros_does(tmp_path: Path) -> None:
    dotted = "lab: {arm: {ros__parameters: {a.b.c: 1, a: {b: {d: 2}}}}}"
    found = params(tmp_path, f"{dotted}\n/x: {{ros__parameters: {{a: 3}}}}\n")
    assert defaults(found) == {"arm_a_b_c": 1, "arm_a_b_d": 2, "x_a": 3}
    assert "'lab/arm'" in found.text


@given(st.permutations(["a: 1", "a.b: 2", "a.b.c: 3", "a.d: {e: 4}"]))
def test_a_name_that_is_also_the_beginning_of_another_loses_nothing(
    tmp_path_factory: pytest.TempPathFactory, lines: list[str]
) -> None:
    found = params(tmp_path_factory.mktemp("dots"), "".join(f"{line}\n" for line in lines))
    assert defaults(found) == {"a": 1, "a_b": 2, "a_b_c": 3, "a_d_e": 4}
    assert found.told == []


def test_a_name_that_is_written_in_two_ways_disagrees(tmp_path: Path) -> None:
    found = params(tmp_path, "a.b: 2\na: {b: 3}\nc: {d: {e: 1}}\nc.d: {f: 2}\n")
    assert defaults(found) == {"a_b": 3, "c_d_e": 1, "c_d_f": 2}
    assert found.told == [("RBX2232", 1)]


def test_flags_and_octal_numbers_are_what_ros_takes_them_for(tmp_path: Path) -> None:
    found = params(tmp_path, "a: [yes, Off]\nb: on\nc: 'yes'\nd: 010\ne: 089\nuse_sim_time: no\n")
    assert [entry["type"] for entry in found.data["args"].values()] == ["list", "flag", "text", "count"]
    assert defaults(found) | {"c": "yes"} == {"a": [True, False], "b": True, "c": "yes", "d": 8}
    assert found.told == [("RBX2230", 5)]


def test_a_node_is_a_component_only_if_all_fits(tmp_path: Path) -> None:
    whole = {
        "max_speed": 0.4,
        "max_turn_rate": 1.5,
        "acceleration": 1.0,
        "turn_acceleration": 2.0,
        "command_timeout": 0.5,
        "rate": 50.0,
        "in_world": False,
        "wheel_distance": 0.23,
        "drift": 0.0,
        "by_physics": False,
    }
    for name, given_ones, is_known in (
        ("base", whole, True),
        ("diff_drive_sim", {"max_speed": 0.4}, True),
        ("base", {"max_speed": 0.4}, False),
        ("base", {**whole, "more": 1}, False),
        ("base", {**whole, "max_speed": -1.0}, False),
        ("mux", {"output": "cmd_vel"}, False),
    ):
        found = params(tmp_path, yaml.safe_dump({name: {"ros__parameters": given_ones}}))
        assert ("components" in found.data) == is_known, (name, given_ones)
        assert [code for code, _ in found.told] == (["RBX2293"] if is_known else [])


WRONG = {
    "a list": ("[1, 2]\n", "RBX2231", 1),
    "a manifest": ("rbx: 1\nkind: Robot\nname: a\n", "RBX2231", 1),
    "nothing": ("n: {ros__parameters: {}}\n", "RBX2238", 0),
    "lists of maps": ("a: 1\nb: [{c: 1}]\n", "RBX2230", 2),
    "infinite": ("a: 1\nb: .inf\n", "RBX1109", 2),
    "simulated time": ("a: 1\nuse_sim_time: true\n", "RBX2230", 2),
    "a sign that nobody sees": ('a: 1\nb: "\\e[31m"\n', "RBX1106", 2),
    "empty": ("a: 1\nb:\n", "RBX2230", 2),
}


@for_all("name", WRONG)
def test_what_cannot_be_carried_over_is_told(name: str, tmp_path: Path) -> None:
    text, code, line = WRONG[name]
    assert (code, line) in params(tmp_path, text).told


VALUES = st.recursive(
    st.booleans()
    | st.integers(-(10**9), 10**9)
    | st.floats(-1e9, 1e9)
    | st.text(st.characters(codec="ascii", exclude_categories=["C"]), max_size=8),
    lambda below: st.lists(below, max_size=3) | st.dictionaries(st.sampled_from("abAB.é "), below, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from(["node", "/a/b", "**"]), VALUES, max_size=2))
def test_whatever_a_file_says_what_is_written_is_a_robot(
    tmp_path_factory: pytest.TempPathFactory, nodes: dict[str, Any]
) -> None:
    folder = tmp_path_factory.mktemp("any")
    found = params(folder, yaml.safe_dump({name: {"ros__parameters": node} for name, node in nodes.items()}))
    if found.text:
        assert set(check_text(found.text, folder).codes) <= {"RBX1209"}  # what is not used yet is told

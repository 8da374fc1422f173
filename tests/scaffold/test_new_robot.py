"""A new robot has no findings and does its mission, whatever its places are."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base.expressions.values import FUNCTIONS
from rbxcompose.commands.new_files import AnswerError
from rbxcompose.compiler.composition.robot_file import RESERVED
from rbxcompose.manifest.registry import robot_keys
from rbxcompose.missions.program.registry import kinds, modifier_keys
from rbxcompose.testing import Checked, Golden, check_file, run_robot
from rbxcompose.tools.scaffold import DOCK, MOST_PLACES, read_places, robot_files
from tests.soak import rare

WORDS = ["and", "or", "not", "in", "is", "lambda", "do", "then", "else", "when", "m"]
WORDS += ["place", "battery", "pose", "base", "dock", "low"]
number = st.floats(-50, 50).map(lambda x: f"{x:.2f}")


def written(folder: Path, *places: str) -> Checked:
    for name, text in robot_files("cart", goals=read_places(places)).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return check_file(folder / "robots/cart/robot.yaml")


def findings(folder: Path, *places: str) -> str:
    """Return what there is to be said of the robot, or the code for which its places are refused."""
    try:
        return written(folder, *places).text
    except AnswerError as error:
        return error.finding.code


def test_it_is_written_as_people_would_write_it(golden: Golden) -> None:
    for name, text in robot_files("cart").items():
        golden.check(f"robot/{name}.txt", text)


ODD = sorted({*WORDS, *RESERVED, *robot_keys(), *FUNCTIONS, *modifier_keys(), *kinds(), "go_to", "recharge"})


@pytest.mark.parametrize("name", [*ODD[::5], *rare(*(name for number, name in enumerate(ODD) if number % 5))])
def test_a_place_with_an_odd_name_is_refused_or_fine(name: str, tmp_path: Path) -> None:
    assert findings(tmp_path, f"{name}=1,1") in ("", "RBX9102")


@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.dictionaries(
        st.from_regex("[a-z][a-z0-9_]{0,9}", fullmatch=True), st.tuples(number, number), min_size=1, max_size=6
    )
)
def test_it_has_no_findings_wherever_its_places_are(tmp_path: Path, places: dict[str, tuple[str, str]]) -> None:
    texts = [f"{name}={x},{y}" for name, (x, y) in places.items()]
    assert findings(tmp_path, *texts) in ("", "RBX9102", "RBX9103")


@pytest.mark.parametrize("places", [["near=20 cm,0", "behind=-1,0,180 deg"], *rare(["far=12,12", "other=-12,-12"])])
def test_it_does_its_mission_also_from_a_nearly_empty_battery(places: list[str], tmp_path: Path) -> None:
    written(tmp_path, *places)
    for level in ("100 %", "31 %"):
        found = check_file(tmp_path / "robots/cart/robot.yaml", sets=[f"battery.initial={level}"])
        assert run_robot(found.plan).outcome == "success"


def test_places_at_one_spot_are_refused() -> None:
    for places in (["a=1,1", "b=1.05,1"], [f"a={DOCK.x},{DOCK.y}"], ["a=1,1", "a=2,2"]):
        with pytest.raises(AnswerError):
            read_places(places)


def test_so_are_too_many_of_them() -> None:
    with pytest.raises(AnswerError, match="more than 20"):
        read_places([f"p{number}={number + 1},0" for number in range(MOST_PLACES + 1)])

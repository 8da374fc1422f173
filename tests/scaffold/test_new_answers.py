"""What a person answers is read, or refused with a reason; nothing in between."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.commands.new_files import AnswerError, read_name, read_place, read_text, read_yes
from rbxcompose.testing import check_file
from rbxcompose.tools.scaffold import read_base, read_component_name, robot_files
from tests.loops import for_all

WRONG_NAMES = ["", "Cart", "my-cart", "1st", "_x", "a b", "../x", "a/b", "a" * 61, "ä", "a\n", "true", "null"]


def refusal(read: object, *arguments: object) -> str:
    assert callable(read)
    with pytest.raises(AnswerError) as caught:
        read(*arguments)
    return f"{caught.value.finding.code} {caught.value.finding.message} {caught.value.finding.help}"


@for_all("name", WRONG_NAMES)
def test_what_is_no_name_in_a_manifest_is_none_here(name: str) -> None:
    assert refusal(read_name, name, "the robot").startswith("RBX9102")


def test_a_name_that_is_nearly_one_is_mended() -> None:
    assert refusal(read_name, "My-Cart 2!", "the robot").endswith("did you mean 'my_cart_2'?")


@for_all("name", ["class", "match", "random", "numpy", "pytest", "rbxcompose", "go_to", "float32"])
def test_a_component_is_not_named_like_what_python_or_rbxcompose_has(name: str) -> None:
    assert refusal(read_component_name, name).startswith("RBX9102")


def test_a_place_has_its_numbers_in_metres_or_with_units() -> None:
    assert read_place("table=2,-50 cm") == read_place("table = 2 m , -0.5m, 0 deg")
    assert read_place("door=1,1,90 deg").heading == pytest.approx(1.5708, abs=1e-4)


@pytest.mark.parametrize(
    "text", ["table", "table=1", "table=1,2,3,4", "=1,2", "table=1,x", "table=1,2 s", "table=1,2,90"]
)
def test_a_place_that_is_written_otherwise_is_refused(text: str) -> None:
    assert refusal(read_place, text).startswith("RBX910")


@pytest.mark.parametrize("text", ["table=nan,0", "table=1e400,0", "table=101,0", "table=inf,1"])
def test_a_place_must_be_one_that_can_be_reached(text: str) -> None:
    assert refusal(read_place, text).startswith("RBX9103")


def test_a_base_follows_commands_and_needs_no_settings() -> None:
    assert read_base("diff_drive_sim") == "diff_drive_sim"
    assert "did you mean 'diff_drive_sim'?" in refusal(read_base, "diff_drive")
    assert "needs settings" in refusal(read_base, "battery_sim")
    assert "does not follow 'cmd_vel'" in refusal(read_base, "go_to")


def test_yes_and_no() -> None:
    assert [read_yes(text) for text in ("y", "YES", "no", "N")] == [True, True, False, False]
    assert refusal(read_yes, "perhaps").startswith("RBX9103")


@pytest.mark.parametrize("text", ["", "  ", "two\nlines", "a\tb", "\x1b[31m", "x" * 201, "\u202e"])
def test_a_sentence_is_one_line_that_a_manifest_may_hold(text: str) -> None:
    assert refusal(read_text, text).startswith("RBX9103")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.text(min_size=1, max_size=30)
    | st.sampled_from(["a: b", "$", "# x", "$x ${y}", "it's", '"', "true", "- a", "\\n"])
)
def test_every_sentence_comes_out_of_the_robot_as_it_went_in(tmp_path: Path, text: str) -> None:
    try:
        about = read_text(text)
    except AnswerError:
        return
    for name, content in robot_files("cart", about).items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
    found = check_file(tmp_path / "robots/cart/robot.yaml")
    assert found.text == ""
    assert found.compilation.robot
    assert found.compilation.robot.manifest.about == about

"""Messages as a person writes and reads them."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus.graph import WireType
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.messages import message_from, message_type, shown, to_json, to_text, type_of
from rbxcompose.msgs import registry
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.plain import to_plain
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.std_msgs import Bool, Int32, String


def test_a_message_is_read_from_yaml() -> None:
    assert message_from(Twist, "{linear: {x: 0.1}}") == Twist(linear=Vector3(x=0.1))
    assert message_from(Twist, "linear:\n  x: 1") == Twist(linear=Vector3(x=1.0))
    assert message_from(Twist, "") == Twist()


def test_a_mistake_has_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    assert message_from(Twist, "{linaer: {x: 0.1}}") is None
    told = capsys.readouterr().err
    assert "error[RBX9023]" in told
    assert "--> MESSAGE:1:2" in told
    assert "did you mean 'linear'?" in told
    assert "check --fix" not in told  # of no file


@pytest.mark.parametrize("number", [".nan", ".inf", "-.inf", ".NaN", ".Inf"])
def test_only_a_real_number_of_a_message_need_not_be_finite(number: str, capsys: pytest.CaptureFixture[str]) -> None:
    scan = message_from(LaserScan, f"{{range_max: {number}, ranges: [1.5, {number}]}}")
    assert scan is not None
    assert not math.isfinite(scan.range_max)
    assert scan.ranges.tolist() == pytest.approx([1.5, scan.range_max], nan_ok=True)
    shown_again = message_from(LaserScan, to_text(to_plain(scan)))
    assert shown_again is not None
    assert to_text(to_plain(shown_again)) == to_text(to_plain(scan))
    for message in (Int32, String, Bool):
        assert message_from(message, f"data: {number}") is None
        assert "error[RBX9024]" in capsys.readouterr().err


def test_a_number_that_is_too_large_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert message_from(Twist, "{linear: {x: 1e999}}") is None
    assert "error[RBX1109]: this number is too large" in capsys.readouterr().err


def test_yaml_that_is_none_is_a_finding(capsys: pytest.CaptureFixture[str]) -> None:
    assert message_from(Twist, "{linear: [}") is None
    assert "error[RBX1102]" in capsys.readouterr().err


NUMBERS = st.floats(allow_nan=False)
VECTORS = st.builds(Vector3, NUMBERS, NUMBERS, NUMBERS)


@given(st.builds(Twist, VECTORS, VECTORS))
def test_what_is_shown_can_be_given_back(message: Twist) -> None:
    assert message_from(Twist, to_text(to_plain(message))) == message


def test_nothing_that_is_shown_can_steer_the_terminal() -> None:
    text = to_text(to_plain(String(data="\x1b[2J \u202e \x9b")))
    assert text.isprintable()
    assert to_json({"data": "\x1b\u202e"}).isprintable()


def test_long_lists_are_cut_in_text_only() -> None:
    data = {"values": list(range(1000))}
    assert "... and 872 more" in to_text(data)
    assert json.loads(shown(data, as_json=True)) == data


def test_json_has_null_for_what_is_no_number() -> None:
    assert to_json({"data": [float("nan"), float("inf"), 1.0]}) == '{"data": [null, null, 1.0]}'


def test_a_misspelt_type_is_told_what_was_probably_meant() -> None:
    with pytest.raises(NotDoneError) as raised:
        message_type("std_msgs/Strin")
    assert raised.value.finding.help == "did you mean 'std_msgs/msg/String'?"


def test_another_definition_of_a_type_is_not_read() -> None:
    assert type_of(WireType("std_msgs/msg/String", "TypeHashNotSupported"), "msg", registry.message) is String
    with pytest.raises(NotDoneError, match="another definition"):
        type_of(WireType("std_msgs/msg/String", "RIHS01_00"), "msg", registry.message)

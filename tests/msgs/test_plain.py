"""Messages as plain data: the way there and back, and what is said of data that are no message."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.geometry_msgs import PoseWithCovariance, Twist, Vector3
from rbxcompose.msgs.plain import from_plain, to_plain
from rbxcompose.msgs.std_msgs import Float32, Int32, String
from rbxcompose.msgs.types import Message
from rbxcompose.msgs.unique_identifier_msgs import UUID
from tests.loops import for_all
from tests.msgs.samples import EVERYTHING, any_message


@given(any_message())
def test_there_and_back_is_the_same_message(message: Any) -> None:
    data = json.loads(json.dumps(to_plain(message)))
    made, findings = from_plain(type(message), data)
    assert findings == []
    assert made is not None
    assert encode(made) == encode(message)


def test_a_small_float_is_shown_as_it_was_written() -> None:
    assert to_plain(Float32(data=0.20000000298023224)) == {"data": 0.2}
    assert to_plain(Float32(data=3.4028234663852886e38)) == {"data": 3.4028235e38}


def test_what_is_left_out_keeps_its_default() -> None:
    assert from_plain(Twist, {"linear": {"x": 1}}) == (Twist(linear=Vector3(x=1.0)), [])
    assert from_plain(Twist, None) == (Twist(), [])
    assert from_plain(EVERYTHING, {}) == (EVERYTHING(), [])


def test_bytes_are_lists_of_numbers() -> None:
    assert to_plain(UUID(bytes(range(16)))) == {"uuid": list(range(16))}


WRONG: list[tuple[type[Message], object, str]] = [
    (Twist, {"linaer": {}}, "geometry_msgs/msg/Twist has no field 'linaer'"),
    (Twist, {"linear": {"w": 1}}, "geometry_msgs/msg/Vector3 has no field 'w'"),
    (Twist, {"linear": 3}, "linear: geometry_msgs/msg/Vector3 is a map of its fields"),
    (Twist, [1], "geometry_msgs/msg/Twist is a map of its fields"),
    (Twist, {"linear": {"x": "fast"}}, "linear.x: expected a number (float64), without a unit"),
    (Twist, {"linear": {"x": True}}, "linear.x: expected a number (float64), without a unit"),
    (Twist, {"linear": {"x": 10**400}}, "linear.x: this number is too large for a float64"),
    (Float32, {"data": 1e39}, "data: this number is too large for a float32"),
    (Int32, {"data": 1.5}, "data: expected a whole number from -2147483648 to 2147483647 (int32)"),
    (Int32, {"data": 2**31}, "data: expected a whole number from -2147483648 to 2147483647 (int32)"),
    (String, {"data": 1}, "data: expected text; quote a number or a flag that is meant as text"),
    (PoseWithCovariance, {"covariance": [1.0]}, "covariance: 36 values are expected, not 1"),
    (PoseWithCovariance, {"covariance": 1.0}, "covariance: expected a list (float64[36])"),
    (UUID, {"uuid": [256] * 16}, "uuid.0: expected a whole number from 0 to 255 (uint8)"),
    (EVERYTHING, {"yes": 1}, "yes: expected true or false"),
    (EVERYTHING, {"short": "longer"}, "short: at most 5 bytes of text are expected, not 6"),
    (EVERYTHING, {"few": [1, 2, 3, 4, 5]}, "few: at most 4 values are expected, not 5"),
]


@for_all("message, data, words", WRONG)
def test_a_mistake_is_a_finding(message: type[Message], data: object, words: str) -> None:
    made, findings = from_plain(message, data)
    assert made is None
    assert findings[0].message == words


def test_a_misspelt_field_is_told_what_was_probably_meant() -> None:
    _, findings = from_plain(Twist, {"linaer": {}})
    assert findings[0].help == "did you mean 'linear'?"


_DATA = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(["linear", "angular", "x", "y", "else"]), inner),
)


@given(_DATA)
def test_whatever_is_given_is_a_message_or_findings(data: object) -> None:
    made, findings = from_plain(Twist, data)
    assert (made is None) == bool(findings)

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.msgs.fields import NotFiniteError, is_finite, require_finite
from rbxcompose.msgs.geometry_msgs import PoseWithCovariance, Transform, TransformStamped, Twist, Vector3
from rbxcompose.msgs.std_msgs import Float32, Int32, String
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.types import Message

numbers = st.floats(width=64)


@given(st.tuples(*[numbers] * 6))
def test_a_twist_is_finite_exactly_if_all_its_numbers_are(values: tuple[float, ...]) -> None:
    twist = Twist(linear=Vector3(*values[:3]), angular=Vector3(*values[3:]))
    assert is_finite(twist) is all(map(math.isfinite, values))


def tf(x: float) -> TFMessage:
    return TFMessage(transforms=(TransformStamped(), TransformStamped(transform=Transform(translation=Vector3(x=x)))))


def covariance(x: float) -> PoseWithCovariance:
    values: Any = np.zeros(36)
    values[35] = x
    return PoseWithCovariance(covariance=values)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("make", [tf, covariance, lambda x: Float32(data=x)], ids=["in a list", "in an array", "alone"])
def test_no_number_is_overlooked_however_deep(make: Any, bad: float) -> None:
    assert is_finite(make(1.0))
    assert not is_finite(make(bad))
    with pytest.raises(NotFiniteError, match="is not finite"):
        require_finite(make(bad))


@pytest.mark.parametrize("message", [String(data="nan"), Int32(data=2**31 - 1), TFMessage()], ids=str)
def test_what_has_no_such_numbers_is_finite(message: Message) -> None:
    assert is_finite(message)

from __future__ import annotations

from rbxcompose.base.expressions.types import TYPES
from rbxcompose.base.units import RATIO, to_si
from rbxcompose.missions.execution.world import Arrivals
from rbxcompose.missions.sources import ValueSource
from rbxcompose.msgs.std_msgs import Float32


def test_a_whole_percentage_is_the_one_that_a_mission_writes_down() -> None:
    arrivals = Arrivals({"battery": ValueSource("battery_level", "Float32", "data", 1, 100, TYPES["ratio"])})
    for percent in range(101):
        assert arrivals.take("battery", Float32(data=float(percent)), 0.0) == ""
        assert arrivals.value("battery") == to_si(f"{percent} %", RATIO)

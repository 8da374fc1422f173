"""Settings of components that change while they work."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.testing import Bench, instance


def test_a_battery_drains_at_its_new_pace_from_where_it_is() -> None:
    bench = Bench(instance("battery", "battery_sim", {"runtime": "100 s"}))
    levels = bench.collect("/battery_level", Float32)
    bench.advance(10.0)
    bench.set_live("battery", runtime=10.0, warn=0.95)
    bench.advance(1.0)
    assert [round(level.data) for level in levels][-2:] == [90, 80]
    assert "battery: Medium battery: 90 %" in bench.texts()


def test_a_base_follows_its_new_limits_from_the_next_command_on() -> None:
    bench = Bench(instance("base", "diff_drive_sim"))
    base: Any = bench.component("base")
    bench.set_live("base", max_speed=0.1, command_timeout="2 s")
    bench.publish("/cmd_vel", Twist(linear=Vector3(x=0.15)))
    bench.advance(1.5)
    assert base.core.velocity.linear == pytest.approx(0.1)
    bench.advance(1.5)
    assert bench.host.is_at_rest


def test_going_to_a_place_takes_its_new_speed() -> None:
    bench = Bench(instance("go_to", "go_to"))
    bench.set_live("go_to", speed="0.1 m/s", tolerance="1 cm")
    go_to: Any = bench.component("go_to")
    assert (go_to.core.settings.speed, go_to.core.settings.distance_tolerance) == (0.1, 0.01)

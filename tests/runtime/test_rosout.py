"""Log lines of components as ROS 2 tools read them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.msgs.rcl_interfaces import Log
from rbxcompose.testing import Bench, instance


@pytest.mark.parametrize(("level", "number"), [(Level.OK, Log.INFO), (Level.WARN, Log.WARN), (Level.ERROR, Log.ERROR)])
def test_a_log_line_goes_out_on_rosout_with_its_level_and_component(level: Level, number: int) -> None:
    bench = Bench(instance("battery", "battery_sim", {"runtime": "45 s"}))
    lines = bench.collect("/rosout", Log)
    bench.component("battery").context.log(level, "hello")
    bench.advance(0.0)
    assert [(line.level, line.name, line.msg) for line in lines] == [(number, "battery", "hello")]


def test_a_failure_is_told_on_rosout_too() -> None:
    bench = Bench(instance("battery", "battery_sim", {"runtime": "45 s"}))
    lines = bench.collect("/rosout", Log)
    bench.host.failed("battery", ValueError("planted"))
    bench.advance(0.0)
    assert (lines[0].level, lines[0].name, "planted" in lines[0].msg) == (Log.ERROR, "battery", True)


def test_what_is_below_the_level_of_a_component_goes_nowhere() -> None:
    bench = Bench(replace(instance("battery", "battery_sim", {"runtime": "45 s"}), log=Level.WARN))
    lines = bench.collect("/rosout", Log)
    for level in (Level.OK, Level.WARN, Level.ERROR):
        bench.component("battery").context.log(level, level.name)
    bench.advance(0.0)
    assert [line.msg for line in lines] == ["WARN", "ERROR"]
    assert [record.text for record in bench.records] == ["WARN", "ERROR"]

from __future__ import annotations

from rbxcompose.levels import Level
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus
from rbxcompose.testing import Bench, instance


def bench() -> Bench:
    config = {"analyzers": {"power": {"match": ["battery"]}}, "expected": ["battery", "diagnostics"]}
    return Bench(
        instance("battery", "battery_sim", {"runtime": "10 s"}), instance("diagnostics", "diagnostics", config)
    )


def levels(report: DiagnosticArray) -> dict[str, int]:
    return {status.name: status.level for status in report.status}


def test_statuses_are_sorted_into_groups() -> None:
    robot = bench()
    reports = robot.collect("/diagnostics_agg", DiagnosticArray)
    robot.advance(1.0)
    assert levels(reports[-1]) == {"/power": 0, "/power/battery": 0, "/Other": 0, "/Other/diagnostics": 0}


def test_a_new_level_is_reported_at_the_same_instant_and_told() -> None:
    robot = bench()
    reports = robot.collect("/diagnostics_agg", DiagnosticArray)
    robot.advance(6.0)
    assert levels(reports[-1])["/power"] == Level.WARN
    assert "diagnostics: /power is WARN: battery: Medium battery" in robot.texts()


def test_a_component_that_raises_is_an_error_with_its_line() -> None:
    robot = bench()
    reports = robot.collect("/diagnostics_agg", DiagnosticArray)
    robot.host.failed("battery", RuntimeError("planted"))
    robot.advance(0.01)
    assert levels(reports[-1])["/power"] == Level.ERROR


def test_components_that_are_lost_are_stale_with_the_cause() -> None:
    robot = bench()
    robot.advance(1.0)
    reports = robot.collect("/diagnostics_agg", DiagnosticArray)
    robot.host.lost(("battery",), "its process was killed (signal 9)")
    robot.advance(0.0)
    status = next(one for one in reports[-1].status if one.name == "/power/battery")
    assert (status.level, status.message) == (Level.STALE, "its process was killed (signal 9)")


def test_going_down_nothing_is_told_to_have_become_better() -> None:
    robot = bench()
    robot.advance(6.0)
    robot.host.brake()
    robot.advance(0.0)
    robot.publish("/diagnostics", DiagnosticArray(status=(DiagnosticStatus(name="battery", level=0),)))
    robot.advance(1.0)
    assert [text for text in robot.texts() if "/power" in text] == [
        "diagnostics: /power is WARN: battery: Medium battery"
    ]
    robot.advance(3.0)
    assert robot.texts()[-1] == "diagnostics: /power is ERROR: battery: Low battery"

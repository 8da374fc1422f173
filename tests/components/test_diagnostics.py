from __future__ import annotations

import json
from typing import Any

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Refused, to_data
from rbxcompose.domains.diagnostics.requests import Acknowledge, ListChanges, ShowDiagnostics
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus
from rbxcompose.runtime.channel import Repeated
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
    status = next(candidate for candidate in reports[-1].status if candidate.name == "/power/battery")
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


def strangers(config: dict[str, Any], *levels: int) -> Bench:
    """Return a bench with nothing but diagnostics, after statuses of `arm`, one every 0.3 s."""
    robot = Bench(instance("diagnostics", "diagnostics", {"expected": ["diagnostics"], **config}))
    robot.advance(0.1)
    for level in levels:
        robot.publish("/diagnostics", DiagnosticArray(status=(DiagnosticStatus(level, "arm", "hm"),)))
        robot.advance(0.3)
    return robot


def test_the_level_of_the_robot_has_a_topic_with_its_cause() -> None:
    robot = strangers({"analyzers": {"arm": {"match": ["arm"]}}})
    states = robot.collect("/diagnostics_toplevel_state", DiagnosticStatus)
    robot.publish("/diagnostics", DiagnosticArray(status=(DiagnosticStatus(2, "arm", "hot"),)))
    robot.advance(0.0)
    assert states[-1] == DiagnosticStatus(2, "toplevel_state", "/arm: arm: hot")


def test_each_change_of_a_level_is_published_once_with_its_cause() -> None:
    robot = strangers({"analyzers": {"arm": {"match": ["arm"]}}})
    told = robot.collect("/diagnostics_changes", DiagnosticArray)
    robot.publish("/diagnostics", DiagnosticArray(status=(DiagnosticStatus(1, "arm", "warm"),)))
    robot.advance(3.0)
    assert [(status.name, status.level, status.message) for array in told for status in array.status] == [
        ("/arm/arm", 1, "warm"),
        ("/arm", 1, "arm: warm"),
    ]


def test_levels_that_flap_are_reported_at_intervals_and_remembered_each() -> None:
    robot = strangers({"analyzers": {"arm": {"match": ["arm"]}}})
    reports = robot.collect("/diagnostics_agg", DiagnosticArray)
    for index in range(100):
        robot.publish("/diagnostics", DiagnosticArray(status=(DiagnosticStatus(index % 2, "arm", "hm"),)))
        robot.advance(0.01)
    assert len(reports) <= 22
    assert len(robot.host.ask("diagnostics", ListChanges())) == 2 * 99


def test_people_see_the_tree_and_acknowledge_what_is_latched() -> None:
    robot = strangers({"analyzers": {"arm": {"match": ["arm"], "latch": True}}}, 2, 0)
    tree = robot.host.ask("diagnostics", ShowDiagnostics())
    assert (tree.level, tree.cause) == (Level.ERROR, "/arm: arm: hm (latched since 0.1 s, OK now)")
    assert [(line.depth, line.path, line.is_group) for line in tree.lines[:2]] == [
        (0, "/arm", True),
        (1, "/arm/arm", False),
    ]
    with pytest.raises(Refused, match="there is no group '/amr'"):
        robot.host.ask("diagnostics", Acknowledge("amr"))
    assert robot.host.ask("diagnostics", Acknowledge("/arm")) == "acknowledged: /arm"
    with pytest.raises(Refused, match="no level is latched"):
        robot.host.ask("diagnostics", Acknowledge())
    assert robot.host.ask("diagnostics", ShowDiagnostics()).level is Level.OK


def test_other_groups_take_effect_while_the_robot_runs_and_keep_what_is_known() -> None:
    robot = strangers({"analyzers": {"arm": {"match": ["arm"], "latch": True}}}, 2, 0)
    changed = {"analyzers": {"arm": {"match": ["arm"], "latch": True}, "rest": {"match": ["diagnostics"]}}}
    robot.host.prepare([instance("diagnostics", "diagnostics", {"expected": ["diagnostics"], **changed})])
    robot.host.activate(["diagnostics"])
    robot.advance(0.0)
    tree = robot.host.ask("diagnostics", ShowDiagnostics())
    assert [line.path for line in tree.lines] == ["/arm", "/arm/arm", "/rest", "/rest/diagnostics"]
    assert (tree.level, len(robot.host.ask("diagnostics", ListChanges()))) == (Level.ERROR, 3)


def test_what_is_latched_outlives_a_restart_and_the_history_begins_with_it() -> None:
    robot = strangers({"analyzers": {"arm": {"match": ["arm"], "latch": True}}}, 2, 0)
    robot.host.failed("diagnostics", RuntimeError("planted"))
    robot.advance(2.0)
    tree = robot.host.ask("diagnostics", ShowDiagnostics())
    assert (tree.level, tree.cause) == (Level.ERROR, "/arm: arm: hm (latched since 0.1 s, OK now)")
    first = robot.host.ask("diagnostics", ListChanges())[0]
    assert (first.path, first.cause) == ("/diagnostics", "has started again: earlier changes are forgotten")
    robot.host.ask("diagnostics", Acknowledge())
    robot.advance(0.3)
    robot.host.failed("diagnostics", RuntimeError("planted"))
    robot.advance(2.0)
    assert robot.host.ask("diagnostics", ShowDiagnostics()).level is Level.OK


def test_what_is_latched_after_a_restart_does_not_replace_what_was_latched_before() -> None:
    robot = Bench(instance("diagnostics", "diagnostics", {"analyzers": {"arm": {"match": ["arm"], "latch": True}}}))
    robot.host.is_restart = True  # as in a process that has started again: its supervisor sends them a little later
    robot.host.prepare(robot.plan.instances)
    robot.host.activate(["diagnostics"])
    robot.publish("/diagnostics", DiagnosticArray(status=(DiagnosticStatus(2, "arm", "hm"),)))
    robot.advance(0.1)
    assert not any(isinstance(event, Repeated) for event in robot.events)
    robot.advance(0.5)
    assert any(isinstance(event, Repeated) for event in robot.events)


def test_the_profile_of_ros_1_reports_at_its_rate_only() -> None:
    robot = strangers({"profile": "ros1", "analyzers": {"arm": {"match": ["arm"]}}}, 0)
    reports = robot.collect("/diagnostics_agg", DiagnosticArray)
    robot.publish("/diagnostics", DiagnosticArray(status=(DiagnosticStatus(2, "arm", "hot"),)))
    robot.advance(0.0)
    assert reports == []
    robot.advance(1.0)
    assert levels(reports[-1])["/arm"] == Level.ERROR


def test_a_flood_of_names_is_cut_off_with_one_line_in_the_log() -> None:
    robot = strangers({})
    for start in range(0, 12_000, 4_000):
        names = (f"name {index}" for index in range(start, start + 4_000))
        robot.publish("/diagnostics", DiagnosticArray(status=tuple(DiagnosticStatus(0, name) for name in names)))
        robot.advance(0.1)
    told = [text for text in robot.texts() if "left out" in text]
    assert told == ["diagnostics: there are 10,000 statuses: further names are left out; `diag tree` counts them"]
    tree = robot.host.ask("diagnostics", ShowDiagnostics())
    assert (tree.dropped, len(tree.lines) + tree.left_out) == (2_001, 10_001)
    assert len(json.dumps(to_data(tree))) < 200_000  # what a control socket takes at once

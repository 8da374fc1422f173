"""Promises of the aggregator."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.diagnostics import core
from rbxcompose.diagnostics.core import Aggregator, Analyzer
from rbxcompose.diagnostics.status import Status
from rbxcompose.levels import Level, combined

OK, WARN, ERROR, STALE = Level
POWER = {"power": Analyzer(match=("battery", "charger"))}


def tree(aggregator: Aggregator, now: float) -> dict[str, tuple[Level, str]]:
    """Return the report by name, in its order."""
    return {status.name: (status.level, status.message) for status in aggregator.report(now)}


def fed(*statuses: Status, analyzers: dict[str, Analyzer] = POWER, now: float = 0.0) -> Aggregator:
    aggregator = Aggregator(analyzers)
    aggregator.feed(now, statuses)
    return aggregator


def test_items_hang_below_the_header_of_their_group() -> None:
    aggregator = fed(Status("charger", OK, "charging"), Status("battery", OK, "Battery OK"))
    assert tree(aggregator, 1.0) == {
        "/power": (OK, "OK"),
        "/power/battery": (OK, "Battery OK"),
        "/power/charger": (OK, "charging"),
    }
    assert list(tree(aggregator, 1.0)) == ["/power", "/power/battery", "/power/charger"]


def test_a_header_names_its_worst_item_and_lists_all() -> None:
    aggregator = fed(Status("battery", WARN, "Medium battery"), Status("charger", OK, "idle"))
    header = aggregator.report(1.0)[0]
    assert (header.level, header.message) == (WARN, "battery: Medium battery")
    assert header.values == (("battery", "Medium battery"), ("charger", "idle"))


def test_values_and_hardware_of_an_item_are_kept() -> None:
    item = fed(Status("battery", OK, "fine", "pack 7", (("volts", "12.1"),))).report(0.0)[1]
    assert (item.hardware_id, item.values) == ("pack 7", (("volts", "12.1"),))


@pytest.mark.parametrize(
    ("pattern", "name", "matches"),
    [
        ("battery", "battery", True),
        ("battery", "battery: cell 3", True),
        ("battery", "battery_2", False),
        ("battery", "Battery", False),
        ("*_joint", "head_pan_joint", True),
        ("*_joint", "head_pan_joint: temperature", True),
        ("battery: cell*", "battery: cell 3", True),
        ("battery: cell*", "battery: volts", False),
        ("arm[1]", "arm[1]", True),
    ],
)
def test_a_pattern_is_a_name_or_a_glob_and_takes_details_along(pattern: str, name: str, matches: bool) -> None:
    assert Analyzer(match=(pattern,)).matches(name) is matches


def test_an_item_may_stand_in_several_groups() -> None:
    both = {"a": Analyzer(match=("battery",)), "b": Analyzer(match=("bat*",))}
    assert list(tree(fed(Status("battery", OK), analyzers=both), 0.0)) == ["/a", "/a/battery", "/b", "/b/battery"]


def test_what_no_analyzer_matches_stands_under_other() -> None:
    assert tree(fed(Status("moon", ERROR, "full")), 0.0) == {
        "/power": (OK, "nothing reported yet"),
        "/Other": (ERROR, "moon: full"),
        "/Other/moon": (ERROR, "full"),
    }


def test_a_slash_in_a_name_opens_no_level_of_its_own() -> None:
    assert "/Other/lidar front" in tree(fed(Status("/lidar/front", OK)), 0.0)


def test_an_item_is_stale_just_after_its_timeout_and_keeps_its_last_message() -> None:
    aggregator = fed(Status("battery", OK, "Battery OK"), now=2.0)
    assert tree(aggregator, 7.0)["/power/battery"] == (OK, "Battery OK")
    assert tree(aggregator, 7.01)["/power/battery"] == (STALE, "silent since 2.0 s, last: Battery OK")


def test_each_group_has_a_timeout_of_its_own() -> None:
    groups = {"fast": Analyzer(match=("battery",), timeout=1.0), "slow": Analyzer(match=("battery",), timeout=9.0)}
    report = tree(fed(Status("battery", OK), analyzers=groups), 2.0)
    assert report["/fast"][0] is STALE
    assert report["/slow"][0] is OK


def test_some_stale_items_are_an_error_and_all_of_them_are_stale() -> None:
    aggregator = fed(Status("battery", OK), Status("charger", OK))
    aggregator.feed(4.0, [Status("charger", OK)])
    assert tree(aggregator, 6.0)["/power"] == (ERROR, "battery: silent since 0.0 s")
    assert tree(aggregator, 9.5)["/power"][0] is STALE


def test_a_group_in_which_nothing_ever_reported_is_stale_after_its_timeout() -> None:
    aggregator = Aggregator(POWER, started=10.0)
    assert tree(aggregator, 15.0) == {"/power": (OK, "nothing reported yet")}
    assert tree(aggregator, 15.1) == {"/power": (STALE, "nothing reported")}


def test_an_expected_part_that_never_reports_is_named() -> None:
    aggregator = Aggregator({"power": Analyzer(expected=("battery",))}, started=1.0)
    assert tree(aggregator, 6.0)["/power/battery"] == (OK, "has not reported yet")
    assert tree(aggregator, 6.1)["/power/battery"] == (STALE, "never reported")


def test_a_detail_of_an_expected_part_is_a_report_of_it() -> None:
    aggregator = Aggregator({"power": Analyzer(expected=("battery",))})
    aggregator.feed(6.0, [Status("battery: volts", OK, "12 V")])
    assert tree(aggregator, 6.1) == {"/power": (OK, "OK"), "/power/battery: volts": (OK, "12 V")}


def test_a_lost_part_is_stale_at_once_with_the_cause_until_it_reports_again() -> None:
    aggregator = fed(Status("battery", OK, "Battery OK"))
    aggregator.lost(0.1, ["battery"], "process robot gone (exit -9)")
    assert tree(aggregator, 0.1)["/power/battery"] == (STALE, "process robot gone (exit -9)")
    aggregator.feed(0.4, [Status("battery", OK, "Battery OK")])
    assert tree(aggregator, 0.4)["/power/battery"] == (OK, "Battery OK")


def test_losing_a_part_loses_its_details_and_no_other_part() -> None:
    aggregator = fed(Status("battery: volts", OK), Status("battery: heat", OK), Status("battery_2", OK))
    aggregator.lost(0.1, ["battery"], "gone")
    report = tree(aggregator, 0.1)
    assert report["/power/battery: volts"] == report["/power/battery: heat"] == (STALE, "gone")
    assert report["/Other/battery_2"][0] is OK


def test_a_part_that_is_lost_before_it_reported_is_shown_until_it_reports() -> None:
    aggregator = Aggregator(POWER)
    aggregator.lost(0.1, ["battery"], "gone")
    assert tree(aggregator, 0.1)["/power/battery"] == (STALE, "gone")
    aggregator.feed(0.2, [Status("battery: volts", OK)])
    assert list(tree(aggregator, 0.2)) == ["/power", "/power/battery: volts"]


def test_a_change_of_a_group_is_told_once_until_it_is_reported() -> None:
    aggregator = fed(Status("battery", OK))
    assert aggregator.changed(0.0)
    aggregator.report(0.0)
    assert not aggregator.changed(0.1)
    aggregator.feed(0.2, [Status("battery", ERROR, "Low battery")])
    assert aggregator.changed(0.2)
    aggregator.report(0.2)
    assert not aggregator.changed(0.3)


def test_falling_silent_is_a_change() -> None:
    aggregator = fed(Status("battery", OK))
    aggregator.report(0.0)
    assert not aggregator.changed(5.0)
    assert aggregator.changed(5.1)


def test_another_message_at_the_same_level_is_no_change() -> None:
    aggregator = fed(Status("battery", OK, "91 %"))
    aggregator.report(0.0)
    aggregator.feed(0.1, [Status("battery", OK, "90 %")])
    assert not aggregator.changed(0.1)


def test_statuses_of_new_names_are_dropped_and_counted_when_there_is_no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(core, "MOST_ITEMS", 1)
    aggregator = fed(Status("a", OK), Status("b", OK), Status("a", WARN))
    assert aggregator.dropped == 1
    assert tree(aggregator, 0.0)["/Other/a"][0] is WARN


NAMES = st.sampled_from(["battery", "battery: volts", "charger", "base", "go_to", "moon"])
STATUSES = st.builds(Status, NAMES, st.sampled_from(Level), st.sampled_from(["", "fine", "hot"]))
GROUPS = {"power": Analyzer(match=("bat*", "charger"), timeout=2.0), "motion": Analyzer(match=("base", "go_to"))}


@given(st.lists(st.tuples(st.floats(0, 3), st.lists(STATUSES, max_size=4)), max_size=10), st.floats(0, 10))
def test_headers_follow_from_their_items_and_the_top_from_the_headers(
    history: list[tuple[float, list[Status]]], wait: float
) -> None:
    aggregator, now = Aggregator(GROUPS), 0.0
    for pause, statuses in history:
        now += pause
        aggregator.feed(now, statuses)
    now += wait
    levels = {name: level for name, (level, _) in tree(aggregator, now).items()}
    headers = {name: level for name, level in levels.items() if name.count("/") == 1}
    for header, level in headers.items():
        items = [below for name, below in levels.items() if name.startswith(f"{header}/")]
        if items:
            assert level is combined(items)
    assert aggregator.top_level(now) is combined(headers.values())
    assert not aggregator.changed(now)
    heard = {status.name for _, statuses in history for status in statuses}
    assert {name.split("/")[-1] for name in levels if name.count("/") == 2} == heard

"""Promises of the aggregator."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.diagnostics import core as admission
from rbxcompose.domains.diagnostics.core import Aggregator
from rbxcompose.domains.diagnostics.settings import AnalyzerModel, DiagnosticsModel, matches
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus, KeyValue
from tests.diagnostics.trees import ERROR, OK, POWER, STALE, WARN, Groups, aggregator, fed, level, news, status, tree
from tests.loops import for_all


def test_items_hang_below_the_header_of_their_group() -> None:
    made = fed(status("charger", OK, "charging"), status("battery", OK, "Battery OK"))
    assert tree(made, 1.0) == {
        "/power": (OK, "OK"),
        "/power/battery": (OK, "Battery OK"),
        "/power/charger": (OK, "charging"),
    }
    assert list(tree(made, 1.0)) == ["/power", "/power/battery", "/power/charger"]


def test_a_header_names_its_worst_item_and_lists_all() -> None:
    made = fed(status("battery", WARN, "Medium battery"), status("charger", OK, "idle"))
    header = made.report(1.0)[0].status
    assert (header.level, header.message) == (WARN, "battery: Medium battery")
    assert header.values == (KeyValue("battery", "Medium battery"), KeyValue("charger", "idle"))


def test_values_and_hardware_of_an_item_are_kept() -> None:
    told = DiagnosticStatus(OK, "battery", "fine", "pack 7", (KeyValue("volts", "12.1"),))
    item = fed(told).report(0.0)[1].status
    assert (item.hardware_id, item.values) == (told.hardware_id, told.values)


@for_all(
    "pattern, name, expected",
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
        ({"name": "battery"}, "battery: cell 3", False),
        ({"startswith": "cam"}, "camera: rate", True),
        ({"contains": ": rate"}, "camera: rate", True),
        ({"regex": "cam.*"}, "a camera", False),
        ({"regex": "cam.*", "not": "camera_2"}, "camera_2: rate", False),
        ({"any": ["lidar", {"contains": "cam"}]}, "webcam", True),
        ({"all": ["cam*", {"contains": "rate"}]}, "camera: delay", False),
    ],
)
def test_names_match_by_pattern_or_by_what_a_map_says_of_them(pattern: object, name: str, expected: bool) -> None:
    assert matches(AnalyzerModel.model_validate({"match": [pattern]}), name) is expected


def test_an_item_may_stand_in_several_groups() -> None:
    both: Groups = {"a": {"match": ["battery"]}, "b": {"match": ["bat*"]}}
    assert list(tree(fed(status("battery", OK), analyzers=both), 0.0)) == ["/a", "/a/battery", "/b", "/b/battery"]


def test_what_no_analyzer_matches_stands_under_other_until_it_falls_silent() -> None:
    made = fed(status("moon", ERROR, "full"))
    assert tree(made, 0.0) == {
        "/power": (OK, "nothing reported yet"),
        "/Other": (ERROR, "moon: full"),
        "/Other/moon": (ERROR, "full"),
    }
    assert "/Other" not in tree(made, 5.1)


def test_a_component_of_the_robot_never_leaves_the_tree() -> None:
    made = aggregator(expected=("battery", "transforms"))
    assert list(tree(made, 0.0)) == ["/power", "/power/battery", "/Other", "/Other/transforms"]
    assert tree(made, 60.0)["/Other/transforms"] == (STALE, "never reported")


def test_a_slash_in_a_name_opens_no_level_of_its_own() -> None:
    assert "/Other/lidar front" in tree(fed(status("/lidar/front", OK)), 0.0)


def test_an_item_is_stale_just_after_its_timeout_and_keeps_its_last_message() -> None:
    made = fed(status("battery", OK, "Battery OK"), now=2.0)
    assert tree(made, 7.0)["/power/battery"] == (OK, "Battery OK")
    assert tree(made, 7.01)["/power/battery"] == (STALE, "silent since 2.0 s, last: Battery OK")


def test_each_group_has_a_timeout_of_its_own_and_with_zero_none() -> None:
    groups = {
        name: {"match": ["battery"], "timeout": timeout} for name, timeout in (("a", 1.0), ("b", 9.0), ("c", 0.0))
    }
    made = fed(status("battery", OK), analyzers=groups)
    assert [level(made, f"/{name}", 2.0) for name in "abc"] == [STALE, OK, OK]
    assert level(made, "/c", 1e6) is OK


def test_a_group_with_a_stale_item_is_stale_unless_it_has_an_error_and_classic_groups_are_then_an_error() -> None:
    for policy, some, with_error in (("stale", STALE, ERROR), ("classic", ERROR, ERROR)):
        made = fed(status("battery", OK), status("charger", WARN), stale_policy=policy)
        made.feed(4.0, [status("charger", WARN)])
        assert level(made, "/power", 6.0) is some
        made.feed(6.0, [status("charger", ERROR)])
        assert level(made, "/power", 6.0) is with_error
        assert level(made, "/power", 20.0) is STALE


def test_a_group_in_which_nothing_ever_reported_is_stale_after_its_timeout() -> None:
    made = Aggregator(DiagnosticsModel.model_validate({"analyzers": POWER}), started=10.0)
    assert tree(made, 15.0) == {"/power": (OK, "nothing reported yet")}
    assert tree(made, 15.1) == {"/power": (STALE, "nothing reported")}


def test_an_expected_part_that_never_reports_is_named() -> None:
    made = aggregator({"power": {"expected": ["battery"]}})
    assert tree(made, 5.0)["/power/battery"] == (OK, "has not reported yet")
    assert tree(made, 5.1)["/power/battery"] == (STALE, "never reported")


def test_a_detail_of_an_expected_part_is_a_report_of_it() -> None:
    made = aggregator({"power": {"expected": ["battery"]}})
    made.feed(6.0, [status("battery: volts", OK, "12 V")])
    assert tree(made, 6.1) == {"/power": (OK, "OK"), "/power/battery: volts": (OK, "12 V")}


def test_a_lost_part_is_stale_at_once_with_the_cause_until_it_reports_again() -> None:
    groups: Groups = {"power": {"match": ["battery"], "debounce": {"up": 60.0}}}
    made = fed(status("battery", OK, "Battery OK"), analyzers=groups)
    made.lost(0.1, ["battery"], "process robot gone (exit -9)")
    assert tree(made, 0.1)["/power/battery"] == (STALE, "process robot gone (exit -9)")
    assert level(made, "/power", 0.1) is STALE
    made.feed(0.4, [status("battery", OK, "Battery OK")])
    assert tree(made, 0.4) == {"/power": (OK, "OK"), "/power/battery": (OK, "Battery OK")}


def test_losing_a_part_loses_its_details_and_no_other_part() -> None:
    made = fed(status("battery: volts", OK), status("battery: heat", OK), status("battery_2", OK))
    made.lost(0.1, ["battery"], "gone")
    report = tree(made, 0.1)
    assert report["/power/battery: volts"] == report["/power/battery: heat"] == (STALE, "gone")
    assert report["/Other/battery_2"][0] is OK


def test_a_part_that_is_lost_before_it_reported_is_shown_until_it_reports() -> None:
    made = aggregator()
    made.lost(0.1, ["battery"], "gone")
    assert tree(made, 0.1)["/power/battery"] == (STALE, "gone")
    made.feed(0.2, [status("battery: volts", OK)])
    assert list(tree(made, 0.2)) == ["/power", "/power/battery: volts"]


def test_only_a_level_of_a_group_is_news() -> None:
    made = fed(status("battery", OK, "91 %"))
    news(made)
    made.feed(0.1, [status("battery", OK, "90 %")])
    assert not news(made)
    made.feed(0.2, [status("battery", ERROR, "Low battery")])
    assert news(made)
    made.advance(5.2)
    assert not news(made)
    made.advance(5.3)
    assert news(made)


# What comes from outside


def test_statuses_of_new_names_are_refused_and_counted_when_there_is_no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(admission, "MOST_ITEMS", 1)
    made = fed(status("a", OK), status("b", OK), status("a", WARN))
    assert made.admission.refused == 1
    assert made.admission.news() == ["there are 1 statuses: further names are left out"]
    assert made.admission.news() == []
    assert tree(made, 0.0)["/Other/a"][0] is WARN


def test_an_unknown_level_is_an_error_that_says_so() -> None:
    assert tree(fed(status("battery", 7, "hm")), 0.0)["/power/battery"] == (ERROR, "level 7 is unknown: hm")


@pytest.mark.parametrize("name", ["", "/", " ", "x" * 257])
def test_a_status_without_a_usable_name_is_refused(name: str) -> None:
    made = fed(status(name, ERROR))
    assert list(tree(made, 0.0)) == ["/power"]
    assert made.admission.refused == 1


def test_a_status_of_any_length_takes_a_bounded_place() -> None:
    long = DiagnosticStatus(WARN, "battery", "x" * 10_000, "", (KeyValue("k", "v" * 10_000),))
    item = fed(long).report(0.0)[1].status
    assert len(item.message) == 1000
    assert item.values == (KeyValue("left out", "a status may have 8,192 characters; this one had 20,001"),)


# Laws


NAMES = ("battery", "battery: volts", "charger", "base", "go_to", "moon")
COMPONENTS = ("battery", "charger", "base", "go_to", "moon")
GROUPS: Groups = {
    "power": {"match": ["bat*", "charger"], "timeout": 2.0, "count": {"max": 2}},
    "motion": {"analyzers": {"wheels": {"match": ["base"], "suppressed_by": "power"}, "legs": {"match": ["go_*"]}}},
}
STATUSES = st.builds(status, st.sampled_from(NAMES), st.integers(0, 4), st.sampled_from(["", "fine", "hot"]))
EVENTS = st.tuples(st.floats(0, 3), st.lists(STATUSES, max_size=4) | st.sampled_from(COMPONENTS))


def run(history: list[tuple[float, list[DiagnosticStatus] | str]], policy: str) -> tuple[Aggregator, float]:
    made, now = aggregator(GROUPS, expected=("go_to",), stale_policy=policy), 0.0
    for pause, event in history:
        now += pause
        made.advance(now)
        made.lost(now, [event], "gone") if isinstance(event, str) else made.feed(now, event)
    return made, now


@given(st.lists(EVENTS, max_size=12), st.floats(0, 10), st.sampled_from(["stale", "classic"]))
def test_what_is_counted_step_by_step_is_what_follows_from_the_last_statuses_alone(
    history: list[tuple[float, list[DiagnosticStatus] | str]], wait: float, policy: str
) -> None:
    made, now = run(history, policy)
    fresh = aggregator(GROUPS, expected=("go_to",), stale_policy=policy)
    fresh.take_over(made, now)
    for one in (made, fresh):
        one.advance(now + wait)
    assert tree(made, now + wait) == tree(fresh, now + wait)
    assert made.level() == fresh.level()


@given(st.lists(EVENTS, max_size=12))
def test_a_group_is_as_bad_as_the_worst_below_it_and_the_robot_as_the_worst_group(
    history: list[tuple[float, list[DiagnosticStatus] | str]],
) -> None:
    made, now = run(history, "stale")
    levels = {path: found for path, (found, message) in tree(made, now).items() if not message.startswith("follows")}
    rank = (OK, WARN, STALE, ERROR).index
    for path, found in levels.items():
        above = path.rpartition("/")[0]
        assert above not in levels or rank(levels[above]) >= rank(found) or path.startswith("/motion/wheels")
    assert made.level()[0] is max((levels[text] for text in levels if text.count("/") == 1), key=rank, default=OK)

"""Each rule of ROS 1's aggregator, in the profile that follows it; where the default profile differs, how."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.ros1 import Ros1Aggregator
from rbxcompose.domains.diagnostics.settings import DiagnosticsModel
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from tests.diagnostics.trees import ERROR, OK, STALE, WARN, Groups, fed, status, tree

ALL: Groups = {"all": {"match": ["*"]}}


def made(*statuses: DiagnosticStatus, analyzers: Groups = ALL, **settings: Any) -> Ros1Aggregator:
    model = DiagnosticsModel.model_validate({"profile": "ros1", "analyzers": analyzers, **settings})
    found = Ros1Aggregator(model)
    found.feed(0.0, statuses)
    return found


def report(found: Ros1Aggregator, now: float = 0.0) -> dict[str, tuple[Level, str]]:
    return {row.status.name: (Level(row.status.level), row.status.message) for row in found.report(now)}


def values(found: Ros1Aggregator, path: str, now: float = 0.0) -> dict[str, str]:
    header = next(row.status for row in found.report(now) if row.status.name == path)
    return {pair.key: pair.value for pair in header.values}


def test_rule_1_each_analyzer_that_matches_gets_the_item_and_they_come_in_the_order_of_their_names() -> None:
    both: Groups = {"b": {"match": ["battery"]}, "a": {"match": ["bat*"]}}
    assert list(report(made(status("battery", OK), analyzers=both))) == ["/a", "/a/battery", "/b", "/b/battery"]


@pytest.mark.parametrize(
    ("condition", "name", "expected"),
    [
        ({"regex": "bat.*"}, "a battery", False),  # the whole name, no search
        ({"regex": "bat.*"}, "battery", True),
        ({"name": "battery"}, "battery: volts", False),
        ({"startswith": "bat"}, "battery", True),
        ({"contains": "tt"}, "battery", True),
        ({"contains": "TT"}, "battery", False),
    ],
)
def test_rule_2_an_item_matches_by_expression_name_beginning_or_part(
    condition: dict[str, str], name: str, expected: bool
) -> None:
    found = report(made(status(name, OK), analyzers={"x": {"match": ["no", condition]}}))
    assert (f"/x/{name}" in found) is expected


def test_rule_2_expected_is_exact() -> None:
    found = report(made(status("battery: volts", OK), analyzers={"x": {"expected": ["battery"]}}))
    assert found["/Other/battery: volts"] == (OK, "")


@pytest.mark.parametrize(
    ("prefixes", "name", "shown"),
    [
        (["cam"], "cam: rate", "rate"),
        (["cam"], "cam:  rate", "rate"),
        (["cam", "cam_front"], "cam_front: rate", "_front: rate"),  # in the order of the list
        (["cam_front", "cam"], "cam_front: rate", "rate"),
        (["/cam"], "/cam/rate", " rate"),
    ],
)
def test_rule_3_prefixes_match_and_go_in_their_order(prefixes: list[str], name: str, shown: str) -> None:
    found = report(made(status(name, OK), analyzers={"x": {"strip_prefix": prefixes}}))
    assert f"/x/{shown.lstrip(' ')}" in found


def test_rule_3_the_default_takes_the_longest_prefix_away() -> None:
    found = fed(status("cam_front: rate", OK), analyzers={"x": {"strip_prefix": ["cam", "cam_front"]}})
    assert list(tree(found, 0.0)) == ["/x", "/x/rate"]


def test_rule_4_a_slash_becomes_a_space_also_in_front() -> None:
    assert "/all/ lidar front" in report(made(status("/lidar/front", OK)))


def test_rule_5_a_header_has_the_worst_level_its_word_and_the_messages_of_all_items() -> None:
    found = made(status("a", WARN, "hm"), status("b", OK, "fine"))
    assert report(found)["/all"] == (WARN, "Warning")
    assert values(found, "/all") == {"a": "hm", "b": "fine"}
    assert report(made(status("a", ERROR), status("b", WARN)))["/all"] == (ERROR, "Error")


def test_rule_6_an_item_is_stale_after_its_timeout_and_keeps_its_message_some_are_an_error() -> None:
    found = made(status("a", OK, "fine"), status("b", OK))
    found.feed(3.0, [status("b", OK)])
    assert report(found, 5.0)["/all"] == (OK, "OK")
    assert report(found, 5.1)["/all/a"] == (STALE, "fine")
    assert report(found, 5.1)["/all"] == (ERROR, "Error")
    assert report(found, 8.1)["/all"] == (STALE, "Stale")


def test_rule_6_no_items_are_stale_and_without_a_timeout_none_ever_is() -> None:
    assert report(made(analyzers={"x": {"match": ["a"]}})) == {"/x": (STALE, "Stale")}
    for_ever = made(status("a", OK), analyzers={"x": {"match": ["a"], "timeout": 0.0}})
    assert report(for_ever, 1e6)["/x"] == (OK, "OK")


def test_rule_6_the_default_keeps_stale_apart_from_error() -> None:
    found = fed(status("battery", OK), status("charger", OK))
    found.feed(3.0, [status("charger", OK)])
    assert tree(found, 5.1)["/power"][0] is STALE


def test_rule_7_a_published_stale_counts_as_stale_and_an_unknown_level_as_an_error() -> None:
    assert report(made(status("a", STALE), status("b", OK)))["/all"] == (ERROR, "Error")
    assert report(made(status("a", STALE)))["/all"] == (STALE, "Stale")
    assert report(made(status("a", 7, "hm")))["/all/a"] == (ERROR, "hm")


def test_rule_8_what_is_expected_and_never_seen_is_missing() -> None:
    found = made(status("a", OK), analyzers={"x": {"match": ["a"], "expected": ["b"]}})
    assert report(found)["/x/b"] == (STALE, "Missing")
    assert report(found)["/x"] == (ERROR, "Error")


def test_rule_8_with_discard_stale_it_is_dropped_and_listed_again_under_another_text() -> None:
    found = made(analyzers={"x": {"match": ["a"], "expected": ["b"], "discard_stale": True}})
    found.feed(5.1, [status("a", OK)])
    assert report(found, 5.1)["/x"] == (ERROR, "Some diagnostics are stale - setting combined level to ERROR.")
    assert report(found, 5.1)["/x/b"] == (STALE, "Missing")
    assert values(found, "/x", 5.1) == {"a": "", "b": "Missing"}
    assert report(found, 10.3)["/x"] == (STALE, "All diagnostics are stale - setting combined level to STALE.")


@pytest.mark.parametrize(
    ("count", "names", "header"),
    [
        (2, ["a", "b"], (OK, "OK")),
        (2, ["a"], (ERROR, "Expected 2, found 1")),
        (2, [], (STALE, "No items found, expected 2")),
        (0, [], (OK, "OK")),
        (0, ["a"], (OK, "OK")),  # the hole
    ],
)
def test_rule_9_a_wrong_number_of_items_is_an_error_but_for_zero(
    count: int, names: list[str], header: tuple[Level, str]
) -> None:
    found = made(*(status(name, OK) for name in names), analyzers={"x": {"match": ["*"], "count": count}})
    assert report(found)["/x"] == header


def test_rule_9_the_default_counts_to_zero_as_well() -> None:
    found = fed(status("a", OK), analyzers={"x": {"match": ["a"], "count": 0}})
    assert tree(found, 0.0)["/x"][0] is ERROR


def test_rule_10_discarded_items_go_then_the_header_is_stale_then_it_goes_too() -> None:
    found = made(status("a", OK), analyzers={"x": {"match": ["a"], "discard_stale": True}})
    assert report(found, 5.1) == {"/x": (STALE, "Stale")}
    assert report(found, 10.0) == {"/x": (STALE, "Stale")}
    assert report(found, 10.2) == {}


def test_rule_10_without_a_timeout_nothing_is_discarded() -> None:
    found = made(status("a", OK), analyzers={"x": {"match": ["a"], "discard_stale": True, "timeout": 0.0}})
    assert list(report(found, 1e6)) == ["/x", "/x/a"]


def test_rule_11_a_group_is_as_bad_as_its_worst_analyzer_and_stale_only_as_a_whole() -> None:
    groups: Groups = {"g": {"path": "G", "analyzers": {"a": {"match": ["a"]}, "b": {"match": ["b"]}}}}
    found = made(status("a", WARN, "hm"), status("b", OK), analyzers=groups)
    assert report(found)["/G"] == (WARN, "Warning")
    assert values(found, "/G") == {"a": "Warning", "b": "OK"}
    found.feed(4.0, [status("a", WARN)])
    assert report(found, 6.0)["/G"] == (ERROR, "Error")
    assert report(found, 10.0)["/G"] == (STALE, "Stale")


def test_rule_12_there_is_a_header_of_all_only_below_a_base() -> None:
    assert "/" not in report(made(status("a", OK)))
    assert report(made(status("a", WARN), base="robot"))["/robot"] == (WARN, "Warning")
    without: Groups = {"g": {"path": "", "analyzers": {"a": {"match": ["a"]}}}}
    assert list(report(made(status("a", OK), analyzers=without))) == ["/a", "/a/a"]


def test_rule_13_what_nothing_matches_is_in_other_for_5_s_and_counts_only_at_the_top() -> None:
    groups: Groups = {"x": {"match": ["a"]}}
    found = made(status("a", OK), status("b", WARN, "hm"), analyzers=groups, base="robot")
    assert report(found)["/robot/Other/b"] == (WARN, "hm")
    assert report(found)["/robot"] == (OK, "OK")
    assert found.level()[0] is WARN
    assert not any("Other" in path for path in report(found, 5.1))
    strict = made(status("b", OK), analyzers=groups, other="error")
    assert report(strict)["/Other"] == (ERROR, 'Unanalyzed items found in "Other"')


def test_rule_14_what_is_ignored_lands_in_other_and_what_is_discarded_nowhere() -> None:
    for kind, expected in (("ignore", {"/Other": (OK, "OK"), "/Other/a": (OK, "")}), ("discard", {})):
        assert report(made(status("a", OK), analyzers={"x": {"type": kind, "match": ["a"]}})) == expected


def test_rule_15_a_broken_analyzer_is_an_item_of_the_base_whose_header_says_ok() -> None:
    found = report(made(status("a", OK), analyzers={"bad": {}, "x": {"match": ["a"]}}, base="robot"))
    assert found["/robot/bad"] == (STALE, "Analyzer init failed")
    assert found["/robot"] == (OK, "OK")


def test_rule_15_a_group_with_a_broken_analyzer_is_broken_as_a_whole() -> None:
    found = made(
        status("a", OK), analyzers={"g": {"analyzers": {"bad": {}, "x": {"match": ["a"]}}}, "z": {"match": ["z"]}}
    )
    assert report(found)["/g"] == (STALE, "Analyzer init failed")
    assert report(found)["/Other/a"] == (OK, "")


def test_rule_16_the_top_is_the_worst_of_all_and_an_error_if_only_some_are_stale() -> None:
    found = made(status("a", OK), analyzers={"x": {"match": ["a"]}, "y": {"match": ["y"]}})
    report(found)
    assert found.level()[0] is ERROR
    report(found, 5.1)
    assert found.level()[0] is STALE


def test_rule_17_other_analyzers_take_effect_with_what_is_known() -> None:
    old = made(status("a", WARN, "hm"), analyzers={"x": {"match": ["b"]}})
    new = made(analyzers={"y": {"match": ["a"]}})
    new.take_over(old, 1.0)
    assert report(new, 1.0)["/y/a"] == (WARN, "hm")
    assert "/Other" not in report(new, 1.0)


def test_rule_18_some_stale_items_may_be_stale_instead_of_an_error_as_in_later_releases_for_ros_2() -> None:
    found = made(status("a", OK), status("b", OK), stale_policy="stale")
    found.feed(3.0, [status("b", OK)])
    assert report(found, 5.1)["/all"] == (STALE, "Stale")
    found.feed(5.1, [status("b", ERROR)])
    assert report(found, 5.1)["/all"] == (ERROR, "Error")


def test_a_lost_component_is_stale_with_the_cause() -> None:
    found = made(status("battery: volts", OK), analyzers={"power": {"match": ["battery"]}})
    found.lost(0.1, ["battery"], "its process was killed")
    assert report(found, 0.1)["/power/battery: volts"] == (STALE, "its process was killed")
    assert {one.path for one in found.history.after(0)} == {"/power/battery: volts", "/power"}

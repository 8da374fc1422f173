"""Promises of what groups can do: nest, leave out, count, delay, keep and silence levels."""

from __future__ import annotations

import pytest

from rbxcompose.base.levels import Level
from tests.diagnostics.trees import ERROR, OK, POWER, STALE, WARN, Groups, aggregator, fed, level, status, tree

NESTED: Groups = {
    "sensors": {
        "path": "Sensors",
        "analyzers": {
            "cameras": {"match": [{"startswith": "cam"}], "strip_prefix": ["cam", "cam_front"]},
            "laser": {"match": ["laser"]},
        },
    }
}


def test_a_prefix_may_go_without_matching_anything() -> None:
    cameras = {"match": [{"contains": "camera"}], "remove_prefix": ["head"]}
    found = fed(status("head camera: rate", OK), status("head: pan", OK), analyzers={"cameras": cameras})
    assert list(tree(found, 0.0)) == ["/cameras", "/cameras/camera: rate", "/Other", "/Other/head: pan"]


def test_groups_nest_and_a_level_rises_through_all_of_them() -> None:
    made = fed(status("laser", OK), status("cam_front: rate", ERROR, "slow"), analyzers=NESTED, base="robot")
    assert tree(made, 0.0) == {
        "/robot": (ERROR, "Sensors: cameras: cam_front: rate: slow"),
        "/robot/Sensors": (ERROR, "cameras: cam_front: rate: slow"),
        "/robot/Sensors/cameras": (ERROR, "cam_front: rate: slow"),
        "/robot/Sensors/cameras/rate": (ERROR, "slow"),  # the longest prefix goes, not the first
        "/robot/Sensors/laser": (OK, "OK"),
        "/robot/Sensors/laser/laser": (OK, ""),
    }
    assert made.level() == (ERROR, "/robot/Sensors: cameras: cam_front: rate: slow")


def test_a_group_with_an_empty_path_has_no_header() -> None:
    groups: Groups = {"all": {"path": "", "analyzers": {"power": {"match": ["battery"]}}}}
    assert list(tree(fed(status("battery", WARN), analyzers=groups), 0.0)) == ["/power", "/power/battery"]


@pytest.mark.parametrize("kind", ["ignore", "discard"])
def test_what_is_ignored_or_discarded_is_shown_nowhere_unless_another_analyzer_matches_it(kind: str) -> None:
    groups: Groups = {"none": {"type": kind, "match": ["moon", "battery"]}, **POWER}
    made = fed(status("moon", ERROR), status("battery", OK), analyzers=groups)
    assert list(tree(made, 0.0)) == ["/power", "/power/battery"]
    assert made.level() == (OK, "")


def test_ignored_statuses_are_shown_nowhere() -> None:
    made = fed(status("battery: noise", ERROR), status("battery", OK), ignore=[{"contains": "noise"}])
    assert list(tree(made, 0.0)) == ["/power", "/power/battery"]


def test_what_is_left_may_have_a_place_of_its_own() -> None:
    groups: Groups = {**POWER, "rest": {"type": "other", "path": "Rest"}}
    made = fed(status("moon", WARN, "full"), analyzers=groups)
    assert tree(made, 0.0)["/Rest"] == (WARN, "moon: full")
    assert "/Rest" not in tree(made, 6.0)


@pytest.mark.parametrize(("other", "expected"), [("ok", OK), ("warn", WARN), ("error", ERROR), ("hide", None)])
def test_strangers_may_be_a_fault_in_themselves_but_parts_of_the_robot_are_not(
    other: str, expected: Level | None
) -> None:
    made = aggregator(expected=("transforms",), other=other)
    assert level(made, "/Other", 0.0) is (None if other == "hide" else OK)
    made.feed(0.0, [status("moon", OK, "new")])
    assert level(made, "/Other", 0.0) is expected
    assert made.level()[0] is (expected or OK)


def test_a_wrong_number_of_items_is_an_error_and_none_at_all_is_stale() -> None:
    made = aggregator({"eyes": {"match": ["eye*"], "count": 2}, "none": {"match": ["leak*"], "count": 0}})
    assert tree(made, 0.0) == {"/eyes": (OK, "nothing reported yet"), "/none": (OK, "OK")}
    assert tree(made, 5.1)["/eyes"] == (STALE, "no items, expected 2")
    made.feed(6.0, [status("eye_1", OK), status("leak", OK)])
    assert tree(made, 6.0)["/eyes"] == (ERROR, "1 item, expected 2")
    assert tree(made, 6.0)["/none"] == (ERROR, "1 item, expected 0")
    made.feed(7.0, [status("eye_2", WARN, "red")])
    assert tree(made, 7.0)["/eyes"] == (WARN, "eye_2: red")


def test_discarded_items_go_when_they_are_stale_and_the_empty_group_follows() -> None:
    made = fed(status("battery", OK), analyzers={"power": {"match": ["battery"], "discard_stale": True}})
    assert tree(made, 5.1) == {"/power": (STALE, "nothing reported")}
    assert tree(made, 10.3) == {}
    assert made.level() == (OK, "")
    made.feed(11.0, [status("battery", OK)])
    assert list(tree(made, 11.0)) == ["/power", "/power/battery"]


def test_a_level_must_last_as_long_as_debounce_says_in_each_direction() -> None:
    groups: Groups = {"power": {"match": ["battery"], "debounce": {"up": 1.0, "down": 2.0}}}
    made = fed(status("battery", OK), analyzers=groups)
    made.feed(1.0, [status("battery", ERROR, "low")])
    assert tree(made, 1.9)["/power"] == (OK, "ERROR for less than 1 s: battery: low")
    made.feed(1.9, [status("battery", OK)])
    assert level(made, "/power", 3.0) is OK  # a flicker counts for nothing
    made.feed(3.0, [status("battery", ERROR, "low")])
    assert level(made, "/power", 4.1) is ERROR
    made.feed(4.1, [status("battery", OK)])
    assert level(made, "/power", 6.0) is ERROR
    assert level(made, "/power", 6.2) is OK


def test_a_latched_level_stays_until_it_is_acknowledged() -> None:
    groups: Groups = {"power": {"match": ["battery"], "latch": True}}
    made = fed(status("battery", ERROR, "low"), analyzers=groups, now=1.0)
    made.feed(2.0, [status("battery", OK, "fine")])
    assert tree(made, 2.0)["/power"] == (ERROR, "battery: low (latched since 1.0 s, OK now)")
    assert made.acknowledge(3.0, "/power") == ["/power"]
    assert tree(made, 3.0)["/power"] == (OK, "OK")
    assert made.acknowledge(3.0) == []


def test_what_is_acknowledged_while_it_lasts_ends_by_itself() -> None:
    made = fed(status("battery", ERROR, "low"), analyzers={"power": {"match": ["battery"], "latch": True}})
    made.acknowledge(1.0)
    assert level(made, "/power", 1.0) is ERROR
    made.feed(2.0, [status("battery", WARN, "less low")])
    assert level(made, "/power", 2.0) is WARN


def test_a_group_is_silent_while_what_it_follows_from_has_failed() -> None:
    groups: Groups = {"motion": {"match": ["base"], "suppressed_by": "power"}, **POWER}
    made = fed(status("base", ERROR, "no voltage"), status("battery", OK), analyzers=groups)
    assert level(made, "/motion", 0.0) is ERROR
    made.feed(1.0, [status("battery", ERROR, "empty")])
    assert tree(made, 1.0)["/motion"] == (OK, "follows from /power, which is ERROR")
    assert tree(made, 1.0)["/motion/base"] == (ERROR, "no voltage")
    assert made.level()[0] is ERROR
    made.feed(2.0, [status("battery", WARN)])
    assert level(made, "/motion", 2.0) is ERROR


def test_a_level_that_is_only_latched_silences_nothing() -> None:
    power = {"match": ["battery"], "latch": True}
    groups: Groups = {"motion": {"match": ["base"], "suppressed_by": "power"}, "power": power}
    made = fed(status("base", ERROR, "stuck"), status("battery", ERROR, "empty"), analyzers=groups)
    made.feed(1.0, [status("battery", OK)])
    assert (level(made, "/power", 1.0), level(made, "/motion", 1.0)) == (ERROR, ERROR)


def test_groups_that_silence_each_other_are_refused() -> None:
    with pytest.raises(ValueError, match="would depend on itself"):
        aggregator({"a": {"match": ["a"], "suppressed_by": "b"}, "b": {"match": ["b"], "suppressed_by": "a"}})


def test_all_changes_of_levels_are_remembered_with_their_cause_up_to_a_limit() -> None:
    made = fed(status("battery", WARN, "half"), now=1.0)
    made.lost(2.0, ["battery"], "gone")
    told = [(change.time, change.path, change.old, change.new, change.cause) for change in made.history.after(0)]
    assert told == [
        (1.0, "/power/battery", OK, WARN, "half"),
        (1.0, "/power", OK, WARN, "battery: half"),
        (2.0, "/power/battery", WARN, STALE, "gone"),
        (2.0, "/power", WARN, STALE, "battery: gone"),
    ]
    for index in range(2000):
        made.feed(3.0, [status("battery", index % 2)])
    assert len(list(made.history.after(0))) == 1000
    assert [one.number for one in made.history.after(made.history.count - 1)] == [made.history.count]


def test_after_a_change_of_the_groups_the_states_of_those_that_stay_are_kept() -> None:
    old = fed(status("battery", ERROR, "low"), analyzers={"power": {"match": ["battery"], "latch": True}})
    old.feed(1.0, [status("battery", OK, "fine"), status("moon", WARN, "full")])
    new = aggregator({"power": {"match": ["bat*"], "latch": True}, "sky": {"match": ["moon"]}})
    new.take_over(old, 2.0)
    report = tree(new, 2.0)
    assert report["/power"] == (ERROR, "battery: low (latched since 0.0 s, OK now)")
    assert report["/sky"] == (WARN, "moon: full")
    assert "/Other" not in report


def test_a_level_that_is_there_when_latch_comes_is_latched() -> None:
    old = fed(status("battery", ERROR, "low"), analyzers={"power": {"match": ["battery"]}}, now=1.0)
    new = aggregator({"power": {"match": ["battery"], "latch": True}})
    new.take_over(old, 2.0)
    new.feed(3.0, [status("battery", OK, "fine")])
    assert tree(new, 3.0)["/power"] == (ERROR, "battery: low (latched since 1.0 s, OK now)")
    assert new.acknowledge(4.0) == ["/power"]
    assert level(new, "/power", 4.0) is OK


def test_a_level_that_is_over_when_latch_comes_is_not_latched() -> None:
    old = fed(status("battery", ERROR, "low"), analyzers={"power": {"match": ["battery"]}})
    assert old.acknowledge(0.5) == []
    old.feed(1.0, [status("battery", OK, "fine")])
    new = aggregator({"power": {"match": ["battery"], "latch": True}})
    new.take_over(old, 2.0)
    assert (level(new, "/power", 2.0), new.acknowledge(3.0)) == (OK, [])


def test_what_was_latched_is_recalled_unless_it_is_worse_by_now() -> None:
    groups: Groups = {name: {"match": [name], "latch": True} for name in ("arm", "base", "gone")}
    old = fed(status("arm", WARN, "warm"), status("base", WARN, "slow"), status("gone", WARN), analyzers=groups)
    new = aggregator({**groups, "gone": {"match": ["gone"]}})
    new.feed(5.0, [status("arm", OK), status("base", ERROR, "stuck")])
    new.recall(6.0, old.latched())
    new.feed(7.0, [status("base", OK)])
    report = tree(new, 7.0)
    assert report["/arm"] == (WARN, "arm: warm (latched since 0.0 s, OK now)")
    assert report["/base"] == (ERROR, "base: stuck (latched since 0.0 s, OK now)")
    assert new.acknowledge(8.0) == ["/arm", "/base"]
    assert level(new, "/base", 8.0) is OK

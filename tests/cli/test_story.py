from __future__ import annotations

from rbxcompose.base.levels import Level
from rbxcompose.runtime.log import Record, StoryWriter, summary


def test_a_record_is_time_source_and_text() -> None:
    story = StoryWriter(["battery", "mission"], colour=False)
    record = Record(22.551, Level.OK, "mission", "interrupt battery_low: $battery < $low (battery 49 %)")
    assert story.line(record) == "   22.55  mission  interrupt battery_low: $battery < $low (battery 49 %)"


def test_sources_stand_in_a_column() -> None:
    story = StoryWriter(["a", "longer_name"], colour=False)
    lines = [story.line(Record(1.0, Level.OK, name, "x")) for name in ("a", "longer_name", "robot")]
    assert {line.index("x") for line in lines} == {len("    1.00  longer_name  ")}


def test_what_a_person_should_look_at_is_marked() -> None:
    story = StoryWriter([], colour=False)
    assert story.line(Record(0.0, Level.WARN, "base", "late")) == "    0.00  base   warn: late"
    assert story.line(Record(0.0, Level.ERROR, "base", "lost")) == "    0.00  base   error: lost"


def test_colours_come_only_when_asked_for() -> None:
    record = Record(0.0, Level.ERROR, "base", "lost")
    assert "\x1b" not in StoryWriter([], colour=False).line(record)
    assert "\x1b" in StoryWriter([], colour=True).line(record)


def test_foreign_text_cannot_steer_the_terminal() -> None:
    story = StoryWriter([], colour=False)
    line = story.line(Record(0.0, Level.OK, "ba\x1bse", "go\x1b[2J\nup\u202e"))
    assert not {"\x1b", "\n", "\u202e"} & set(line)


def test_the_summary_aligns_facts_and_names_the_instance_where_labels_are_equal() -> None:
    facts = {"mission": {"skills": "go_to 8 (8 success)"}, "left": {"turns": "3"}, "right": {"turns": "4"}}
    assert summary("turtlebot", "mission patrol: success", 61.234, facts).splitlines() == [
        "turtlebot is down: mission patrol: success",
        "  robot time   61.23 s",
        "  left turns   3",
        "  skills       go_to 8 (8 success)",
        "  right turns  4",
    ]

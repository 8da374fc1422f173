"""Values of several lines and in brackets: shown as they are written, and changed without touching anything else."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.tools.mission_editor.form import shape_of, shown_value
from rbxcompose.tools.mission_editor.outline import MissionOutline
from rbxcompose.tools.mission_editor.patches import change
from tests.loops import for_all

HEAD = "rbx: 1\nkind: Mission\nname: fetch\ndo:\n"
TEXT = f"""{HEAD}  - go_to:   # there
      # where
      place: dock
      speed: 1 m/s  # slowly
    timeout: 3 s
  - log: |
      one
        two

  - for: room
    in: [a,
         b]
    do: {{go_to: $room}}
  - recharge
"""


def after(text: str, **operation: Any) -> str:
    return change(text, {"op": "set", **operation}).applied(text)


def value(path: list[Any]) -> tuple[str, str]:
    outline = MissionOutline(TEXT)
    assert outline.root is not None
    node = outline.root.at(tuple(path))
    assert node is not None
    return shape_of(outline.lines, node), shown_value(outline.lines, node)


def test_a_value_is_shown_as_it_is_written() -> None:
    assert value(["do", 0, "go_to"]) == ("lines", "# where\nplace: dock\nspeed: 1 m/s  # slowly")
    assert value(["do", 0, "timeout"]) == ("line", "3 s")
    assert value(["do", 1, "log"]) == ("text", "one\n  two\n")
    assert value(["do", 2, "in"]) == ("lines", "[a,\n         b]")


@for_all(
    "operation, old, new",
    [
        (
            {"path": ["do", 0], "key": "go_to", "shape": "lines", "value": "# where\nplace: table\n"},
            "place: dock\n      speed: 1 m/s  # slowly\n",
            "place: table\n",
        ),
        (
            {"path": ["do", 1], "key": "log", "shape": "text", "value": "three\nfour"},
            "|\n      one\n        two\n",
            "|-\n      three\n      four\n",
        ),
        (
            {"path": ["do", 1], "key": "log", "shape": "text", "value": "three"},
            "|\n      one\n        two\n",
            "three\n",
        ),
        (
            {"path": ["do", 2], "key": "in", "shape": "lines", "value": "- a\n- c"},
            "in: [a,\n         b]\n",
            "in:\n      - a\n      - c\n",
        ),
        ({"path": ["do", 2], "key": "in", "shape": "lines", "value": "[c, d]"}, "[a,\n         b]", "[c, d]"),
        (
            {"path": ["do", 3], "key": "recharge", "within": [], "shape": "line", "value": "1"},
            "- recharge\n",
            "- recharge: 1\n",
        ),
        (
            {"path": ["do", 3], "key": "until", "within": ["recharge"], "value": "80 %"},
            "- recharge\n",
            "- recharge:\n      until: 80 %\n",
        ),
        (
            {"path": ["do", 3], "key": "save", "shape": "lines", "value": "a: 1\nb: 2"},
            "- recharge\n",
            "- recharge:\n    save:\n      a: 1\n      b: 2\n",
        ),
        ({"path": ["do", 0], "key": "speed", "within": ["go_to"], "value": "2 m/s"}, "speed: 1", "speed: 2"),
        ({"path": ["do", 0], "key": "speed", "within": ["go_to"], "value": ""}, "      speed: 1 m/s  # slowly\n", ""),
        (
            {"path": ["do", 0], "key": "yaw", "within": ["go_to"], "value": "1 rad"},
            "place: dock\n",
            "place: dock\n      yaw: 1 rad\n",
        ),
    ],
)
def test_a_value_changes_and_nothing_else(operation: dict[str, Any], old: str, new: str) -> None:
    assert TEXT.count(old) == 1
    assert after(TEXT, **operation) == TEXT.replace(old, new)


@pytest.mark.parametrize(
    ("operation", "why"),
    [
        ({"path": ["do", 0], "key": "go_to", "shape": "line", "value": "dock"}, "has comments in it"),
        ({"path": ["do", 2], "key": "in", "shape": "lines", "value": "[a"}, "cannot be read"),
        ({"path": ["do", 2], "key": "in", "shape": "lines", "value": "a: 1\n b: 2"}, "cannot be read"),
        ({"path": ["do", 2, "do"], "key": "save", "shape": "lines", "value": "a: 1\nb: 2"}, "within a line"),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(operation: dict[str, Any], why: str) -> None:
    with pytest.raises(Refused, match=why):
        after(TEXT, **operation)


FLOW = (
    f"{HEAD}  - [{{wait: 1 s}},  recharge, {{log: 'a, b'}}]  # three\n  - parallel: {{a: recharge, b: {{wait: 2 s}}}}\n"
)


@for_all(
    "operation, old, new",
    [
        ({"op": "delete", "path": ["do", 0, 1]}, ",  recharge", ""),
        ({"op": "delete", "path": ["do", 0, 0]}, "{wait: 1 s},  ", ""),
        ({"op": "delete", "path": ["do", 1, "parallel", "a"]}, "a: recharge, ", ""),
        ({"op": "duplicate", "path": ["do", 0, 2]}, "{log: 'a, b'}", "{log: 'a, b'}, {log: 'a, b'}"),
        ({"op": "duplicate", "path": ["do", 1, "parallel", "a"]}, "a: recharge", "a: recharge, a_2: recharge"),
        ({"op": "move", "way": "up", "path": ["do", 0, 1]}, "{wait: 1 s},  recharge", "recharge,  {wait: 1 s}"),
        (
            {"op": "move_to", "to": ["do", 0], "index": 3, "path": ["do", 0, 0]},
            "{wait: 1 s},  recharge, {log: 'a, b'}",
            "recharge,  {log: 'a, b'}, {wait: 1 s}",
        ),
        (
            {"op": "insert", "path": ["do", 0], "index": 1, "yaml": "wait: 5 s\ntimeout: 9 s"},
            "1 s},  ",
            "1 s},  {wait: 5 s, timeout: 9 s}, ",
        ),
        ({"op": "add", "path": ["do", 1, "parallel"], "index": 2}, "2 s}}", "2 s}, new_branch: {wait: 1 s}}"),
    ],
)
def test_blocks_in_brackets_change_within_these(operation: dict[str, Any], old: str, new: str) -> None:
    assert FLOW.count(old) == 1
    assert change(FLOW, operation).applied(FLOW) == FLOW.replace(old, new)


@pytest.mark.parametrize(
    ("operation", "why"),
    [
        ({"op": "move_to", "to": ["do"], "index": 0, "path": ["do", 0, 0]}, "in brackets"),
        ({"op": "move_to", "to": ["do", 0], "index": 0, "path": ["do", 1]}, "brackets"),
        ({"op": "move", "way": "up", "path": ["do", 0, 0]}, "the first one"),
    ],
)
def test_what_would_leave_the_brackets_is_refused(operation: dict[str, Any], why: str) -> None:
    with pytest.raises(Refused, match=why):
        change(FLOW, operation)


def test_a_comment_within_brackets_is_not_lost() -> None:
    text = f"{HEAD}  - [recharge, # why\n     dock]\n"
    with pytest.raises(Refused, match="comment"):
        change(text, {"op": "delete", "path": ["do", 0, 1]})

"""Changes of an outline as changes of the text: nothing else moves, and comments go with what they are about."""

from __future__ import annotations

from copy import deepcopy
from itertools import pairwise
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.requests import Refused
from rbxcompose.tools.mission_editor.outline import Block, MissionOutline
from rbxcompose.tools.mission_editor.patches import OPERATIONS, change
from rbxcompose.tools.mission_editor.yaml_places import TextPatch
from tests.loops import for_all

HEAD = "# what it is for\nrbx: 1\nkind: Mission\nname: fetch\n"
WORDS = (
    "go_to: dock",
    "wait: 2 s   # a while",
    "log: 'it is: so'",
    "recharge",
    "{wait: 2 s}",
    "[{wait: 2 s}, recharge, {log: 'a, b', optional: true}]",
    "{parallel: {a: recharge, b: {wait: 1 s}}, timeout: 5 s}",
    "log: |\n  # no comment\n    further\n\n  end",
    'log: "two\n  lines"',
    "wait_for: $battery > 50 %",
    "go_to:\n  # where\n  place: dock",
)
OPTIONS = ("timeout: 3 s", "optional: true  # it may fail", "# timeout: 5 s")


@st.composite
def steps(draw: st.DrawFn, depth: int = 0) -> list[str]:
    """Return the lines of one step."""
    kinds = ("word", "word", "sequence", "fallback", "repeat", "if", "list", "choose", "branches", "machine")
    kind = draw(st.sampled_from(kinds))
    if kind == "word" or depth == 3:
        lines = draw(st.sampled_from(WORDS)).split("\n")
        if ":" in lines[0] and not lines[0].startswith(("{", "[")):
            lines += draw(st.lists(st.sampled_from(OPTIONS), max_size=2, unique=True))
        return lines
    inside = draw(st.lists(steps(depth + 1), min_size=1, max_size=3))
    listed = draw(listing(inside))
    if kind == "list":
        return ["sequence:", *listed]
    if kind == "repeat":
        is_one = draw(st.booleans()) and not inside[0][0].startswith(("{", "[")) and ":" in inside[0][0]
        return ["repeat: 2", "do:  # again", *((f"  {line}" for line in inside[0]) if is_one else indented(listed))]
    if kind in ("choose", "branches"):
        cases = [line for name, step in zip("xyz", inside, strict=False) for line in named(name, step)]
        return ["choose: $room", "cases:", *indented(cases)] if kind == "choose" else ["parallel:", *indented(cases)]
    if kind == "machine":
        return ["machine:", *indented(draw(machine(inside)))]
    if kind == "if":
        return ["if: $battery > 3 %", "then:", *indented(listed), "else:", "  wait: 1 s"]
    return [f"{kind}:", *indented(listed)]


def named(name: str, step: list[str]) -> list[str]:
    """Return the lines of a step with a name."""
    return [f"{name}:  # {name}", *indented([f"- {step[0]}", *indented(step[1:])])]


@st.composite
def machine(draw: st.DrawFn, inside: list[list[str]]) -> list[str]:
    """Return the lines of a machine's start and states."""
    lines, names = [], [name for name, _ in zip("pqr", inside, strict=False)]
    for name, step in zip(names, inside, strict=True):
        targets = st.sampled_from((*names, "finished"))
        one, other = draw(targets), draw(targets)
        forms: tuple[list[str], ...] = (
            [f"next: {one}"],
            ["next:", f"  success: {one}  # on", f"  failure: {other}"],
            [f"next: {{success: {one}, failure: {other}}}"],
            [],
        )
        body = ["do:", *indented([f"- {step[0]}", *indented(step[1:])])]
        lines += [f"{name}:", *indented([*body, *draw(st.sampled_from(forms))])]
    return [f"start: {draw(st.sampled_from(names))}", "states:", *indented(lines)]


@st.composite
def listing(draw: st.DrawFn, inside: list[list[str]]) -> list[str]:
    """Return the lines of a list of steps, with comments and empty lines between them."""
    lines: list[str] = []
    for step in inside:
        lines += draw(st.sampled_from(([], [], [""], ["# one", "# two"], ["", "# three"])))
        lines += [f"- {step[0]}", *indented(step[1:])]
    return lines


def indented(lines: list[str]) -> list[str]:
    return [f"  {line}" if line else line for line in lines]


@st.composite
def missions(draw: st.DrawFn) -> str:
    """Return the text of a mission."""
    listed = draw(listing(draw(st.lists(steps(), min_size=1, max_size=4))))
    lines = draw(st.sampled_from((listed, indented(listed))))
    end = draw(st.sampled_from(("\n", "", "\n\n# the end\n")))
    text = f"{HEAD}do:\n" + "\n".join(lines)
    return text if end == "" and not text.endswith("\n") else text + (end or "\n")


def blocks(text: str) -> list[Block]:
    return [block for top in MissionOutline(text).blocks for block in top.all()]


def undone(text: str, made: TextPatch) -> str:
    """Return a changed text with the inverse of each edit."""
    after, shift = made.applied(text), 0
    for edit in made.edits:
        at = edit.start + shift
        after = f"{after[:at]}{text[edit.start : edit.end]}{after[at + len(edit.text) :]}"
    return after


def words(text: str) -> list[str]:
    """Return what is written in each line, without where: an item that moves may get or lose a dash."""
    return sorted(stripped for line in text.split("\n") if (stripped := line.strip(" -")))


@st.composite
def changes(draw: st.DrawFn) -> tuple[str, dict[str, Any], TextPatch]:
    """Return a text, an operation that it allows, and its change."""
    text = draw(missions())
    block = draw(st.sampled_from(blocks(text)))
    slots = [slot for one in blocks(text) for slot in one.slots]
    operations: list[dict[str, Any]] = [
        *({"op": "move", "way": way} for way in ("up", "down", "in", "out")),
        {"op": "delete"},
        {"op": "duplicate"},
        {"op": "set", "key": "timeout", "value": "7 s"},
        {"op": "set", "key": block.kind, "value": "a: 'b' # c"},
        {"op": "set", "key": "timeout", "value": ""},
        {"op": "set", "key": "save", "value": "a: 1\n# why\nb: [2]\n", "shape": "lines"},
        {"op": "set", "key": block.kind, "value": "one\n\n  two\n", "shape": "text"},
        {"op": "set", "key": "speed", "value": "1 m/s", "within": [block.kind]},
        {"op": "set", "key": "place", "value": "", "within": [block.kind]},
        {"op": "rename", "name": draw(st.sampled_from(("renamed", "x", "a b")))},
    ]
    if slots:
        slot = draw(st.sampled_from(slots))
        operations.append({"op": "move_to", "to": slot.path, "index": draw(st.integers(0, 3))})
        operations.append({"op": "add", "path": slot.path, "index": draw(st.integers(0, 3))})
        operations.append({"op": "insert", "path": slot.path, "index": 1, "yaml": "log: new\noptional: true"})
    operation = {"path": block.path, **draw(st.sampled_from(operations))}
    try:
        made = change(text, operation)
    except Refused:
        made = TextPatch((), ())
    return text, operation, made


@settings(max_examples=settings().max_examples // 2)
@given(changes())
def test_no_byte_outside_of_the_edits_changes_and_undo_is_the_identity(
    given_: tuple[str, dict[str, Any], TextPatch],
) -> None:
    text, _, made = given_
    assert all(one.end <= other.start for one, other in pairwise(made.edits))
    assert undone(text, made) == text


@settings(max_examples=settings().max_examples // 2)
@given(changes())
def test_what_moves_takes_its_comments_along_and_loses_nothing(given_: tuple[str, dict[str, Any], TextPatch]) -> None:
    text, operation, made = given_
    if operation["op"] in ("move", "move_to"):
        after = made.applied(text)
        if MissionOutline(text).region(operation["path"]) is None:  # in brackets, where lines stay
            assert sorted(after) == sorted(text)
            return
        assert words(after) == words(text)
        for block in blocks(text):
            own = [line.strip(" -") for line in text[block.start : block.end].split("\n") if line.strip()]
            if block.path == operation["path"] and made.edits:
                there = [line.strip(" -") for line in after.split("\n") if line.strip()]
                assert any(there[at : at + len(own)] == own for at in range(len(there)))


@settings(max_examples=settings().max_examples // 2)
@given(changes())
def test_the_tree_afterwards_is_the_one_that_was_meant(given_: tuple[str, dict[str, Any], TextPatch]) -> None:
    text, operation, made = given_
    if not made.edits:
        return
    before, after = yaml.safe_load(text), yaml.safe_load(made.applied(text))
    if operation["op"] == "delete":
        *above, last = operation["path"]
        if isinstance(last, int) and len(at(before, above)) == 1:  # `else` goes with the only one in it
            *above, last = above
        del at(before, above)[last]
        assert after == before
    elif operation["op"] == "duplicate" and isinstance(operation["path"][-1], str):
        *above, last = operation["path"]
        copy = at(after, above).pop(made.chosen[-1])
        assert copy == at(before, above)[last]
        assert after == before
    elif operation["op"] == "duplicate":
        *above, last = operation["path"]
        at(before, above).insert(last, deepcopy(at(before, above)[last]))
        assert after == before
    elif operation["op"] == "move":
        moved = at(before, operation["path"])
        assert at(after, made.chosen) == moved
    elif operation["op"] == "insert":
        assert at(after, made.chosen) == {"log": "new", "optional": True}
    elif operation["op"] == "set" and operation.get("shape"):
        assert at(after, operation["path"])[operation["key"]] in ({"a": 1, "b": [2]}, "one\n\n  two\n")


@settings(max_examples=settings().max_examples // 2)
@given(changes())
def test_the_chosen_block_is_one_of_the_new_outline(given_: tuple[str, dict[str, Any], TextPatch]) -> None:
    text, _, made = given_
    if made.edits:
        assert MissionOutline(made.applied(text)).at(made.chosen) is not None


@given(missions())
def test_each_block_begins_and_ends_at_lines_and_holds_those_below_it(text: str) -> None:
    for block in blocks(text):
        assert block.start == 0 or text[block.start - 1] == "\n"
        assert block.end in (len(text), 0) or text[block.end - 1] == "\n"
        for child in block.children:
            assert block.start <= child.start < child.end <= block.end


ANYTHING: st.SearchStrategy[Any] = st.one_of(
    st.integers(-3, 9), st.sampled_from(("do", "machine", "states", "a", "up", "", "x: [", "lines")), st.none(),
    st.lists(st.sampled_from(("do", 0, 1, "then", "cases", "x", "machine", "states", "p", True, -1)), max_size=6),
)  # fmt: skip
KEYS = ("path", "to", "index", "way", "yaml", "name", "key", "value", "within", "shape")


@given(missions(), st.sampled_from((*OPERATIONS,)), st.dictionaries(st.sampled_from(KEYS), ANYTHING))
def test_whatever_is_asked_for_is_done_or_refused(text: str, name: str, given_: dict[str, Any]) -> None:
    try:
        made = change(text, {**given_, "op": name})
    except Refused:
        return
    assert undone(text, made) == text


def at(tree: Any, path: Any) -> Any:
    for key in path:
        tree = tree[key]
    return tree


TEXT = f"""{HEAD}
do:
  # there
  - go_to: table   # at once

  - repeat: 2
    do:
      # inside
      go_to: dock
      timeout: 3 s
  - recharge
"""


def after(text: str, **operation: Any) -> str:
    return change(text, operation).applied(text)


def test_a_step_moves_with_the_comments_above_and_beside_it() -> None:
    assert after(TEXT, op="move", path=["do", 0], way="down") == TEXT.replace(
        "  # there\n  - go_to: table   # at once\n", ""
    ).replace("  - recharge\n", "  # there\n  - go_to: table   # at once\n  - recharge\n")


def test_a_second_step_in_a_place_for_one_makes_it_a_list() -> None:
    assert after(TEXT, op="move", path=["do", 2], way="in").endswith(
        "      # inside\n      - go_to: dock\n        timeout: 3 s\n      - recharge\n"
    )
    word = f"{HEAD}do:\n  - repeat: 2\n    do: recharge   # now\n"
    made = after(word, op="insert", path=["do", 0, "do"], index=1, yaml="wait: 2 s")
    assert made.endswith("    do:\n      - recharge   # now\n      - wait: 2 s\n")


def test_an_option_of_a_step_that_was_only_a_word() -> None:
    assert after(TEXT, op="set", path=["do", 2], key="timeout", value="1 min").endswith(
        "  - recharge:\n    timeout: 1 min\n"
    )


@pytest.mark.parametrize(
    ("value", "written"),
    [("dock", "dock"), ("2 s", "2 s"), ("a: b", '"a: b"'), ("x # y", '"x # y"'), ("*x", '"*x"'), ("- a", '"- a"')],
)
def test_a_value_is_in_quotes_only_if_it_needs_them(value: str, written: str) -> None:
    assert f"go_to: {written}   # at once" in after(TEXT, op="set", path=["do", 0], key="go_to", value=value)


def test_a_step_without_a_name_does_not_go_among_those_that_have_names() -> None:
    text = f"{TEXT}  - parallel:\n      a: recharge\n      b: recharge\n"
    with pytest.raises(Refused, match="has names"):
        change(text, {"op": "move_to", "path": ["do", 0], "to": ["do", 3, "parallel"], "index": 1})


def test_states_and_interrupts_have_names_and_move_among_themselves() -> None:
    states = "    # first\n    a: {do: recharge, next: b}\n    b:\n      do: recharge\n"
    text = f"{HEAD}machine:\n  start: a\n  states:\n{states}"
    assert [block.name for block in blocks(text) if block.kind == "state"] == ["a", "b"]
    path = ["machine", "states", "a"]
    moved = after(text, op="move", path=path, way="down")
    assert moved.endswith("    b:\n      do: recharge\n    # first\n    a: {do: recharge, next: b}\n")
    assert "    a_2: {do: recharge, next: b}\n" in after(text, op="duplicate", path=path)
    low = after(TEXT, op="insert", path=["interrupts"], index=0, name="low", yaml="when: $battery < 20 %\ndo: recharge")
    assert "\ninterrupts:\n  low:\n    when: $battery < 20 %\n    do: recharge\n\ndo:\n" in low


def test_a_copy_has_no_name_of_another_step() -> None:
    text = f"{HEAD}do:\n  # first\n  - wait: 1 s\n    name: rest  # a name\n  - publish: {{topic: x, name: rest}}\n"
    copied = after(text, op="duplicate", path=["do", 0])
    assert "name: rest  # a name\n  # first\n  - wait: 1 s\n    name: rest_2  # a name\n  - publish" in copied
    assert "rest  # a name\n  # first\n  - wait: 1 s\n    name: rest_3" in after(copied, op="duplicate", path=["do", 0])
    assert "x, name: rest}\n  - publish: {topic: x, name: rest}\n" in after(text, op="duplicate", path=["do", 1])
    body = "do:\n      - {wait: 1 s, name: 'a'}\n      - [{log: x, name: b}, dock]\n    name: whole\n"
    inside = f"{HEAD}do:\n  - repeat: 2\n    {body}"
    body = body.replace("'a'", "a_2").replace("name: b", "name: b_2").replace("whole", "whole_2")
    assert after(inside, op="duplicate", path=["do", 0]) == f"{inside}  - repeat: 2\n    {body}"
    assert "name: b}, {log: x, name: b_2}, dock]" in after(inside, op="duplicate", path=["do", 0, "do", 1, 0])
    states = "    a:\n      do:\n        wait: 1 s\n        name: rest\n      next: finished\n"
    machine = f"{HEAD}machine:\n  start: a\n  states:\n{states}"
    copied = states.replace("a:", "a_2:", 1).replace("rest", "rest_2")
    assert after(machine, op="duplicate", path=["machine", "states", "a"]) == machine + copied
    flow = f"{HEAD}machine:\n  start: a\n  states: {{a: {{do: {{wait: 1 s, name: rest}}, next: finished}}}}\n"
    assert "a_2: {do: {wait: 1 s, name: rest_2}, next" in after(flow, op="duplicate", path=["machine", "states", "a"])


@for_all(
    "operation",
    [
        {"op": "delete", "path": ["do", 9]},
        {"op": "delete", "path": ["do"]},
        {"op": "delete", "path": "do"},
        {"op": "delete", "path": [True]},
        {"op": "nothing", "path": []},
        {"op": "move", "path": ["do", 0], "way": "away"},
        {"op": "move", "path": ["do", 0], "way": "up"},
        {"op": "move_to", "path": ["do", 1], "to": ["do", 1, "do"], "index": 0},
        {"op": "insert", "path": ["do"], "index": 0, "yaml": "a: ["},
        {"op": "insert", "path": ["do"], "index": "x", "yaml": "a: b"},
        {},
    ],
)
def test_what_is_no_change_is_refused(operation: dict[str, Any]) -> None:
    with pytest.raises(Refused):
        change(TEXT, operation)


@pytest.mark.parametrize("text", ["", "[", "do", "- a", "do: " + "[" * 10_000, "\x00"])
@pytest.mark.parametrize("name", OPERATIONS)
def test_a_text_that_cannot_be_read_is_not_changed(text: str, name: str) -> None:
    with pytest.raises(Refused):
        change(
            text,
            {
                "op": name,
                "path": ["do", 0],
                "way": "up",
                "to": ["do"],
                "index": 0,
                "yaml": "a",
                "key": "a",
                "value": "b",
            },
        )

"""Changes of entries as changes of the text: nothing else moves, and comments go with what they are about."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.requests import Refused
from rbxcompose.tools.mission_editor.yaml_places import TextPatch
from rbxcompose.tools.robot_editor.map_patches import MapPatch

NAMES = ("dock", "table", "hall", "seat_2", "'quoted'")
FLOWS = (
    "{x: 1 m, y: 2 m}",
    "{ x: 1 m,y: '2 m' }   # there",
    "{x: 1 m, y: 2 m, heading: 90 deg,}",
    "&a {x: 1 m, y: 2 m}",
)
BLOCKS = (
    ["  x: 1 m   # from the wall", "  y: -50 cm"],
    ["  # both measured", "  x: 1 m", "", "  y: 2 m", "  colour: 'blue'"],
    ["  x: &far 9 m", "  y: *far"],
)
HEADS = ("", "# what it is\nrbx: 1\nkind: Robot\n\n", "name: näme 🤖\n")
TAILS = ("", "\n", "\n# the end\n", "\ninclude:\n  base: rbx:parts/base.yaml\n", "\n\nmissions: {a: b}\n")


@st.composite
def robots(draw: st.DrawFn) -> str:
    """Return the text of a manifest with places."""
    names = draw(st.lists(st.sampled_from(NAMES), max_size=4, unique=True))
    lines: list[str] = []
    for name in names:
        lines += draw(st.sampled_from(([], [], [""], ["# above it"], ["", "# one", "# two"])))
        if draw(st.booleans()):
            entry = [f"{name}: {draw(st.sampled_from(FLOWS))}"]
        else:
            entry = [f"{name}:", *draw(st.sampled_from(BLOCKS))]
        number = names.index(name)  # an anchor stands once
        lines += [line.replace("&a", f"&a{number}").replace("far", f"far{number}") for line in entry]
    indented = [f"  {line}" if line else line for line in lines]
    is_flow = not names and draw(st.booleans())
    section = ["places: {}"] if is_flow else ["places:", *indented]
    return f"{draw(st.sampled_from(HEADS))}{chr(10).join(section)}{draw(st.sampled_from(TAILS))}"


def changed(how: str, text: str, *arguments: object) -> TextPatch:
    patch = MapPatch(text)
    getattr(patch, how)(*arguments)
    return patch.done()


def tree(text: str) -> Any:
    return yaml.safe_load(text)


def names_in(text: str) -> list[str]:
    return list(tree(text).get("places") or {})


@st.composite
def changes(draw: st.DrawFn) -> tuple[str, str, str, TextPatch | None]:
    """Return a text, what is done to which entry, and the change, None if it is refused."""
    text = draw(robots())
    name = draw(st.sampled_from([*names_in(text), "missing"]))
    op = draw(st.sampled_from(("set", "add", "rename", "remove")))
    try:
        match op:
            case "set":
                made = changed("set", text, ("places", name), {"y": "7 m", "heading": "30 deg"})
            case "add":
                made = changed("add", text, ("places",), "new", "{x: 3 m, y: 4 m}")
            case "rename":
                made = changed("rename", text, ("places", name), "other")
            case _:
                made = changed("remove", text, ("places", name))
    except Refused:
        return text, op, name, None
    return text, op, name, made


def undone(text: str, made: TextPatch) -> str:
    """Return a changed text with the inverse of each edit."""
    after, shift = made.applied(text), 0
    for edit in made.edits:
        at = edit.start + shift
        after = f"{after[:at]}{text[edit.start : edit.end]}{after[at + len(edit.text) :]}"
    return after


@given(changes())
def test_no_byte_outside_of_the_edits_changes_and_undo_is_the_identity(
    given_: tuple[str, str, str, TextPatch | None],
) -> None:
    text, _, _, made = given_
    if made is not None:
        assert all(one.end <= other.start for one, other in pairwise(made.edits))
        assert undone(text, made) == text


@given(changes())
def test_the_tree_afterwards_is_the_one_that_was_meant(given_: tuple[str, str, str, TextPatch | None]) -> None:
    text, op, name, made = given_
    if made is None:
        return
    before, after = tree(text), tree(made.applied(text))
    places = dict(before.get("places") or {})
    match op:
        case "set":
            places[name] = {**places[name], "y": "7 m", "heading": "30 deg"}
        case "add":
            places["new"] = {"x": "3 m", "y": "4 m"}
        case "rename":
            places["other"] = places.pop(name)
        case _:
            del places[name]
    assert (after.get("places") or {}) == places
    assert {key: one for key, one in after.items() if key != "places"} == {
        key: one for key, one in before.items() if key != "places"
    }


@given(changes())
def test_only_the_comments_of_what_is_removed_go(given_: tuple[str, str, str, TextPatch | None]) -> None:
    text, op, _, made = given_
    if made is not None and op != "remove":
        comments = [line.partition("#")[2] for line in text.split("\n") if "#" in line]
        assert [line.partition("#")[2] for line in made.applied(text).split("\n") if "#" in line] == comments


TEXT = """# a robot
places:
  # where it charges
  dock: {x: 0 m, y: 0 m}   # below the window
  table:
    x: 1 m   # measured
    y: 2 m
include:
  base: rbx:parts/base.yaml
"""


def test_a_number_changes_where_it_stands_and_a_new_key_follows_the_others() -> None:
    after = changed("set", TEXT, ("places", "table"), {"x": "1.5 m", "heading": "90 deg"}).applied(TEXT)
    assert after == TEXT.replace("x: 1 m ", "x: 1.5 m ").replace("    y: 2 m\n", "    y: 2 m\n    heading: 90 deg\n")


def test_an_entry_goes_with_its_comments() -> None:
    after = changed("remove", TEXT, ("places", "dock")).applied(TEXT)
    assert after == TEXT.replace("  # where it charges\n  dock: {x: 0 m, y: 0 m}   # below the window\n", "")


def test_the_last_entry_takes_its_section_along() -> None:
    text = changed("remove", TEXT, ("places", "dock")).applied(TEXT)
    assert "places" not in tree(changed("remove", text, ("places", "table")).applied(text))


@pytest.mark.parametrize("text", ["rbx: 1\n", "rbx: 1", "rbx: 1\nplaces:\n", "rbx: 1\nplaces: {}\n", "rbx: 1\nplaces:"])
def test_a_section_is_made_if_there_is_none(text: str) -> None:
    after = changed("add", text, ("places",), "dock", "{x: 1 m, y: 2 m}").applied(text)
    assert tree(after) == {"rbx": 1, "places": {"dock": {"x": "1 m", "y": "2 m"}}}


def test_a_new_section_stands_apart_if_the_others_do() -> None:
    text = "rbx: 1\n\nname: x\n"
    assert changed("add", text, ("places",), "a", "{x: 1 m}").applied(text) == f"{text}\nplaces:\n  a: {{x: 1 m}}\n"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("places: &p\n  dock: {x: 1 m, y: 2 m}\n", "'places' has the anchor '&p' in line 1"),
        ("places:\n  a: &a {x: 1 m, y: 2 m}\n  dock: *a\n", r"'dock' is '\*a' in line 3"),
        ("places:\n  dock:\n    x: 1 m\n    y: >\n      2 m\n", "written in several lines"),
        ("places: [1, 2]\n", "no 'places.dock'"),
        ("places: {\n", "cannot be read"),
        ("- a\n", "cannot be read"),
        ("", "cannot be read"),
    ],
)
def test_what_others_have_a_part_in_is_left_alone(text: str, why: str) -> None:
    with pytest.raises(Refused, match=why):
        changed("set", text, ("places", "dock"), {"y": "7 m"})


@pytest.mark.parametrize("value", ["1 m\ny: 2", "1 m, y: 3", "*a", "{", "1 # no", ""])
def test_a_value_cannot_bring_more_than_itself(value: str) -> None:
    with pytest.raises(Refused):
        changed("set", "places:\n  dock: {x: 1 m}\n", ("places", "dock"), {"x": value})

"""Parts with names: added so that the mission stays valid, and renamed with what leads to them."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.missions.program.registry import kinds
from rbxcompose.tools.mission_editor.editor import MissionEditor
from rbxcompose.tools.mission_editor.form import example_of
from rbxcompose.tools.mission_editor.outline import MissionOutline
from rbxcompose.tools.mission_editor.patches import change
from tests.mission_editor.test_editor import FETCH, ask, editor, project

__all__ = ["editor", "project"]
HEAD = "rbx: 1\nkind: Mission\nname: fetch\n"
MACHINE = f"""{HEAD}machine:
  start: away   # first
  states:
    away:
      do:
        go_to: table
      next: {{success: home, failure: failed}}
    # at home
    home:
      do: [{{go_to: dock}}]
      next:
        success: finished  # done
        failure: away
"""
STATES = ["machine", "states"]


def after(text: str, **operation: Any) -> str:
    return change(text, operation).applied(text)


def findings(editor: MissionEditor, text: str) -> list[str]:
    told = ask(editor, "check", text=text)
    return [one["message"] for one in (*told["findings"], *told["elsewhere"])]


@pytest.mark.parametrize(("index", "leads"), [(0, "away"), (1, "home"), (2, "finished"), (9, "finished")])
def test_a_state_is_put_between_the_one_before_it_and_where_that_leads_to(
    editor: MissionEditor, index: int, leads: str
) -> None:
    made = change(MACHINE, {"op": "add", "path": STATES, "index": index})
    text = made.applied(MACHINE)
    assert made.chosen == ("machine", "states", "new_state")
    assert f"    new_state:\n      do:\n        wait: 1 s\n      next: {leads}\n" in text
    assert findings(editor, MACHINE) == []
    assert findings(editor, text) == []


def test_an_interrupt_a_case_and_a_branch_are_valid_at_once_and_have_free_names(editor: MissionEditor) -> None:
    low = after(FETCH, op="add", path=["interrupts"], index=0)
    assert "\ninterrupts:\n  new_interrupt:\n    when: false\n    do:\n      wait: 1 s\n" in low
    assert findings(editor, low) == []
    assert "      wait: 1 s\n  new_interrupt_2:\n" in after(low, op="add", path=["interrupts"], index=9)
    parallel, choose = "parallel:\n      a: {wait: 1 s}\n", "choose: $room\n    cases:\n      a: {wait: 1 s}\n"
    both = f"{HEAD}data: {{room: b}}\ndo:\n  - {parallel}  - {choose}"
    text = after(both, op="add", path=["do", 0, "parallel"], index=0)
    text = after(text, op="add", path=["do", 1, "cases"], index=1)
    assert "  - parallel:\n      new_branch:\n        wait: 1 s\n      a: {wait: 1 s}\n" in text
    assert text.endswith("      a: {wait: 1 s}\n      new_case:\n        wait: 1 s\n")
    assert findings(editor, text) == []


def test_a_key_for_steps_that_is_not_there_is_added(editor: MissionEditor) -> None:
    text = f"{HEAD}do:\n  - if: 1 > 2\n    then:\n      wait: 1 s\n  - wait: 2 s\n"
    made = change(text, {"op": "add", "path": ["do", 0, "else"], "index": 0})
    assert made.applied(text) == text.replace("  - wait: 2 s", "    else:\n      wait: 1 s\n  - wait: 2 s")
    assert made.chosen == ("do", 0, "else")
    with pytest.raises(Refused, match="there already"):
        change(text, {"op": "add", "path": ["do", 0, "then"], "index": 0})


@pytest.mark.parametrize("kind", kinds())
def test_whatever_a_kind_declares_can_be_added_to_its_example(editor: MissionEditor, kind: str) -> None:
    """The slots are those of the grammar: no kind is named here."""
    step = example_of(kind)
    text = after(f"{HEAD}do:\n  - wait: 1 s\n", op="insert", path=["do"], index=1, yaml=step)
    for slot in MissionOutline(text).all_slots():
        if slot.has_names or not slot.is_there:
            made = change(text, {"op": "add", "path": list(slot.path), "index": 1_000})
            block = MissionOutline(made.applied(text)).at(made.chosen)
            assert block is not None
            assert made.chosen[: len(slot.path)] == slot.path


def test_what_need_not_be_there_goes_with_the_last_of_its_steps(editor: MissionEditor) -> None:
    text = f"{HEAD}do:\n  - if: 1 > 2\n    then:\n      wait: 1 s\n  - wait: 2 s\n"
    with_else = after(text, op="add", path=["do", 0, "else"], index=0)
    assert after(with_else, op="delete", path=["do", 0, "else"]) == text
    listed = after(with_else, op="insert", path=["do", 0, "else"], index=1, yaml="wait: 3 s")
    one = after(listed, op="delete", path=["do", 0, "else", 0])
    assert after(one, op="delete", path=["do", 0, "else", 0]) == text
    with pytest.raises(Refused):
        change(text, {"op": "delete", "path": ["do", 0, "then"]})
    low = change(FETCH, {"op": "add", "path": ["interrupts"], "index": 0})
    gone = change(low.applied(FETCH), {"op": "delete", "path": list(low.chosen)})
    assert "interrupts" not in gone.applied(low.applied(FETCH))
    assert gone.chosen == ("do", 0)


def test_a_state_is_renamed_with_all_that_leads_to_it(editor: MissionEditor) -> None:
    text = after(MACHINE, op="rename", path=[*STATES, "away"], name="out")
    assert text == MACHINE.replace("away", "out")
    assert findings(editor, text) == []
    assert after(text, op="rename", path=[*STATES, "out"], name="away") == MACHINE
    low = MACHINE.replace("machine:", "interrupts:\n  low:\n    when: false\n    afterwards: {restart: away}\nmachine:")
    text = after(low, op="rename", path=[*STATES, "away"], name="out")
    assert text == low.replace("away", "out")
    assert findings(editor, text) == []


@pytest.mark.parametrize(
    ("path", "name", "why"),
    [
        ([*STATES, "away"], "home", "already"),
        ([*STATES, "away"], "", "needs a name"),
        ([*STATES, "away"], "a: b", "needs a name"),
        (["machine"], "x", "no name of its own"),
        ([*STATES, "nowhere"], "x", "no name of its own"),
    ],
)
def test_a_name_that_cannot_be_is_refused(path: list[Any], name: str, why: str) -> None:
    with pytest.raises(Refused, match=why):
        change(MACHINE, {"op": "rename", "path": path, "name": name})


def test_a_step_goes_behind_the_only_one_of_a_case(editor: MissionEditor) -> None:
    text = f"{HEAD}data: {{room: b}}\ndo:\n  choose: $room\n  cases:\n    a:\n      wait: 1 s\n"
    made = after(text, op="insert", path=["do", "cases", "a"], index=1, yaml="wait: 2 s")
    assert made.endswith("    a:\n      - wait: 1 s\n      - wait: 2 s\n")


def test_what_holds_blocks_does_not_repeat_them_in_its_row() -> None:
    text = (
        f"{HEAD}do:\n  - sequence: [{{wait: 1 s}}]\n  - machine: {{start: a, states: {{a: {{do: {{wait: 1 s}}}}}}}}\n"
    )
    assert [(block.kind, block.text) for block in MissionOutline(text).blocks] == [
        ("sequence", ""),
        ("machine", "from a"),
    ]

"""What can be added to a mission, and the forms of its blocks: all of it as the grammar declares it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.missions.program.registry import kinds
from rbxcompose.tools.mission_editor.editor import MissionEditor
from rbxcompose.tools.mission_editor.outline import kind_of
from rbxcompose.tools.mission_editor.yaml_places import placed
from tests.mission_editor.test_editor import FETCH, ask, editor, project

__all__ = ["editor", "project"]
ROOT = Path(__file__).parents[2]

TEXT = """rbx: 1
kind: Mission
name: fetch
data:
  seen: 0
interrupts:
  low:
    when: $seen > 3
    do: {wait: 1 s}
do:
  - go_to: table
    timeout: 3 s
  - log: done
    level: warn
  - log: |
      more
      lines
  - [{wait: 2 s}]
"""


def fields(editor: MissionEditor, *path: str | int, text: str = TEXT) -> dict[str, Any]:
    form = ask(editor, "form", text=text, path=list(path))
    return {field["key"]: field for field in form["fields"]}


def test_all_kinds_and_the_skills_of_the_robot_can_be_added_each_as_itself(editor: MissionEditor) -> None:
    offered = ask(editor, "palette")
    assert {one["word"] for one in offered if one["sort"] == "kind"} == set(kinds())
    skills = {one["word"]: one["yaml"] for one in offered if one["sort"] == "skill"}
    assert skills.items() >= {"go_to": "go_to: dock", "say": "say: hello"}.items()  # other tests declare more
    for one in offered:
        node = placed(one["yaml"])
        assert node is not None
        assert kind_of(node) == one["word"]
        assert one["about"]


def test_whatever_can_be_added_makes_a_mission_that_can_be_read(editor: MissionEditor) -> None:
    for one in ask(editor, "palette"):
        operation = {"op": "insert", "path": ["do"], "index": 1, "yaml": one["yaml"]}
        (edit,) = ask(editor, "edit", text=FETCH, operation=operation)["edits"]
        text = FETCH[: edit["from"]] + edit["text"] + FETCH[edit["to"] :]
        told = ask(editor, "look", text=text)
        assert len(told["outline"]["blocks"]) == 3
        assert not any("unknown key" in found["message"] for found in told["findings"])


def test_a_step_has_the_options_of_its_kind_with_values_units_and_names(editor: MissionEditor) -> None:
    found = fields(editor, "do", 0)
    assert list(found)[:2] == ["go_to", "timeout"]
    assert (found["go_to"]["value"], found["go_to"]["choices"]) == ("table", ["dock", "table"])
    assert (found["timeout"]["value"], found["timeout"]["units"][0]) == ("3 s", "s")
    assert "$seen" in found["only_if"]["choices"]
    assert "wait" not in found
    log = fields(editor, "do", 1)
    assert (log["level"]["value"], log["level"]["only"]) == ("warn", True)
    assert (fields(editor, "do", 2)["log"]["shape"], fields(editor, "do", 2)["log"]["value"]) == (
        "text",
        "more\nlines\n",
    )
    assert found["save"]["shape"] == "line"


def test_a_field_offers_data_of_its_type_and_a_transition_states_and_ends(editor: MissionEditor, project: Path) -> None:
    text = """rbx: 1
kind: Mission
name: fetch
inputs:
  pause: {type: time, default: 2 s}
machine:
  start: a
  ends: {lost: failure}
  states:
    a:
      do: {wait: 1 s}
      next: {success: b, failure: lost}
    b: {do: {repeat: 2, do: {wait: 1 s}}, next: a}
"""
    (project / "missions/fetch.yaml").write_text(text, encoding="utf-8")
    state = fields(editor, "machine", "states", "b", text=text)
    assert state["next"]["choices"] == ["a", "b", "lost", "finished", "failed"]
    assert "$pause" in state["cooldown"]["choices"]
    assert "$pose" not in state["cooldown"]["choices"]
    assert {"$pause", "$pose"} <= set(state["only_if"]["choices"])  # where a comparison is written
    repeat = fields(editor, "machine", "states", "b", "do", text=text)
    assert not {"$pause", "$pose"} & set(repeat["repeat"]["choices"])


def test_an_interrupt_has_a_form(editor: MissionEditor) -> None:
    assert list(fields(editor, "interrupts", "low")) == ["when", "afterwards"]


def test_a_step_that_is_only_a_word_has_the_options_of_that(editor: MissionEditor) -> None:
    found = fields(editor, "do", 0, text=TEXT.replace("go_to: table\n    timeout: 3 s", "go_to"))
    assert found["timeout"]["value"] == ""


def test_what_has_no_options_is_refused(editor: MissionEditor, project: Path) -> None:
    paths: tuple[list[Any], ...] = (["do"], ["do", 3], ["do", 9], ["nothing"], [[]])
    for path in paths:
        with pytest.raises(Refused):
            ask(editor, "form", text=TEXT, path=path)


def library_editor(robot: str) -> MissionEditor:
    file = ROOT / robot

    def compiled(unsaved: Any) -> Any:
        return compile_robot(str(file), environment=os.environ, unsaved=unsaved)

    return MissionEditor(compiled, file)


def test_what_there_is_to_choose_is_offered_places_joints_poses_topics_values_and_names() -> None:
    """On a robot of the library, whose skills declare all of it."""
    editor = library_editor("robots/pedestal_pi/robot.yaml")
    head = "rbx: 1\nkind: Mission\nname: poses_and_gripper\ndo:\n"
    steps = ("move_right_arm:", "right_gripper_controller: 1 cm", "publish: x", "call: x", "set_parameter:", "use: x")
    text = head + "".join(f"  - {step}\n" for step in (*steps, "check: 1 > 0"))

    def offered(turn: int) -> dict[str, Any]:
        form = editor.answer({"do": "form", "mission": "poses_and_gripper", "text": text, "path": ["do", turn]})
        return {".".join([*field["within"], field["key"]]): field for field in form["fields"]}

    arm = offered(0)
    assert {"resting", "wave"} <= set(arm["move_right_arm"]["choices"])
    assert arm["move_right_arm.right_arm_elbow_flex_joint"]["units"] == ["rad", "deg"]
    assert arm["move_right_arm.keep"]["shape"] == "lines"
    assert offered(1)["right_gripper_controller"]["units"][:2] == ["m", "cm"]
    assert "right_arm/servo/twist" in [one.strip("/") for one in offered(2)["publish"]["choices"]]
    assert offered(3)["call"]["choices"][0]
    assert "move_right_arm" not in offered(4)
    assert offered(4)["set_parameter.component"]["choices"]
    assert "poses_and_gripper" in offered(5)["use"]["choices"]
    assert "$leading" in offered(6)["check"]["choices"]


def test_a_skill_is_told_by_the_component_of_this_robot(editor: MissionEditor) -> None:
    offered = {one["word"]: one["about"] for one in editor.answer({"do": "palette", "mission": "fetch"})}
    assert offered["go_to"].startswith("Skill of 'go_to': ")  # a navigator of another robot offers one, too
    assert ask(editor, "form", text=TEXT, path=["do", 0])["about"].replace("`", "'") == offered["go_to"]

"""The mission read aloud: the sentences of `mission show`, each with the block that it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.missions.view.picture import picture_of
from rbxcompose.tools.mission_editor.editor import MissionEditor
from tests.mission_editor.test_editor import FETCH, ask, editor, project

__all__ = ["editor", "project"]
WITH_INTERRUPT = FETCH.replace("do:\n", "interrupts:\n  never:\n    when: false\n    do: {wait: 1 s}\ndo:\n")


def test_each_sentence_is_that_of_the_picture_and_has_its_block(editor: MissionEditor, project: Path) -> None:
    (project / "missions/fetch.yaml").write_text(WITH_INTERRUPT, encoding="utf-8")
    robot = editor._compile({}).robot
    assert robot is not None
    picture = picture_of(robot.missions["fetch"].program, robot.names)
    told = ask(editor, "aloud", text=WITH_INTERRUPT)
    drawn = [one for root in picture.roots for one in root.all()]
    assert [one["text"].rstrip(":") for one in told] == [one.sentence for one in drawn]
    assert [(one["place"], one["path"]) for one in told] == [
        ("1", None),
        ("1.1", ["do", 0]),
        ("1.2", ["do", 1]),
        ("2", ["interrupts", "never"]),
        ("2.1", ["interrupts", "never", "do"]),
    ]


def test_a_list_within_a_step_is_not_taken_for_its_first_step(editor: MissionEditor) -> None:
    told = ask(editor, "aloud", text=FETCH + "  - [{wait: 1 s}, {wait: 3 s}]\n")
    assert [one["path"] for one in told][3:] == [["do", 2], ["do", 2, 0], ["do", 2, 1]]


def test_what_is_not_saved_is_read(editor: MissionEditor) -> None:
    told = ask(editor, "aloud", text=FETCH.replace("2 s", "7 s"))
    assert "7 s" in told[-1]["text"]


def test_a_text_with_mistakes_says_so(editor: MissionEditor) -> None:
    for text in ("do: [", FETCH.replace("wait: 2 s", "wait: 2 secs")):
        with pytest.raises(Refused, match="cannot be read aloud yet"):
            ask(editor, "aloud", text=text)

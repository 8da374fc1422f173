"""The editor of missions: texts read, checked as they are typed, and saved only over what was read."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.tools.mission_editor.editor import MissionEditor
from rbxcompose.tools.mission_editor.process import answer_line
from rbxcompose.tools.mission_editor.yaml_places import Utf16

ROBOT = """rbx: 1
kind: Robot
name: fetcher
places:
  dock: {x: 0 m, y: 0 m}
  table: {x: 1 m, y: 0 m}
include:
  base: rbx:parts/base.yaml
  nav: rbx:parts/navigation.yaml
missions:
  fetch: ../../missions/fetch.yaml
"""
FETCH = """# What it is for
rbx: 1
kind: Mission
name: fetch
do:
  - go_to: table   # there
  - wait: 2 s
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "robots/fetcher").mkdir(parents=True)
    (tmp_path / "missions").mkdir()
    (tmp_path / "robots/fetcher/robot.yaml").write_text(ROBOT, encoding="utf-8")
    (tmp_path / "missions/fetch.yaml").write_text(FETCH, encoding="utf-8")
    return tmp_path


@pytest.fixture
def editor(project: Path) -> MissionEditor:
    return editor_of(project)


def editor_of(project: Path) -> MissionEditor:
    file = project / "robots/fetcher/robot.yaml"

    def compiled(unsaved: Any) -> Any:
        return compile_robot(str(file), environment=os.environ, unsaved=unsaved)

    return MissionEditor(compiled, file)


def ask(editor: MissionEditor, do: str, **more: Any) -> Any:
    return editor.answer({"do": do, "mission": "fetch", **more})


def test_a_text_is_read_with_what_is_wrong_and_where_it_is_kept(editor: MissionEditor) -> None:
    read = ask(editor, "read")
    assert (read["file"], read["text"], read["findings"], read["why_not"]) == ("missions/fetch.yaml", FETCH, [], "")


def test_a_mistake_is_found_as_it_is_typed_and_its_fix_corrects_the_text(editor: MissionEditor) -> None:
    text = FETCH.replace("table ", "tabel ")
    (found,) = ask(editor, "look", text=text)["findings"]
    assert found["message"].startswith("there is no place 'tabel'")
    assert text[found["from"] : found["to"]] == "tabel"
    (edit,) = found["fix"]["edits"]
    assert text[: edit["from"]] + edit["text"] + text[edit["to"] :] == FETCH


def test_what_is_found_is_what_check_finds(editor: MissionEditor) -> None:
    text = FETCH.replace("wait: 2 s", "wiat: 2 s\n    timeut: 3 s")
    looked, checked = ask(editor, "look", text=text), ask(editor, "check", text=text)
    assert looked["errors"] > 0
    assert looked["findings"] == [found for found in checked["findings"] if found["severity"] == "error"]


def test_a_mistake_that_shows_elsewhere_is_told_with_its_place(editor: MissionEditor, project: Path) -> None:
    robot = project / "robots/fetcher/robot.yaml"
    robot.write_text(f"{ROBOT}start: nothing\n", encoding="utf-8")
    (found, *_) = ask(editor, "check", text=FETCH)["elsewhere"]
    assert "nothing" in found["message"]
    assert found["place"].endswith("robot.yaml:12:8")


@pytest.mark.parametrize(
    "text", ["", "do: [", "\tdo: x", "- a\n- b\n", "do: &a [*a]", "do: " + "[" * 10_000, "x" * 10, "\x00", "{" * 70]
)
def test_no_text_is_too_wrong_to_be_told_so(editor: MissionEditor, text: str) -> None:
    for do in ("look", "check"):
        told = ask(editor, do, text=text)
        assert told["errors"] + len(told["elsewhere"]) > 0
        assert all(0 <= found["from"] <= found["to"] <= len(text) for found in told["findings"])


def test_places_are_counted_as_a_browser_counts(editor: MissionEditor) -> None:
    text = FETCH.replace("# What it is for", "# \U0001f916\U0001f916").replace("table ", "tabel ")
    (found,) = ask(editor, "look", text=text)["findings"]
    units = text.encode("utf-16-le")
    assert units[2 * found["from"] : 2 * found["to"]].decode("utf-16-le") == "tabel"
    units_of = Utf16(text)
    assert all(units_of.at(offset) == len(text[:offset].encode("utf-16-le")) // 2 for offset in range(len(text)))


def test_it_is_shown_what_would_change_before_it_is_saved(editor: MissionEditor, project: Path) -> None:
    read, text = ask(editor, "read"), FETCH.replace("2 s", "3 s")
    told = ask(editor, "save", text=text, hash=read["hash"], dry_run=True)
    assert [line for line in told["diff"] if line[0] in "+-"] == ["-  - wait: 2 s", "+  - wait: 3 s"]
    assert told["errors"] == 0
    assert (project / "missions/fetch.yaml").read_text(encoding="utf-8") == FETCH


def test_saving_writes_the_whole_file_and_the_next_save_goes_on_from_it(editor: MissionEditor, project: Path) -> None:
    file = project / "missions/fetch.yaml"
    saved = ask(editor, "save", text=FETCH.replace("2 s", "3 s"), hash=ask(editor, "read")["hash"])
    assert file.read_text(encoding="utf-8") == FETCH.replace("2 s", "3 s")
    ask(editor, "save", text=FETCH, hash=saved["hash"])
    assert file.read_text(encoding="utf-8") == FETCH
    assert [path.name for path in file.parent.iterdir()] == ["fetch.yaml"]


def test_of_two_editors_the_second_to_save_is_refused(editor: MissionEditor, project: Path) -> None:
    other, file = editor_of(project), project / "missions/fetch.yaml"
    mine, theirs = ask(editor, "read"), ask(other, "read")
    ask(other, "save", text=FETCH.replace("2 s", "5 s"), hash=theirs["hash"])
    with pytest.raises(Refused, match="has changed on disk"):
        ask(editor, "save", text=FETCH.replace("2 s", "3 s"), hash=mine["hash"])
    assert file.read_text(encoding="utf-8") == FETCH.replace("2 s", "5 s")


def test_a_file_that_vanished_is_not_made_again(editor: MissionEditor, project: Path) -> None:
    read, file = ask(editor, "read"), project / "missions/fetch.yaml"
    file.unlink()
    with pytest.raises(Refused, match="cannot be read"):
        ask(editor, "save", text=FETCH, hash=read["hash"])
    assert not file.exists()


def test_a_link_that_leads_out_of_the_project_is_not_followed(editor: MissionEditor, project: Path) -> None:
    read, file = ask(editor, "read"), project / "missions/fetch.yaml"
    outside = project.parent / f"{project.name}_outside.yaml"
    outside.write_text(FETCH, encoding="utf-8")
    file.unlink()
    file.symlink_to(outside)
    with pytest.raises(Refused, match="cannot be read"):
        ask(editor, "save", text="", hash=read["hash"])
    assert outside.read_text(encoding="utf-8") == FETCH
    outside.unlink()


def test_a_mission_of_the_library_is_shown_and_not_changed(editor: MissionEditor, project: Path) -> None:
    robot = project / "robots/fetcher/robot.yaml"
    robot.write_text(ROBOT.replace("../../missions/fetch.yaml", "rbx:missions/fetch.yaml"), encoding="utf-8")
    read = ask(editor, "read")
    assert "belongs to the library" in read["why_not"]
    with pytest.raises(Refused, match="belongs to the library"):
        ask(editor, "save", text="", hash=read["hash"])


def test_line_ends_and_the_byte_order_mark_of_a_file_stay(editor: MissionEditor, project: Path) -> None:
    file = project / "missions/fetch.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + FETCH.replace("\n", "\r\n").encode())
    read = ask(editor, "read")
    assert read["text"] == FETCH
    ask(editor, "save", text=FETCH.replace("2 s", "3 s"), hash=read["hash"])
    assert file.read_bytes() == b"\xef\xbb\xbf" + FETCH.replace("2 s", "3 s").replace("\n", "\r\n").encode()


@pytest.mark.parametrize(
    ("data", "why"),
    [(b"a: \xff", "not UTF-8"), (b"a: 1\r\nb: 2\n", "end in different ways"), (b"#" * 2_000_001, "larger than")],
)
def test_a_file_that_cannot_be_kept_as_it_is_is_refused(
    editor: MissionEditor, project: Path, data: bytes, why: str
) -> None:
    (project / "missions/fetch.yaml").write_bytes(data)
    with pytest.raises(Refused, match=why):
        ask(editor, "read")


def test_a_mission_that_does_not_exist_is_refused(editor: MissionEditor) -> None:
    with pytest.raises(Refused, match="no mission 'x'"):
        editor.answer({"do": "read", "mission": "x"})


def test_a_robot_that_cannot_be_read_keeps_the_missions_that_were_known(editor: MissionEditor, project: Path) -> None:
    ask(editor, "read")
    (project / "robots/fetcher/robot.yaml").write_text("{", encoding="utf-8")
    assert ask(editor, "look", text=FETCH)["findings"] == []
    with pytest.raises(Refused, match="cannot be read"):
        ask(editor_of(project), "read")


def test_what_cannot_be_written_is_refused(editor: MissionEditor) -> None:
    read = ask(editor, "read")
    for text, why in (("\ud800", "no file can hold"), ("#" * 2_000_001, "larger than")):
        with pytest.raises(Refused, match=why):
            ask(editor, "save", text=text, hash=read["hash"])


def test_the_process_answers_a_mistake_of_its_own_too(
    editor: MissionEditor, capsys: pytest.CaptureFixture[str]
) -> None:
    assert answer_line(editor, "{}")["refused"] == "the editor has failed: KeyError"
    assert "Traceback" in capsys.readouterr().err
    assert answer_line(editor, '{"do": "read", "mission": "x"}')["refused"] == "the robot has no mission 'x'"

"""The editor of robots: changes where values stand, checked with the whole robot, saved only over what was read."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.files import replace_file
from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.tools.robot_editor.editor import MOST_CHANGES, RobotEditor
from tests.loops import for_all

ROBOT = """# A robot that fetches
rbx: 1
kind: Robot
name: fetcher
places:
  # where it charges
  dock: {x: 0 m, y: 0 m}   # below the window
  table: {x: 1 m, y: 50 cm, heading: 90 deg}
include:
  base: rbx:parts/base.yaml
  nav: rbx:parts/navigation.yaml
  left: ../../parts/rooms.yaml
missions:
  fetch: ../../missions/fetch.yaml
"""
ROOMS = """rbx: 1
kind: Part
name: rooms
places:
  hall: {x: 3 m, y: 1 m}   # measured
"""
FETCH = "rbx: 1\nkind: Mission\nname: fetch\ndo:\n  - go_to: table\n"
Json = dict[str, Any]


def written(folder: Path, files: dict[str, str]) -> Path:
    for file, text in files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")
    return folder


FILES = {"robots/fetcher/robot.yaml": ROBOT, "parts/rooms.yaml": ROOMS, "missions/fetch.yaml": FETCH}


@pytest.fixture
def project(tmp_path: Path) -> Path:
    return written(tmp_path, FILES)


@pytest.fixture
def editor(project: Path) -> RobotEditor:
    return editor_of(project)


def editor_of(project: Path, *shared_with: str, **layers: Any) -> RobotEditor:
    file = project / "robots/fetcher/robot.yaml"

    def compiled(unsaved: Any) -> Any:
        return compile_robot(str(file), environment=os.environ, unsaved=unsaved, **layers)

    return RobotEditor(compiled, file, shared_with)


def ask(editor: RobotEditor, do: str, *changes: Json, subject: str = "places", **more: Any) -> Any:
    return editor.answer({"do": f"robot/{do}", "subject": subject, "changes": list(changes), **more})


def save(editor: RobotEditor, *changes: Json, subject: str = "places") -> Any:
    hashes = ask(editor, "look", subject=subject)["hashes"]
    return ask(editor, "save", *changes, subject=subject, hashes=hashes)


class Refuser:
    """An editor that saves nothing of what it is asked for: it looks once, for many changes."""

    def __init__(self, project: Path, subject: str) -> None:
        self.project, self.editor, self.subject = project, editor_of(project), subject
        self.hashes = ask(self.editor, "look", subject=subject)["hashes"]

    def save(self, change: Json) -> None:
        ask(self.editor, "save", change, subject=self.subject, hashes=self.hashes)


@pytest.fixture(scope="module")
def refuser(tmp_path_factory: pytest.TempPathFactory) -> Refuser:
    return Refuser(written(tmp_path_factory.mktemp("refused"), FILES), "places")


def place(name: str, op: str = "set", **values: Any) -> Json:
    return {"op": op, "path": ["places", name], **({"values": values} if values else {})}


def text_of(project: Path, file: str = "robots/fetcher/robot.yaml") -> str:
    return (project / file).read_text(encoding="utf-8")


def test_places_are_told_with_their_numbers_and_where_they_stand(editor: RobotEditor) -> None:
    told = ask(editor, "look")
    assert told["findings"] == []
    table = next(one for one in told["entries"] if one["name"] == "table")
    assert table["written"] == {"x": "1 m", "y": "50 cm", "heading": "90 deg"}
    assert (table["y"], table["file"], table["why_not"]) == (0.5, "robots/fetcher/robot.yaml", "")
    assert next(one["file"] for one in told["entries"] if one["name"] == "left_hall") == "parts/rooms.yaml"


def test_a_place_that_moves_keeps_its_units_and_all_that_stands_around_it(editor: RobotEditor, project: Path) -> None:
    save(editor, place("table", x=1.25, y=0.75, heading=math.pi))
    assert text_of(project) == ROBOT.replace(
        "{x: 1 m, y: 50 cm, heading: 90 deg}", "{x: 1.25 m, y: 75 cm, heading: 180 deg}"
    )


def test_what_is_typed_with_a_unit_is_written_as_it_is(editor: RobotEditor, project: Path) -> None:
    save(editor, place("dock", x="20 cm"))
    assert text_of(project) == ROBOT.replace("dock: {x: 0 m", "dock: {x: 20 cm")


def test_a_place_of_a_part_changes_in_the_file_of_the_part(editor: RobotEditor, project: Path) -> None:
    saved = save(
        editor, place("left_hall", y=2), {"op": "rename", "path": ["places", "left_hall"], "name": "left_room"}
    )
    assert saved == {"files": ["parts/rooms.yaml"]}
    assert text_of(project) == ROBOT
    assert text_of(project, "parts/rooms.yaml") == ROOMS.replace("hall: {x: 3 m, y: 1 m}", "room: {x: 3 m, y: 2 m}")


def test_changes_follow_each_other_and_undo_is_a_shorter_list(editor: RobotEditor) -> None:
    changes = [
        place("seat", "add", x=2, y=0.5),
        {"op": "rename", "path": ["places", "seat"], "name": "chair"},
        place("chair", heading=-0.5235987755982988),
        place("dock", "remove"),
    ]
    names = [[one["name"] for one in ask(editor, "look", *changes[:count])["entries"]] for count in range(5)]
    assert names[1] == [*names[0], "seat"]
    assert names[2] == names[3] == [*names[0], "chair"]
    assert "dock" not in names[4]
    assert [one["name"] for one in ask(editor, "look", *changes[:1])["entries"]] == names[1]


def test_a_mission_that_uses_a_removed_place_is_named_before_anything_is_saved(
    editor: RobotEditor, project: Path
) -> None:
    told = ask(editor, "save", place("table", "remove"), hashes=ask(editor, "look")["hashes"], dry_run=True)
    (found,) = [one for one in told["findings"] if one["is_new"]]
    assert "there is no place 'table'" in found["message"]
    assert found["place"] == "missions/fetch.yaml:5:12"
    assert told["errors"] == 1
    assert [line for line in told["diff"] if line[0] in "+-"] == ["-  table: {x: 1 m, y: 50 cm, heading: 90 deg}"]
    assert text_of(project) == ROBOT


def test_of_two_editors_the_second_to_save_is_refused(editor: RobotEditor, project: Path) -> None:
    other = editor_of(project)
    mine, theirs = ask(editor, "look")["hashes"], ask(other, "look")["hashes"]
    ask(other, "save", place("dock", x=5), hashes=theirs)
    with pytest.raises(Refused, match=r"'robots/fetcher/robot.yaml' has changed on disk since it was opened"):
        ask(editor, "save", place("table", x=3), hashes=mine)
    assert text_of(project) == ROBOT.replace("dock: {x: 0 m", "dock: {x: 5 m")
    newest = ask(editor, "look", place("table", x=3))["hashes"]  # loaded again, its own change is still there
    ask(editor, "save", place("table", x=3), hashes=newest)
    assert "table: {x: 3 m" in text_of(project)
    assert "dock: {x: 5 m" in text_of(project)


def test_a_file_that_is_read_only_is_left_alone(
    editor: RobotEditor, project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).name != "robot.yaml")  # root may write everything
    assert "not writable" in ask(editor, "look")["why_not"]
    with pytest.raises(Refused, match=r"'robots/fetcher/robot.yaml' is not writable"):
        save(editor, place("dock", x=1))
    assert text_of(project) == ROBOT


def test_if_one_of_two_files_cannot_be_written_neither_is(
    editor: RobotEditor, project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changes, hashes = (place("dock", x=1), place("left_hall", x=1)), ask(editor, "look")["hashes"]
    told = ask(editor, "look", *changes)
    assert told["errors"] == 0

    def fail(path: Path, data: bytes) -> None:
        if path.name == "rooms.yaml" and data != ROOMS.encode():
            raise OSError(28, "No space left on device")
        replace_file(path, data)

    monkeypatch.setattr("rbxcompose.tools.project_texts.replace_file", fail)
    with pytest.raises(Refused, match="was not saved: No space left"):
        ask(editor, "save", *changes, hashes=hashes)
    assert (text_of(project), text_of(project, "parts/rooms.yaml")) == (ROBOT, ROOMS)


@for_all(
    "change, why",
    [
        (place("dock", x=math.nan), "'x' must be a finite number"),
        (place("dock", x=math.inf), "'x' must be a finite number"),
        (place("dock", x=1e300), "below 1e15"),
        (place("dock", x=1e9), "farther away than"),
        (place("dock", x=True), "'x' must be a finite number"),
        (place("dock", x=10**400), "'x'"),
        (place("dock", x=f"1.{'0' * 1000} m"), "at most 60 characters"),
        (place("dock", x="1 kg"), "'x' must be a length"),
        (place("dock", x="1 m, y: 3 m"), "'x' must be a length"),
        (place("dock", heading="90"), "the unit is missing"),
        (place("dock", heading="${env.HOME}"), "'heading' must be an angle"),
        (place("dock", colour="a\nb"), "'colour' is a word"),
        (place("dock", size=1), "a place has no 'size'"),
        (place("nowhere", x=1), "there is no place 'nowhere'"),
        (place("table", "add", x=1, y=1), "cannot be the name of a place, it is taken"),
        (place("Big Table", "add", x=1, y=1), "did you mean 'big_table'"),
        (place("../x", "add", x=1, y=1), "cannot be the name"),
        (place("new", "add", x=1), "needs 'x' and 'y'"),
        ({"op": "rename", "path": ["places", "dock"], "name": "table"}, "it is taken"),
        ({"op": "rename", "path": ["places", "dock"], "name": "a: b"}, "cannot be the name"),
        ({"op": "rename", "path": ["places", "dock"]}, "cannot be the name"),
        ({"op": "rename", "path": ["places", "left_hall"], "name": "hall"}, "its name begins with 'left_'"),
        ({"op": "set", "path": ["places"]}, "no change of a robot"),
        ({"op": "set", "path": ["components", "battery"], "values": {"x": 1}}, "no change of a robot"),
        ({"op": "eat", "path": ["places", "dock"]}, "no change of a robot"),
    ],
)
def test_what_is_no_change_is_refused_with_the_reason(refuser: Refuser, change: Json, why: str) -> None:
    with pytest.raises(Refused, match=why):
        refuser.save(change)
    assert text_of(refuser.project) == ROBOT


def test_too_many_changes_are_refused(editor: RobotEditor) -> None:
    with pytest.raises(Refused, match="more than"):
        ask(editor, "look", *[place("dock", x=1)] * (MOST_CHANGES + 1))


@pytest.mark.parametrize(
    ("places", "change", "why"),
    [
        ("  dock: &d {x: 0 m, y: 0 m}\n  table: *d\n", place("table", x=1), r"anchor '&d' in line 6"),
        ("  dock: &d {x: 0 m, y: 0 m}\n  table: {<<: *d, x: 1 m}\n", place("table", y=1), r"anchor '&d' in line 6"),
        ("  dock: &d {x: 0 m, y: 0 m}\n  table: *d\n", place("dock", "remove"), "anchor '&d'"),
        (
            "  dock: {x: 0 m, y: 0 m}\n  table: {x: '${args.far}', y: 0 m}\n",
            place("table", x=1),
            r"computed from .* at ",
        ),
    ],
)
def test_what_is_written_for_several_or_computed_is_refused_with_the_place_and_the_reason(
    project: Path, places: str, change: Json, why: str
) -> None:
    file = project / "robots/fetcher/robot.yaml"
    head, tail = ROBOT[: ROBOT.index("  # where")], ROBOT[ROBOT.index("include:") :]
    text = f"{head}{places}args: {{far: 3 m}}\n{tail}"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(Refused, match=why):
        save(editor_of(project), change)
    assert file.read_text(encoding="utf-8") == text


def test_a_part_that_is_there_twice_does_not_change_twice(project: Path) -> None:
    file = project / "robots/fetcher/robot.yaml"
    text = ROBOT.replace("missions:", "  right: ../../parts/rooms.yaml\nmissions:")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(Refused, match="this would change 'right_hall', too"):
        save(editor_of(project), place("left_hall", x=1))


def test_a_place_of_a_world_is_told_to_be_there(project: Path) -> None:
    world = "rbx: 1\nkind: World\nname: flat\nplaces:\n  sofa: {x: 1 m, y: 2 m}\n"
    (project / "robots/fetcher/flat.yaml").write_text(world, encoding="utf-8")
    file = project / "robots/fetcher/robot.yaml"
    file.write_text(f"{ROBOT}world: flat.yaml\n", encoding="utf-8")
    why = r"'sofa' comes from the world 'flat.yaml', named at .*robot.yaml:15:8"
    (sofa,) = [one for one in ask(editor_of(project), "look")["entries"] if one["name"] == "sofa"]
    assert "comes from the world 'flat.yaml'" in sofa["why_not"]
    renamed = {"op": "rename", "path": ["places", "sofa"], "name": "couch"}
    for change in (place("sofa", "remove"), place("sofa", x=3), renamed):
        with pytest.raises(Refused, match=why):
            save(editor_of(project), change)


def test_a_place_of_the_command_line_is_in_no_file(project: Path) -> None:
    with pytest.raises(Refused, match="--set"):
        save(editor_of(project, sets=["places.dock.x=3 m"]), place("dock", x=1))


def test_a_manifest_that_others_of_the_system_have_is_not_changed(project: Path) -> None:
    editor = editor_of(project, "left", "right")
    assert "is the manifest of 'left', 'right', too" in ask(editor, "look")["why_not"]
    with pytest.raises(Refused, match="is the manifest of 'left', 'right', too"):
        save(editor, place("dock", x=1))


def test_a_link_that_leads_out_of_the_project_is_not_followed(project: Path) -> None:
    file, outside = project / "robots/fetcher/robot.yaml", project.parent / f"{project.name}_outside.yaml"
    editor = editor_of(project)
    hashes = ask(editor, "look")["hashes"]
    outside.write_text(ROBOT, encoding="utf-8")
    file.unlink()
    file.symlink_to(outside)
    with pytest.raises(Refused):
        ask(editor, "save", place("dock", x=1), hashes=hashes)
    assert outside.read_text(encoding="utf-8") == ROBOT


@pytest.mark.parametrize("text", ["", "places: [", "rbx: 1\nkind: Robot\nname: x\nplaces: 7\n", "\x00", "- a\n"])
def test_a_file_that_is_no_robot_is_told_so(project: Path, text: str) -> None:
    (project / "robots/fetcher/robot.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(Refused):
        save(editor_of(project), place("new", "add", x=1, y=1))
    assert text_of(project) == text


def test_line_ends_and_the_byte_order_mark_of_a_file_stay(editor: RobotEditor, project: Path) -> None:
    file, text = project / "robots/fetcher/robot.yaml", f"\ufeff{ROBOT}".replace("\n", "\r\n")
    file.write_bytes(text.encode())
    save(editor, place("dock", x=1))
    assert file.read_bytes() == text.replace("dock: {x: 0 m", "dock: {x: 1 m").encode()


def test_a_robot_that_has_mistakes_already_can_be_edited(project: Path) -> None:
    file = project / "robots/fetcher/robot.yaml"
    file.write_text(ROBOT + "start: nothing\n", encoding="utf-8")
    told = ask(editor_of(project), "look", place("dock", x=1))
    assert [one["is_new"] for one in told["findings"]] == [False]

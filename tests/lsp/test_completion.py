"""What is proposed where."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.manifest.documents import KINDS
from rbxcompose.missions.program.registry import modifier_keys
from rbxcompose.tools.lsp.completion import complete
from rbxcompose.tools.lsp.document import Document
from tests.loops import for_all
from tests.lsp.places import BATTERY, HEAD, LOOK, PATROL, ROBOT, TRIAL, TWINS, Editor

PLACES = ["dock", "corner_1", "corner_2", "corner_3", "corner_4"]
COMPONENTS = ["battery", "base", "go_to", "charger", "cmd_vel"]


@pytest.fixture(scope="module")
def editor() -> Editor:
    return Editor(ROBOT, TWINS, HEAD, TRIAL)


@for_all(
    "path, old, new, labels",
    [
        (ROBOT, "    reach: 20 cm", "    re", ["reach", "process", "starts_after", "connect"]),
        (ROBOT, "dock: dock", "dock: ", PLACES),
        (ROBOT, "type: charger", "type: ", ["battery_sim", "charger", "diff_drive_sim", "go_to"]),
        (ROBOT, "runtime: 45 s", "runtime: 45", ["s", "ms", "us", "min", "h"]),
        (ROBOT, "warn: 50 %", "warn: 50 ", ["%"]),
        (ROBOT, "from: go_to", "from: ", [*COMPONENTS, "go_to.cmd_vel"]),
        (ROBOT, "battery.battery_level", "battery.", ["battery.battery_level"]),
        (ROBOT, "[battery, charger]", "[battery, ", [*COMPONENTS, "diagnostics", "mission"]),
        (ROBOT, "    reach: 20 cm", "    starts_after: [", COMPONENTS),
        (ROBOT, "    reach: 20 cm", "    connect:\n      ", ["battery_level", "recharge"]),
        (ROBOT, "start: patrol", "start: ", ["patrol"]),
        (ROBOT, "${args.speed}", "${", ["args.speed", "robot.name", "sim"]),
        (ROBOT, "        runtime: 30 s", "        ", ["runtime", "warn"]),
        (ROBOT, "      battery:\n        runtime: 30 s", "      ", COMPONENTS),
        (ROBOT, "type: speed", "type: ", ["length", "speed", "choice"]),
        (ROBOT, "start: patrol", "", ["start", "include", "bus"]),
        (PATROL, "- recharge", "- ", ["recharge", "go_to", "wait", "sequence"]),
        (PATROL, "go_to: dock", "go_to: ", PLACES),
        (PATROL, "[corner_1, ", "[", PLACES),
        (PATROL, "$battery < $low", "$", ["battery", "low", "rounds", "pose"]),
        (PATROL, "go_to: $corner", "go_to: $", ["corner", "battery"]),
        (PATROL, "timeout: 10 s", "timeout: 10 ", ["s", "min"]),
        (PATROL, "afterwards: continue", "afterwards: ", ["continue"]),
        (PATROL, "optional: true", "optional: ", ["true"]),
        (TRIAL, "mission: patrol", "mission: ", ["patrol"]),
        (TRIAL, "go_to: corner_1", "go_to: ", PLACES),
        (TWINS, "      dock: dock\n      runtime: 60 s", "      ", ["reach", "warn", "error"]),
        (LOOK, "      head_pan_joint: $side\n", "      head_", ["head_pan_joint", "head_tilt_joint"]),
        (
            LOOK,
            "      head_pan_joint: $side\n      duration",
            "      ",
            ["head_pan_joint", "head_tilt_joint", "duration"],
        ),
        (LOOK, "head_pan_joint: $side", "head_pan_joint: $", ["side", "up"]),
        (BATTERY, "${args.reach}", "${args.", ["args.reach", "args.dock"]),
    ],
)
def test_what_may_be_written_is_proposed(editor: Editor, path: Path, old: str, new: str, labels: list[str]) -> None:
    found = editor.labels(path, old, new)
    assert set(labels) <= set(found), found


def test_keys_that_are_there_are_not_proposed_again(editor: Editor) -> None:
    found = editor.labels(ROBOT, "    error: 20 %", "    ")
    assert {"initial", "error"} <= set(found)
    assert not {"type", "runtime", "warn"} & set(found)


def test_beside_a_skill_no_second_step_is_proposed(editor: Editor) -> None:
    found = editor.labels(PATROL, "      timeout: 10 s", "      ")
    assert set(found) == {"name", "timeout", *modifier_keys()} - {"optional"}


def test_a_kind_proposes_its_own_settings(editor: Editor) -> None:
    found = editor.labels(PATROL, "    in: [corner_1, corner_2, corner_3, corner_4]", "    ")
    assert {"in", "order", "if_one_fails", "timeout"} <= set(found)
    assert not {"every", "then", "wait", "go_to"} & set(found)


def test_a_proposal_replaces_what_was_begun_and_writes_the_colon_once(editor: Editor) -> None:
    new = next(item for item in editor.complete(ROBOT, "    reach: 20 cm", "    re") if item.label == "reach")
    assert (new.text, new.replaces, new.detail) == ("reach: ", 2, "length")
    assert new.about == "How near to the dock the robot must be."
    text = "rbx: 1\nkind: Robot\nname: r\ncomponents:\n  base:\n    type: charger\n    rea: 2 cm\n"
    old = next(item for item in complete(Document(ROBOT, text), 6, 6) if item.label == "reach")
    assert (old.text, old.replaces) == ("reach", 2)


def test_a_unit_stands_behind_a_space(editor: Editor) -> None:
    close = editor.complete(ROBOT, "runtime: 45 s", "runtime: 45")[0]
    apart = editor.complete(ROBOT, "runtime: 45 s", "runtime: 45 ")[0]
    begun = editor.complete(ROBOT, "runtime: 45 s", "runtime: 45 m")[0]
    assert [(completion_item.text, completion_item.replaces) for completion_item in (close, apart, begun)] == [
        (" s", 0),
        ("s", 0),
        ("s", 1),
    ]


def test_an_empty_file_gets_the_first_keys() -> None:
    assert [item.label for item in complete(Document(ROBOT, ""), 0, 0)][:4] == ["rbx", "kind", "name", "about"]


WORLD = "rbx: 1\nkind: World\nname: w\n"


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("", {"map", "objects", "spawn", "places"}),
        ("objects:\n  desk:\n    ", {"box", "cylinder", "shape", "at", "path", "colour"}),
        ("objects:\n  desk:\n    shape: ", {"person"}),
        ("places:\n  door:\n    heading: 90 ", {"deg", "rad"}),
        ("objects:\n  desk:\n    at: {x: 1 m, ", {"y", "heading"}),
    ],
)
def test_a_file_of_a_world_gets_its_own_keys(text: str, labels: set[str], tmp_path: Path) -> None:
    whole = f"{WORLD}{text}"
    found = complete(Document(tmp_path / "w.yaml", whole), whole.count("\n"), len(whole.rpartition("\n")[2]))
    assert labels <= {item.label for item in found}
    assert "components" not in {item.label for item in found}


@pytest.mark.parametrize(
    ("file", "kind", "key"),
    [
        ("missions/tour.yaml", "Mission", "do"),
        ("missions/tests/tour.test.yaml", "Test", "expect"),
        ("parts/arm.yaml", "Part", "components"),
        ("robots/one/robot.yaml", "Robot", "components"),
        ("systems/two.yaml", "System", "hosts"),
    ],
)
def test_a_file_without_its_kind_gets_those_of_its_folder_first(file: str, kind: str, key: str, tmp_path: Path) -> None:
    path = tmp_path / file
    assert key in {item.label for item in complete(Document(path, "rbx: 1\n"), 1, 0)}
    kinds = [item.label for item in complete(Document(path, "rbx: 1\nkind: "), 1, 6)]
    assert kinds[0] == kind
    assert sorted(kinds) == sorted(KINDS)

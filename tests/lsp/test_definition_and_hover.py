"""Jumps lead to where something is written; hovers tell what it is and where its value is from."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.tools.lsp.answers import define
from rbxcompose.tools.lsp.completion import complete
from rbxcompose.tools.lsp.document import Document
from tests.conftest import ROOT
from tests.loops import for_all
from tests.lsp.places import BATTERY, PATROL, ROBOT, TRIAL, TWINS, Editor, line_of


@pytest.fixture(scope="module")
def editor() -> Editor:
    return Editor(ROBOT, TWINS, TRIAL)


@for_all(
    "path, words, offset, target, there",
    [
        (ROBOT, "dock: dock", 7, ROBOT, "  dock: {"),
        (ROBOT, "from: go_to", 8, ROBOT, "  go_to:\n"),
        (ROBOT, "battery.battery_level", 3, ROBOT, "  battery:\n    type"),
        (ROBOT, "${args.speed}", 9, ROBOT, "  speed:\n"),
        (ROBOT, "../../missions/patrol.yaml", 8, PATROL, "# yaml-language-server"),
        (ROBOT, "start: patrol", 9, ROBOT, "  patrol: ../.."),
        (ROBOT, "go_to, cmd_vel]", 9, ROBOT, "  cmd_vel:\n"),
        (PATROL, "go_to: dock", 8, ROBOT, "  dock: {"),
        (PATROL, "go_to: dock", 2, ROBOT, "  go_to:\n"),
        (PATROL, "- recharge", 5, ROBOT, "  charger:\n"),
        (PATROL, "$battery", 3, ROBOT, "  battery: battery."),
        (PATROL, "$low", 2, PATROL, "  low:\n"),
        (PATROL, "$corner", 3, PATROL, "for: corner"),
        (PATROL, "corner_2", 3, ROBOT, "  corner_2: {"),
        (TRIAL, "mission: patrol", 10, ROBOT, "  patrol: ../.."),
        (TRIAL, "../../robots/turtlebot/robot.yaml", 8, ROBOT, "# yaml-language-server"),
        (TRIAL, "go_to: corner_4", 8, ROBOT, "  corner_4: {"),
        (TWINS, "part: rbx:parts/battery.yaml", 20, BATTERY, "# yaml-language-server"),
        (BATTERY, "level: battery.battery_level", 9, BATTERY, "  battery:\n    type"),
    ],
)
def test_a_name_leads_to_where_it_is_written(
    editor: Editor, repository: Path, path: Path, words: str, offset: int, target: Path, there: str
) -> None:
    found = editor.define(path, words, offset)
    assert found.startswith(f"{target.relative_to(ROOT)}:{line_of(target, there)}:")


def test_the_file_of_a_body_is_led_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart.urdf").write_text('<robot><link name="base"/></robot>', encoding="utf-8")
    document = Document(tmp_path / "robot.yaml", "rbx: 1\nkind: Robot\nname: cart\nbody:\n  urdf: cart.urdf\n")
    assert str(define(document, 4, 10)) == "cart.urdf:1:1"


def test_the_device_of_a_port_is_proposed_and_led_to(tmp_path: Path) -> None:
    lines = ["rbx: 1", "kind: Robot", "name: arm", "devices:", "  adapter: {vendor: 0403, product: 6014}"]
    lines += ["buses:", "  servos:", "    type: dynamixel", "    port: dev:adapter"]
    document = Document(tmp_path / "robot.yaml", "\n".join(lines))
    for column, typed in ((10, 0), (16, 6)):
        assert [
            (completion_item.text, completion_item.replaces) for completion_item in complete(document, 8, column)
        ] == [("dev:adapter", typed)]
    assert str(define(document, 8, 16)).endswith("robot.yaml:5:3")


def test_what_names_nothing_leads_nowhere(editor: Editor) -> None:
    assert editor.define(ROBOT, "warn: 50 %", 8) == "None"
    assert editor.define(ROBOT, "rbx: 1", 5) == "None"


@for_all(
    "path, words, offset, told",
    [
        (
            ROBOT,
            "runtime: 45 s",
            2,
            ["Time from full to empty.", "Takes a time.", "`45 s` from robots/turtlebot/robot.yaml:30"],
        ),
        (
            ROBOT,
            "speed: ${args.speed}",
            2,
            ["Largest speed forwards.", "Default: `0.3 m/s`", "`${args.speed}` = `0.3 m/s`"],
        ),
        (ROBOT, "type: battery_sim", 8, ["A battery that drains evenly"]),
        (ROBOT, "  base:\n", 3, ["A base with two driven wheels"]),
        (ROBOT, "muxes:", 2, ["Which source may command"]),
        (ROBOT, "dock: dock", 7, ["`dock`: (0.5 m, 0.5 m)"]),
        (PATROL, "$battery", 3, ["`$battery`: a ratio, a value of the robot from /battery_level"]),
        (PATROL, "$low", 2, ["`$low`: a ratio, an input"]),
        (PATROL, "$corner", 3, ["`$corner`: a place, the item of a loop"]),
        (PATROL, "repeat: ", 3, ["Do the body repeatedly"]),
        (PATROL, "timeout: 10 s", 3, ["Fail when the node takes longer", "Takes a time."]),
        (PATROL, "- recharge", 5, ["`recharge`: skill"]),
        (TWINS, "warn: 45 %", 2, ["`45 %` from robots/twins/robot.yaml", "had `${args.warn}` (parts/battery.yaml"]),
    ],
)
def test_a_hover_tells_what_something_is(
    editor: Editor, repository: Path, path: Path, words: str, offset: int, told: list[str]
) -> None:
    found = editor.hover(path, words, offset)
    assert [text for text in told if text not in found] == [], found


def test_a_key_of_a_test_has_no_value_of_its_robot(editor: Editor, repository: Path) -> None:
    assert editor.hover(TRIAL, "name: recharges", 2) == "Its name: lower-case letters, digits and underscores."

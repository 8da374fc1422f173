"""A section that is one file is checked, joined, renamed, shown in editors, described and run like any other."""

from __future__ import annotations

import json
from collections.abc import Sequence
from difflib import unified_diff
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator

from docs.generating.robot import whole_page
from rbxcompose.base.findings import Fix
from rbxcompose.compiler.schema.documents import as_text, installed_schema, makers
from rbxcompose.manifest import registry
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.section import Section
from rbxcompose.sdk.registry import usable_names
from rbxcompose.tools.lsp.answers import define, describe
from rbxcompose.tools.lsp.completion import complete
from rbxcompose.tools.lsp.document import Document
from rbxcompose.tools.lsp.project import Project as OpenProject
from tests.parts.project import Project
from tests.soak import rare

pytestmark = pytest.mark.usefixtures("lamps")

BASE = "components:\n  base: {type: diff_drive_sim}\n"
ROBOT = BASE + "lamps:\n  front: base\n  rear: {driver: base, after: [front]}\n"
HEADLIGHT = """
components:
  driver: {type: diff_drive_sim, connect: {cmd_vel: other, odom: wheels}}
lamps:
  left: driver
  right: {driver: driver, after: [left, front]}
"""


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


def told(project: Project) -> list[tuple[str, str, int]]:
    """Return code, message and line of the errors."""
    found = [finding for finding in project.findings if finding.severity.name == "ERROR"]
    return [(finding.code, finding.message, finding.span.line if finding.span else 0) for finding in found]


def test_its_model_holds_and_a_word_may_stand_for_an_entry(project: Project) -> None:
    project.check(ROBOT)
    assert told(project) == []
    assert project.value("lamps", "front", "driver") == "base"


def test_what_its_model_does_not_take_is_a_finding(project: Project) -> None:
    project.check(BASE + "lamps:\n  front: {driver: base, aftr: []}\n  Rear: base\n")
    assert told(project) == [
        ("RBX1001", "unknown key 'aftr' in lamp 'front'", 7),
        ("RBX1006", "'Rear' is not a valid name", 8),
    ]


@pytest.mark.parametrize(
    ("entry", "message", "fixed"),
    [
        ("rear: {driver: base, after: [frnt]}", "'after[0]': there is no lamp 'frnt'", "front"),
        ("rear: bas", "'driver': there is no component 'bas'", "base"),
        ("rear: {driver: base, place: dock}", "'place': there is no place 'dock'", ""),
    ],
)
def test_a_name_that_does_not_exist_is_found_at_its_place(
    project: Project, entry: str, message: str, fixed: str
) -> None:
    project.check(BASE + f"lamps:\n  front: base\n  {entry}\n")
    assert told(project) == [("RBX1004", message, 8)]
    fixes: Sequence[Fix] = [finding.fix for finding in project.findings if finding.fix]
    assert [edit.text for fix in fixes for edit in fix.edits] == ([fixed] if fixed else [])


def test_each_entry_runs_as_a_component_under_its_name(project: Project) -> None:
    project.check(ROBOT)
    assert project.checked
    robot = project.checked.compilation.robot
    assert robot
    assert {
        name: component.type_name for name, component in robot.components.items() if component.path[:1] == ("lamps",)
    } == {"front": "toy_lantern", "rear": "toy_lantern"}
    assert robot.component_span("rear").line == 8


def helps(project: Project, code: str, about: str) -> list[str]:
    """Return the helps of the findings of a kind whose message has some words."""
    return [finding.help for finding in project.findings if finding.code == code and about in finding.message]


def test_only_an_entry_that_takes_connect_is_told_to_write_it(project: Project) -> None:
    sensor, lamp = (
        "  sensor: {type: program, command: [./sensor], publishes: {dusk: std_msgs/Bool}",
        "lamps: {front: base}",
    )
    project.check(BASE + f"{sensor}}}\n{lamp}\n")
    assert helps(project, "RBX3010", "'/dark'") == ["give 'sensor' the topic that is needed: 'connect: {dusk: dark}'"]
    project.check(BASE + f"{sensor}, connect: {{dusk: dark}}}}\n{lamp}\n")
    assert helps(project, "RBX3010", "'/dark'") == []
    project.check(BASE + "lamps: {front: base, rear: base}\n")
    assert helps(project, "RBX3010", "'/dark'") == ["add the component that provides it"] * 2
    assert helps(project, "RBX3015", "'/shines'") == [""]
    mine = "  mine: {type: program, command: [./mine], publishes: {shines: std_msgs/Bool}, connect: {CONNECT}}\n"
    project.check(BASE + mine.replace("CONNECT", "") + lamp)
    told = helps(project, "RBX3015", "'/shines'")
    assert told == ["give 'mine' another topic: 'connect: {shines: mine/shines}'"]
    project.check(BASE + mine.replace("CONNECT", "shines: mine/shines") + lamp)
    assert helps(project, "RBX3015", "") == []


def test_only_a_topic_that_an_instance_may_rename_is_told_to_be_renamed(project: Project) -> None:
    part = "components:\n  sensor: {type: program, command: [./sensor], publishes: {dusk: std_msgs/Bool}}\n"
    pair = "include:\n  left: ../../parts/lit.yaml\n  right: ../../parts/lit.yaml\n"
    project.check(pair, {"lit": part + "lamps: {front: sensor}\n"})
    assert helps(project, "RBX3023", "'/dusk'") == ["give one of them another topic: 'connect: {dusk: right/dusk}'"]
    assert helps(project, "RBX3023", "'/shines'") == [""]


def test_a_component_and_a_lamp_of_one_name_are_a_finding(project: Project) -> None:
    project.check(BASE + "lamps:\n  base: base\n")
    assert told(project) == [("RBX1007", "a component and a lamp are both named 'base'", 5)]


def test_components_may_refer_to_what_it_runs(project: Project) -> None:
    project.check(ROBOT.replace("{type: diff_drive_sim}", "{type: diff_drive_sim, starts_after: [rear]}"))
    assert told(project) == []


def test_what_parts_bring_is_joined_under_the_names_of_their_instances(project: Project) -> None:
    robot = ROBOT + "include:\n  lit: ../../parts/headlight.yaml\n"
    project.check(robot, {"headlight": HEADLIGHT})
    assert told(project) == []
    assert project.value("lamps") == {
        "lit_left": {"driver": "lit_driver"},
        "lit_right": {"driver": "lit_driver", "after": ["lit_left", "front"]},
        "front": {"driver": "base"},
        "rear": {"driver": "base", "after": ["front"]},
    }


def test_a_value_for_an_argument_of_a_part_may_be_one_of_its_names(project: Project) -> None:
    inner = "args: {lamp: {type: text}}\nlamps:\n  third: {driver: base, after: ['${args.lamp}']}\n"
    outer = "lamps:\n  left: base\ninclude:\n  in: {part: inner.yaml, with: {lamp: left}}\n"
    project.check(BASE + "include:\n  out: ../../parts/outer.yaml\n", {"inner": inner, "outer": outer})
    assert told(project) == []
    assert project.value("lamps", "out_in_third", "after", 0) == "out_left"


def test_layers_change_a_part_of_an_entry(project: Project) -> None:
    changed = "rbx: 1\nkind: Overlay\nname: dark\nlamps: {front: {after: [rear]}, rear: !remove , side: base}\n"
    robot = ROBOT.replace("after: [front]", "after: []") + "profiles: {swapped: {lamps: {rear: {after: [front]}}}}\n"
    project.check(robot, files={"dark.yaml": changed}, profiles=["swapped"], overlays=["dark.yaml"], sets=[])
    assert told(project) == [("RBX1004", "'after[0]': there is no lamp 'rear'", 4)]
    assert project.value("lamps", "side", "driver") == "base"


@pytest.mark.parametrize(
    ("path", "message", "help_text"),
    [
        ("lamps.frnt.driver=base", "'--set' changes 'lamps.frnt.driver', which the robot does not have", "'front'"),
        ("front.driver=base", "'--set' changes 'front.driver', which the robot does not have", "'lamps.front.driver'"),
    ],
)
def test_a_set_that_names_no_lamp_is_told_what_is_there(
    project: Project, path: str, message: str, help_text: str
) -> None:
    project.check(ROBOT, sets=[path])
    [finding] = [candidate for candidate in project.findings if candidate.code == "RBX1302"]
    assert finding.message == message
    assert help_text in finding.help


def test_a_set_changes_what_stands_in_an_entry(project: Project) -> None:
    project.check(ROBOT, sets=["lamps.rear.after=[]"])
    assert told(project) == []
    assert project.value("lamps", "rear", "after") == []


def test_an_overlay_that_changes_a_misspelt_lamp_is_told_which_is_meant(project: Project) -> None:
    project.check(ROBOT + "profiles: {dim: {lamps: {reer: {after: []}}}}\n", profiles=["dim"])
    [finding] = [candidate for candidate in project.findings if candidate.code == "RBX1302"]
    assert finding.message == "profile 'dim' changes the lamp 'reer', which the robot does not have"
    assert "'rear'" in finding.help


class Editor:
    """A robot with lamps as an editor has it."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "robots/one/robot.yaml"
        self.path.parent.mkdir(parents=True)
        self.text = f"rbx: 1\nkind: Robot\nname: one\n{ROBOT}"
        self.path.write_text(self.text, encoding="utf-8")
        project = OpenProject({})
        project.change(self.path, self.text)
        self.robot = project.robot_of(self.path)

    def at(self, before: str, instead: str | None = None) -> tuple[Document, int, int]:
        """Return the position behind a text, which may be written otherwise."""
        written = before if instead is None else instead
        text = self.text.replace(before, written, 1)
        lines = text[: text.index(written) + len(written)].split("\n")
        return Document(self.path, text, self.robot), len(lines) - 1, len(lines[-1])


SELDOM = [pytest.param("front: base", "front: ", {"base"}, marks=pytest.mark.soak)]  # as `driver`


@pytest.mark.parametrize(
    ("before", "instead", "labels"),
    [
        ("after: [front", "after: [", {"front", "rear"}),
        ("driver: base", "driver: ", {"base", "front"}),
        *SELDOM,
        ("driver: base, after", "driver: base, ", {"after", "place"}),
        ("lamps:\n", "", {"lamps"}),
        ("rear: {driver: base, after: [front]}\n", "rear: base\nprofiles:\n  dim:\n    lamps:\n      ", {"front"}),
    ],
)
def test_editors_propose_its_names_and_keys(tmp_path: Path, before: str, instead: str, labels: set[str]) -> None:
    assert labels <= {item.label for item in complete(*Editor(tmp_path).at(before, instead))}


@pytest.mark.parametrize(("before", "line"), [("after: [fro", 7), ("{driver: ba", 5), ("front: ba", 5)])
def test_a_jump_leads_to_what_is_named(tmp_path: Path, before: str, line: int) -> None:
    span = define(*Editor(tmp_path).at(before))
    assert span
    assert span.line == line


@pytest.mark.parametrize(
    ("before", "words"),
    [
        ("lam", "Lamps of the robot, by name."),
        ("{dri", "The component that switches it."),
        ("after: [fro", "`front`: lamp"),
    ],
)
def test_a_hover_tells_what_it_is(tmp_path: Path, before: str, words: str) -> None:
    assert words in describe(*Editor(tmp_path).at(before))


@pytest.mark.parametrize("kind", ["Robot", *rare("Part", "Overlay")])
def test_schemas_have_it(kind: str) -> None:
    schema: Any = json.loads(json.dumps(installed_schema(kind)))
    validator, header = Draft7Validator(schema), {"rbx": 1, "kind": kind, "name": "one"}
    assert not list(validator.iter_errors({**header, "lamps": {"front": "base", "rear": {"driver": "base"}}}))
    wrong = [*validator.iter_errors({**header, "lamps": {"front": {"drivr": "base"}}})]
    assert [list(error.absolute_path)[:2] for error in wrong][:1] == [["lamps", "front"]]


@pytest.mark.parametrize("kind", ["Robot", *rare("Part", "Overlay")])
def test_schemas_grow_by_few_lines_for_it(lamps: Section[Any, Any], kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with_it = as_text(installed_schema(kind))
    others = {section.name: section for section in sections() if section.name != lamps.name}
    monkeypatch.setattr(registry, "_SECTIONS", others)
    without = as_text(makers()[kind](usable_names()))
    changed = [*unified_diff(without.split("\n"), with_it.split("\n"), n=0)][2:]
    assert 0 < len([line for line in changed if line[:1] in "+-"]) < 60


def test_the_reference_has_it_with_its_keys_and_example() -> None:
    page = whole_page()
    about = page[page.index("## `lamps`") :]
    assert about.startswith("## `lamps`\nLamps of the robot, by name. *In a file of the kind Robot, Part, Overlay.*")
    assert "| `driver` | name of a component | *required* | The component that switches it. |" in about
    assert "| `after` | list of names of a lamp |  | Lamps that shine before this one. |" in about
    assert "lamps:\n  front: base\n" in about


def test_it_stands_at_its_place_among_the_others(lamps: Section[Any, Any]) -> None:
    names = [section.name for section in sections()]
    assert names.index("missions") < names.index(lamps.name) < names.index("bus")

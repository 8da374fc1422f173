"""The JSON Schemas: what is right passes, typical mistakes do not, everything is described."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator

from rbxcompose.cli.main import main as command
from rbxcompose.config import Config
from rbxcompose.manifest.file_models import FILES, file_model
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.validate import to_plain
from rbxcompose.missions.registry import kinds
from rbxcompose.schema.asking import kind_schema
from rbxcompose.schema.documents import MAKERS, files
from tests.conftest import ROOT

SCHEMAS: dict[str, Any] = {name.partition(".")[0]: json.loads(text) for name, text in files().items()}
ROBOT = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
MISSION = "rbx: 1\nkind: Mission\nname: m\n"


def mistakes(text: str) -> list[str]:
    """Return where a manifest's schema objects to it."""
    node, findings = read_text(text, "file.yaml")
    assert node is not None, findings
    data: Any = json.loads(json.dumps(to_plain(node)))
    found = Draft7Validator(SCHEMAS[data["kind"].lower()]).iter_errors(data)
    return [".".join(map(str, error.absolute_path)) for error in found]


def manifests() -> list[Path]:
    folders = ("robots", "missions", "parts", "overlays")
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.yaml"))


@pytest.mark.parametrize("path", manifests(), ids=lambda path: str(path.relative_to(ROOT)))
def test_the_manifests_of_the_project_are_right(path: Path) -> None:
    assert mistakes(path.read_text(encoding="utf-8")) == []


def test_the_schemas_in_the_repository_are_up_to_date() -> None:
    written = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "schemas").iterdir()}
    assert written == files(), "run `make docs`"


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_is_one_of_draft_7(name: str) -> None:
    Draft7Validator.check_schema(SCHEMAS[name])


def properties(schema: object, path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield every property that a schema declares, but for those that a condition names."""
    if isinstance(schema, dict):
        for key, value in schema.items():
            if key == "properties" and isinstance(value, dict):
                yield from ((f"{path}.{name}", one) for name, one in value.items())
            if key != "if":
                yield from properties(value, f"{path}.{key}")
    elif isinstance(schema, list):
        for index, value in enumerate(schema):
            yield from properties(value, f"{path}[{index}]")


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_property_has_a_description(name: str) -> None:
    assert [path for path, schema in properties(SCHEMAS[name]) if not schema.get("description")] == []


@pytest.mark.parametrize(("name", "model"), [(kind.lower(), file_model(kind)) for kind in FILES])
def test_every_section_has_a_schema(name: str, model: type[Config]) -> None:
    assert set(SCHEMAS[name]["properties"]) == set(model.model_fields)


@pytest.mark.parametrize("kind", kinds().values(), ids=lambda kind: kind.name)
def test_a_kind_of_node_tells_of_each_of_its_keys(kind: Any) -> None:
    keys, _ = kind_schema(kind)
    assert set(keys) == {kind.name, *kind.options}


@pytest.mark.parametrize(
    ("right", "wrong", "place"),
    [
        ("runtime: 45 s ", "runtme: 45 s ", "components.battery"),
        ("runtime: 45 s ", "runtime: 45 m ", "components.battery.runtime"),
        ("runtime: 45 s ", "runtime: long ", "components.battery.runtime"),
        ("warn: 50 %", "warn: 0.5", "components.battery.warn"),
        ("max_turn_rate: 90 deg/s", "max_turn_rate: 90 deg", "components.base.max_turn_rate"),
        ("heading: 90 deg", "heading: 90", "places.corner_1.heading"),
        ("type: battery_sim", "type: batery_sim", "components.battery.type"),
        ("    type: charger\n", "", "components.charger"),
        ("    dock: dock\n", "", "components.charger"),
        (
            "  teleop:\n        priority: 100",
            "  teleop:\n        priority: high",
            "muxes.cmd_vel.inputs.teleop.priority",
        ),
        ("match: [battery, charger]", "match: []", "diagnostics.analyzers.power.match"),
        ("type: speed", "type: sped", "args.speed.type"),
        ("kind: Robot", "kind: Robot\nplacs: {}", ""),
        ("components:\n  battery", "components:\n  Battery", "components"),
        ("start: patrol", "start: [patrol]", "start"),
        ("profiles:\n  tired:", "profiles:\n  tired:\n    component: {}", "profiles.tired"),
        ("rbx: 1", "rbx: 2", "rbx"),
    ],
)
def test_a_mistake_in_a_robot_is_refused_at_its_place(right: str, wrong: str, place: str) -> None:
    assert ROBOT.count(right) == 1
    found = mistakes(ROBOT.replace(right, wrong))
    assert found
    assert all(place.startswith(one) for one in found), found


@pytest.mark.parametrize(
    ("written", "instead"),
    [
        ("runtime: 45 s ", "runtime: ${args.long} "),
        ("runtime: 45 s ", "runtime: 45 "),
        ("runtime: 45 s ", "runtime: 45s "),
        ("priority: 100", "priority: ${args.first}"),
        ("match: [battery, charger]", "match: ${args.names}"),
        ("places:\n", "bus:\n  domain: 3\nplaces:\n"),
        ("places:\n", "bus:\nplaces:\n"),
        ("battery: battery.battery_level ", "battery: {topic: level, type: ratio} "),
        ("patrol: ../../missions/patrol.yaml", "patrol: {file: ../../missions/patrol.yaml, with: {rounds: 1}}"),
        (
            "    components:\n      battery:\n",
            "    args: {speed: 0.2 m/s}\n    components:\n      charger:\n      battery:\n",
        ),
        ("colour: red", "colour: 7"),
        ("    reach: 20 cm", "    reach: -2e-1 m\n    process: dock\n    starts_after: [base]"),
    ],
)
def test_what_is_unusual_and_right_passes(written: str, instead: str) -> None:
    assert ROBOT.count(written) == 1
    assert mistakes(ROBOT.replace(written, instead)) == []


@pytest.mark.parametrize(
    "text",
    [
        "do: recharge",
        "do:\n  - recharge\n  - go_to: dock",
        "do:\n  - wave_hello: 3\n    timeout: 5 s",
        "do:\n  go_to:\n    pose: dock\n  attempts: forever",
        "do:\n  wait: $pause * 2\n  optional: true",
        "do:\n  repeat: forever\n  every: 1 min\n  do: recharge",
        "do:\n  if: $battery < 50 %\n  then: recharge",
        "do:\n  for: room\n  in: $rooms\n  do:\n    - clean: $room",
        "data: {n: 0}\ndo:\n  set:\n    n: $n + 1",
        "rate: 5 Hz\ninterrupts:\n  low:\n    when: $battery < 20 %\ndo:\n  log: hello\n  level: warn",
    ],
)
def test_missions_that_are_right_pass(text: str) -> None:
    assert mistakes(f"{MISSION}{text}\n") == []


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", ""),
        ("do: []", "do"),
        ("do:\n  wait: 5 sec", "do.wait"),
        ("do:\n  wait: [5 s]", "do.wait"),
        ("do:\n  repeat: 3", "do"),
        ("do:\n  repeat: often\n  do: recharge", "do.repeat"),
        ("do:\n  wait: 5 s\n  evry: 3 s", "do"),
        ("do:\n  go_to: dock\n  timeout: 10 deg", "do.timeout"),
        ("do:\n  go_to: {plac: dock}", "do.go_to"),
        ("do:\n  log: hello\n  level: loud", "do.level"),
        ("do:\n  - sequence:\n      recharge", "do.0.sequence"),
        ("do: recharge\ninterrupts:\n  low:\n    do: recharge", "interrupts.low"),
        ("do: recharge\ninputs:\n  low:\n    default: 3", "inputs.low"),
        ("do: recharge\ndatta: {}", ""),
    ],
)
def test_a_mistake_in_a_mission_is_refused_at_its_place(text: str, place: str) -> None:
    assert place in mistakes(f"{MISSION}{text}\n")


@pytest.mark.parametrize("name", sorted(SCHEMAS["robot"]["definitions"]))
def test_the_examples_of_a_definition_are_right(name: str) -> None:
    schema = SCHEMAS["robot"]["definitions"][name]
    validator = Draft7Validator({**schema, "definitions": SCHEMAS["robot"]["definitions"]})
    for sample in schema.get("examples", []):
        validator.validate(sample)


def test_a_component_type_has_its_docstring_as_description_and_its_example() -> None:
    battery = SCHEMAS["robot"]["definitions"]["component_battery_sim"]
    assert battery["description"].startswith("A battery that drains evenly")
    assert battery["examples"] == [{"type": "battery_sim", "runtime": "45 s", "warn": "50 %", "error": "20 %"}]
    assert battery["properties"]["warn"]["default"] == "50 %"


@pytest.mark.parametrize("kind", MAKERS)
def test_the_command_prints_a_schema(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["schema", kind.lower()]) == 0
    assert json.loads(capsys.readouterr().out)["properties"]["kind"]["const"] == kind

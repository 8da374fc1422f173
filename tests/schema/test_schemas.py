"""The JSON Schemas: what is right passes, typical mistakes do not, everything is described."""

from __future__ import annotations

import json
from collections.abc import Iterator
from difflib import unified_diff
from functools import cache, reduce
from operator import getitem
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis.strategies import DataObject, data, sampled_from
from jsonschema import Draft7Validator
from jsonschema.exceptions import best_match
from referencing import Registry, Resource

from rbxcompose.base.config import Config, Length, Time
from rbxcompose.commands.main import main as command
from rbxcompose.compiler.schema.documents import as_text, files, makers
from rbxcompose.compiler.schema.scalars import referred
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.registry import FILES, file_model
from rbxcompose.manifest.validate import to_plain
from rbxcompose.missions.program.registry import kinds, modifiers
from rbxcompose.sdk import Component, component
from rbxcompose.sdk.registry import PLUGINS
from tests.conftest import ROOT
from tests.loops import for_all
from tests.soak import rare

NAMES = [kind.lower() for kind in makers()]
LIKE_ROBOTS = ("part", "overlay")  # whose definitions are those of robots
ROBOT = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
MISSION = "rbx: 1\nkind: Mission\nname: m\n"


texts = cache(files)


@cache
def written() -> dict[str, Any]:
    """Return the schemas as files, by the names of the files."""
    return {name: json.loads(text) for name, text in texts().items()}


@cache
def neighbours() -> Any:
    return Registry().with_resources((name, Resource.from_contents(schema)) for name, schema in written().items())


@cache
def schemas() -> dict[str, Any]:
    """Return each schema as it is printed: alone."""
    return {kind.lower(): json.loads(as_text(make(sorted(PLUGINS.shipped)))) for kind, make in makers().items()}


def plain(text: str) -> Any:
    """Return a manifest as editors hand it to a schema."""
    node, findings = read_text(text, "file.yaml")
    assert node is not None, findings
    return json.loads(json.dumps(to_plain(node)))


def mistakes(text: str) -> list[str]:
    """Return where a manifest's schema objects to it: the one that is printed, and the file beside its neighbours."""
    manifest = plain(text)
    kind = manifest["kind"].lower()
    alone = Draft7Validator(schemas()[kind])
    beside = Draft7Validator(written()[f"{kind}.schema.json"], registry=neighbours())
    found, again = (
        [".".join(map(str, error.absolute_path)) for error in made.iter_errors(manifest)] for made in (alone, beside)
    )
    assert found == again
    return found


def manifests() -> list[Path]:
    folders = ("robots", "missions", "parts", "overlays", "systems", "worlds")
    files = (path for folder in folders for path in (ROOT / folder).rglob("*.yaml"))
    return sorted(path for path in files if not path.stem.endswith("_map"))


@pytest.mark.parametrize(
    "path",
    [path if not number % 5 else pytest.param(path, marks=pytest.mark.soak) for number, path in enumerate(manifests())],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_the_manifests_of_the_project_are_right(path: Path) -> None:
    assert mistakes(path.read_text(encoding="utf-8")) == []


def test_the_schemas_in_the_repository_are_up_to_date() -> None:
    committed = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "schemas").iterdir()}
    assert committed == texts(), "run `make docs`"


@pytest.mark.parametrize("name", [*(name for name in NAMES if name not in LIKE_ROBOTS), *rare(*LIKE_ROBOTS)])
def test_a_schema_and_its_definitions_are_of_draft_7(name: str) -> None:
    for schema in [schemas()[name], *schemas()[name]["$defs"].values()]:
        Draft7Validator.check_schema(schema)


@pytest.mark.parametrize("name", NAMES)
def test_a_schema_that_is_printed_can_be_used_alone(name: str) -> None:
    assert all(reference["$ref"].startswith("#/") for reference in references(schemas()[name]))


def maps(schema: object) -> Iterator[dict[str, Any]]:
    """Yield the properties of every map that a schema declares, but for those that a condition names."""
    if isinstance(schema, dict):
        for key, value in schema.items():
            if key == "properties" and isinstance(value, dict):
                yield value
            if key != "if":
                yield from maps(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from maps(value)


@pytest.mark.parametrize("name", NAMES)
def test_every_property_has_a_description(name: str) -> None:
    root = schemas()[name]
    declared = [(key, schema) for keys in maps(root) for key, schema in keys.items()]
    told = {key for key, schema in declared if schema is not True and schema.get("description")}
    for key, schema in declared:  # what a whole map adds to the changes of it is described there
        assert key in told or referred(schema, root)["description"]


@pytest.mark.parametrize("kind", ["robot", "part", "overlay"])
def test_what_every_component_may_have_is_described_at_the_entry(kind: str) -> None:
    root = schemas()[kind]
    entry, _ = referred(root["properties"]["components"], root)["additionalProperties"]["anyOf"]
    for chosen in entry["allOf"]:
        if "$ref" in chosen["then"]:
            keys = referred(chosen["then"], root)["properties"]
            assert {key for key, schema in keys.items() if schema is True} == set(entry["properties"])


class OneConfig(Config):
    """What can be set."""

    size: Length = 0.3
    """How large it is."""


class TwoConfig(OneConfig):
    """What can be set."""

    pause: Time
    """How long it rests, which is told here in about as many words as most settings need."""


@component("toy_one")
class One(Component[OneConfig]):
    """A toy, for schemas."""


@component("toy_two")
class Two(Component[TwoConfig]):
    """A toy, for schemas."""


@pytest.mark.parametrize("kind", ["Robot", *rare("Part", "Overlay")])
def test_a_type_and_a_setting_cost_few_lines(kind: str) -> None:
    nothing, one, two = (
        as_text(makers()[kind](types)).replace("toy_two", "toy_one").splitlines()
        for types in (["charger"], ["charger", "toy_one"], ["charger", "toy_two"])
    )
    assert more(nothing, one) <= 48
    assert more(one, two) <= 12


def more(before: list[str], after: list[str]) -> int:
    """Return how many lines there are that were not there before."""
    return sum(line[0] == "+" for line in [*unified_diff(before, after, n=0)][2:])  # behind the names of the files


def references(schema: object) -> Iterator[dict[str, Any]]:
    """Yield every schema that refers to another one."""
    inner = schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else ()
    for one in inner:
        yield from references(one)
    if isinstance(schema, dict) and isinstance(schema.get("$ref"), str):
        yield schema


@pytest.mark.parametrize("name", NAMES)
def test_beside_a_reference_stand_only_notes_because_nothing_else_there_counts(name: str) -> None:
    notes = {"$ref", "description", "default"}
    assert [reference for reference in references(schemas()[name]) if not reference.keys() <= notes] == []


@pytest.mark.parametrize(("name", "model"), [(kind.lower(), file_model(kind)) for kind in FILES])
def test_every_section_has_a_schema(name: str, model: type[Config]) -> None:
    assert set(schemas()[name]["properties"]) == set(model.model_fields)


def test_every_key_of_a_kind_or_modifier_is_described() -> None:
    declared = [*kinds().values(), *modifiers().values()]
    assert [(kind.name, key) for kind in declared for key, field in kind.fields.items() if not field.help] == []


@pytest.mark.parametrize(
    ("right", "wrong", "place"),
    [
        ("runtime: 45 s ", "runtme: 45 s ", "components.battery"),
        ("runtime: 45 s ", "runtime: 45 m ", "components.battery.runtime"),
        ("max_turn_rate: 90 deg/s", "max_turn_rate: 90 deg", "components.base.max_turn_rate"),
        ("type: battery_sim", "type: batery_sim", "components.battery.type"),
        ("    dock: dock\n", "", "components.charger"),
        (
            "  teleop:\n        priority: 100",
            "  teleop:\n        priority: high",
            "muxes.cmd_vel.inputs.teleop.priority",
        ),
        ("match: [battery, charger]", "match: []", "diagnostics.analyzers.power.match"),
        ("type: speed", "type: sped", "args.speed.type"),
        ("kind: Robot", "kind: Robot\nplacs: {}", ""),
        ("profiles:\n  tired:", "profiles:\n  tired:\n    component: {}", "profiles.tired"),
        ("rbx: 1", "rbx: 2", "rbx"),
        *(
            pytest.param(*case, marks=pytest.mark.soak)  # each is like one above
            for case in (
                ("runtime: 45 s ", "runtime: long ", "components.battery.runtime"),
                ("warn: 50 %", "warn: 0.5", "components.battery.warn"),
                ("heading: 90 deg", "heading: 90", "places.corner_1.heading"),
                ("    type: charger\n", "", "components.charger"),
                ("start: patrol", "start: [patrol]", "start"),
                ("components:\n  battery", "components:\n  Battery", "components"),
            )
        ),
    ],
)
def test_a_mistake_in_a_robot_is_refused_at_its_place(right: str, wrong: str, place: str) -> None:
    assert ROBOT.count(right) == 1
    found = mistakes(ROBOT.replace(right, wrong))
    assert found
    assert all(place.startswith(mistake) for mistake in found), found


@pytest.mark.parametrize(
    ("right", "wrong", "place"),
    [
        ("runtime: 45 s ", "runtime: ", "runtime"),
        ("runtime: 45 s ", "process: World\n    runtime: 45 s ", "process"),
        ("runtime: 45 s ", "restart: sometimes\n    runtime: 45 s ", "restart"),
        ("runtime: 45 s ", "restart: {wen: always}\n    runtime: 45 s ", "restart"),
        ("runtime: 45 s ", "log: loud\n    runtime: 45 s ", "log"),
        ("runtime: 45 s ", "connect: {Level: charge}\n    runtime: 45 s ", "connect"),
        ("runtime: 45 s ", "starts_after: base\n    runtime: 45 s ", "starts_after"),
    ],
)
def test_a_mistake_in_what_every_component_may_have_is_refused(right: str, wrong: str, place: str) -> None:
    (found,) = Draft7Validator(schemas()["robot"]).iter_errors(plain(ROBOT.replace(right, wrong)))
    nearest = best_match([found])
    assert nearest
    assert ".".join(map(str, nearest.absolute_path)).startswith(f"components.battery.{place}")


CHANGES = [
    ("components: {battery: {type: battery_sim, runtime: 45 m}}", "components.battery"),
    ("components: {battery: {type: battery_sim, runtme: 45 s}}", "components.battery"),
    ("components: {battery: {type: batery_sim}}", "components.battery"),
    ("components: {battery: {restart: sometimes}}", "components.battery"),
    ("components: {battery: {process: World}}", "components.battery"),
    ("components: {Battery: {runtime: 45 s}}", "components"),
    ("places: {dock: {x: 4 deg}}", "places.dock"),
    ("values: {level: {topik: level}}", "values.level"),
    ("muxes: {cmd_vel: {inputs: {teleop: {priority: high}}}}", "muxes.cmd_vel"),
    ("component: {}", ""),
]


@pytest.mark.parametrize(("text", "place"), CHANGES)
@pytest.mark.parametrize("kind", ["Overlay", "Robot", "Part", "profile"])
def test_a_mistake_in_what_is_laid_over_others_is_refused(kind: str, text: str, place: str) -> None:
    head = f"rbx: 1\nkind: {kind}\nname: changed\n"
    if kind == "profile":
        robot = f"rbx: 1\nkind: Robot\nname: changed\nprofiles:\n  other:\n    {text}\n"
        (found,) = mistakes(robot)
        assert f"profiles.other.{place}".startswith(found)
        return
    include = "" if kind == "Overlay" else "include: {base: {part: base.yaml}}\n"
    found, *others = mistakes(f"{head}{include}{text}\n")
    assert not others
    assert place.startswith(found)


@pytest.mark.parametrize("kind", ["Overlay", "Robot", "Part"])
def test_what_is_laid_over_others_may_take_out_and_leave_out(kind: str) -> None:
    text = """
components:
  battery: ""  # what editors see of `!remove`
  base: {max_speed: null, process: "", restart: {max: null}}
  charger: {type: charger, reach: ""}
places: {dock: {x: 1 m}}
muxes: {cmd_vel: {inputs: {teleop: null}}}
"""
    include = "" if kind == "Overlay" else "include: {base: {part: base.yaml}}\n"
    assert mistakes(f"rbx: 1\nkind: {kind}\nname: changed\n{include}{text}") == []


@for_all(
    "written, instead",
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


@for_all(
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


@for_all(
    "text, place",
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


@for_all(
    "text, place",
    [
        ("map: [house_map.yaml]", "map"),
        ("objects: {sofa: {box: [1 m, 2 m]}}", "objects.sofa.box"),
        ("objects: {sofa: {bocks: [1 m, 2 m, 1 m]}}", "objects.sofa"),
        ("objects: {Sofa: {shape: person}}", "objects"),
        ("objects: {man: {shape: dog}}", "objects.man.shape"),
        ("spawn: {door: {heading: 90}}", "spawn.door.heading"),
        ("places: {door: {x: 1 deg}}", "places.door.x"),
        ("components: {}", ""),
    ],
)
def test_a_mistake_in_a_world_is_refused_at_its_place(text: str, place: str) -> None:
    assert mistakes(f"rbx: 1\nkind: World\nname: w\n{text}\n") == [place]


def test_the_examples_of_definitions_are_right() -> None:
    shared = schemas()["robot"]["$defs"]
    for name, definition in shared.items():
        both = {"allOf": [definition, shared.get(f"whole_{name}", True)], "$defs": shared}
        for sample in definition.get("examples", []):
            Draft7Validator(both).validate(sample)


def keys_of(node: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield the path of each key of a map and of the maps in it."""
    for key, value in node.items() if isinstance(node, dict) else ():
        yield (*path, key)
        yield from keys_of(value, (*path, key))


@given(data())
def test_what_stands_in_a_section_is_removed_only_where_there_are_parts(examples: DataObject) -> None:
    robot = plain(ROBOT)
    del robot["profiles"]
    paths = [path for path in keys_of(robot) if len(path) > 1 and path[0] in ("places", "components")]
    *above, key = examples.draw(sampled_from(paths))
    reduce(getitem, above, robot)[key] = None
    schema = Draft7Validator(schemas()["robot"])
    assert not schema.is_valid(robot)
    assert schema.is_valid({**robot, "include": {"more": "rbx:parts/battery.yaml"}})


def test_a_component_type_has_its_docstring_as_description_and_its_example() -> None:
    battery = schemas()["robot"]["$defs"]["component_battery_sim"]
    assert battery["description"].startswith("A battery that drains evenly")
    assert battery["examples"] == [{"type": "battery_sim", "runtime": "45 s", "warn": "50 %", "error": "20 %"}]
    assert battery["properties"]["warn"]["default"] == "50 %"
    warn, _ = referred(battery["properties"]["warn"], schemas()["robot"])["anyOf"]
    assert referred(warn, schemas()["robot"])["x-dimension"] == "ratio"


@pytest.mark.parametrize("kind", ["Mission", *rare(*(kind for kind in makers() if kind != "Mission"))])
def test_the_command_prints_a_schema(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["schema", kind.lower()]) == 0
    assert json.loads(capsys.readouterr().out)["properties"]["kind"]["const"] == kind

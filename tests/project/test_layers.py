"""Imports point one way: who may import whom stands here, once."""

from __future__ import annotations

import re
from graphlib import TopologicalSorter
from pathlib import Path

from tests.project.package import PACKAGE, ROOT, files, imported_by, module_of, text_of

# What everything else may import, each with what it imports itself.
GROUND = {
    "atomic_files": "",
    "clock": "",
    "config": "dataclass field_docs references units",
    "dataclass": "",
    "edits": "dataclass findings",
    "endpoints": "",
    "expressions": "dataclass findings units",
    "fence": "",
    "field_docs": "",
    "findings": "dataclass per_compile",
    "foreign_units": "",
    "formats": "findings plugins",
    "geometry": "dataclass",
    "key_feed": "",
    "levels": "",
    "manifest": "config dataclass expressions field_docs findings per_compile plugins printable references "
    "regular_files restarts slips units",
    "msgs": "dataclass findings units",
    "per_compile": "dataclass",
    "plugins": "findings printable",
    "printable": "",
    "process_end": "",
    "qos": "",
    "references": "dataclass findings units",
    "regular_files": "",
    "requests": "typed_json",
    "restarts": "config",
    "robot_events": "dataclass",
    "rules": "dataclass findings",
    "scheduler": "",
    "slips": "dataclass findings",
    "typed_json": "",
    "units": "dataclass findings foreign_units",
}
# What the others import beside the ground and themselves. A row may be that of a package, a module or what lies deeper.
ABOVE = {
    "__main__": "cli.main",
    "actuation": "control devices",
    "arm_config": "body control hand_config motion",
    "arm_goals": "motion",
    "arm_model": "motion.planner_types",
    "arm_location": "arm_config sdk",
    "arm_moveit": "arm_config motion sdk",
    "arm_hand": "arm_config arm_pictures hand_config motion sdk",
    "arm_pictures": "arm_config body motion",
    "arm_processes": "arm_config motion process_end",
    "arm_servo": "arm_config motion sdk",
    "body": "",
    "bus": "sdk.bound",
    "bus_types": "actuation",
    "check_runner": "missions.analysis model.doubts model.robot",
    "checks": "actuation body.model body.solid_boxes check_runner composition diagnostics hand_config missions model "
    "motion mux params sdk sections",
    "cli": "actuation arm_config arm_goals body bus compiler composition controller_requests devices "
    "diagnostics.requests doctor executive.requests exporting finding_pages importing inspection "
    "lsp.server mission_tests missions model motion mux.requests params plan recording rendering replay "
    "runtime scaffold scene_requests scene_view schema.documents sdk sections systems",
    "controller_interface": "control sdk",
    "controller_manager": "controller_interface sdk",
    "controller_requests": "",
    "controllers": "control controller_interface sdk",
    "cloud_config": "manifest.fields",
    "compiler": "check_runner composition model plan",
    "components": "actuation arm_config arm_goals arm_hand arm_location arm_moveit arm_processes arm_servo body "
    "control controller_interface controller_manager controller_requests devices diagnostics executive missions "
    "monitors motion mux navigation scene_requests scene_view sdk servo_bus_config servo_bus_line "
    "servo_report sim twins.fault_script",
    "servo_report": "actuation control",
    "composition": "body.description diagnostics.settings sections",
    "control": "",
    "devices": "",
    "diagnostics": "",
    "doctor": "devices bus.graph composition model.flow model.robot runtime.folder runtime.processes sdk sections",
    "executive": "missions sdk",
    "exporting": "body plan sdk sections systems",
    "finding_pages": "check_runner missions.analysis",
    "importing": "actuation.servo_models body composition.dump motion.groups mux.words scaffold.answers "
    "sdk.registry sections",
    "hand_config": "",
    "inspection": "body.model bus.names bus.wire composition missions model plan schema sdk sections systems",
    "lsp": "compiler composition missions model.robot schema sections",
    "mission_tests": "compiler components.mission composition executive missions model plan.model sdk sections.faults "
    "testing.bench twins.fault_script twins.servo_faults",
    "missions": "",
    "monitors": "diagnostics.limits sdk",
    "motion": "body control",
    "model": "actuation body.model composition missions params.live_types sdk sections servo_bus_config",
    "mux": "",
    "navigation": "",
    "params": "",
    "plan": "composition missions model sdk",
    "recording": "bus.attachment bus.classes bus.names bus.tokens bus.transport bus.witness",
    "rendering": "finding_pages",
    "replay": "bus plan.model recording runtime.process_group runtime.records sdk",
    "runtime": "body.transform_errors body.transforms bus diagnostics.updater missions.program.sources params plan "
    "process_end recording sdk",
    "scaffold": "actuation.bus_load actuation.servo_models actuation.torques composition missions sdk",
    "schema": "controller_interface missions sdk sections",
    "sdk": "diagnostics.updater",
    "sections": "arm_model actuation.bus_types actuation.control_tables actuation.servo_models actuation.torques body "
    "cloud_config control.calibration control.limits controller_interface devices.usb diagnostics.settings hand_config "
    "motion.group_findings "
    "motion.gaze motion.groups motion.planner_types motion.scene motion.scene_text mux.words sdk twins.servo_faults",
    "scene_requests": "motion.scene",
    "scene_view": "motion.reasons motion.scene",
    "servo_bus_config": "actuation control controller_interface sdk.ports twins.fault_script",
    "servo_bus_line": "actuation servo_bus_config twins",
    "sim": "",
    "skills": "sdk",
    "twins": "actuation devices.port_errors",
    "systems": "compiler composition missions.program.sources model plan sdk",
    "testing": "twins bus compiler components missions model.wires mux.config params plan.model recording.message "
    "rendering.text runtime.process_group runtime.records sdk",
}
# Pure: no bus, thread or clock.
CORES = {"body", "control", "devices", "diagnostics", "missions", "motion", "mux", "navigation", "params", "sim"}
TABLE = {
    **{name: frozenset(row.split()) for name, row in GROUND.items()},
    **{name: frozenset(row.split()) | GROUND.keys() for name, row in ABOVE.items()},
}
TYPE_CHECKING_BLOCKS = 17


def imports(path: Path) -> set[str]:
    """Return the modules of ours that a file imports, with the names that it takes from them."""
    pairs = [(module, taken) for module, taken in imported_by(path) if f"{module}.".startswith("rbxcompose.")]
    names = {module for module, _ in pairs} | {f"{module}.{taken}" for module, taken in pairs if taken}
    ours = (name.removeprefix("rbxcompose.") for name in names if name != "rbxcompose")
    return {name for name in ours if not name.startswith("__")}


def row_of(module: str) -> str | None:
    """Return the row that a module belongs to: that of its deepest part that has one."""
    parts = module.split(".")
    names = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
    return next((name for name in names if name in TABLE), None)


def is_within(name: str, permitted: str) -> bool:
    return f"{name}.".startswith(f"{permitted}.") or permitted.startswith(f"{name}.")


def wrong_imports(path: Path) -> set[str]:
    row = row_of(module_of(path))
    if row is None:
        return {"it has no row in the table above"}
    return {name for name in imports(path) if not any(is_within(name, permitted) for permitted in (row, *TABLE[row]))}


def test_a_module_imports_only_from_the_layers_below_it() -> None:
    assert imports(PACKAGE / "__init__.py") == set()
    found = {str(path.relative_to(ROOT)): wrong_imports(path) for path in files() if path != PACKAGE / "__init__.py"}
    assert {path: wrong for path, wrong in found.items() if wrong} == {}


def test_no_row_is_left_of_what_is_gone() -> None:
    modules = {module_of(path).removesuffix(".__init__") for path in files()}
    named = {*TABLE, *(name for row in TABLE.values() for name in row)}
    assert named - modules == set()


def test_the_table_has_no_circle() -> None:
    tops = {name: {one.partition(".")[0] for one in row} for name, row in TABLE.items() if "." not in name}
    TopologicalSorter({name: row - {name} for name, row in tops.items()}).prepare()


def test_types_are_rarely_imported_for_the_type_checker_alone() -> None:
    blocks = sum(text_of(path).count("\nif TYPE_CHECKING:") for path in files())
    assert blocks <= TYPE_CHECKING_BLOCKS


def test_the_page_for_contributors_tells_the_home_of_every_core() -> None:
    page = text_of(ROOT / "CONTRIBUTING.md")
    table = page.partition("| package | decides |")[2].partition("\n\n")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)) == CORES

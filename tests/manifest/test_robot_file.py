"""A robot's file: what it gives, and that every mistake of it is found in one run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from rbxcompose.base.findings import Report
from rbxcompose.compiler.composition.robot_file import load_robot, read_mission
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.domains.diagnostics.sections.diagnostics import diagnostics
from rbxcompose.domains.muxes.sections.muxes import muxes
from rbxcompose.domains.power.components.battery_sim import BatterySimConfig
from rbxcompose.manifest.tree import at

ROOT = Path(__file__).parents[2]
TURTLEBOT = (ROOT / "robots/turtlebot/robot.yaml").read_text()


class Bench:
    """A project in a temporary folder with the turtlebot, changed by replacing text."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.report = Report()
        self.sources: dict[str, str] = {}
        (folder / "missions").mkdir()
        (folder / "robots/turtlebot").mkdir(parents=True)
        (folder / "missions/patrol.yaml").write_text((ROOT / "missions/patrol.yaml").read_text())

    def load(
        self, *changes: tuple[str, str], profiles: Sequence[str] = (), sets: Sequence[str] = ()
    ) -> RobotManifest | None:
        text = TURTLEBOT
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = self.folder / "robots/turtlebot/robot.yaml"
        path.write_text(text)
        return load_robot(path, report=self.report, sources=self.sources, profiles=profiles, sets=sets)

    @property
    def messages(self) -> list[str]:
        return [finding.message for finding in self.report]

    @property
    def codes(self) -> list[str]:
        return [finding.code for finding in self.report]


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.chdir(tmp_path)
    return Bench(tmp_path)


def values(robot: RobotManifest | None, component: str) -> dict[str, object]:
    assert robot
    config = robot.components[component].config
    assert config
    return config.model_dump()


def test_the_turtlebot_has_no_mistakes_and_is_read_in_si(bench: Bench) -> None:
    robot = bench.load()
    assert bench.messages == []
    assert robot
    assert list(robot.components) == ["battery", "base", "go_to", "charger"]
    assert values(robot, "battery")["warn"] == 0.5
    assert values(robot, "go_to")["speed"] == 0.3
    assert robot.places["corner_3"].heading == -math.pi / 2
    assert robot.contents.of(muxes)["cmd_vel"].inputs["navigation"].source == "go_to"
    assert robot.missions["patrol"].path == bench.folder / "missions/patrol.yaml"
    assert robot.contents.of(diagnostics).analyzers["power"].match == ("battery", "charger")
    assert (robot.start, robot.values["battery"].port) == ("patrol", "battery.battery_level")


def test_a_profile_and_a_set_change_values_in_this_order(bench: Bench) -> None:
    robot = bench.load(profiles=["tired"], sets=["battery.warn=40 %"])
    assert bench.messages == []
    assert (values(robot, "battery")["runtime"], values(robot, "battery")["warn"]) == (30.0, 0.4)
    robot = bench.load(profiles=["tired"], sets=["battery.runtime=20 s"])
    assert values(robot, "battery")["runtime"] == 20.0


def test_setting_an_argument_changes_what_uses_it(bench: Bench) -> None:
    assert values(bench.load(sets=["args.speed=0.4 m/s"]), "go_to")["speed"] == 0.4
    assert bench.messages == []


def test_an_argument_beyond_its_limit_is_one_finding_at_its_value(bench: Bench) -> None:
    bench.load(sets=["args.speed=2 m/s"])
    assert bench.messages == ["'speed' must be at most 0.5 m/s"]


def test_an_argument_without_a_value_is_a_finding_and_what_uses_it_is_not(bench: Bench) -> None:
    bench.load(("    default: 0.3 m/s\n", ""))
    assert bench.codes == ["RBX1206"]


def test_all_mistakes_are_found_in_one_run_by_place(bench: Bench) -> None:
    robot = bench.load(
        ("heading: 90 deg", "heading: 90"),
        ("runtime: 45 s", "runtime: long"),
        ("type: diff_drive_sim", "type: dif_drive_sim"),
        ("dock: dock", "dock: dokc"),
        ("priority: 100", "priorty: 100"),
        ("match: [base", "mach: [base"),
        ("speed: ${args.speed}", "speed: ${args.sped}"),
        ("missions/patrol.yaml", "missions/patrl.yaml"),
    )
    assert robot
    assert bench.codes == ["RBX1003", "RBX1003", "RBX3004", "RBX1202", "RBX1004", "RBX1001", "RBX1001", "RBX1301"]


def test_a_component_with_mistakes_stays_as_far_as_it_could_be_read(bench: Bench) -> None:
    robot = bench.load(("runtime: 45 s", "runtime: long"))
    assert robot
    battery = robot.components["battery"]
    assert isinstance(battery.config, BatterySimConfig)
    assert (battery.is_sound, battery.config.warn) == (False, 0.5)


def test_an_input_of_a_mux_with_mistakes_stays_in_its_mux(bench: Bench) -> None:
    robot = bench.load(("priority: 100", "priority: high"))
    assert robot
    assert list(robot.contents.of(muxes)["cmd_vel"].inputs) == ["teleop", "navigation"]
    assert robot.contents.of(muxes)["cmd_vel"].inputs["navigation"].source == "go_to"
    assert bench.codes == ["RBX1003"]


def test_a_place_with_mistakes_is_not_missing_as_well(bench: Bench) -> None:
    bench.load(("dock: {x: 0.5 m", "dock: {x: wide"))
    assert bench.messages == ["'x' must be a length, such as '0.5 m'"]


MISTAKES = [
    (("rbx: 1\n", "rbx: 2\n"), "RBX1004", "'rbx' must be '1'"),
    (("name: turtlebot\n", ""), "RBX1002", "this file needs the key 'name'"),
    (("name: turtlebot", "name: Turtle Bot"), "RBX1006", "'Turtle Bot' is not a valid name"),
    (("kind: Robot", "kind: Mission"), "RBX1304", "this is not a manifest of kind Robot"),
    (("\nvalues:", "\nvalus:"), "RBX1001", "unknown key 'valus' in this file"),
    (
        ("  battery:\n    type: battery_sim", "  muxes:\n    type: battery_sim"),
        "RBX1007",
        "a component cannot be named",
    ),
    (("  charger:", "  mission:"), "RBX1007", "every robot already runs a component 'mission'"),
    (("  charger:", "  cmd_vel:"), "RBX1007", "a component and a mux are both named 'cmd_vel'"),
    (("    type: go_to\n", ""), "RBX1002", "component 'go_to' needs the key 'type'"),
    (("\nplaces:", "\nbus: {wire: jazy}\nplaces:"), "RBX1004", "'wire' must be"),
    (("    reach: 20 cm", "    reach: 20 cm\n    proces: own"), "RBX1001", "unknown key 'proces' in component"),
    (("\ncomponents:\n", "\ncomponents: 5\nx:\n"), "RBX1001", "unknown key 'x' in this file"),
    (("\nplaces:", "\nbus: {port: 0}\nplaces:"), "RBX1005", "'port' must be at least 1"),
    (("args:\n", "args: 5\nx:\n"), "RBX1003", "'args' must be a map of named entries"),
    (("  speed:\n    type: speed", "  Speed:\n    type: speed"), "RBX1006", "'Speed' is not a valid name"),
    (("inputs:", "inputs: {}\n    locks:"), "RBX1005", "'inputs' must have at least 1 entry"),
]


@pytest.mark.parametrize(("change", "code", "message"), MISTAKES, ids=[mistake[2][:40] for mistake in MISTAKES])
def test_a_mistake_is_found(bench: Bench, change: tuple[str, str], code: str, message: str) -> None:
    bench.load(change)
    assert any(f.code == code and f.message.startswith(message) for f in bench.report), bench.messages


def test_an_unknown_profile_is_a_finding_with_a_caret_in_the_command(bench: Bench) -> None:
    bench.load(profiles=["tierd"])
    (finding,) = bench.report
    assert (finding.code, str(finding.span), finding.help) == ("RBX1302", "--profile:1:1", "did you mean 'tired'?")
    assert bench.sources["--profile"] == "tierd"


def test_an_empty_section_is_none(bench: Bench) -> None:
    bench.load(("\nprofiles:\n", "\nbus:\n\nprofiles:\n"))
    assert bench.messages == []


def test_a_robot_that_is_not_there_is_a_finding(bench: Bench) -> None:
    assert load_robot("robots/turtlebo", report=bench.report, sources={}) is None
    assert [finding.help for finding in bench.report] == ["did you mean 'turtlebot'?"]


@pytest.mark.parametrize("text", ["- a\n- b\n", "just text\n"])
def test_what_is_no_map_is_no_manifest(bench: Bench, text: str) -> None:
    (bench.folder / "robots/turtlebot/robot.yaml").write_text(text)
    assert load_robot("robots/turtlebot", report=bench.report, sources={}) is None
    assert bench.codes == ["RBX1304"]


def test_a_mission_is_read_up_to_its_header(bench: Bench) -> None:
    path = bench.folder / "missions/patrol.yaml"
    root = read_mission(path, robot="turtlebot", report=bench.report, sources=bench.sources)
    assert bench.messages == []
    assert root
    assert at(root, ("do", "do", "for"))


def test_the_header_of_a_mission_is_checked_and_braces_are_filled_in(bench: Bench) -> None:
    path = bench.folder / "missions/hello.yaml"
    path.write_text("rbx: 1\nkind: Mission\nname: Hello\ndo:\n  - say: I am ${robot.name} at $room\n")
    root = read_mission(path, robot="ada", report=bench.report, sources=bench.sources)
    assert bench.codes == ["RBX1006"]
    assert root
    assert getattr(at(root, ("do", 0, "say")), "text", "") == "I am ada at $room"

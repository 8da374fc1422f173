"""Packages of somebody else that are broken: who uses them is told which it is, everybody else goes on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.base.findings import Report, Span
from rbxcompose.base.plugins import Plugins
from rbxcompose.commands.importing import importer
from rbxcompose.commands.importing.foreign_files import ForeignFile
from rbxcompose.commands.main import main
from rbxcompose.compiler.schema.documents import makers
from rbxcompose.domains.servos import controller
from rbxcompose.domains.servos.sections import controllers
from rbxcompose.manifest import registry as section_registry
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.sdk import registry
from rbxcompose.testing import Checked, check_text
from tests.third_party.places import put, see

ROBOT = """\
rbx: 1
kind: Robot
name: example
components:
  one:
    type: {type}
    runtime: 45 s
diagnostics:
  analyzers:
    all: {{match: ["*"]}}
"""
LIKE_A_COMPONENT = """\
from rbxcompose.sdk import Component, Config, component


@component("{name}")
class Thing(Component[Config]):
    pass
"""
CHECK = '''\
from rbxcompose.compiler.check_runner import check


@check("{code}")
def rule(robot):
    """A rule

    It has a page.
    """
    {body}
'''


def checked(folder: Path, type_: str) -> Checked:
    return check_text(ROBOT.format(type=type_), folder)


@pytest.mark.parametrize(
    ("module", "reason"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module' (odd_module.py:1)"),
        ("raise SystemExit(3)", "SystemExit: 3 (odd_module.py:1)"),
        ("def broken(:", "SyntaxError: invalid syntax"),
        (
            "from rbxcompose.sdk import component\n@component('odd')\nclass Odd: pass",
            "odd_module.Odd is not a subclass",
        ),
        ("", "declares no class by @component('odd')"),
        (
            LIKE_A_COMPONENT.format(name="odd") + "raise RuntimeError('too late')",
            "RuntimeError: too late (odd_module.py:7)",
        ),
        (LIKE_A_COMPONENT.format(name="go_to"), "ValueError: two component types are named 'go_to'"),
    ],
    ids=["import", "exit", "syntax", "class", "nothing", "late", "other_name"],
)
def test_who_uses_a_broken_type_is_told_the_package_and_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, reason: str
) -> None:
    registry.component_type("go_to")
    put(tmp_path / "site", "odd-package", {"component.odd": "odd_module"}, {"odd_module.py": module})
    see(tmp_path / "site", monkeypatch)
    found = checked(tmp_path, "odd")
    assert found.codes == ["RBX9301"], found.text
    assert "the component 'odd' of package 'odd-package' cannot be used: " in found.text
    assert reason in found.text
    assert "robot.yaml:6:11" in found.text
    assert checked(tmp_path, "odd").codes == ["RBX9301"]  # also when it is asked for once more
    assert checked(tmp_path, "battery_sim").text == ""
    assert "odd" not in registry.usable_names()


def test_a_broken_type_is_not_in_the_schema(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path / "site", "odd-package", {"component.odd": "odd_module"}, {"odd_module.py": "import no_such_module"})
    see(tmp_path / "site", monkeypatch)
    assert "component_odd" not in makers()["Robot"](registry.usable_names())["$defs"]


def test_two_packages_with_one_name_are_both_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("one", "two"):
        files = {f"{name}_module.py": LIKE_A_COMPONENT.format(name="odd")}
        put(tmp_path / "site", f"package-{name}", {"component.odd": f"{name}_module"}, files)
    see(tmp_path / "site", monkeypatch)
    found = checked(tmp_path, "odd")
    assert found.codes == ["RBX9301"]
    assert "packages 'package-one' and 'package-two'" in found.text


def test_a_type_of_ours_stays_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"odd_module.py": "raise RuntimeError('imported')"}
    put(tmp_path / "site", "odd-package", {"component.battery_sim": "odd_module"}, files)
    see(tmp_path / "site", monkeypatch)
    found = checked(tmp_path, "battery_sim")
    assert found.codes == ["RBX9302"]
    assert "the component 'battery_sim' of package 'odd-package' is left out" in found.text
    assert found.plan


@pytest.mark.parametrize(
    ("name", "module", "reason"),
    [
        ("odd", "import no_such_module", "No module named 'no_such_module'"),
        ("odd", CHECK.format(code="RBX3001", body="return []"), "starts with RBX"),
        ("odd", CHECK.format(code="odd one", body="return []"), "is not a code"),
        ("odd", CHECK.format(code="ODD01", body="return [robot.no_such_name]"), "the check ODD01 of 'odd_module' has"),
        ("absurd_speed", CHECK.format(code="ODD01", body="return []"), "rbxcompose has one of this name"),
    ],
    ids=["import", "ours", "malformed", "raises", "shadow"],
)
def test_a_broken_check_is_left_out_with_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, module: str, reason: str
) -> None:
    put(tmp_path / "site", "odd-package", {f"check.{name}": "odd_module"}, {"odd_module.py": module})
    see(tmp_path / "site", monkeypatch)
    found = checked(tmp_path, "battery_sim")
    assert found.codes == ["RBX9302"], found.text
    assert reason in found.text
    assert found.plan


SECTION = '''\
from rbxcompose.base.config import Config
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import WantedComponent


class BeaconModel(Config):
    height: float = 1.0


def components(contents, wiring):
    for name, beacon in contents.of(toy_beacons).items():
        yield WantedComponent(name, "{type}", {config}, ("toy_beacons", name))


@section("toy_beacons", BeaconModel, entry="beacon", components=components)
def toy_beacons(reading):
    """Beacons."""
    return reading.entries()
'''
RAISES_IN = """
    @classmethod
    def {method}(cls, config):
        return {{}}["x"]
"""
BEACONS = "rbx: 1\nkind: Robot\nname: example\ntoy_beacons:\n  front: {height: 2.0}\n"


@pytest.fixture
def own_sections(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have this process find the sections of other packages anew, and forget them when the test ends."""
    monkeypatch.setattr(section_registry, "_SECTIONS", {one.name: one for one in section_registry.sections()})
    monkeypatch.setattr(section_registry, "PLUGINS", Plugins("section", "sections"))
    section_registry._problems.cache_clear()
    yield
    section_registry._problems.cache_clear()


@pytest.mark.parametrize(
    ("type_", "config", "component", "what"),
    [
        ("toy_beacon", "{}", "import no_such_module", "5:3: the component 'toy_beacon' of package 'beacons'"),
        (
            "toy_beacon",
            "{}",
            LIKE_A_COMPONENT.format(name="toy_beacon") + RAISES_IN.format(method="ports"),
            "5:3: the component 'toy_beacon' of package 'beacons' cannot be used: KeyError: 'x'",
        ),
        (
            "toy_beacon",
            "{}",
            LIKE_A_COMPONENT.format(name="toy_beacon") + RAISES_IN.format(method="capabilities"),
            "5:3: the component 'toy_beacon' of package 'beacons' cannot be used: KeyError: 'x'",
        ),
        ("toy_other", "{}", "", "4:1: the section 'toy_beacons' of package 'beacons' cannot be used: KeyError: 'toy_o"),
        ("battery_sim", "{1: 2}[3]", "", "4:1: the section 'toy_beacons' of package 'beacons' cannot be used: KeyErr"),
    ],
    ids=["import", "ports", "capabilities", "no_such_type", "raises"],
)
def test_what_a_section_of_another_package_breaks_is_found_at_its_entry(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    own_sections: None,
    type_: str,
    config: str,
    component: str,
    what: str,
) -> None:
    points = {"section.toy_beacons": "beacons_module", "component.toy_beacon": "beacon_module"}
    files = {"beacons_module.py": SECTION.format(type=type_, config=config), "beacon_module.py": component}
    put(tmp_path / "site", "beacons", points, files)
    see(tmp_path / "site", monkeypatch)
    found = check_text(BEACONS, tmp_path)
    assert found.codes == ["RBX9301"], found.text
    assert what.partition(": ")[2] in found.text
    assert f"robot.yaml:{what.partition(': ')[0]}" in found.text


def test_an_importer_that_raises_is_told_with_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    importer.importers()
    module = (
        "from rbxcompose.commands.importing.importer import importer\n"
        "@importer('toy_odd', 'of nothing')\ndef odd(files, name, report):\n    return {}['x']\n"
    )
    put(tmp_path / "site", "odd-package", {"importer.toy_odd": "odd_module"}, {"odd_module.py": module})
    see(tmp_path / "site", monkeypatch)
    monkeypatch.setattr(importer, "PLUGINS", Plugins("importer", "importers"))
    monkeypatch.setattr(importer, "_IMPORTERS", dict(importer._IMPORTERS))
    report = Report()
    file = ForeignFile("a.yaml", MappingNode({}, Span("a.yaml", 1, 1, 1, 1)))
    assert not importer.imported("toy_odd", [file], "example", report).text
    [finding] = report
    assert finding.code == "RBX9301"
    assert "the importer 'toy_odd' of package 'odd-package' cannot be used: KeyError: 'x'" in finding.message


def test_explain_knows_the_codes_of_all_plug_ins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module = (
        "from rbxcompose.base.findings import Severity, kind\n"
        "DRY = kind('OIL01', Severity.WARNING, doc='Too little oil\\n\\nFill it up.')\n"
    )
    points = {"doctor.toy_oil": "oil_module", "doctor.toy_broken": "no_such_module"}
    put(tmp_path / "site", "oil", points, {"oil_module.py": module})
    see(tmp_path / "site", monkeypatch)
    assert main(["explain", "oil01"]) == 0
    assert capsys.readouterr().out.startswith("OIL01: Too little oil\n(warning")


def test_a_controller_that_raises_is_found_where_it_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in controller.PLUGINS.shipped:
        controller.controller_type(name)
    module = """\
from rbxcompose.domains.servos.controller import Controller, ControllerConfig, controller


class LeadConfig(ControllerConfig):
    @property
    def claimed(self):
        return ()


@controller("toy_lead")
class Lead(Controller[LeadConfig]):
    @classmethod
    def ports(cls, name, config):
        return {}["x"]
"""
    put(tmp_path / "site", "odd-package", {"controller.toy_lead": "odd_module"}, {"odd_module.py": module})
    see(tmp_path / "site", monkeypatch)
    plugins = Plugins("controller", "controllers")
    monkeypatch.setattr(controller, "PLUGINS", plugins)
    monkeypatch.setattr(controllers, "PLUGINS", plugins)
    monkeypatch.setattr(controller, "_TYPES", dict(controller._TYPES))
    found = check_text("rbx: 1\nkind: Robot\nname: example\ncontrollers:\n  front: {type: toy_lead}\n", tmp_path)
    assert "the controller 'toy_lead' of package 'odd-package' cannot be used: KeyError: 'x'" in found.text
    assert "robot.yaml:5:17" in found.text
    assert found.codes == ["RBX9301"], found.text

"""Packages of somebody else that are broken: who uses them is told which it is, everybody else goes on."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.compiler.schema.documents import makers
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
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("def broken(:", "SyntaxError: invalid syntax"),
        (
            "from rbxcompose.sdk import component\n@component('odd')\nclass Odd: pass",
            "odd_module.Odd is not a subclass",
        ),
        ("", "declares no class by @component('odd')"),
        (LIKE_A_COMPONENT.format(name="odd") + "raise RuntimeError('too late')", "RuntimeError: too late"),
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

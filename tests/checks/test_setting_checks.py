"""Rules that run again while settings change find what all of them would find."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.config import Config
from rbxcompose.base.findings import Finding, Report, Rule
from rbxcompose.compiler import setting_checks
from rbxcompose.compiler.check_runner import findings_of, run_checks
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.setting_checks import SettingChecks
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.msgs.rcl_interfaces import Parameter
from rbxcompose.sdk.parameters import ParameterField, UnsettableError, changed, to_message
from rbxcompose.sdk.parameters import settings as settings_of
from rbxcompose.testing import check_text
from tests.conftest import ROOT
from tests.shipped import compiled
from tests.soak import rare

ROBOTS = sorted(path.parent.name for path in (ROOT / "robots").glob("*/robot.yaml"))
FEW = ("turtlebot", "rover")  # with a base, and a lift
SIZES = (-1.0, 0.0, 1e-6, 0.01, 0.5, 2.0, 100.0)  # by which numbers are multiplied
POWERED = """rbx: 1
kind: Robot
name: powered
components:
  battery: {type: battery_sim, runtime: 45 s, warn: 0.5, error: 0.2}
  base: {type: diff_drive_sim}
  go_to: {type: go_to}
"""


@cache
def robot_named(name: str) -> Robot:
    found = compiled(str(ROOT / "robots" / name), environment={}).robot
    assert found is not None
    return found


@cache
def changeable(name: str) -> list[tuple[str, ParameterField]]:
    """Return the numbers and switches of a robot that may change while it runs."""
    return [
        (component.name, setting)
        for component in robot_named(name).components.values()
        for setting in settings_of(component.config).values()
        if setting.is_live and isinstance(setting.value, bool | int | float)
    ]


def all_findings(robot: Robot, configs: dict[str, Config]) -> list[Finding]:
    components = dict(robot.components)
    for name, config in configs.items():
        old = components[name]
        components[name] = replace(old, config=config, capabilities=old.cls.capabilities(config))
    report = Report()
    run_checks(replace(robot, components=components), report)
    return list(report)


def set_to(config: Config, name: str, value: object) -> Config:
    message = to_message(value)
    assert message is not None
    try:
        return changed(config, [Parameter(name=name, value=message)])
    except UnsettableError:
        return config


@pytest.mark.parametrize("name", [*FEW, *rare(*(name for name in ROBOTS if name not in FEW))])
@given(data=st.data())
@settings(max_examples=4)
def test_the_findings_are_those_of_all_rules(name: str, data: st.DataObject) -> None:
    robot, known = robot_named(name), changeable(name)
    checks = SettingChecks(robot)
    configs = {component.name: component.config for component in robot.components.values()}
    assert list(checks.report(configs)) == all_findings(robot, configs)
    for _ in range(data.draw(st.integers(1, 5)) if known else 0):
        component, setting = data.draw(st.sampled_from(known))
        configs[component] = set_to(configs[component], setting.name, other_value(setting.value, data))
        assert list(checks.report(configs)) == all_findings(robot, configs)


def other_value(value: object, data: st.DataObject) -> object:
    if isinstance(value, bool):
        return not value
    factor = data.draw(st.sampled_from(SIZES))
    return int(value * factor) if isinstance(value, int) else value * factor if isinstance(value, float) else value


def test_only_rules_run_that_have_read_what_is_different(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = check_text(POWERED, tmp_path).compilation.robot
    assert robot is not None
    checks, battery = SettingChecks(robot), robot.components["battery"].config
    ran: list[str] = []

    def noted(rule: Rule[Any], subject: Robot | Examined) -> list[Finding]:
        ran.append(rule.code)
        return findings_of(rule, subject)

    monkeypatch.setattr(setting_checks, "findings_of", noted)
    checks.report({})
    assert len(ran) > 50
    ran.clear()
    checks.report({"battery": set_to(battery, "runtime", 60.0)})
    assert 0 < len(ran) < 20
    ran.clear()
    checks.report({"battery": set_to(battery, "runtime", 60.0)})
    assert ran == []
    before = {finding.code for finding in checks.report({"battery": battery})}
    after = {finding.code for finding in checks.report({"battery": battery.model_copy(update={"error": 0.9})})}
    assert after - before

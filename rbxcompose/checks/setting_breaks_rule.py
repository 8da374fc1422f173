"""Values that missions give to settings and that break a rule of the whole robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.check_runner import all_checks, check
from rbxcompose.checks.parameter_value import config_with, parameter_value
from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.types import Type
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.facts import Constants
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot
from rbxcompose.rules import OUR_CODES


@check("RBX4186", Severity.WARNING)
def setting_breaks_rule(robot: Robot) -> Iterator[Finding]:
    """A mission gives a setting a value that does not fit the rest of the robot."""
    written = list({(one.place, one.value.text): one for one in _written(robot)}.values())
    before = {(one.code, one.span) for one in _found(robot)} if written else set()
    refused = {span for code, span in before if code == parameter_value.code}
    for one in written:
        if one.value.span in refused:
            continue
        new = [found for found in _found(_with(robot, one)) if (found.code, found.span) not in before]
        others = [other for other in written if other.place != one.place]
        helped = (_codes(_with(_with(robot, other), one)) for other in others)  # by what was set before
        if new and all(new[0].code in codes for codes in helped):
            yield setting_breaks_rule.at(
                one.value.span,
                f"with this, {new[0].message} ({new[0].code}): the change would be refused",
                help=new[0].help,
                related=[Related(new[0].span, "what it does not fit")] if new[0].span else [],
            )


@dataclass(frozen=True, slots=True)
class _Change:
    """A step that sets something: the component, the setting with its type, the value, and what is constant there."""

    component: str
    parameter: str
    wanted: Type
    value: ScalarNode
    known: Constants

    @property
    def place(self) -> tuple[str, str]:
        return self.component, self.parameter


def _written(robot: Robot) -> Iterator[_Change]:
    """Yield the changes that are known before a mission runs and that a rule may notice."""
    settings = robot.settings
    for mission in robot.missions.values() if settings else ():
        for node in mission.program.nodes:
            if (setting := node.step.effects.setting) is None:
                continue
            name, parameter = setting.component.text, setting.parameter.text
            value, wanted = node.step.arguments[0].value, settings.get(name, {}).get(parameter)
            if wanted is not None and isinstance(value, ScalarNode) and value.text:
                change = _Change(name, parameter, wanted, value, constants(mission))
                if _with(robot, change) is not robot:
                    yield change


def _with(robot: Robot, change: _Change) -> Robot:
    """Return the robot as it is after a change; itself, if that is unknown, refused or of no concern to rules."""
    from rbxcompose.params.core import UnsettableError  # with messages that few robots need for a check

    old = robot.components[change.component]
    try:
        config = config_with(old, change.parameter, change.value, change.wanted, change.known)
    except UnsettableError:
        return robot  # reported by RBX7011
    capabilities = old.cls.capabilities(config) if config is not None and old.is_sound else old.capabilities
    if config is None or capabilities == old.capabilities:
        return robot
    new = replace(old, config=config, capabilities=capabilities)
    return replace(robot, components={**robot.components, change.component: new})


def _found(robot: Robot) -> Iterator[Finding]:
    """Yield what our other rules about the robot find."""
    for one in all_checks():
        if one.code.startswith(OUR_CODES) and one.code != setting_breaks_rule.code:
            yield from one(robot)


def _codes(robot: Robot) -> set[str]:
    return {one.code for one in _found(robot)}

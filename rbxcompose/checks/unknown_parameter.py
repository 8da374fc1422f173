"""Settings that missions change: whether a component has them, and may change them while it runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.program.moments import WrittenSetting
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES


@check("RBX7010", is_fixable=True, closed=(NAMES,))
def unknown_parameter(robot: Robot) -> Iterator[Finding]:
    """A mission changes a setting that the robot does not have, or that cannot change while it runs."""
    for mission in robot.missions.values():
        for node in mission.program.nodes:
            if (setting := node.step.effects.setting) is not None:
                yield from _of_setting(robot, setting)


def _of_setting(robot: Robot, setting: WrittenSetting) -> Iterator[Finding]:
    component, parameter = setting.component, setting.parameter
    types = robot.names.settings
    if not component.text or not parameter.text:
        return  # reported where it was read
    if component.text not in robot.components:
        yield _unknown(component, f"the robot has no component '{component.text}'", types, "components with settings")
    elif parameter.text not in types.get(component.text, {}):
        from rbxcompose.params.core import settings  # with messages that few robots need for a check

        known = settings(robot.components[component.text].config)
        live = types.get(component.text, {})
        if parameter.text in known:
            message = f"'{parameter.text}' of '{component.text}' cannot change while the robot runs"
            help_text = f"what may change is {', '.join(live)}" if live else ""
            yield unknown_parameter.at(parameter.span, message, help=help_text)
        else:
            message = f"'{component.text}' has no setting '{parameter.text}'"
            yield _unknown(parameter, message, live, "its live settings")


def _unknown(scalar: ScalarNode, message: str, valid: Iterable[str], what: str) -> Finding:
    return unknown_parameter.misspelt(scalar.span, message, scalar.text, list(valid), what)

"""The rules of `check` for the settings of a robot that runs: what a change would break that was not broken before."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from contextlib import suppress

from rbxcompose.bus.names import resolve
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.compiler import check_settings, compile_robot
from rbxcompose.config import Config
from rbxcompose.findings import Finding, kind
from rbxcompose.model.robot import Robot
from rbxcompose.msgs.rcl_interfaces import GetParameters, Parameter
from rbxcompose.params.core import UnsettableError, changed, settings
from rbxcompose.runtime.folder import RobotState

BREAKS_RULE = kind(
    "RBX9030",
    """A live value would break a rule of the robot

`param set` checks a value as `check` does, together with all values that components have now: what is refused in the
manifest is refused while the robot runs. Warnings count as well, since a robot that moves gives no time to read them.

Bad: `rbxcompose param set go_to speed "0.8 m/s"`, for a base that can do 0.5 m/s.
Good: `rbxcompose param set go_to speed "0.4 m/s"`
""",
)


def why_not(nodes: ParameterNodes, node: str, parameter: Parameter, state: RobotState) -> Finding | None:
    """Return why a value would break a rule of a robot that runs, None if it breaks none that was not broken before.

    The robot is compiled as its files are now, with the layers that it runs with. What its components have set
    meanwhile, they are asked.
    """
    robot = _robot_of(state)
    if robot is None:
        sys.stderr.write("the rules of the robot are not checked: its files have errors now\n")
        return None
    full = {resolve(name, robot.manifest.bus.namespace or ""): name for name in robot.components}
    if node not in full:
        return None
    now = _live_configs(nodes, robot, {one: name for one, name in full.items() if one in nodes.names})
    try:
        new = changed(now[full[node]], [parameter])
    except UnsettableError:
        return None  # the component refuses it, with the reason
    return next((_refusal(one) for one in broken_rules(robot, now, full[node], new)), None)


def _robot_of(state: RobotState) -> Robot | None:
    """Return a robot that runs, compiled as its files are now, with the layers that it runs with; None after errors."""
    layers = state.layers
    compilation = compile_robot(
        state.file,
        profiles=layers.profiles,
        overlays=layers.overlays,
        sets=layers.sets,
        real=layers.real,
        environment=os.environ,
    )
    return None if compilation.plan is None else compilation.robot


def broken_rules(robot: Robot, now: Mapping[str, Config], name: str, new: Config) -> list[Finding]:
    """Return the findings that another configuration of a component brings, where others have those of `now`."""
    known = {(one.code, one.span) for one in check_settings(robot, now)}
    return [one for one in check_settings(robot, {**now, name: new}) if (one.code, one.span) not in known]


def _refusal(broken: Finding) -> Finding:
    """Return why a value is not set, in the words of the rule that it would break."""
    return BREAKS_RULE.at(None, f"{broken.message} ({broken.code})", help=broken.help)


def _live_configs(nodes: ParameterNodes, robot: Robot, wanted: Mapping[str, str]) -> dict[str, Config]:
    """Return the configurations of components by name, with the values that they have now."""
    configs = {node: robot.components[name].config for node, name in wanted.items()}
    live = {node: [one.name for one in settings(config).values() if one.is_live] for node, config in configs.items()}
    asked = [node for node, names in live.items() if names]
    requests = [GetParameters.Request(names=tuple(live[node])) for node in asked]
    for node, answer in zip(asked, nodes.ask(asked, "get_parameters", GetParameters, requests), strict=True):
        pairs = zip(live[node], answer.values, strict=True)
        told = [Parameter(name=name, value=value) for name, value in pairs if value.type]
        with suppress(UnsettableError):  # its file has changed meanwhile
            configs[node] = changed(configs[node], told)
    return {name: configs[node] for node, name in wanted.items()}

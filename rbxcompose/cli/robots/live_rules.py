"""The rules of `check` for the settings of a robot that runs: what a change would break that was not broken before."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence

from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.robots.live_settings import live_settings, nodes_of
from rbxcompose.compiler import check_settings
from rbxcompose.config import Config
from rbxcompose.findings import Finding, kind
from rbxcompose.model.robot import Robot
from rbxcompose.msgs.rcl_interfaces import Parameter
from rbxcompose.params.core import UnsettableError, changed
from rbxcompose.runtime.folder import RobotState

BREAKS_RULE = kind(
    "RBX9030",
    """A live value would break a rule of the robot

`param set` checks values as `check` does, together with all values that components have now: what is refused in the
manifest is refused while the robot runs. Warnings count as well, since a robot that moves gives no time to read them.

Bad: `rbxcompose param set go_to speed "0.8 m/s"`, for a base that can do 0.5 m/s.
Good: `rbxcompose param set go_to speed "0.4 m/s"`
""",
)


def why_not(nodes: ParameterNodes, wanted: Mapping[str, Sequence[Parameter]], state: RobotState) -> Finding | None:
    """Return why values, by node, would break a rule of a robot that runs; None if they break none that held before.

    The robot is compiled as its files are now, with the layers that it runs with. What its components have set
    meanwhile, they are asked.
    """
    live = live_settings(nodes, state)
    if live is None:
        sys.stderr.write("the rules of the robot are not checked: its files have errors now\n")
        return None
    names = nodes_of(live.robot)
    new = {}
    try:
        for node, parameters in wanted.items():
            if (name := names.get(node)) in live.now and name is not None:
                new[name] = changed(live.now[name], parameters)
    except UnsettableError:
        return None  # the component refuses it, with the reason
    return next((_refusal(one) for one in broken_rules(live.robot, live.now, new)), None)


def broken_rules(robot: Robot, now: Mapping[str, Config], new: Mapping[str, Config]) -> list[Finding]:
    """Return the findings that `new` configurations of components bring, where others have those of `now`."""
    known = {(one.code, one.span) for one in check_settings(robot, now)}
    return [one for one in check_settings(robot, {**now, **new}) if (one.code, one.span) not in known]


def _refusal(broken: Finding) -> Finding:
    """Return why a value is not set, in the words of the rule that it would break."""
    return BREAKS_RULE.at(None, f"{broken.message} ({broken.code})", help=broken.help)

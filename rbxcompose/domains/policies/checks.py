"""Rules about policies."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from rbxcompose.base.findings import Finding
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.manifest.tree import ScalarNode, at


@check("RBX3801", closed=())
def unusable_policy(robot: Robot) -> Iterator[Finding]:
    """The network of a policy is not there, or takes or gives other numbers than those that are written."""
    for made in robot.components.values():
        if made.type_name == "policy":
            yield from _examined(robot, made)


def _examined(robot: Robot, made: RobotComponent) -> Iterator[Finding]:
    # Few robots have one.
    from rbxcompose.domains.policies.components.policy import PolicyNetwork, PolicyNetworkError, read_network

    config: Any = made.config
    path = Path(config.model)
    try:
        read_network(path)
        network = PolicyNetwork(path) if find_spec("onnxruntime") else None
    except PolicyNetworkError as error:
        node = at(robot.manifest.root, made.place("model"))
        written = str(node.filled or node.text) if isinstance(node, ScalarNode) else ""
        if path.exists() or not written.startswith("/"):  # a whole path is one on the computer of the robot
            where = robot.value(*made.place("model"))
            yield unusable_policy.at(where, str(error).replace(str(path), written))
        return
    if network is None or not made.is_sound:
        return
    takes, gives = sum(seen.length for seen in config.observes), len(config.commands.outputs)
    if network.takes not in (None, takes):
        where = robot.value(*made.place("observes"))
        yield unusable_policy.at(where, f"these are {takes} numbers, and '{path.name}' takes {network.takes}")
    if network.gives not in (None, gives):
        where = robot.value(*made.place("commands.outputs"))
        yield unusable_policy.at(where, f"these are {gives} numbers, and '{path.name}' gives {network.gives}")

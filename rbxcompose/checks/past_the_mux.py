"""A subscriber that bypasses a mux."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.qos import Qos
from rbxcompose.sdk.capabilities import Forwards
from rbxcompose.sdk.ports import In, Out


@check("RBX3102")
def past_the_mux(robot: Robot) -> Iterator[Finding]:
    """A component subscribes to an input of a mux instead of its output."""
    outputs = {name: _outputs(component) for name, component in robot.components.items()}
    for topic, ends in robot.readers.items():
        inputs = [end for end in ends if end.name in outputs[end.instance]]
        muxes = {end.instance for end in inputs}
        for end in ends:
            if muxes and end.instance not in muxes and isinstance(end.port, In) and end.port.qos is Qos.COMMAND:
                mux, own = robot.components[inputs[0].instance], inputs[0]
                if own.topic in {one.topic for one in mux.ends if isinstance(one.port, Out)}:
                    continue  # the mux takes what it writes itself, which is told there
                yield past_the_mux.at(
                    robot.end_span(end),
                    f"'{end.instance}' subscribes to '{topic}', bypassing the mux '{mux.name}'",
                    help=f"subscribe to the mux's output: '{end.name}: {outputs[own.instance][own.name]}'",
                    related=[Related(robot.key(*mux.path, "inputs", own.name), "this is an input of the mux")],
                )


def _outputs(mux: RobotComponent) -> dict[str, str]:
    """Return the topic to which a mux forwards what each of its inputs receives; empty if it is no mux."""
    found: dict[str, str] = {}
    for one in mux.declared(Forwards):
        if output := mux.end(one.output):
            found = dict.fromkeys(one.inputs, output.port.topic) | found  # the first that takes an input
    return {name: topic for name, topic in found.items() if topic}

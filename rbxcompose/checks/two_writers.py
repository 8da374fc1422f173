"""Two writers on one command topic."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from rbxcompose.check_runner import check
from rbxcompose.checks.mux_source import missing
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.qos import Qos
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import Forwards
from rbxcompose.sdk.ports import Out


def is_command(end: PortEnd) -> bool:
    """Return whether this end publishes commands."""
    return isinstance(end.port, Out) and end.port.qos is Qos.COMMAND


@check("RBX3001", closed=(WIRING, NAMES))
def two_writers(robot: Robot) -> Iterator[Finding]:
    """Two components write commands on one topic without a mux

    A subscriber would follow whichever published last, so the robot jerks between the two. A mux decides by priority
    which one gets through.

    Bad:
    ```yaml
    components:
      go_to:
        type: go_to
      follow:
        type: go_to
        connect:
          go_to: follow
    ```
    Good:
    ```yaml
    components:
      go_to:
        type: go_to
      follow:
        type: go_to
        connect:
          go_to: follow
    muxes:
      cmd_vel:
        inputs:
          navigation:
            from: go_to
            priority: 10
            timeout: 0.5 s
          follow:
            from: follow
            priority: 20
            timeout: 0.5 s
    ```
    """
    commands = sorted(filter(is_command, robot.ends), key=lambda end: end.topic)
    for topic, ends in groupby(commands, key=lambda end: end.topic):
        mux = robot.manifest.muxes.get(topic.strip("/"))
        if mux and any(one.source and missing(robot, one.source) for one in mux.inputs.values()):
            continue  # the mux was to take one of them, and its mistake is reported at its own place
        writers = sorted(ends, key=lambda end: robot.component_span(end.instance))
        first, *others = writers
        for other in others:
            yield two_writers.at(
                robot.component_span(other.instance),
                f"'{other.instance}' and '{first.instance}' both write commands on '{topic}'",
                label="this one",
                help=_remedy(robot, topic, writers, (first.instance, other.instance)),
                related=[Related(robot.component_span(first.instance), "and this one")],
            )


def _remedy(robot: Robot, topic: str, writers: Iterable[PortEnd], both: tuple[str, str]) -> str:
    """Return how to combine two of the writers: in the mux that is also a writer, or else in a new one."""
    mux = next((one.instance for one in writers if robot.components[one.instance].declared(Forwards)), None)
    if mux is None:
        return f"put both into a mux: 'muxes: {{{topic.strip('/')}: ...}}' with an input 'from:' each"
    missing = " and ".join(f"'from: {name}'" for name in both if name != mux)
    return f"the mux '{mux}' has to decide: give it an input {missing}"

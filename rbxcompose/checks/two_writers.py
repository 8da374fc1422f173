"""Two writers on one command topic."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from rbxcompose.check_runner import check
from rbxcompose.checks.mux_source import missing
from rbxcompose.findings import Finding, Related
from rbxcompose.missions.analysis.effects import published
from rbxcompose.model.build import MISSION
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd, resolve
from rbxcompose.qos import Qos
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import Forwards
from rbxcompose.sdk.ports import In, Out


@check("RBX3001", closed=(WIRING, NAMES))
def two_writers(robot: Robot) -> Iterator[Finding]:
    """Two components write commands on one topic without a mux."""
    commands = sorted(commands_of(robot), key=lambda end: end.topic)
    for topic, ends in groupby(commands, key=lambda end: end.topic):
        mux = robot.manifest.muxes.get(topic.strip("/"))
        if mux and any(one.source and missing(robot, one.source) for one in mux.inputs.values()):
            continue  # the mux was to take one of them, and its mistake is reported at its own place
        writers = sorted(ends, key=lambda end: (end.instance == MISSION, robot.component_span(end.instance)))
        first, *others = writers
        related = [Related(robot.component_span(first.instance), "and this one")]
        for other in others:
            if other.instance == MISSION:
                yield from _by_missions(robot, other, first, related)
                continue
            yield two_writers.at(
                robot.component_span(other.instance),
                f"'{other.instance}' and '{first.instance}' both write commands on '{topic}'",
                label="this one",
                help=_remedy(robot, topic, writers, (first.instance, other.instance)),
                related=related,
            )


def commands_of(robot: Robot) -> Iterator[PortEnd]:
    """Yield the ends that publish what somebody is commanded by, whatever they call it themselves."""
    commanded = {(end.topic, end.type_name) for end in robot.ends if isinstance(end.port, In) and is_command(end)}
    for end in robot.ends:
        if isinstance(end.port, Out) and (is_command(end) or (end.topic, end.type_name) in commanded):
            yield end


def is_command(end: PortEnd) -> bool:
    """Return whether the messages at this end are commands."""
    return isinstance(end.port, In | Out) and end.port.qos is Qos.COMMAND


def _by_missions(robot: Robot, end: PortEnd, writer: PortEnd, related: list[Related]) -> Iterator[Finding]:
    """Yield a finding for each place where a mission publishes beside a component."""
    forwards = robot.components[writer.instance].declared(Forwards)
    free = [topic for one in forwards for topic in _open_inputs(robot, writer.instance, one)]
    example = "give it an input, such as 'mission: {priority: 5, timeout: 0.5 s}', and publish there"
    put = f"publish on an open input of the mux: {', '.join(free)}" if free else example
    for mission in robot.missions.values():
        for message in (one for node in mission.program.nodes for one in published(node)):
            if resolve(message.target.text, robot.manifest.bus.namespace or "") == end.topic:
                text = f"this mission and '{writer.instance}' both write commands on '{end.topic}'"
                help_text = put if forwards else _new_mux(end.topic)
                yield two_writers.at(message.target.span, text, help=help_text, related=related)


def _open_inputs(robot: Robot, mux: str, forwards: Forwards) -> list[str]:
    """Return the topics of a mux on which nothing in the robot publishes yet."""
    ends = [end for end in robot.components[mux].ends if end.name in forwards.inputs]
    return [end.port.topic for end in ends if not robot.writers.get(end.topic)]


def _remedy(robot: Robot, topic: str, writers: Iterable[PortEnd], both: tuple[str, str]) -> str:
    """Return how to combine two of the writers: in the mux that is also a writer, or else in a new one."""
    mux = next((one.instance for one in writers if robot.components[one.instance].declared(Forwards)), None)
    if mux is None:
        return _new_mux(topic)
    missing = " and ".join(f"'from: {name}'" for name in both if name != mux)
    return f"the mux '{mux}' has to decide: give it an input {missing}"


def _new_mux(topic: str) -> str:
    return f"put both into a mux: 'muxes: {{{topic.strip('/')}: ...}}' with an input 'from:' each"

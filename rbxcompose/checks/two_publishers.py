"""Two components that write numbers on one topic."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.build import MISSION
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.msgs.definitions import parse_type
from rbxcompose.qos import Qos
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.ports import Out

_STATES = (Qos.STATE, Qos.LATCHED)


@check("RBX3015", Severity.WARNING, closed=(WIRING, NAMES))
def two_publishers(robot: Robot) -> Iterator[Finding]:
    """Two components write numbers on one topic."""
    for topic, ends in robot.writers.items():
        nameless = [end for end in ends if _is_nameless(end)]
        first = nameless[0].instance if nameless else ""
        for other in nameless:
            if other.instance == first:
                continue
            own = f"{other.name}: {other.instance}/{other.name}"
            yield two_publishers.at(
                robot.component_span(other.instance),
                f"'{other.instance}' and '{first}' both write on '{topic}', and nobody can tell whose it is",
                help=f"give one of them another topic: 'connect: {{{own}}}'",
                related=[Related(robot.component_span(first), "and this one")],
            )


def _is_nameless(end: PortEnd) -> bool:
    """Return whether messages with a state are bare values: no header, frame or name in them tells whose it is."""
    port = end.port
    if not isinstance(port, Out) or port.qos not in _STATES or end.instance == MISSION or port.interface is None:
        return False
    types = [parse_type(one) for one in port.interface.FIELDS.values()]
    return bool(types) and not any(one.is_message or one.base in ("string", "wstring") for one in types)

"""Two servers of one service or action."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.rules import WIRING
from rbxcompose.sdk.ports import Serves, ServesAction, ServesTopic


@check("RBX3008", closed=(WIRING,))
def two_servers(robot: Robot) -> Iterator[Finding]:
    """Two components serve the same service or action

    Either of them might respond to a client; which one is undefined.

    Bad:
    ```yaml
    components:
      battery:
        type: battery_sim
        runtime: 45 s
      spare:
        type: battery_sim
        runtime: 45 s
    ```
    Good:
    ```yaml
    components:
      battery:
        type: battery_sim
        runtime: 45 s
      spare:
        type: battery_sim
        runtime: 45 s
        connect:
          battery_level: spare/battery_level
          set_battery_level: spare/set_battery_level
    ```
    """
    first: dict[str, str] = {}
    for end in robot.ends:
        if not _answers(end):
            continue
        other = first.setdefault(end.topic, end.instance)
        if other != end.instance:
            yield two_servers.at(
                robot.component_span(end.instance),
                f"'{end.instance}' and '{other}' both serve '{end.topic}'",
                label="this one",
                help=f"give one of them another name: 'connect: {{{end.name}: ...}}'",
                related=[Related(robot.component_span(other), "and this one")],
            )


def _answers(end: PortEnd) -> bool:
    """Return whether a client of this end waits for an answer; an order whose end is not reported may go to several."""
    return isinstance(end.port, Serves | ServesAction) or (isinstance(end.port, ServesTopic) and bool(end.port.ends))

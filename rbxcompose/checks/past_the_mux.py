"""A listener that bypasses a mux."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.flow import MUX
from rbxcompose.model.robot import Robot
from rbxcompose.qos import Qos
from rbxcompose.sdk.ports import In


@check("RBX3102")
def past_the_mux(robot: Robot) -> Iterator[Finding]:
    """A component listens to an input of a mux instead of its output

    It would follow that one source whatever its priority, even while the robot is stopped.

    Bad:
    ```yaml
    components:
      base:
        type: diff_drive_sim
        connect:
          cmd_vel: cmd_vel/navigation
    ```
    Good:
    ```yaml
    components:
      base:
        type: diff_drive_sim
    ```
    """
    for topic, ends in robot.readers.items():
        muxed = [end for end in ends if robot.parts[end.instance].type_name == MUX]
        for end in ends:
            if muxed and end not in muxed and isinstance(end.port, In) and end.port.qos is Qos.COMMAND:
                mux = muxed[0].instance
                yield past_the_mux.at(
                    robot.end_span(end),
                    f"'{end.instance}' listens to '{topic}', past the mux '{mux}'",
                    help=f"listen to the mux's output: '{end.name}: {mux}'",
                    related=[Related(robot.key("muxes", mux, "inputs", muxed[0].name), "this is an input of the mux")],
                )

"""A timeout of 0 in a mux."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX3136")
def mux_no_time(robot: Robot) -> Iterator[Finding]:
    """A timeout of a mux is 0."""
    for mux, entry in robot.manifest.muxes.items():
        timeouts = [("inputs", name, one.timeout) for name, one in entry.inputs.items()]
        timeouts += [("locks", name, one.timeout) for name, one in entry.locks.items()]
        for key, name, timeout in timeouts:
            if timeout == 0 and entry.profile not in ("twist_mux", "yocs"):
                yield mux_no_time.at(
                    robot.value("muxes", mux, key, name, "timeout"),
                    f"{key[:-1]} '{name}' of mux '{mux}' has no time at all",
                    help="a few times the time between two messages is enough, such as '0.5 s'",
                )

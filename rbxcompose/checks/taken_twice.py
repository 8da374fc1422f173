"""One output that two mux inputs take."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot


@check("RBX3106")
def taken_twice(robot: Robot) -> Iterator[Finding]:
    """Two mux inputs take the same output."""
    first: dict[str, tuple[str, str]] = {}
    for mux, entry in robot.manifest.muxes.items():
        for name, one in entry.inputs.items():
            if one.source is None:
                continue
            other = first.setdefault(one.source, (mux, name))
            if other != (mux, name):
                yield taken_twice.at(
                    robot.value("muxes", mux, "inputs", name, "from"),
                    f"input '{name}' of mux '{mux}' takes the same as another input: '{one.source}'",
                    help="remove one of the two",
                    related=[Related(robot.value("muxes", other[0], "inputs", other[1], "from"), "taken here")],
                )

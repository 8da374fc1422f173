"""A stop for messages that have none."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.mux.config import MuxConfig
from rbxcompose.mux.handover import RAMPS
from rbxcompose.rules import WIRING
from rbxcompose.sections.muxes import MuxModel


@check("RBX3135", closed=(WIRING,))
def mux_rest(robot: Robot) -> Iterator[Finding]:
    """A mux is to stop what zeros do not stop."""
    for mux, entry in robot.manifest.muxes.items():
        config = _config(robot.components.get(mux))
        if config is None:
            continue
        for path in _stops(entry) if not config.has_rest else ():
            yield mux_rest.at(
                robot.key("muxes", mux, *path),
                f"zeros of {config.message} are no rest, so mux '{mux}' cannot stop with them",
                help="leave it out; or, if zeros are rest for the receiver, add 'zero_stops: true'",
            )
        if entry.handover is not None and config.message not in RAMPS:
            yield mux_rest.at(
                robot.key("muxes", mux, "handover"),
                f"a hand-over is for velocities, and mux '{mux}' forwards {config.message}",
                help="leave it out",
            )


def _config(component: RobotComponent | None) -> MuxConfig | None:
    return component.config if component and isinstance(component.config, MuxConfig) else None


def _stops(entry: MuxModel) -> Iterator[tuple[str, ...]]:
    """Yield the paths of keys that need a message of rest."""
    for key, ending in (("on_idle", entry.on_idle), ("on_lock", entry.on_lock)):
        if ending not in (None, "none"):
            yield (key,)
    yield from (("inputs", name, "zero_releases") for name, one in entry.inputs.items() if one.zero_releases)

"""A mux that holds a command for longer than the base follows it."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.mux.words import HoldFirst
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import Drives, Forwards, Setting
from rbxcompose.units import TIME, format_quantity

ENDINGS = ("on_idle", "on_lock")


@check("RBX3514", Severity.WARNING, closed=(WIRING,))
def idle_hold(robot: Robot) -> Iterator[Finding]:
    """A mux holds a command for longer than the base follows it."""
    bases = list(_bases(robot))
    for mux, entry in robot.manifest.muxes.items():
        for ending in ENDINGS:
            written = getattr(entry, ending)
            brakes = [(base, after) for base, after, name in bases if name == mux]
            if not isinstance(written, HoldFirst) or not brakes:
                continue
            base, after = max(brakes, key=lambda one: one[1].value)
            if written.hold > after.value:
                held, braked = format_quantity(written.hold, TIME), format_quantity(after.value, TIME)
                yield idle_hold.at(
                    robot.value("muxes", mux, ending, "hold"),
                    f"'{mux}' holds the last command for {held}, but '{base.name}' brakes after {braked}",
                    help=f"make it shorter than {braked}",
                    related=[Related(setting_span(robot, (base, after.field)), "it brakes")],
                )


def _bases(robot: Robot) -> Iterator[tuple[RobotComponent, Setting[float], str]]:
    """Yield each base that brakes by itself, with each mux that sends it commands."""
    for base, drives in robot.declared(Drives):
        end = base.end(drives.commands)
        for writer in robot.writers.get(end.topic, ()) if end and drives.stops_after else ():
            sender = robot.components[writer.instance]
            if drives.stops_after and any(one.output == writer.name for one in sender.declared(Forwards)):
                yield base, drives.stops_after, sender.name

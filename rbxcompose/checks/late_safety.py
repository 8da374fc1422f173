"""Limits of safety that come too late."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.sections.safety import safety
from rbxcompose.units import TIME, format_quantity

_HOTTEST = 85.0  # [degC]: no Dynamixel servo lets its own limit be higher; most shut down at 70 to 80
_LONGEST = 10.0  # [s]


@check("RBX2244", Severity.WARNING, closed=())
def late_safety(robot: Robot) -> Iterator[Finding]:
    """A limit of safety comes too late."""
    care = robot.manifest.contents.of(safety)
    if care.thermal.limit > _HOTTEST:
        yield late_safety.at(
            robot.value("safety", "thermal", "limit"),
            f"no joint rests before {care.thermal.limit:g} degC, but servos fail from 70 degC to {_HOTTEST:g} degC on",
            help="'limit: 60 degC' is usual",
        )
    if care.estop is not None and care.estop.deadline > _LONGEST:
        yield late_safety.at(
            robot.value("safety", "estop", "deadline"),
            f"the emergency stop may be silent for {format_quantity(care.estop.deadline, TIME)} until the robot stops",
            help="a few times the time between two of its messages is enough, such as '0.5 s'",
        )
    for mux, entry in robot.manifest.muxes.items():
        for name, lock in entry.locks.items():
            if lock.timeout and lock.timeout > _LONGEST:
                yield late_safety.at(
                    robot.value("muxes", mux, "locks", name, "timeout"),
                    f"lock '{name}' of mux '{mux}' engages after {format_quantity(lock.timeout, TIME)} of silence only",
                    help="a few times the time between two heartbeats is enough, such as '0.5 s'",
                )

"""A speed that the base does not reach."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Kind, Related, Severity
from rbxcompose.model.flow import Flow, setting, setting_span
from rbxcompose.model.robot import Part, Robot
from rbxcompose.units import ANGULAR_SPEED, SPEED, Dimension, format_quantity

LIMITS = (("speed", "max_speed", SPEED), ("turn_rate", "max_turn_rate", ANGULAR_SPEED))
ABSURD = 2.0  # a base takes a command above this many times its limit for a fault, and drops it


@check("RBX3503", Severity.WARNING)
def clamped_speed(robot: Robot) -> Iterator[Finding]:
    """A component drives faster than its base can

    The base clamps each such command to its limit, but the component that sends it plans with a speed that is never
    reached.

    Bad:
    ```yaml
    components:
      go_to:
        type: go_to
        speed: 0.8 m/s
    ```
    Good:
    ```yaml
    components:
      go_to:
        type: go_to
        speed: 0.4 m/s
    ```
    """
    for one in excesses(robot):
        if not one.is_absurd:
            yield one.finding(robot, clamped_speed, f"can do {one.shown(one.limit)} at most")


@dataclass(frozen=True, slots=True)
class Excess:
    """A setting of a driver that is above the limit of its base."""

    driver: Part
    base: Part
    setting: str
    limiting: str
    wanted: float
    limit: float
    dimension: Dimension

    @property
    def is_absurd(self) -> bool:
        """Tell whether the base drops such commands instead of cutting them."""
        return self.wanted > ABSURD * self.limit

    def shown(self, value: float) -> str:
        """Write a value of this setting for people."""
        return format_quantity(value, self.dimension)

    def finding(self, robot: Robot, kind: Kind, what: str) -> Finding:
        """Return the finding; `what` the base does about it."""
        here, there = (self.driver, self.setting), (self.base, self.limiting)
        span, limit = setting_span(robot, here, there), setting_span(robot, there)
        return kind.at(
            span,
            f"'{self.driver.name}' drives with {self.shown(self.wanted)}, but its base '{self.base.name}' {what}",
            help=f"make '{self.setting}' of '{self.driver.name}' at most {self.shown(self.limit)}",
            related=[Related(limit, f"'{self.limiting}' of the base")] if limit != span else [],
        )


def excesses(robot: Robot) -> Iterator[Excess]:
    """Yield the speeds and turn rates above the limits of the base that they are for."""
    for driver, base in Flow(robot).drives():
        for name, limiting, dimension in LIMITS:
            wanted, limit = setting(driver, name), setting(base, limiting)
            if wanted is not None and limit is not None and wanted > limit:
                yield Excess(driver, base, name, limiting, wanted, limit, dimension)

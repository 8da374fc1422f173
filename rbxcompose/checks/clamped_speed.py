"""A speed that the base does not reach."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, FindingKind, Related, Severity
from rbxcompose.model.flow import OTHER_TYPE, Drive, MessageFlow, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import Setting
from rbxcompose.units import ANGULAR_SPEED, SPEED, Dimension, format_quantity


@check("RBX3503", Severity.WARNING, closed=(WIRING, NAMES))
def clamped_speed(robot: Robot) -> Iterator[Finding]:
    """A component drives faster than its base can."""
    for one in excesses(robot):
        if not one.is_absurd:
            yield one.finding(robot, clamped_speed, f"can do {one.shown(one.limit)} at most")


@dataclass(frozen=True, slots=True)
class Excess:
    """A setting of a component that exceeds the limit of the base it drives."""

    drive: Drive
    wanted: Setting[float]
    limit: Setting[float]
    dimension: Dimension

    @property
    def is_absurd(self) -> bool:
        """Return whether the base ignores such commands instead of clamping them."""
        factor = self.drive.drives.drops_above
        return factor is not None and self.wanted.value > factor.value * self.limit.value

    def shown(self, setting: Setting[float]) -> str:
        """Return the value of one of the settings, formatted for people."""
        return format_quantity(setting.value, self.dimension)

    @property
    def times(self) -> str:
        """Return, in words, the multiple of its limit up to which the base accepts commands."""
        factor = self.drive.drives.drops_above
        return "twice" if factor is None or factor.value == 2.0 else f"{factor.value:g} times"

    @property
    def remedy(self) -> str:
        """Return how to correct it."""
        if self.wanted.field:
            return f"make '{self.wanted.field}' of '{self.drive.driver.name}' at most {self.shown(self.limit)}"
        if self.limit.field:
            return f"make '{self.limit.field}' of '{self.drive.base.name}' at least {self.shown(self.wanted)}"
        return OTHER_TYPE

    def finding(self, robot: Robot, kind: FindingKind, what: str) -> Finding:
        """Return the finding; `what` says how the base reacts."""
        driver, base, name = self.drive.driver, self.drive.base, self.limit.field
        there = (base, name)
        span, limit = setting_span(robot, (driver, self.wanted.field), there), setting_span(robot, there)
        return kind.at(
            span,
            f"'{driver.name}' drives at {self.shown(self.wanted)}, but its base '{base.name}' {what}",
            help=self.remedy,
            related=[Related(limit, f"'{name}' of the base" if name else "the base")] if limit != span else [],
        )


def excesses(robot: Robot) -> Iterator[Excess]:
    """Yield the speeds and turn rates that exceed the limits of the base they drive."""
    for one in MessageFlow(robot).drives():
        wants, has = one.commands, one.drives
        speeds = (wants.max_speed, has.max_speed, SPEED), (wants.max_turn_rate, has.max_turn_rate, ANGULAR_SPEED)
        for wanted, limit, dimension in speeds:
            if wanted and limit and wanted.value > limit.value:
                yield Excess(one, wanted, limit, dimension)

"""Twin of a battery that drains evenly."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level

NOTHING_LEFT = 1e-9  # anything less is rounding from many small steps, not charge


@dataclass(frozen=True, slots=True)
class BatterySettings:
    """How fast the battery drains and when it warns; levels are ratios from 0 to 1."""

    runtime: float
    """Time from full to empty [s], above zero."""
    warn: float = 0.5
    """Strictly below this level it warns."""
    error: float = 0.2
    """Strictly below this level it is an error."""


class BatteryCore:
    """Charge that falls from 1 to 0 over `settings.runtime`; replacing `settings` keeps the level."""

    def __init__(self, settings: BatterySettings, level: float = 1.0) -> None:
        self._settings = settings
        self._start, self._drained = level, 0.0  # a ratio, and how long it has drained since then [s]

    @property
    def settings(self) -> BatterySettings:
        """How it drains and warns."""
        return self._settings

    @settings.setter
    def settings(self, settings: BatterySettings) -> None:
        self.set(self.level)
        self._settings = settings

    @property
    def level(self) -> float:
        """Charge as a ratio from 0 to 1, computed from the total time: steps would accumulate rounding errors."""
        runtime = self._settings.runtime
        left = (self._start * runtime - self._drained) / runtime
        return left if left > NOTHING_LEFT else 0.0

    @property
    def status(self) -> tuple[Level, str]:
        """Diagnostic level and a message for people."""
        if self.level < self.settings.error:
            return Level.ERROR, "Low battery"
        if self.level < self.settings.warn:
            return Level.WARN, "Medium battery"
        return Level.OK, "Battery OK"

    def set(self, level: float) -> str:
        """Set the charge; return the reason if `level` is not a ratio from 0 to 1, else nothing."""
        if not 0.0 <= level <= 1.0:
            return f"a battery level is between 0 % and 100 %, not at {level * 100:g} %"
        self._start, self._drained = level, 0.0
        return ""

    def step(self, dt: float) -> None:
        """Drain for `dt` [s]."""
        self._drained += dt

"""The simulated battery, and its twin: a charge that drains evenly."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.levels import Level
from rbxcompose.msgs.rbxcompose_msgs import SetBatteryLevel
from rbxcompose.msgs.std_msgs import Float32

PERCENT = 100.0  # a `battery_level` message counts from 0 to 100
DIGITS = 6  # of a percentage; further ones are rounding errors, which would put 80 % below 80 %
NOTHING_LEFT = 1e-9  # anything less is rounding from many small steps, not charge


class BatterySimConfig(sdk.Config):
    """How fast the battery drains, and when it warns."""

    runtime: Annotated[sdk.Time, sdk.Live()] = Field(gt=0)
    """Time from full to empty."""
    initial: sdk.Ratio = Field(1.0, ge=0, le=1)
    """Charge at the start."""
    warn: Annotated[sdk.Ratio, sdk.Live()] = Field(0.5, ge=0, le=1)
    """Below this charge its status is WARN."""
    error: Annotated[sdk.Ratio, sdk.Live()] = Field(0.2, ge=0, le=1)
    """Below this charge its status is ERROR."""


class BatteryCore:
    """Charge that falls from 1 to 0 over `settings.runtime`; replacing `settings` keeps the level."""

    def __init__(self, settings: BatterySimConfig, level: float = 1.0) -> None:
        self._settings = settings
        self._start, self._drained = level, 0.0  # a ratio, and how long it has drained since then [s]

    @property
    def settings(self) -> BatterySimConfig:
        """How it drains and warns."""
        return self._settings

    @settings.setter
    def settings(self, settings: BatterySimConfig) -> None:
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


@sdk.component("battery_sim")
class BatterySim(sdk.Component[BatterySimConfig]):
    """A battery that drains evenly from full to empty over `runtime`; a charger can set its level.

    Example:
        battery: {type: battery_sim, runtime: 45 s, warn: 50 %, error: 20 %}
    """

    rate = 1.0
    process = "world"
    simulated = True
    battery_level = sdk.Out(Float32, "battery_level", unit="%", rate=rate)
    set_battery_level = sdk.Serves(SetBatteryLevel, "set_battery_level", unit="%")

    @classmethod
    def capabilities(cls, config: BatterySimConfig) -> tuple[sdk.Capability, ...]:
        """Declare that it is a battery."""
        runtime = sdk.Setting(config.runtime, "runtime")
        warn, error = sdk.Setting(config.warn, "warn"), sdk.Setting(config.error, "error")
        return (sdk.Drains("battery_level", runtime, warn, error),)

    def configure(self) -> None:
        """Fill the battery."""
        self.core = BatteryCore(self.config, self.config.initial)
        self.reported = Level.OK

    def reconfigure(self, old: BatterySimConfig) -> None:
        """Apply the new runtime and thresholds; the charge stays unchanged."""
        self.core.settings = self.config
        self.publish()

    def activate(self) -> None:
        """Publish the first level immediately, since others wait for it."""
        self.publish()

    def step(self, dt: float) -> None:
        """Drain for `dt` [s]."""
        self.core.step(dt)
        self.publish()

    def on_set_battery_level(self, request: SetBatteryLevel.Request) -> SetBatteryLevel.Response:
        """Set the charge, given from 0 to 100; refuse one out of range."""
        if refusal := self.core.set(request.value / PERCENT):
            raise sdk.Refused(refusal)
        self.info(f"set to {request.value:.0f} %")
        self.publish()
        return SetBatteryLevel.Response()

    def publish(self) -> None:
        """Publish level and status; log a new status level to the story."""
        percent = round(self.core.level * PERCENT, DIGITS)
        level, message = self.core.status
        self.battery_level(Float32(data=percent))
        self.status(level, message, level=f"{percent:.1f} %")
        if level is not self.reported:
            self.context.log(level, f"{message}: {percent:.0f} %")
            self.reported = level

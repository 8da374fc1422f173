"""The battery of this computer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.limits import LimitCore, Limits
from rbxcompose.domains.diagnostics.monitors import FOLDER, HostMonitor, Supply, batteries
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk import Capability, Config, Drains, Live, Out, Ratio, Setting, component

PERCENT = 100.0
HYSTERESIS = 0.02


class HostBatteryConfig(Config):
    """Which battery, and when it is too low."""

    battery: str = ""
    """Its name, such as `BAT0`; the first one if there is none here."""
    warn: Annotated[Ratio, Live()] = Field(0.5, ge=0, le=1)
    """Below this charge it is WARN."""
    error: Annotated[Ratio, Live()] = Field(0.2, ge=0, le=1)
    """Below this charge it is ERROR."""
    folder: str = str(FOLDER)
    """Where Linux shows batteries."""


@component("host_battery")
class HostBattery(HostMonitor[HostBatteryConfig]):
    """Reports and publishes the charge of the battery of this computer, as `battery_sim` does for a simulated one.

    Example:
        laptop: {type: host_battery, warn: 50 %, error: 20 %}
    """

    battery_level = Out(Float32, "battery_level", unit="%")

    @classmethod
    def capabilities(cls, config: HostBatteryConfig) -> tuple[Capability, ...]:
        """Declare that it is a battery."""
        return (Drains("battery_level", None, Setting(config.warn, "warn"), Setting(config.error, "error")),)

    def configure(self) -> None:
        """Begin without a level."""
        self.core = LimitCore(limits_of(self.config))

    def reconfigure(self, old: HostBatteryConfig) -> None:
        """Apply new limits."""
        self.core.limits = limits_of(self.config)

    def measure(self, dt: float) -> None:
        """Look, publish and report."""
        found = batteries(Path(self.config.folder))
        name = self.config.battery
        supply = next((battery for battery in found if name in ("", battery.name)), None)
        if supply is None or supply.charge is None:
            there = f"there is {', '.join(battery.name for battery in found)}" if found else "there is none"
            self.status(Level.ERROR, f"no battery{' ' + name if name else ''} reports its charge: {there}")
            return
        self.battery_level(Float32(data=supply.charge * PERCENT))
        level = self.core.feed(self.now, supply.charge)
        self.status(level, f"{supply.charge:.0%}, {supply.status.lower()}", **values_of(supply))


def limits_of(config: HostBatteryConfig) -> Limits:
    """Return the limits of the core."""
    return Limits(warn_below=config.warn, error_below=config.error, hysteresis=HYSTERESIS)


def values_of(supply: Supply) -> dict[str, str]:
    """Return what people may want to know besides."""
    known = {"voltage": (supply.voltage, "V"), "current": (supply.current, "A")}
    values = {name: f"{value:.2f} {unit}" for name, (value, unit) in known.items() if value is not None}
    return values if supply.health is None else {**values, "of its first capacity": f"{supply.health:.0%}"}

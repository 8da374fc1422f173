"""The battery of this computer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.monitors import HostMonitor, LimitCore, Limits
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk import Capability, Config, Drains, Live, Out, Ratio, Setting, component

FOLDER = Path("/sys/class/power_supply")
MICRO = 1e-6
PERCENT = 100.0
HYSTERESIS = 0.02
MOST = 1.1  # of its capacity: one that was measured anew may have a little more than the gauge knows


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
        if not 0.0 <= supply.charge <= MOST:
            self.status(Level.ERROR, f"the gauge of {supply.name} is broken: it says {supply.charge * PERCENT:g}%")
            return
        charge = min(supply.charge, 1.0)
        self.battery_level(Float32(data=charge * PERCENT))
        level = self.core.feed(self.now, charge)
        self.status(level, f"{charge:.0%}, {supply.status.lower()}", **values_of(supply))


def limits_of(config: HostBatteryConfig) -> Limits:
    """Return the limits of the core."""
    return Limits(warn_below=config.warn, error_below=config.error, hysteresis=HYSTERESIS)


def values_of(supply: Supply) -> dict[str, str]:
    """Return what people may want to know besides."""
    known = {"voltage": (supply.voltage, "V"), "current": (supply.current, "A")}
    values = {name: f"{value:.2f} {unit}" for name, (value, unit) in known.items() if value is not None}
    return values if supply.health is None else {**values, "of its first capacity": f"{supply.health:.0%}"}


@dataclass(frozen=True, slots=True)
class Supply:
    """A battery: `charge` and `health` are shares, None where Linux does not know; [V], [A]."""

    name: str
    status: str
    charge: float | None
    health: float | None
    voltage: float | None
    current: float | None


def batteries(folder: Path = FOLDER) -> tuple[Supply, ...]:
    """Return the batteries that are present, by name; none where there is no such folder.

    Batteries of devices, such as a mouse, have the scope `Device` and do not count.
    """
    try:
        found = sorted(folder.iterdir())
    except OSError:
        return ()
    return tuple(_supply(path) for path in found if _is_own_battery(path))


def _is_own_battery(folder: Path) -> bool:
    is_battery = _text(folder, "type") == "Battery" and _text(folder, "scope") != "Device"
    return is_battery and _text(folder, "present") != "0"


def _supply(folder: Path) -> Supply:
    full = _number(folder, "energy_full", "charge_full")
    design = _number(folder, "energy_full_design", "charge_full_design")
    now = _number(folder, "energy_now", "charge_now")
    percent = _number(folder, "capacity")
    charge = percent / 100 if percent is not None else _share(now, full)
    voltage, current = _number(folder, "voltage_now"), _number(folder, "current_now")
    return Supply(
        folder.name,
        _text(folder, "status") or "Unknown",
        charge,
        _share(full, design),
        voltage * MICRO if voltage is not None else None,
        current * MICRO if current is not None else None,
    )


def _share(part: float | None, whole: float | None) -> float | None:
    return part / whole if part is not None and whole else None


def _number(folder: Path, *names: str) -> float | None:
    for name in names:
        text = _text(folder, name)
        if text.lstrip("-").isdecimal():
            return float(text)
    return None


def _text(folder: Path, name: str) -> str:
    try:
        with (folder / name).open(encoding="utf-8", errors="replace") as file:
            return file.read(64).strip()
    except OSError:  # Linux shows only what the battery reports, and a battery may be taken out while it is read
        return ""

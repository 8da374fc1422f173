"""Batteries in `/sys/class/power_supply`, as Linux shows them: a folder each, with a file for each property.

Properties and their units (uV, uA, uWh, uAh, percent): Linux, Documentation/ABI/testing/sysfs-class-power.
"""

from __future__ import annotations

from pathlib import Path

from rbxcompose.dataclass import dataclass

FOLDER = Path("/sys/class/power_supply")
MICRO = 1e-6


@dataclass(frozen=True, slots=True)
class Supply:
    """A battery: `charge` and `health` from 0 to 1, None where Linux does not know; [V], [A]."""

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
    return tuple(_supply(one) for one in found if _is_own_battery(one))


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
    except OSError:  # Linux shows only what the battery tells, and a battery may be taken out while it is read
        return ""

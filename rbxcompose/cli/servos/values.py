"""Values of servos as people write and read them: raw numbers, or quantities with a unit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rbxcompose.actuation.servo_findings import NO_ITEM
from rbxcompose.actuation.servo_models import ServoModel
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import Finding
from rbxcompose.printable import plain
from rbxcompose.units import (
    ANGLE,
    ANGULAR_ACCELERATION,
    ANGULAR_SPEED,
    CURRENT,
    RATIO,
    TEMPERATURE,
    TIME,
    VOLTAGE,
    Dimension,
    UnitError,
    to_si,
)

DIMENSIONS: Mapping[str, Dimension] = {
    "rad": ANGLE,
    "rad/s": ANGULAR_SPEED,
    "rad/s^2": ANGULAR_ACCELERATION,
    "V": VOLTAGE,
    "A": CURRENT,
    "s": TIME,
    "degC": TEMPERATURE,
    "1": RATIO,
}


def unknown_item(model: ServoModel, name: str) -> Finding:
    """Return the finding about an item that a model does not have."""
    return NO_ITEM.misspelt(None, f"{model.name} has no item '{plain(name)}'", name, model.items, "items")


def shown(model: ServoModel, item: str, raw: int) -> tuple[float, str]:
    """Return a raw value in its SI unit; the unit is empty for a code."""
    where = model.items.get(item)
    return (where.to_si(raw), where.unit) if where else (raw, "")


def raw_values(model: ServoModel, texts: Iterable[str]) -> dict[str, int]:
    """Read `goal_position=512` or `goal_position=30 deg`.

    Raises:
        NotDoneError: if an item is not known, or a value does not fit.
    """
    return dict(_raw_value(model, text) for text in texts)


def _raw_value(model: ServoModel, text: str) -> tuple[str, int]:
    name, equals, value = text.partition("=")
    if name not in model.items:
        raise NotDoneError(unknown_item(model, name))
    item = model.items[name]
    try:
        raw = int(value) if value.lstrip("-").isdecimal() else item.to_raw(_quantity(item.unit, value))
        item.encode(raw)
    except (UnitError, ValueError) as error:
        words = f"'{plain(text)}': {error}" if equals else f"'{plain(text)}' lacks '=' and a value"
        raise NotDoneError(NO_ITEM.at(None, words, help="write a raw number or a quantity with its unit")) from error
    return name, raw


def _quantity(unit: str, text: str) -> float:
    if unit not in DIMENSIONS:
        raise ValueError("must be a whole number")
    return to_si(text, DIMENSIONS[unit])

"""The settings that missions may change: their types."""

from __future__ import annotations

from rbxcompose.config import Config
from rbxcompose.expressions.types import COUNT, FLAG, TEXT, Type, choice_of, quantity_of
from rbxcompose.params.core import ParameterField, settings
from rbxcompose.units import NUMBER


def live_types(config: Config) -> dict[str, Type]:
    """Return the settings of a configuration that may change while the robot runs and have one value, by name."""
    found = ((name, _type_of(one)) for name, one in settings(config).items() if one.is_live)
    return {name: type_ for name, type_ in found if type_ is not None}


def _type_of(one: ParameterField) -> Type | None:
    if choices := one.choices:
        return choice_of(*choices)
    match one.value:
        case bool():
            return FLAG
        case int():
            return COUNT
        case float():
            return quantity_of(one.dimension or NUMBER)
        case str():
            return TEXT
    return None

"""The fields of a configuration as parameters of ROS 2: their values, their descriptions, and changes to them.

Numbers are SI. A client may also send text with a unit (`30 s`), as in a manifest.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from types import MappingProxyType
from typing import Any, Literal, TypeVar, get_args, get_origin

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from rbxcompose.config import Bound, Config, Dimensioned, is_live, leaves, value_at, with_values
from rbxcompose.dataclass import dataclass
from rbxcompose.field_docs import field_docs
from rbxcompose.findings import suggest
from rbxcompose.manifest.unit_choice import is_nearly, rounder_unit
from rbxcompose.msgs.rcl_interfaces import (
    FloatingPointRange,
    IntegerRange,
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterValue,
)
from rbxcompose.params.values import HIGHEST, LOWEST, from_message, parameter_type, to_message
from rbxcompose.units import RATIO, UNITS, Dimension, Quantity, UnitError, format_number, format_quantity

C = TypeVar("C", bound=Config)
SEPARATOR = "."
SettingBounds = Mapping[str, Sequence[Bound]]  # what bounds settings beside their fields, by name
NO_BOUNDS: SettingBounds = MappingProxyType({})
_RATIO = "0 to 1"  # in the place of a unit
_BOUNDS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}


class UnsettableError(ValueError):
    """Raised with the reason why parameters cannot be set."""


@dataclass(frozen=True, slots=True)
class ParameterField:
    """A parameter: a field of the configuration, or one below a field (`inputs.teleop.priority`)."""

    name: str
    value: object
    field: FieldInfo | None = None
    model: type[Config] | None = None  # whose field it is
    is_whole: bool = True
    """Whether it is a field of the configuration, or of a group of its fields."""
    bounds: Sequence[Bound] = ()
    """What bounds it beside its field."""

    @property
    def is_live(self) -> bool:
        """Return whether it may change while the robot runs."""
        return self.is_whole and self.field is not None and is_live(self.field)

    @property
    def dimension(self) -> Dimension | None:
        """Return its dimension, None if it is not a quantity."""
        return dimension_of(self.field) if self.field else None

    @property
    def descriptor(self) -> ParameterDescriptor:
        """Return its description and the values that it accepts."""
        numbers, integers = self._ranges()
        return ParameterDescriptor(
            name=self.name,
            type=parameter_type(self.value) or 0,
            description=self._description(),
            additional_constraints=self._constraints(),
            read_only=not self.is_live,
            floating_point_range=numbers,
            integer_range=integers,
        )

    @property
    def _marks(self) -> Sequence[Any]:
        return self.field.metadata if self.field else ()

    def _description(self) -> str:
        text = field_docs(self.model).get(self.name.rpartition(SEPARATOR)[2], "") if self.model else ""
        return f"{text} [{unit}]".strip() if (unit := _si_unit(self.dimension)) else text

    def _bounds(self) -> Iterator[tuple[str, float]]:
        for mark in self._marks:
            for key in _BOUNDS:
                if (bound := getattr(mark, key, None)) is not None:
                    yield key, bound
        for one in self.bounds:
            for key, limit in (("ge", one.least), ("le", one.most)):
                if limit is not None:
                    yield key, limit

    @property
    def _step(self) -> float:
        return next((step for mark in self._marks if (step := getattr(mark, "multiple_of", None)) is not None), 0)

    def _ranges(self) -> tuple[tuple[FloatingPointRange, ...], tuple[IntegerRange, ...]]:
        """Return the ranges that the wire has; they have no bounds that are not part of them."""
        low = [(bound, key) for key, bound in self._bounds() if key in ("gt", "ge")]
        high = [(bound, key) for key, bound in self._bounds() if key in ("lt", "le")]
        if isinstance(self.value, bool) or not (low or high or self._step):
            return (), ()
        if isinstance(self.value, int):
            lows = (math.floor(bound) + 1 if key == "gt" else math.ceil(bound) for bound, key in low)
            highs = (math.ceil(bound) - 1 if key == "lt" else math.floor(bound) for bound, key in high)
            least, most = max(lows, default=LOWEST), min(highs, default=HIGHEST)
            return (), (IntegerRange(from_value=least, to_value=most, step=int(self._step)),)
        up = (math.nextafter(bound, math.inf) if key == "gt" else bound for bound, key in low)
        down = (math.nextafter(bound, -math.inf) if key == "lt" else bound for bound, key in high)
        lowest, highest = max(up, default=-math.inf), min(down, default=math.inf)
        return (FloatingPointRange(from_value=lowest, to_value=highest, step=float(self._step)),), ()

    def _constraints(self) -> str:
        words = [f"{_BOUNDS[key]} {self._shown(bound)}" for key, bound in self._bounds()]
        words += [f"in steps of {self._shown(self._step)}"] if self._step else []
        if choices := self.choices:
            words.append(f"one of {', '.join(choices)}")
        return ", ".join(words)

    @property
    def choices(self) -> Sequence[str]:
        """Return the words that it may be; none if it is not a choice."""
        hint = self.field.annotation if self.field else None
        if get_origin(hint) is Literal:
            return [str(one) for one in get_args(hint)]
        return [str(one.value) for one in hint] if isinstance(hint, type) and issubclass(hint, Enum) else []

    def _shown(self, bound: float) -> str:
        return format_quantity(bound, self.dimension) if self.dimension else f"{bound:g}"


def told_dimension(description: str) -> Dimension | None:
    """Return the dimension that a description tells by the unit at its end; None if it tells none."""
    _, bracket, unit = description.removesuffix("]").rpartition("[")
    if not bracket or not description.endswith("]"):
        return None
    return RATIO if unit == _RATIO else UNITS[unit].dimension if unit in UNITS else None


def shown(value: object, dimension: Dimension | None, unit: str | None = None) -> str:
    """Return the value of a parameter as a person writes it: in its `unit`, else a usual or rounder one."""
    match value:
        case bool():
            return "true" if value else "false"
        case float() if dimension is not None:
            return format_quantity(value, dimension, rounder_unit(value, dimension, unit))
        case int() | float():
            return format_number(value)
        case tuple():
            return f"[{', '.join(shown(each, dimension, unit) for each in value)}]"
        case None:
            return "-"
    return str(value)


def _si_unit(dimension: Dimension | None) -> str:
    """Return the unit of a parameter's values; ratios go from 0 to 1."""
    if dimension == RATIO:
        return _RATIO
    return next((name for name, unit in UNITS.items() if unit.dimension == dimension and unit.to_si(1.0) == 1.0), "")


def settings(config: Config, bounds: SettingBounds = NO_BOUNDS) -> dict[str, ParameterField]:
    """Return all parameters by name; fields without a plain value, such as a secret, are omitted."""
    found: dict[str, ParameterField] = {}
    fields = dict(leaves(config))
    for name, field in type(config).model_fields.items():
        for one in _settings_of(name, getattr(config, name), field, type(config)):
            is_whole = one.name in fields
            found[one.name] = replace(one, is_whole=is_whole, bounds=bounds.get(one.name, ()) if is_whole else ())
    return found


def _settings_of(
    name: str, value: object, field: FieldInfo | None = None, model: type[Config] | None = None
) -> Iterator[ParameterField]:
    match value:
        case Config():
            for key, inner in type(value).model_fields.items():
                yield from _settings_of(f"{name}{SEPARATOR}{key}", getattr(value, key), inner, type(value))
        case Mapping():
            for key, each in value.items():
                yield from _settings_of(f"{name}{SEPARATOR}{key}", each)
        case _ if parameter_type(value) is not None:
            yield ParameterField(name, value, field, model)


def values_of(known: Mapping[str, ParameterField], names: Iterable[str]) -> tuple[ParameterValue, ...]:
    """Return the values of parameters; one that does not exist is not set."""
    found = (to_message(known[name].value) if name in known else None for name in names)
    return tuple(value or ParameterValue() for value in found)


def listed(known: Iterable[str], prefixes: Sequence[str], depth: int) -> ListParametersResult:
    """Return the names below one of `prefixes` (none: all), at most `depth` words deep (0: any depth)."""

    def is_wanted(name: str, prefix: str) -> bool:
        if prefix and name != prefix and not name.startswith(prefix + SEPARATOR):
            return False
        below = name.removeprefix(prefix).removeprefix(SEPARATOR) if prefix else name
        return not depth or below.count(SEPARATOR) < depth

    names = [name for name in known if any(is_wanted(name, prefix) for prefix in prefixes or ("",))]
    above = dict.fromkeys(name.rpartition(SEPARATOR)[0] for name in names if SEPARATOR in name)
    return ListParametersResult(names=tuple(names), prefixes=tuple(above))


def changed(config: C, parameters: Sequence[Parameter], bounds: SettingBounds = NO_BOUNDS) -> C:
    """Return the configuration with all of `parameters` set.

    Raises:
        UnsettableError: if one of them is unknown, is read-only or refuses the value, or if they do not fit together.
    """
    known = settings(config)
    _require_single(parameters)
    wanted = {one.name: _wanted(known, one) for one in parameters}
    new, fields = _made(config, wanted), dict(leaves(config))
    for name in wanted:
        _require_within(name, value_at(new, name), dimension_of(fields[name]), bounds.get(name, ()))
    same = {name: old for name in wanted if _is_same(old := value_at(config, name), value_at(new, name))}
    return with_values(new, same)


def _made(config: C, wanted: Mapping[str, object], above: str = "") -> C:
    """Return a validated configuration; names and findings of a group of fields begin with what is `above` it."""
    data: dict[str, object] = {}
    for name, field in type(config).model_fields.items():
        value, path = getattr(config, name), f"{above}{name}"
        if isinstance(value, Config):
            is_changed = any(one.startswith(path + SEPARATOR) for one in wanted)
            data[field.alias or name] = _made(value, wanted, path + SEPARATOR) if is_changed else value
        else:
            value = _with_unit(wanted.get(path, value), dimension_of(field))
            data[field.alias or name] = _as_choice(path, value, field)
    try:
        return type(config).model_validate(data, strict=True)
    except ValidationError as error:
        raise UnsettableError(_reason(error.errors(include_url=False)[0], above)) from error


def _is_same(old: object, new: object) -> bool:
    """Return whether a number is what it was, but for the last digits of a conversion: `3 deg`, for example."""
    return isinstance(old, float) and isinstance(new, float) and is_nearly(old, new)


def _require_single(parameters: Sequence[Parameter]) -> None:
    names = Counter(one.name for one in parameters)
    if twice := next((name for name, times in names.items() if times > 1), None):
        raise UnsettableError(f"'{twice}' is set twice")


def _require_within(name: str, value: object, dimension: Dimension | None, bounds: Iterable[Bound]) -> None:
    """Refuse a value beyond a bound that is not one of the field's own."""
    for one in bounds:
        for words, limit, sign in (("at least", one.least, 1), ("at most", one.most, -1)):
            if limit is not None and isinstance(value, int | float) and (value - limit) * sign < 0:
                told = format_quantity(limit, dimension) if dimension else format_number(limit)
                raise UnsettableError(f"'{name}' must be {words} {told}: {one.by} says so")


def _wanted(known: Mapping[str, ParameterField], parameter: Parameter) -> object:
    setting = known.get(parameter.name)
    if setting is None:
        help_text = suggest(parameter.name, known, "parameters")
        raise UnsettableError(f"there is no parameter '{parameter.name}'" + (f"; {help_text}" if help_text else ""))
    if not setting.is_live:
        raise UnsettableError(f"'{parameter.name}' cannot change while the robot runs")
    value = from_message(parameter.value)
    if type(setting.value) is int and isinstance(value, float) and value.is_integer():
        value = int(value)  # a client that has only one kind of numbers
    if value is None:
        raise UnsettableError(f"'{parameter.name}' needs a value")
    if any(
        isinstance(one, float) and not math.isfinite(one) for one in (value if isinstance(value, tuple) else [value])
    ):
        raise UnsettableError(f"'{parameter.name}' must be a finite number")
    return value


def _as_choice(name: str, value: object, field: FieldInfo) -> object:
    """Return a word as the member of an enumeration, which a strict field requires; any other value stays."""
    hint = field.annotation
    if isinstance(value, Enum) or not (isinstance(hint, type) and issubclass(hint, Enum)):
        return value
    if (member := next((one for one in hint if one.value == value), None)) is None:
        raise UnsettableError(f"'{name}' must be one of {', '.join(str(one.value) for one in hint)}")
    return member


def _with_unit(value: object, dimension: Dimension | None) -> object:
    """Return SI numbers as quantities: a bare number would not be accepted for an angle."""
    match value:
        case _ if dimension is None:
            return value
        case bool():
            return value
        case int() | float():
            return Quantity(float(value), dimension)
        case tuple():
            return tuple(_with_unit(each, dimension) for each in value)
        case Mapping():
            return {key: _with_unit(each, dimension) for key, each in value.items()}
    return value


def _reason(error: ErrorDetails, above: str) -> str:
    name = above + SEPARATOR.join(map(str, error["loc"]))
    cause = error.get("ctx", {}).get("error")
    if isinstance(cause, UnitError):
        words = f"{cause.message}; {cause.detail}" if cause.detail else cause.message
    else:
        words = str(cause or error["msg"]).replace("Input should be", "must be")
    return f"'{name.removesuffix(SEPARATOR)}' {words}" if name else words


def differences(old: Config, new: Config) -> tuple[Parameter, ...]:
    """Return the parameters that differ in `new`, with their new values."""
    before = settings(old)
    others = (one for one in settings(new).values() if one.name not in before or before[one.name].value != one.value)
    return tuple(Parameter(name=one.name, value=to_message(one.value) or ParameterValue()) for one in others)


def dimension_of(field: FieldInfo) -> Dimension | None:
    """Return the dimension of a field's values, also within `... | None` and lists; None if they are not quantities."""
    marks = (*field.metadata, *_marks_within(field.annotation))
    return next((mark.dimension for mark in marks if isinstance(mark, Dimensioned)), None)


def _marks_within(hint: Any) -> Iterator[Any]:
    yield from getattr(hint, "__metadata__", ())
    for argument in get_args(hint):
        yield from _marks_within(argument)

"""The fields of a configuration as parameters of ROS 2: types, descriptions, values as messages, changes."""

import math
from base64 import b64decode, b64encode
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from types import MappingProxyType
from typing import Any, Literal, Protocol, Self, TypeVar, get_args, get_origin

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from rbxcompose.base.config import Bound, Config, Dimensioned, field_docs, is_live, leaves, value_at, with_values
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import COUNT, FLAG, TEXT, Type, choice_of, quantity_of
from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.units import NUMBER, RATIO, UNITS, Dimension, Quantity, UnitError, format_number, format_quantity
from rbxcompose.manifest.shapes import is_nearly, rounder_unit
from rbxcompose.msgs import rcl_interfaces
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.rbxcompose_parameters import NodeChange

LOWEST, HIGHEST = -(2**63), 2**63 - 1  # of an integer on the wire

_KIND = rcl_interfaces.ParameterType
# By type: the field with the value, the words for it, and for a single value the type of several.
_TYPES: Mapping[int, tuple[str, str, int]] = {
    _KIND.PARAMETER_BOOL: ("bool_value", "a flag", _KIND.PARAMETER_BOOL_ARRAY),
    _KIND.PARAMETER_INTEGER: ("integer_value", "a whole number", _KIND.PARAMETER_INTEGER_ARRAY),
    _KIND.PARAMETER_DOUBLE: ("double_value", "a number", _KIND.PARAMETER_DOUBLE_ARRAY),
    _KIND.PARAMETER_STRING: ("string_value", "text", _KIND.PARAMETER_STRING_ARRAY),
    _KIND.PARAMETER_BYTE_ARRAY: ("byte_array_value", "bytes", 0),
    _KIND.PARAMETER_BOOL_ARRAY: ("bool_array_value", "flags", 0),
    _KIND.PARAMETER_INTEGER_ARRAY: ("integer_array_value", "whole numbers", 0),
    _KIND.PARAMETER_DOUBLE_ARRAY: ("double_array_value", "numbers", 0),
    _KIND.PARAMETER_STRING_ARRAY: ("string_array_value", "texts", 0),
}
TYPE_WORDS = {number: words for number, (_, words, _) in _TYPES.items()}


def to_message(value: object) -> rcl_interfaces.ParameterValue | None:
    """Return a value as a message, None if no parameter can have its type."""
    number = parameter_type(value)
    return None if number is None else _made(number, value.value if isinstance(value, Enum) else value)


def _made(number: int, value: object) -> rcl_interfaces.ParameterValue:
    fields: dict[str, object] = {_TYPES[number][0]: value} if number in _TYPES else {}
    return rcl_interfaces.ParameterValue(type=number, **fields)  # type: ignore[arg-type]


def parameter_type(value: object) -> int | None:
    """Return the number of the type of a value, None if it is of no type that a parameter has; None is not set."""
    match value:
        case None:
            return _KIND.PARAMETER_NOT_SET
        case bool():
            return _KIND.PARAMETER_BOOL
        case int() if not isinstance(value, Enum):
            return _KIND.PARAMETER_INTEGER if LOWEST <= value <= HIGHEST else None
        case float():
            return _KIND.PARAMETER_DOUBLE
        case str() | Enum(value=str()):
            return _KIND.PARAMETER_STRING
        case tuple() | list():
            return _array_type(value)
    return None


def _array_type(values: Sequence[object]) -> int | None:
    numbers = {parameter_type(each) for each in values}
    if numbers == {_KIND.PARAMETER_INTEGER, _KIND.PARAMETER_DOUBLE}:
        return _KIND.PARAMETER_DOUBLE_ARRAY
    if not numbers:
        return _KIND.PARAMETER_STRING_ARRAY
    number = numbers.pop()
    if numbers or any(isinstance(each, Enum) for each in values):
        return None
    return _TYPES.get(number or 0, ("", "", 0))[2] or None


def from_message(message: rcl_interfaces.ParameterValue) -> object:
    """Return the value in a message, lists as tuples; None if it is not set."""
    if message.type not in _TYPES:
        return None
    field, _, several = _TYPES[message.type]
    value = getattr(message, field)
    return value if several else tuple(value.tolist() if hasattr(value, "tolist") else value)


Configs = Mapping[str, Config]  # by component


@dataclass(frozen=True, slots=True)
class ChangeRefusal:
    """Why a change is not done, and what to do instead.

    `breaks_rule` tells that a rule about the whole robot forbids it, `is_half_done` that a component did not take its
    old values back.
    """

    reason: str
    help: str = ""
    breaks_rule: bool = False
    is_half_done: bool = False

    @property
    def text(self) -> str:
        """Return both in one line."""
        return f"{self.reason}; {self.help}" if self.help else self.reason


@dataclass(frozen=True, slots=True)
class WantedChange:
    """New values of components, all or none, by the names of the components or of their nodes; values are encoded."""

    parts: dict[str, str]
    by: str
    together: str = ""

    @classmethod
    def of(cls, parts: Mapping[str, NodeChange], by: str, together: str = "") -> Self:
        """Return a change that can be sent between processes."""
        return cls({name: b64encode(encode(part)).decode() for name, part in parts.items()}, by, together)

    def part(self, name: str) -> NodeChange:
        """Return what is wanted of a component."""
        return decode(NodeChange, b64decode(self.parts[name]))


class RobotRules(Protocol):
    """The rules about the whole robot, which live settings must keep."""

    def why_not(self, now: Configs, new: Configs) -> ChangeRefusal | None:
        """Return what `new` configurations break that was not broken before, where others have those of `now`."""


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
    def descriptor(self) -> rcl_interfaces.ParameterDescriptor:
        """Return its description and the values that it accepts."""
        numbers, integers = self._ranges()
        return rcl_interfaces.ParameterDescriptor(
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
        return f"{text} [{unit}]".strip() if (unit := si_unit(self.dimension)) else text

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

    def _ranges(self) -> tuple[tuple[rcl_interfaces.FloatingPointRange, ...], tuple[rcl_interfaces.IntegerRange, ...]]:
        """Return the ranges that the wire has; they have no bounds that are not part of them."""
        low = [(bound, key) for key, bound in self._bounds() if key in ("gt", "ge")]
        high = [(bound, key) for key, bound in self._bounds() if key in ("lt", "le")]
        if isinstance(self.value, bool) or not (low or high or self._step):
            return (), ()
        if isinstance(self.value, int):
            lows = (math.floor(bound) + 1 if key == "gt" else math.ceil(bound) for bound, key in low)
            highs = (math.ceil(bound) - 1 if key == "lt" else math.floor(bound) for bound, key in high)
            least, most = max(lows, default=LOWEST), min(highs, default=HIGHEST)
            return (), (rcl_interfaces.IntegerRange(from_value=least, to_value=most, step=int(self._step)),)
        up = (math.nextafter(bound, math.inf) if key == "gt" else bound for bound, key in low)
        down = (math.nextafter(bound, -math.inf) if key == "lt" else bound for bound, key in high)
        lowest, highest = max(up, default=-math.inf), min(down, default=math.inf)
        return (rcl_interfaces.FloatingPointRange(from_value=lowest, to_value=highest, step=float(self._step)),), ()

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
            return [str(argument) for argument in get_args(hint)]
        return [str(item.value) for item in hint] if isinstance(hint, type) and issubclass(hint, Enum) else []

    def _shown(self, bound: float) -> str:
        return format_quantity(bound, self.dimension) if self.dimension else f"{bound:g}"


def dimension_in(description: str) -> Dimension | None:
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


def si_unit(dimension: Dimension | None) -> str:
    """Return the unit of a parameter's values; ratios go from 0 to 1."""
    if dimension == RATIO:
        return _RATIO
    return next((name for name, unit in UNITS.items() if unit.dimension == dimension and unit.to_si(1.0) == 1.0), "")


def settings(config: Config, bounds: SettingBounds = NO_BOUNDS) -> dict[str, ParameterField]:
    """Return all parameters by name; fields without a plain value, such as a secret, are omitted."""
    found: dict[str, ParameterField] = {}
    fields = dict(leaves(config))
    for name, field in type(config).model_fields.items():
        for setting in _settings_of(name, getattr(config, name), field, type(config)):
            is_whole = setting.name in fields
            own = bounds.get(setting.name, ()) if is_whole else ()
            found[setting.name] = replace(setting, is_whole=is_whole, bounds=own)
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


def values_of(known: Mapping[str, ParameterField], names: Iterable[str]) -> tuple[rcl_interfaces.ParameterValue, ...]:
    """Return the values of parameters; one that does not exist is not set."""
    found = (to_message(known[name].value) if name in known else None for name in names)
    return tuple(value or rcl_interfaces.ParameterValue() for value in found)


def listed(known: Iterable[str], prefixes: Sequence[str], depth: int) -> rcl_interfaces.ListParametersResult:
    """Return the names below one of `prefixes` (none: all), at most `depth` words deep (0: any depth)."""

    def is_wanted(name: str, prefix: str) -> bool:
        if prefix and name != prefix and not name.startswith(prefix + SEPARATOR):
            return False
        below = name.removeprefix(prefix).removeprefix(SEPARATOR) if prefix else name
        return not depth or below.count(SEPARATOR) < depth

    names = [name for name in known if any(is_wanted(name, prefix) for prefix in prefixes or ("",))]
    above = dict.fromkeys(name.rpartition(SEPARATOR)[0] for name in names if SEPARATOR in name)
    return rcl_interfaces.ListParametersResult(names=tuple(names), prefixes=tuple(above))


def changed(config: C, parameters: Sequence[rcl_interfaces.Parameter], bounds: SettingBounds = NO_BOUNDS) -> C:
    """Return the configuration with all of `parameters` set.

    Raises:
        UnsettableError: if one of them is unknown, is read-only or refuses the value, or if they do not fit together.
    """
    known = settings(config)
    _require_single(parameters)
    wanted = {parameter.name: _wanted(known, parameter) for parameter in parameters}
    new, fields = _core_made(config, wanted), dict(leaves(config))
    for name in wanted:
        _require_within(name, value_at(new, name), dimension_of(fields[name]), bounds.get(name, ()))
    same = {name: old for name in wanted if _is_same(old := value_at(config, name), value_at(new, name))}
    return with_values(new, same)


def _core_made(config: C, wanted: Mapping[str, object], above: str = "") -> C:
    """Return a validated configuration; names and findings of a group of fields begin with what is `above` it."""
    data: dict[str, object] = {}
    for name, field in type(config).model_fields.items():
        value, path = getattr(config, name), f"{above}{name}"
        if isinstance(value, Config):
            is_changed = any(one.startswith(path + SEPARATOR) for one in wanted)
            data[field.alias or name] = _core_made(value, wanted, path + SEPARATOR) if is_changed else value
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


def _require_single(parameters: Sequence[rcl_interfaces.Parameter]) -> None:
    names = Counter(parameter.name for parameter in parameters)
    if twice := next((name for name, times in names.items() if times > 1), None):
        raise UnsettableError(f"'{twice}' is set twice")


def _require_within(name: str, value: object, dimension: Dimension | None, bounds: Iterable[Bound]) -> None:
    """Refuse a value beyond a bound that is not one of the field's own."""
    for bound in bounds:
        for words, limit, sign in (("at least", bound.least, 1), ("at most", bound.most, -1)):
            if limit is not None and isinstance(value, int | float) and (value - limit) * sign < 0:
                limit_text = format_quantity(limit, dimension) if dimension else format_number(limit)
                raise UnsettableError(f"'{name}' must be {words} {limit_text}: {bound.by} says so")


def _wanted(known: Mapping[str, ParameterField], parameter: rcl_interfaces.Parameter) -> object:
    setting = known.get(parameter.name)
    if setting is None:
        help_text = suggest(parameter.name, known, "parameters")
        raise UnsettableError(clauses(f"there is no parameter '{parameter.name}'", help_text))
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
    if (member := next((item for item in hint if item.value == value), None)) is None:
        raise UnsettableError(f"'{name}' must be one of {', '.join(str(item.value) for item in hint)}")
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


def differences(old: Config, new: Config) -> tuple[rcl_interfaces.Parameter, ...]:
    """Return the parameters that differ in `new`, with their new values."""
    before = settings(old)
    others = (one for one in settings(new).values() if one.name not in before or before[one.name].value != one.value)
    return tuple(
        rcl_interfaces.Parameter(name=other.name, value=to_message(other.value) or rcl_interfaces.ParameterValue())
        for other in others
    )


def dimension_of(field: FieldInfo) -> Dimension | None:
    """Return the dimension of a field's values, also within `... | None` and lists; None if they are not quantities."""
    marks = (*field.metadata, *_marks_within(field.annotation))
    return next((mark.dimension for mark in marks if isinstance(mark, Dimensioned)), None)


def _marks_within(hint: Any) -> Iterator[Any]:
    yield from getattr(hint, "__metadata__", ())
    for argument in get_args(hint):
        yield from _marks_within(argument)


def live_types(config: Config) -> dict[str, Type]:
    """Return the settings of a configuration that may change while the robot runs and have one value, by name."""
    found = ((name, _type_of(setting)) for name, setting in settings(config).items() if setting.is_live)
    return {name: type_ for name, type_ in found if type_ is not None}


def _type_of(field: ParameterField) -> Type | None:
    if choices := field.choices:
        return choice_of(*choices)
    match field.value:
        case bool():
            return FLAG
        case int():
            return COUNT
        case float():
            return quantity_of(field.dimension or NUMBER)
        case str():
            return TEXT
    return None

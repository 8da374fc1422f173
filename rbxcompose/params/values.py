"""The value of a parameter as a message, and back."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from rbxcompose.msgs.rcl_interfaces import ParameterType, ParameterValue

LOWEST, HIGHEST = -(2**63), 2**63 - 1  # of an integer on the wire

_SINGLE = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
}
_ARRAYS = {
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array_value",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array_value",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array_value",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array_value",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array_value",
}


TYPE_WORDS = {
    ParameterType.PARAMETER_BOOL: "a flag",
    ParameterType.PARAMETER_INTEGER: "a whole number",
    ParameterType.PARAMETER_DOUBLE: "a number",
    ParameterType.PARAMETER_STRING: "text",
    ParameterType.PARAMETER_BYTE_ARRAY: "bytes",
    ParameterType.PARAMETER_BOOL_ARRAY: "flags",
    ParameterType.PARAMETER_INTEGER_ARRAY: "whole numbers",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "numbers",
    ParameterType.PARAMETER_STRING_ARRAY: "texts",
}


def to_message(value: object) -> ParameterValue | None:
    """Return a value as a message, None if no parameter can have its type."""
    number = parameter_type(value)
    if number is None:
        return None
    return _made(number, value.value if isinstance(value, Enum) else value)


def _made(number: int, value: object) -> ParameterValue:
    name = {**_SINGLE, **_ARRAYS}.get(number)
    fields: dict[str, object] = {name: value} if name else {}
    return ParameterValue(type=number, **fields)  # type: ignore[arg-type]


def parameter_type(value: object) -> int | None:
    """Return the number of the type of a value, None if it is of no type that a parameter has; None is not set."""
    match value:
        case None:
            return ParameterType.PARAMETER_NOT_SET
        case bool():
            return ParameterType.PARAMETER_BOOL
        case int() if not isinstance(value, Enum):
            return ParameterType.PARAMETER_INTEGER if LOWEST <= value <= HIGHEST else None
        case float():
            return ParameterType.PARAMETER_DOUBLE
        case str() | Enum(value=str()):
            return ParameterType.PARAMETER_STRING
        case tuple() | list():
            return _array_type(value)
    return None


def _array_type(values: Sequence[object]) -> int | None:
    numbers = {parameter_type(each) for each in values}
    if numbers == {ParameterType.PARAMETER_INTEGER, ParameterType.PARAMETER_DOUBLE}:
        return ParameterType.PARAMETER_DOUBLE_ARRAY
    if not numbers:
        return ParameterType.PARAMETER_STRING_ARRAY
    number = numbers.pop()
    if numbers or any(isinstance(each, Enum) for each in values):
        return None
    return {
        ParameterType.PARAMETER_BOOL: ParameterType.PARAMETER_BOOL_ARRAY,
        ParameterType.PARAMETER_INTEGER: ParameterType.PARAMETER_INTEGER_ARRAY,
        ParameterType.PARAMETER_DOUBLE: ParameterType.PARAMETER_DOUBLE_ARRAY,
        ParameterType.PARAMETER_STRING: ParameterType.PARAMETER_STRING_ARRAY,
    }.get(number or 0)


def from_message(message: ParameterValue) -> object:
    """Return the value in a message, lists as tuples; None if it is not set."""
    if name := _SINGLE.get(message.type):
        return getattr(message, name)
    if name := _ARRAYS.get(message.type):
        values = getattr(message, name)
        return tuple(values.tolist() if hasattr(values, "tolist") else values)
    return None

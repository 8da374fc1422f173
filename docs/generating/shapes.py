"""What a key takes, in words: read from the annotations of the models."""

from __future__ import annotations

from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic.fields import FieldInfo

from docs.generating.markdown import code, table
from rbxcompose.base.config import (
    ANYTHING,
    FILE,
    PORT,
    TOPIC,
    Config,
    Dimensioned,
    Name,
    Refers,
    Restart,
    Secret,
    field_docs,
)
from rbxcompose.base.units import Dimension, format_number, format_quantity
from rbxcompose.manifest.fields import DottedName, InterfaceName
from rbxcompose.manifest.registry import naming
from rbxcompose.manifest.section import RestartModel
from rbxcompose.manifest.shapes import rounder_unit

_NAMED: tuple[tuple[object, str], ...] = (
    (Name, "name"),
    (InterfaceName, "message type"),
    (DottedName, "`field` or `field.field`"),
    (RestartModel, "word, or a map"),
    (Secret, "secret"),
    (str, "text"),
    (bool, "`true` or `false`"),
    (int, "whole number"),
    (float, "number"),
    (Any, "any value"),
)
_KINDS = {TOPIC: "topic", PORT: "`component` or `component.port`", FILE: "file", ANYTHING: "any value"}
_LIMITS: tuple[tuple[type, str, str], ...] = (
    (Gt, "gt", "above"),
    (Ge, "ge", "at least"),
    (Lt, "lt", "below"),
    (Le, "le", "at most"),
)


def keys_table(model: type[Config]) -> str:
    """Return a table of the keys of a model."""
    hints = get_type_hints(model, include_extras=True)
    about = field_docs(model)
    rows = [
        _row(field.alias or name, field, hints[name], about.get(name, "")) for name, field in model.model_fields.items()
    ]
    return table(("key", "takes", "default", "what it is"), rows)


def with_default(model: type[Config]) -> list[str]:
    """Return the keys of a model, each with its default in brackets if it has one."""
    hints = get_type_hints(model, include_extras=True)
    fields = (
        (field.alias or name, default_of(field, dimension_of(hints[name])))
        for name, field in model.model_fields.items()
    )
    return [f"{code(key)} ({default})" if default else code(key) for key, default in fields]


def _row(key: str, field: FieldInfo, hint: object, about: str) -> tuple[str, str, str, str]:
    takes = ", ".join([takes_of(hint), *limits(field, dimension_of(hint))])
    return code(key), takes, default_of(field, dimension_of(hint)), about


def takes_of(hint: object) -> str:
    """Return what a key with this annotation takes."""
    if get_origin(hint) is Annotated and (
        marks := [argument for argument in get_args(hint) if isinstance(argument, Refers)]
    ):
        base, *others = [argument for argument in get_args(hint) if argument not in marks]
        return _referring(marks[0].kind) or takes_of(Annotated[(base, *others)] if others else base)
    for known, words in _NAMED:
        if hint == known:
            return words
    origin = get_origin(hint)
    if origin is not Union and origin is not UnionType and (dimension := _own_dimension(hint)):
        return dimension.name.replace("_", " ")
    if origin is Annotated:
        return takes_of(get_args(hint)[0])
    inner = [
        takes_of(argument)
        for argument in get_args(hint)
        if not isinstance(argument, str) and argument not in (type(None), ...)
    ]
    if origin in (Union, UnionType):
        return " or ".join(inner)
    if origin is Literal:
        return " or ".join(code(str(word)) for word in get_args(hint))
    if origin in (tuple, list):
        return f"list of {plural(inner[0])}"
    if origin is dict:
        return f"map from {plural(inner[0])} to {plural(inner[1])}"
    return "map" if isinstance(hint, type) and issubclass(hint, Config) else "made by the compiler"


def _referring(kind: str) -> str:
    """Return what a key takes that refers to something of a kind; empty if its type tells more."""
    return _KINDS.get(kind) or (f"name of a{'n' if kind[0] in 'aeiou' else ''} {kind}" if any(naming(kind)) else "")


def plural(words: str) -> str:
    """Return words for several of what the words are for one: 'names', 'any values', 'maps'."""
    if " or " in words and "`" not in words:
        return " or ".join(map(plural, words.split(" or ")))
    head, space, rest = words.partition(" of ")
    return words if head.endswith("`") else f"{head}s{space}{rest}"


def _own_dimension(hint: object) -> Dimension | None:
    """Return what a quantity measures; None for a choice of several types, of which one may be a quantity."""
    is_choice = any(get_origin(argument) in (Union, UnionType) for argument in get_args(hint)[:1])
    return None if is_choice else dimension_of(hint)


def dimension_of(hint: object) -> Dimension | None:
    """Return what a quantity of this annotation measures, None for other things."""
    inner = get_args(hint)
    marks = (argument.dimension for argument in inner if isinstance(argument, Dimensioned))
    return next(marks, None) or next((found for argument in inner if (found := dimension_of(argument))), None)


def limits(field: FieldInfo, dimension: Dimension | None) -> list[str]:
    """Return the limits of a field: 'above 0 m', 'at least one'."""
    found = []
    for limit in field.metadata:
        for kind, key, words in _LIMITS:
            if isinstance(limit, kind):
                found.append(f"{words} {_shown(getattr(limit, key), dimension)}")
        if isinstance(limit, MinLen):
            found.append("at least one")
    return found


def default_of(field: FieldInfo, dimension: Dimension | None) -> str:
    """Return the default of a field; '*required*' for one without."""
    if field.is_required():
        return "*required*"
    value = field.get_default(call_default_factory=True)
    value = value.when if isinstance(value, Restart) else value  # the word that stands for it
    if isinstance(value, Config):
        return ""  # its keys have theirs
    return code(_shown(value, dimension)) if value not in (None, {}, (), [], "") else ""


def _shown(value: object, dimension: Dimension | None) -> str:
    if dimension and isinstance(value, int | float):
        return format_quantity(value, dimension, rounder_unit(value, dimension))
    return format_number(value) if isinstance(value, int | float) and not isinstance(value, bool) else str(value)

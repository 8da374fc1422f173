"""What a model accepts at a place below it: keys, quantities, names of something; and values as people write them."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel

from rbxcompose.base.config import Dimensioned, Refers
from rbxcompose.base.units import (
    UNITS,
    Dimension,
    Unit,
    UnitError,
    format_number,
    format_quantity,
    to_si,
    units_of,
    written_unit,
)
from rbxcompose.manifest.tree import Entry, KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode


@cache
def field_types(model: type[BaseModel]) -> dict[str, Any]:
    """Return the types of a model's fields by key, with their annotations."""
    return {
        field.alias or name: Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
        for name, field in model.model_fields.items()
    }


def keys_at(model: Any, path: KeyPath) -> list[str]:
    """Return the keys of the map at `path` below `model` as declared; none if the model does not name them."""
    shapes = (shape for type_ in _types_at(model, path) for shape in _models(type_))
    return list(dict.fromkeys(name for shape in shapes for name in field_types(shape)))


def models_at(model: Any, path: KeyPath) -> list[type[BaseModel]]:
    """Return the models that the map at `path` below `model` may have."""
    return [shape for type_ in _types_at(model, path) for shape in _models(type_)]


def dimension_at(model: Any, path: KeyPath) -> Dimension | None:
    """Return the dimension of the quantity at `path` below `model`, None if it is not a quantity."""
    marks = (mark for type_ in _types_at(model, path) for mark in alternatives(type_))
    return next((mark.dimension for mark in marks if isinstance(mark, Dimensioned)), None)


def refers_below(hint: Any, path: KeyPath) -> bool | None:
    """Return whether what stands at `path` below a type names something, itself or deeper; None if nothing may."""
    found = _types_at(hint, path)
    return any(_refers(type_) for type_ in found) if found else None


def _refers(hint: Any) -> bool:
    if isinstance(hint, Refers):
        return True
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return any(map(_refers, field_types(hint).values()))
    return any(map(_refers, get_args(hint)))


def kinds_of(hint: Any) -> Iterator[str]:
    """Yield the kinds of things that a value of this type names itself, not through the items of a list or map."""
    return (alternative.kind for alternative in alternatives(hint) if isinstance(alternative, Refers))


def kind_of_keys(model: Any, path: KeyPath) -> str:
    """Return the kind of things that the keys of the map at `path` below `model` name, or nothing."""
    maps = (shape for type_ in _types_at(model, path) for shape in alternatives(type_) if get_origin(shape) is dict)
    return next((kind for map_ in maps for kind in kinds_of(get_args(map_)[0])), "")


def below(hint: Any, key: str | int) -> Iterator[Any]:
    """Yield the types possible below a key or index of a value of this type."""
    for alternative in alternatives(hint):
        if isinstance(alternative, type) and issubclass(alternative, BaseModel):
            if key in field_types(alternative):
                yield field_types(alternative)[str(key)]
        elif get_origin(alternative) is dict:
            yield get_args(alternative)[1]
        elif get_origin(alternative) in (list, tuple):
            yield get_args(alternative)[0]


def with_references(node: TreeNode, hint: Any, change: Callable[[str, TreeNode], TreeNode]) -> TreeNode:
    """Return a node with `change(kind, value)` in place of each value that, by its type, is a name of a kind."""
    for kind in kinds_of(hint):
        node = change(kind, node)
    match node:
        case MappingNode(entries=entries):
            changed = [
                Entry(_changed_key(entry.key, hint, change), _changed_below(entry.value, hint, name, change))
                for name, entry in entries.items()
            ]
            return replace(node, entries={entry.key.text: entry for entry in changed})
        case SequenceNode(items=items):
            return replace(node, items=tuple(_changed_below(item, hint, i, change) for i, item in enumerate(items)))
    return node


def _changed_key(key: ScalarNode, hint: Any, change: Callable[[str, TreeNode], TreeNode]) -> ScalarNode:
    """Return the key of a map with `change` applied, if keys of this map are names of a kind."""
    kinds = {kind for one in alternatives(hint) if get_origin(one) is dict for kind in kinds_of(get_args(one)[0])}
    for kind in kinds:
        changed = change(kind, key)
        key = changed if isinstance(changed, ScalarNode) else key
    return key


def _changed_below(node: TreeNode, hint: Any, key: str | int, change: Callable[[str, TreeNode], TreeNode]) -> TreeNode:
    for inner in below(hint, key):
        node = with_references(node, inner, change)
    return node


def alternatives(hint: Any) -> Iterator[Any]:
    """Yield the models, maps, lists, plain types and marks that a type is made of, without looking into them."""
    if not get_args(hint) or get_origin(hint) in (dict, list, tuple):
        yield hint
        return
    inner, marks = get_args(hint), ()
    if get_origin(hint) is Annotated:
        inner, marks = inner[:1], inner[1:]
    yield from marks
    for one in inner:
        yield from alternatives(one)


def _models(hint: Any) -> Iterator[type[BaseModel]]:
    return (one for one in alternatives(hint) if isinstance(one, type) and issubclass(one, BaseModel))


def _types_at(model: Any, path: KeyPath) -> list[Any]:
    found = [model]
    for key in path:
        found = [inner for item in found for inner in below(item, key)]
    return found


_LAST_DIGITS = 1e-12  # of a number, which a conversion between units may lose


def is_nearly(value: float, other: float) -> bool:
    """Return whether two numbers are the same but for their last digits."""
    return math.isclose(value, other, rel_tol=_LAST_DIGITS)


def rounder_unit(value: float, dimension: Dimension, wanted: str | None = None) -> str | None:
    """Return the unit for a value: the wanted or usual one, unless only another needs no more than six digits.

    So 3 rad/s^2 is not 171.887 deg/s^2. None if the dimension has no units.
    """
    units = units_of(dimension)
    usual = written_unit(format_quantity(value, dimension))
    if usual is None:
        return None
    first = wanted if wanted in units else usual

    def is_round(unit: Unit) -> bool:
        return is_nearly(unit.to_si(float(format_number(unit.from_si(value)))), value)

    return next((name for name in dict.fromkeys((first, usual, *units)) if is_round(UNITS[name])), first)


def exact(value: float, dimension: Dimension) -> str:
    """Return a quantity in its usual or rounder unit, with as many digits as its value needs."""
    first = rounder_unit(value, dimension)
    units = [unit for unit in UNITS.values() if unit.dimension == dimension]
    units.sort(key=lambda unit: (unit.name != first, unit.name))
    texts = [f"{digits} {unit.name}" for unit in units for digits in _digits(unit.from_si(value))] or [repr(value)]
    found = next((text for text in texts if _read(text, dimension) == value), None)
    # Some ratios have no text in percent that is exact to the last bit; a product is.
    return found or f"${{{value!r} * {format_quantity(1.0, dimension)}}}"


def _digits(number: float) -> Iterator[str]:
    """Yield ways to write a number, the shortest first."""
    yield f"{number:.6g}"
    yield f"{number:.15g}"
    for near in (number, math.nextafter(number, math.inf), math.nextafter(number, -math.inf)):
        yield repr(near)


def _read(text: str, dimension: Dimension) -> float:
    try:
        return to_si(text, dimension)
    except UnitError:
        return math.inf


def as_written(config: BaseModel) -> dict[str, Any]:
    """Return the fields of a configuration that are set, by key, quantities as texts."""
    fields = zip(type(config).model_fields, field_types(type(config)).items(), strict=True)
    found = {key: _written(getattr(config, name), hint) for name, (key, hint) in fields}
    return {name: value for name, value in found.items() if value is not None}


def _written(value: Any, hint: Any) -> Any:
    match value:
        case BaseModel():
            return as_written(value)
        case Mapping():
            return {key: _item(entry, hint, key) for key, entry in value.items()}
        case list() | tuple():
            return [_item(one, hint, index) for index, one in enumerate(value)]
        case int() | float() if not isinstance(value, bool):
            marks = (mark.dimension for mark in alternatives(hint) if isinstance(mark, Dimensioned))
            return next((_quantity(value, dimension) for dimension in marks), value)
    return value


def _item(value: Any, hint: Any, key: str | int) -> Any:
    return next((_written(value, inner) for inner in below(hint, key)), value)


def _quantity(value: float, dimension: Dimension) -> str:
    unit = _unit_of(dimension)
    return f"{unit.from_si(value)!r} {unit.name}"


def _unit_of(dimension: Dimension) -> Unit:
    """Return the unit in which the number is nearest to that in SI."""
    return min(
        (unit for unit in UNITS.values() if unit.dimension == dimension), key=lambda one: abs(one.times / one.per - 1)
    )

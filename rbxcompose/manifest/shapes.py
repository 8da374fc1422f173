"""What a model accepts at a place below it: keys, quantities, names of something."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel

from rbxcompose.base.config import Dimensioned, Refers
from rbxcompose.base.units import Dimension
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
    kinds = {
        kind
        for alternative in alternatives(hint)
        if get_origin(alternative) is dict
        for kind in kinds_of(get_args(alternative)[0])
    }
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
    return (
        alternative
        for alternative in alternatives(hint)
        if isinstance(alternative, type) and issubclass(alternative, BaseModel)
    )


def _types_at(model: Any, path: KeyPath) -> list[Any]:
    found = [model]
    for key in path:
        found = [inner for item in found for inner in below(item, key)]
    return found

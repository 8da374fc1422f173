"""What a model takes at a place below it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from rbxcompose.config import Dimensioned
from rbxcompose.manifest.tree import Path
from rbxcompose.units import Dimension


def keys_at(model: Any, path: Path) -> list[str]:
    """Return the keys of the map at `path` below `model`; none if the model does not name them."""
    return sorted({name for shape in _shapes_at(model, path) for name in _fields(shape)})


def dimension_at(model: Any, path: Path) -> Dimension | None:
    """Return what the quantity at `path` below `model` measures, None if it is no quantity."""
    if not path:
        return None
    for shape in _shapes_at(model, path[:-1]):
        if isinstance(shape, type) and issubclass(shape, BaseModel):
            for name, field in shape.model_fields.items():
                if (field.alias or name) == path[-1]:
                    return next((mark.dimension for mark in field.metadata if isinstance(mark, Dimensioned)), None)
    return None


def _shapes_at(model: Any, path: Path) -> list[Any]:
    shapes = list(_models(model))
    for key in path:
        shapes = [inner for shape in shapes for inner in _below(shape, str(key))]
    return shapes


def _models(annotation: Any) -> Iterator[Any]:
    """Yield the models, maps and lists that an annotation allows; `X | None` and `Annotated[X, ...]` are X."""
    is_model = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    if is_model or get_origin(annotation) in (dict, list, tuple):
        yield annotation
    else:
        for argument in get_args(annotation):
            yield from _models(argument)


def _below(shape: Any, key: str) -> Iterator[Any]:
    if isinstance(shape, type) and issubclass(shape, BaseModel):
        for name, field in shape.model_fields.items():
            if (field.alias or name) == key:
                yield from _models(field.annotation)
    else:
        yield from _models(get_args(shape)[-1] if get_origin(shape) is dict else get_args(shape)[0])


def _fields(shape: Any) -> Iterator[str]:
    if isinstance(shape, type) and issubclass(shape, BaseModel):
        for name, field in shape.model_fields.items():
            yield field.alias or name

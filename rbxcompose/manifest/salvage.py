"""As much of a value with mistakes as could be read, so that the rest of the robot can be checked with it."""

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any, TypeVar, cast

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from rbxcompose.base.config import Place
from rbxcompose.base.units import Quantity
from rbxcompose.manifest.shapes import dimension_at
from rbxcompose.manifest.tree import KeyPath, TreeNode
from rbxcompose.manifest.validate import changed, repaired, to_plain, validator

T = TypeVar("T")
_ROUNDS = 60  # of repairs; each replaces, at every place that is refused, one value by the next stand-in
_ABSENT = object()
_NOWHERE = Place("nowhere", 0.0, 0.0, 0.0)
_STAND_INS: tuple[object, ...] = (1, 1.0, "unknown", False, {}, [], _NOWHERE)


def salvaged(model: type[T], node: TreeNode, context: Mapping[str, object] | None = None) -> T | None:
    """Return a node with mistakes as an instance of `model`, None if too little of it can be read.

    What is unknown or wrong is left out, so that it has its default; what must be there gets a stand-in, some value
    that the model accepts. Nothing is reported: that was done by `validate`. Nobody may conclude anything from a
    value that is in doubt; see `rbxcompose/compiler/doubts.py`.
    """
    data, tried = to_plain(node), Counter[KeyPath]()
    for _ in range(_ROUNDS):
        try:
            return cast(T, validator(cast(Any, model)).validate_python(data, strict=True, context=context))
        except ValidationError as error:
            errors = error.errors(include_url=False)
        for details in errors:
            before = data
            data = repaired(data, details, node)
            if data is before:
                data = _mended(model, data, details, tried)
        if not isinstance(data, dict):
            return None
    return None


def _mended(model: Any, data: object, error: ErrorDetails, tried: Counter[KeyPath]) -> object:
    """Return the data without the refused value, or with the next stand-in for it; without what holds it, if none fits.

    An item of a list is replaced at once, because the places of those after it must not change.
    """
    path = _place(data, error)
    if not path:
        return _ABSENT
    if error["type"] == "extra_forbidden" or error["loc"][-1:] == ("[key]",):
        return _without(data, path)
    is_first = path not in tried
    tried[path] += 0
    if is_first and error["type"] != "missing" and not isinstance(path[-1], int):
        return _without(data, path)
    number, stand_ins = tried[path], _stand_ins(model, path, error)
    tried[path] += 1
    if number < len(stand_ins):
        return _with(data, path, stand_ins[number])
    return _ABSENT if len(path) == 1 else _without(data, path[:-1])


def _stand_ins(model: Any, path: KeyPath, error: ErrorDetails) -> list[object]:
    dimension = dimension_at(model, path)
    words = re.findall(r"'([^']*)'", str(error.get("ctx", {}).get("expected", "")))
    measured = [Quantity(1.0, dimension)] if dimension else []
    return [*measured, *words[:1], *_STAND_INS]


def _place(data: object, error: ErrorDetails) -> KeyPath:
    """Return the place of an error in the data, without pydantic's own steps, such as members of a union."""
    found: KeyPath = ()
    for step in error["loc"]:
        below = _below(data, step)
        if below is not _ABSENT:
            found, data = (*found, step), below
    return (*found, error["loc"][-1]) if error["type"] == "missing" else found


def _below(data: object, key: str | int) -> object:
    match data:
        case dict():
            return data.get(key, _ABSENT)
        case list() | tuple() if isinstance(key, int) and key < len(data):
            return data[key]
    return _ABSENT


def _without(data: object, path: KeyPath) -> object:
    *above, last = path
    if isinstance(last, int):
        return _ABSENT if not above else _without(data, tuple(above))
    return changed(data, tuple(above), lambda around: _left(around, last))


def _left(around: object, key: str) -> object:
    return {name: value for name, value in around.items() if name != key} if isinstance(around, dict) else around


def _with(data: object, path: KeyPath, value: object) -> object:
    *above, last = path
    if isinstance(last, int):
        return changed(data, path, lambda _: value)
    return changed(data, tuple(above), lambda around: {**around, last: value} if isinstance(around, dict) else around)

"""Arrays that compiled functions borrow; importing it imports numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

from numba import types
from numba.extending import intrinsic

T = TypeVar("T")
Numba = Any  # its types and code


class _Borrow(Protocol):
    def __call__(self, one: T, /) -> T:
        """Return an array, or a tuple of arrays and tuples, whose references are not counted: its owner outlives it."""
        ...


def _typed(_: Numba, one: Numba) -> tuple[Numba, Callable[..., Numba]]:
    def code(context: Numba, builder: Numba, signature: Numba, given: Numba) -> Numba:
        return _without_owner(context, builder, signature.args[0], given[0])

    return one(one), code


def _without_owner(context: Numba, builder: Numba, type_: Numba, value: Numba) -> Numba:
    if isinstance(type_, types.BaseTuple):
        for index, each in enumerate(type_.types):  # type: ignore[attr-defined]
            part = _without_owner(context, builder, each, builder.extract_value(value, index))
            value = builder.insert_value(value, part, index)
        return value
    array = context.make_array(type_)(context, builder, value)
    array.meminfo = array.meminfo.type(None)
    array.parent = array.parent.type(None)
    return array._getvalue()


borrowed = cast(_Borrow, intrinsic(_typed))
"""For compiled functions alone."""

"""What numba makes of `borrowed`; importing it imports numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types
from numba.extending import lower_builtin, type_callable

from rbxcompose.domains.arms.motion.numba_cache import borrowed

Numba = Any  # its types and code


@type_callable(borrowed)
def _typed(_: Numba) -> Callable[[Numba], Numba]:
    return lambda value: value


@lower_builtin(borrowed, types.Any)  # type: ignore[no-untyped-call, untyped-decorator]
def _code(context: Numba, builder: Numba, signature: Numba, given: Numba) -> Numba:
    return _without_owner(context, builder, signature.args[0], given[0])


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

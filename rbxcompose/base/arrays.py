"""numpy, imported when it is first used, and the types of arrays.

Its import takes four times as long as Python's start, and a command that only checks a robot needs no array.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    AnyArray = NDArray[Any]
    Array = NDArray[np.float64]
    Singles = NDArray[np.float32]
    Ints = NDArray[np.int64]
    Ints32 = NDArray[np.int32]
    Ints8 = NDArray[np.int8]
    Words = NDArray[np.uint64]
    Bytes = NDArray[np.uint8]
    Bools = NDArray[np.bool_]
    Indices = NDArray[np.intp]
else:

    class _Numpy(ModuleType):
        def __getattr__(self, name: str) -> Any:
            if name.startswith("__"):  # which Python asks any module for
                raise AttributeError(name)
            value = getattr(import_module("numpy"), name)
            setattr(self, name, value)
            return value

    np = _Numpy("numpy")
    AnyArray = Array = Singles = Ints = Ints32 = Ints8 = Words = Bytes = Bools = Indices = ArrayLike = Any

__all__ = [
    "AnyArray", "Array", "ArrayLike", "Bools", "Bytes", "Indices", "Ints", "Ints8", "Ints32", "Singles", "Words", "np"
]  # fmt: skip

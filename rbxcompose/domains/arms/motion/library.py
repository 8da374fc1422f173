"""Compiled functions in shared libraries: how they are called without the compiler that has made them.

A function takes one block of 8 bytes for each number. An array is what numba makes of it: two owners, which are not
there, the number of its entries, the size of one [B], its address, its shape and its strides [B].
"""

from __future__ import annotations

import ctypes
from functools import cache, lru_cache
from pathlib import Path
from struct import Struct, pack
from typing import Any

from rbxcompose.base.arrays import np

LIBRARY = ".so"
ENTRY, KINDS = "entry", "kinds"  # what a library exports: the function, and the types that it takes
FAILED = -(1 << 63)  # instead of an answer: there was no memory
WHOLE, REAL, OTHER = "i", "f", "?"
"""Kinds of values; of an array, they are its type and dimensions."""
_DATA = object.__basicsize__  # where an array has its address, as numpy's C API declares it
_PACKERS = [Struct(f"{5 + 2 * dimensions}q").pack for dimensions in range(4)]
MOST_TUPLES = 8  # whose blocks are kept: a model and its workspace are passed again and again


class Library:
    """One compiled function, which returns a whole number."""

    def __init__(self, path: Path) -> None:
        ctypes.CDLL("libm.so.6", mode=ctypes.RTLD_GLOBAL)  # which compiled code calls
        library = ctypes.CDLL(str(path))
        self._entry = library[ENTRY]
        self._entry.argtypes, self._entry.restype = (ctypes.c_char_p,), ctypes.c_int64
        self.kinds = ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(library, KINDS))).decode()

    def call(self, block: bytes) -> int:
        """Call it with its arguments, whose kinds must be those of the library.

        Raises:
            MemoryError: if it has needed more memory than there is.
        """
        found: int = self._entry(block)
        if found == FAILED:
            raise MemoryError
        return found


class _Held:
    """A tuple that is only equal to itself, and lives as long as this does."""

    def __init__(self, value: tuple[Any, ...]) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Held) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)


def flat(value: Any) -> tuple[str, bytes]:
    """Return the kinds of the numbers that a value consists of, and these as a block."""
    if isinstance(value, tuple):
        return _flat_tuple(_Held(value))
    if isinstance(value, np.ndarray):
        if not (value.flags.c_contiguous and value.flags.aligned) or value.ndim >= len(_PACKERS):
            return OTHER, b""
        address = ctypes.c_int64.from_address(id(value) + _DATA).value  # `value.ctypes.data` takes four times as long
        numbers = (0, 0, value.size, value.itemsize, address, *value.shape, *value.strides)
        return array_kind(value.dtype, value.ndim), _PACKERS[value.ndim](*numbers)
    if isinstance(value, float):
        return REAL, pack("d", value)
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return WHOLE, pack("q", value)
    return OTHER, b""


@lru_cache(MOST_TUPLES)
def _flat_tuple(held: _Held) -> tuple[str, bytes]:
    parts = [flat(part) for part in held.value]
    return "".join(kinds for kinds, _ in parts), b"".join(block for _, block in parts)


@cache
def array_kind(dtype: np.dtype[Any], dimensions: int) -> str:
    """Return the kind of an array whose entries follow each other."""
    return f"{dtype.str}{dimensions}"

"""What lasts for one compile: results that cannot change meanwhile, and the work that may be spent on guesses.

Outside a compile nothing is remembered, and nothing is limited.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field
from functools import wraps
from typing import ParamSpec, TypeVar, cast

from rbxcompose.dataclass import dataclass

P = ParamSpec("P")
T = TypeVar("T")

GUESSES = 4_000_000  # units of work, each about 0.1 us


@dataclass(slots=True)
class _Memory:
    """What one compile has found out, by function and arguments, and what it may still spend on guesses."""

    known: dict[tuple[object, ...], object] = field(default_factory=dict)
    left: int = GUESSES


_MEMORY: ContextVar[_Memory | None] = ContextVar("memory", default=None)


@contextmanager
def one_compile() -> Iterator[None]:
    """Remember and limit what is done in this block."""
    token = _MEMORY.set(_Memory())
    try:
        yield
    finally:
        _MEMORY.reset(token)


def once(function: Callable[P, T]) -> Callable[P, T]:
    """Call a function only once per compile for the same positional arguments, which must be hashable."""

    @wraps(function)
    def remembered(*args: P.args, **kwargs: P.kwargs) -> T:
        memory, key = _MEMORY.get(), (function, *args)
        if memory is None or kwargs:
            return function(*args, **kwargs)
        if key not in memory.known:
            memory.known[key] = function(*args)  # type: ignore[call-arg]
        return cast(T, memory.known[key])

    return remembered


def may_guess(work: int = 0) -> bool:
    """Spend units of work on a guess; return whether this compile may go on guessing."""
    memory = _MEMORY.get()
    if memory is None:
        return True
    memory.left -= work
    return memory.left >= 0

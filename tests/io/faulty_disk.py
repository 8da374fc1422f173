"""A disk that fails once: at the n-th call of the system that a writer makes, in a way that a disk can fail.

Files are written by Python's own implementation of `io` meanwhile, so that each of their calls passes through `os`.
"""

from __future__ import annotations

import builtins
import errno
import importlib
import io
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import count
from typing import Any
from unittest.mock import patch

SHORT = "short write"  # half of the bytes, without an error
_NAMES = {"open", "rename", "replace", "unlink", "link", "mkdir"}
CALLS = sorted({*_NAMES, "write", "fsync", "close", "fchmod", "dup2"})
FAULTS: dict[str, tuple[int, set[str]]] = {
    "ENOSPC": (errno.ENOSPC, {"open", "write", "fsync", "close", "mkdir", "link", "rename", "replace"}),
    "EIO": (errno.EIO, {*CALLS}),
    "EMFILE": (errno.EMFILE, {"open"}),
    "EACCES": (errno.EACCES, _NAMES),
    "EROFS": (errno.EROFS, _NAMES),
    SHORT: (0, {"write"}),
}


@dataclass
class FaultyDisk:
    """Fails at the call of this number, if the fault is one of that call; `failed` names the call then."""

    fault: str
    number: int
    calls: int = 0
    failed: str = ""

    def call(self, name: str, real: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        """Do what is asked for, or fail."""
        code, failing = FAULTS[self.fault]
        self.calls += name in failing
        if self.failed or self.calls != self.number or name not in failing:
            return real(*arguments, **options)
        self.failed = name
        if self.fault == SHORT:
            descriptor, data = arguments
            return real(descriptor, bytes(data)[: max(1, len(data) // 2)])
        if name == "close":
            real(*arguments)  # as Linux has it: the descriptor is gone whatever is returned
        raise OSError(
            code, os.strerror(code), *(str(argument) for argument in arguments[:1] if not isinstance(argument, int))
        )

    @contextmanager
    def spun(self) -> Iterator[FaultyDisk]:
        """Have all of this process write to it."""
        opened = importlib.import_module("_pyio").open
        with ExitStack() as stack:
            for module in (io, builtins):
                stack.enter_context(patch.object(module, "open", opened))
            for name in CALLS:
                stack.enter_context(patch.object(os, name, self._wrap(name, getattr(os, name))))
            yield self

    def _wrap(self, name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *arguments, **options: self.call(name, real, *arguments, **options)


def faulty_disks() -> Iterator[FaultyDisk]:
    """Yield disks for all faults at all calls, until the writer has come through without one."""
    for fault in FAULTS:
        for number in count(1):
            disk = FaultyDisk(fault, number)
            yield disk
            if not disk.failed:
                break

"""Functions that numba compiles on their first call, kept in the user's folder of caches."""

from __future__ import annotations

import os
import shutil
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from xxhash import xxh3_64_hexdigest

MOST_FOLDERS = 8
_PREFIX = "motion-"
_BLAS = "scipy.linalg.cython_blas"
F = TypeVar("F", bound=Callable[..., object])


def is_installed() -> bool:
    """Return whether numba can be imported."""
    return find_spec("numba") is not None


def is_empty() -> bool:
    """Return whether there is a folder for compiled functions, and none in it."""
    return bool(folder := cache_folder()) and not any(Path(folder).rglob("*.nbc"))


def compiled(function: F) -> F:
    """Return a function that numba compiles without Python's objects; it releases Python's lock while it runs.

    It may call other compiled functions only, and take numbers, arrays and named tuples of them.

    Raises:
        ModuleNotFoundError: without numba.
    """
    numba = _numba()
    config = numba.config
    folder, before = cache_folder(), config.CACHE_DIR
    config.CACHE_DIR = folder  # which numba reads now, and only here: functions of others keep their own place
    try:
        made: F = numba.njit(function, cache=bool(folder), nogil=True, error_model="numpy")
    finally:
        config.CACHE_DIR = before
    return made


def inlined(function: F) -> F:
    """Return a function that becomes a part of the compiled ones that call it, which makes these a third faster.

    Nothing is made that Python could call, which halves the compiling.

    Raises:
        ModuleNotFoundError: without numba.
    """
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}
    made: F = _numba().njit(function, nogil=True, error_model="numpy", **options)
    return made


@cache
def _numba() -> Any:
    """Import numba, and what it asks scipy for first: linear algebra, which is not used here and takes 10 MB."""
    import numba

    sys.modules.setdefault(_BLAS, None)  # type: ignore[arg-type] # so that importing it fails
    try:
        import_module("numba.np.arraymath")
    finally:
        if sys.modules[_BLAS] is None:
            del sys.modules[_BLAS]
    return numba


@cache
def cache_folder() -> str:
    """Return where compiled functions are kept; nothing without a folder that only this user can write.

    Numba notices a change of the file of a function, not of those that it calls. So the folder is that of all files
    beside this one, as they are now.
    """
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "rbxcompose/numba"
    home = Path(os.environ.get("NUMBA_CACHE_DIR") or home)
    each = sorted((one.name, one.stat().st_mtime_ns) for one in Path(__file__).parent.glob("*.py"))
    path = home / f"{_PREFIX}{xxh3_64_hexdigest(repr((__file__, each)).encode())}"
    try:
        path.mkdir(parents=True, exist_ok=True, mode=0o700)
        about = path.stat()
    except OSError:
        return ""
    if about.st_uid != os.getuid() or about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return ""
    with suppress(OSError):  # another process may remove the same
        for old in sorted(path.parent.glob(f"{_PREFIX}*"), key=lambda one: one.stat().st_mtime_ns)[:-MOST_FOLDERS]:
            shutil.rmtree(old)
    return str(path)

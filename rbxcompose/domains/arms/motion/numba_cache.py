"""Functions that numba compiles on their first call, kept in the user's folder of caches."""

from __future__ import annotations

import os
import shutil
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, cached_property, update_wrapper
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

from xxhash import xxh3_64_hexdigest

from rbxcompose.domains.arms.motion.library import LIBRARY, Library, flat

MOST_FOLDERS = 8
_PREFIX = "motion-"
_BLAS = "scipy.linalg.cython_blas"
F = TypeVar("F", bound=Callable[..., object])
T = TypeVar("T")
Numba = Any  # its types and code


def is_installed() -> bool:
    """Return whether numba can be imported."""
    return find_spec("numba") is not None


def is_empty() -> bool:
    """Return whether there is a folder for compiled functions, and none in it that this machine can load."""
    kept = f"*-{_machine()}{LIBRARY}" if can_link() else "*.nbc"
    return bool(folder := cache_folder()) and not any(Path(folder).rglob(kept))


def compiled(function: F) -> F:
    """Return a function that numba compiles without Python's objects; it releases Python's lock while it runs.

    It may call other compiled functions only, and take numbers, arrays and named tuples of them. Numba is imported
    when it is called for the first time, and not at all where `keep_libraries` has written what it needs.

    Raises:
        ModuleNotFoundError: without numba, when it is called.
    """
    return cast(F, CompiledFunction(function, is_kept=True))


def inlined(function: F) -> F:
    """Return a function that becomes a part of the compiled ones that call it, which makes these a third faster.

    Nothing is made that Python could call, which halves the compiling.
    """
    return cast(F, CompiledFunction(function, no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=True))


def borrowed(value: T) -> T:
    """Return an array, or a tuple of arrays and tuples, whose references are not counted: its owner outlives it.

    For compiled functions alone.
    """
    return value


class CompiledFunction:
    """A function for numba, or one of a library that it has made before."""

    def __init__(self, function: Callable[..., object], *, is_kept: bool = False, **options: bool) -> None:
        self.function, self._is_kept, self._options = function, is_kept, options
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """Call it; values of other types than the library has been made for are left to numba."""
        if self._library is not None:
            kinds, slots = zip(*map(flat, arguments), strict=True)
            if "".join(kinds) == self._library.kinds:
                return self._library.call(b"".join(slots))
        return self.dispatcher(*arguments)

    @cached_property
    def dispatcher(self) -> Any:
        """Return what numba makes of it."""
        numba = _numba()
        config = numba.config
        folder, before = cache_folder(), config.CACHE_DIR
        config.CACHE_DIR = folder  # which numba reads now, and only here: functions of others keep their own place
        cached = self._is_kept and bool(folder)
        try:
            made = numba.njit(self.function, cache=cached, nogil=True, error_model="numpy", **self._options)
        finally:
            config.CACHE_DIR = before
        if self._is_kept:
            _made.append(self)
        return made

    @property
    def library_path(self) -> Path | None:
        """Return the file of its library, whether it is there or not; None if it is not kept."""
        if not (folder := cache_folder()) or not self._is_kept:
            return None
        function = self.function
        return Path(folder, f"{function.__module__}.{function.__qualname__}-{_machine()}{LIBRARY}")

    @cached_property
    def _library(self) -> Library | None:
        path = self.library_path
        with suppress(OSError):  # it is damaged, or nothing may be executed from there
            return Library(path) if path is not None and path.is_file() else None
        return None


_made: list[CompiledFunction] = []


def keep_libraries() -> None:
    """Write what numba has compiled in this process as shared libraries, which later processes call without numba.

    That saves each of them half a second and 100 MB, most of it LLVM. It needs the system's linker.
    """
    if can_link():
        for function in _made:
            path = function.library_path
            if path is not None and not path.exists():
                from rbxcompose.domains.arms.motion.linker import write_library  # imports LLVM

                write_library(function.dispatcher, path)


def can_link() -> bool:
    """Return whether there is a linker, without which compiled functions are loaded by numba."""
    return shutil.which("ld") is not None


@cache
def _numba() -> Any:
    """Import numba, and what it asks scipy for first: linear algebra, which is not used here and takes 10 MB."""
    import numba
    from numba.extending import typeof_impl

    sys.modules.setdefault(_BLAS, None)  # type: ignore[arg-type] # so that importing it fails
    try:
        import_module("numba.np.arraymath")
    finally:
        if sys.modules[_BLAS] is None:
            del sys.modules[_BLAS]
    _teach_borrowing()
    typeof_impl.register(CompiledFunction)(lambda function, context: typeof_impl(function.dispatcher, context))
    return numba


def _teach_borrowing() -> None:
    """Tell numba what it makes of `borrowed`."""
    from numba import types
    from numba.extending import lower_builtin, type_callable

    @type_callable(borrowed)
    def typed(_: Numba) -> Callable[[Numba], Numba]:
        return lambda value: value

    @lower_builtin(borrowed, types.Any)  # type: ignore[no-untyped-call, untyped-decorator]
    def code(context: Numba, builder: Numba, signature: Numba, given: Numba) -> Numba:
        return without_owner(context, builder, signature.args[0], given[0])

    def without_owner(context: Numba, builder: Numba, type_: Numba, value: Numba) -> Numba:
        if isinstance(type_, types.BaseTuple):
            for index, each in enumerate(type_.types):  # type: ignore[attr-defined]
                part = without_owner(context, builder, each, builder.extract_value(value, index))
                value = builder.insert_value(value, part, index)
            return value
        array = context.make_array(type_)(context, builder, value)
        array.meminfo = array.meminfo.type(None)
        array.parent = array.parent.type(None)
        return array._getvalue()


@cache
def _machine() -> str:
    """Return what distinguishes compiled code beside its source: the processor, and the numba that has made it."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").split("\n\n", 1)[0].splitlines()
    processor = [line for line in lines if line.lower().startswith(("model", "flags", "features", "cpu "))]
    found = find_spec("numba")
    made = (found.origin, Path(found.origin).stat().st_mtime_ns) if found is not None and found.origin else None
    return xxh3_64_hexdigest(repr(([line for line in processor if "MHz" not in line], made)).encode())


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

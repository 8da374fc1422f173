"""Finding plug-ins: one file is one plug-in, its name is the plug-in's name; none is imported before it is used.

Modules are found by their folders, without a list and without importing them. Each room of the package, that is each
package at its top and each domain, may have a folder for each family of plug-ins (`components/`, `sections/`,
`commands/`, ...): a file is a plug-in, and its name is that of the plug-in. There are two exceptions. All rules run, so
a room has them in `checks.py` or in files of `checks/`, many in one, whatever its name; and the sections that belong to
no domain are always imported, so a file has all those of one subject.

Third parties register theirs under the entry-point group `rbxcompose.plugins` as `FAMILY.NAME = "package.module"` and
use the same decorators.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from types import ModuleType
from typing import TYPE_CHECKING, TypeVar

from rbxcompose.base.findings import Report, Severity, Span, kind
from rbxcompose.base.printable import plain

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")
GROUP = "rbxcompose.plugins"

BROKEN = kind("RBX9301")
LEFT_OUT = kind("RBX9302", Severity.WARNING)

_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
_NAME, _DOMAINS, _RULES = "rbxcompose", "domains", "checks"


@cache
def modules_of(folder: str) -> dict[str, str]:
    """Return the modules of a family by the names of their plug-ins, sorted; those of rules by their own names."""
    return dict(sorted(_found(folder)))


def file_of(module: str) -> str:
    """Return the file of one of these modules."""
    return os.path.join(_PACKAGE, *module.split(".")[1:]) + ".py"


def domain_of(module: str) -> str:
    """Return the domain of a module, by its name; empty for modules of other rooms and of other packages."""
    package, _, below = module.partition(f".{_DOMAINS}.")
    return below.partition(".")[0] if package == _NAME else ""


def package_of(domain: str) -> ModuleType:
    """Return the package of a domain."""
    return importlib.import_module(f"{_NAME}.{_DOMAINS}.{domain}")


def _found(folder: str) -> Iterator[tuple[str, str]]:
    for room, path in _rooms():
        try:
            files = os.listdir(os.path.join(path, folder))
        except FileNotFoundError:
            if folder == _RULES and os.path.exists(os.path.join(path, f"{folder}.py")):
                yield f"{room}.{folder}", f"{room}.{folder}"
            continue
        for stem in (file.removesuffix(".py") for file in files if file.endswith(".py") and file != "__init__.py"):
            module = f"{room}.{folder}.{stem}"
            yield (module if folder == _RULES else stem), module


@cache
def _rooms() -> tuple[tuple[str, str], ...]:
    """Return the packages that may have plug-ins, each by its name and its folder."""
    tops = _below(_NAME, _PACKAGE)
    return (*tops, *_below(f"{_NAME}.{_DOMAINS}", os.path.join(_PACKAGE, _DOMAINS)))


def _below(package: str, path: str) -> list[tuple[str, str]]:
    with os.scandir(path) as entries:
        names = sorted(entry.name for entry in entries if "." not in entry.name and not entry.name.startswith("_"))
    return [(f"{package}.{name}", os.path.join(path, name)) for name in names]


class BrokenPluginError(Exception):
    """Raised when a plug-in cannot be used; its text names plug-in, package and reason."""


@contextmanager
def reported(report: Report, span: Span | None) -> Iterator[None]:
    """Report a plug-in that turns out to be broken in this block, whose rest is left out."""
    try:
        yield
    except BrokenPluginError as error:
        report.add(BROKEN.at(span, str(error)))


class Plugins:
    """The modules of one family, by name; importing one lets its decorators register its contents."""

    def __init__(self, family: str, folder: str) -> None:
        self.family, self.folder = family, folder

    @cached_property
    def shipped(self) -> dict[str, str]:
        """Our own modules of this family, by the names of their files; a file beside folders has that of its room."""
        return modules_of(self.folder)

    @cached_property
    def third_party(self) -> dict[str, tuple[EntryPoint, ...]]:
        """Entry points of other distributions, by name; two with the same name conflict."""
        prefix = f"{self.family}."
        found: dict[str, tuple[EntryPoint, ...]] = {}
        for entry in _entries(tuple(sys.path)):
            if entry.name.startswith(prefix):
                name = entry.name.removeprefix(prefix)
                found[name] = (*found.get(name, ()), entry)
        return found

    def names(self) -> list[str]:
        """Return all names, sorted."""
        return sorted({*self.shipped, *self.third_party})

    def load(self, name: str) -> bool:
        """Import the plug-in of this name; return whether there is one.

        Raises:
            BrokenPluginError: if it belongs to another package and cannot be imported.
        """
        if name in self.shipped:
            importlib.import_module(self.shipped[name])
            return True
        return self.load_foreign(name)

    def find(self, name: str, known: dict[str, T], declared: str) -> T:
        """Return the thing of this name from `known`, importing the plug-in that enters it there if necessary.

        `declared` says what its decorator declares.

        Raises:
            KeyError: if there is none.
            BrokenPluginError: if its module does not declare it, or it belongs to another package and cannot be used.
        """
        if name not in known:
            try:
                is_there = self.load(name)
            except BrokenPluginError:
                known.pop(name, None)  # it may have got that far
                raise
            if is_there and name not in known:
                raise self.broken(name, f"its module declares no {declared}")
        return known[name]

    def load_shipped(self) -> None:
        """Import all of our own."""
        for module in self.shipped.values():
            importlib.import_module(module)

    def load_foreign(self, name: str) -> bool:
        """Import the plug-in of this name of another package; return whether there is one.

        Raises:
            BrokenPluginError: if it cannot be imported.
        """
        if name not in self.third_party:
            return False
        [entry, *others] = self.third_party[name]
        if others:
            raise self.broken(name, "more than one package announces it")
        with self.guarded(name):
            entry.load()
        return True

    def problem(self, name: str) -> str:
        """Import the plug-in of this name of another package; return why it cannot be used, or nothing."""
        try:
            self.load_foreign(name)
        except BrokenPluginError as error:
            return str(error)
        return ""

    @contextmanager
    def guarded(self, name: str) -> Iterator[None]:
        """Blame what this block raises on the package of a plug-in, unless that is ours.

        Raises:
            BrokenPluginError: in place of whatever the plug-in raises.
        """
        try:
            yield
        except BrokenPluginError:
            raise
        except (Exception, SystemExit) as error:  # third-party code may raise anything
            if name in self.shipped or name not in self.third_party:
                raise
            raise self.broken(name, f"{type(error).__name__}: {error}", _place(error)) from error

    def overshadowed(self, name: str) -> str:
        """Return the message for a name of ours that other packages register as well; empty if none does."""
        return self.left_out(name) if name in self.shipped and name in self.third_party else ""

    def left_out(self, name: str) -> str:
        """Return the message for a plug-in of another package that has the name of one of ours."""
        return f"the {self.family} '{name}' of {self._packages(name)} is left out: rbxcompose has one of this name"

    def broken(self, name: str, reason: str, place: str = "") -> BrokenPluginError:
        """Return the error that reports why a plug-in cannot be used."""
        what = f"{self.family} '{plain(name, 60)}' of {self._packages(name)}"
        return BrokenPluginError(f"the {what} cannot be used: {plain(reason)}{plain(place)}")

    def _packages(self, name: str) -> str:
        if not (entries := self.third_party.get(name, ())):
            return _NAME
        packages = sorted({f"'{plain(entry.dist.name, 60)}'" if entry.dist else entry.module for entry in entries})
        return f"package{'s' if len(packages) > 1 else ''} {' and '.join(packages)}"


def _place(error: BaseException) -> str:
    """Return the innermost place in the package that an error passed through first and is not ours, in brackets."""
    found, package, trace = "", "", error.__traceback__
    while trace is not None:
        of = trace.tb_frame.f_globals.get("__name__", "").partition(".")[0]
        package = package or (of if of not in (_NAME, "importlib", "contextlib") else "")
        if package and of == package and not (file := trace.tb_frame.f_code.co_filename).startswith("<"):
            found = f" ({os.path.basename(file)}:{trace.tb_lineno})"
        trace = trace.tb_next
    return found


def load_all_foreign() -> None:
    """Import all that other packages announce, except what cannot be imported."""
    for family in dict.fromkeys(entry.name.partition(".")[0] for entry in _entries(tuple(sys.path))):
        plugins = Plugins(family, "")
        for name in plugins.third_party:
            plugins.problem(name)


@cache
def _entries(path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Return what the distributions on Python's path announce: their files are read once for all families."""
    if not any(map(_may_announce, path)):
        return ()
    from importlib.metadata import entry_points  # slow to import, and most users have no plug-in

    return tuple(entry_points(group=GROUP))


def _may_announce(folder: str) -> bool:
    """Return whether a distribution in a folder of Python's path may announce plug-ins."""
    try:
        names = os.listdir(folder or ".")
    except NotADirectoryError:  # an archive
        return True
    except OSError:
        return False
    return any(
        _announces(os.path.join(folder, name)) for name in names if name.endswith((".dist-info", ".egg-info", ".egg"))
    )


def _announces(distribution: str) -> bool:
    if distribution.endswith(".egg"):
        return True
    try:
        with open(os.path.join(distribution, "entry_points.txt"), "rb") as file:
            return GROUP.encode() in file.read()
    except OSError:
        return False

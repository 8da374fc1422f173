"""Finding plug-ins: one file is one plug-in, its name is the plug-in's name; none is imported before it is used.

Our own are in one package per family (`component`, `check`, ...). Third parties register theirs under the entry-point
group `rbxcompose.plugins` as `FAMILY.NAME = "package.module"` and use the same decorators.
"""

from __future__ import annotations

import importlib
import os
import sys
from functools import cache, cached_property
from typing import TYPE_CHECKING

from rbxcompose.base.findings import Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.base.rooms import modules_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "rbxcompose.plugins"

BROKEN = kind("RBX9301")
LEFT_OUT = kind("RBX9302", Severity.WARNING)


class BrokenPluginError(Exception):
    """Raised when a plug-in of another package cannot be used; its text names plug-in, package and reason."""


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
        try:
            entry.load()
        except (Exception, SystemExit) as error:  # third-party code may raise anything while it is imported
            raise self.broken(name, f"{type(error).__name__}: {error}") from error
        return True

    def overshadowed(self, name: str) -> str:
        """Return the message for a name of ours that other packages register as well; empty if none does."""
        return self.left_out(name) if name in self.shipped and name in self.third_party else ""

    def left_out(self, name: str) -> str:
        """Return the message for a plug-in of another package that has the name of one of ours."""
        return f"the {self.family} '{name}' of {self._packages(name)} is left out: rbxcompose has one of this name"

    def broken(self, name: str, reason: str) -> BrokenPluginError:
        """Return the error that reports why a plug-in of another package cannot be used."""
        return BrokenPluginError(
            f"the {self.family} '{plain(name, 60)}' of {self._packages(name)} cannot be used: {plain(reason)}"
        )

    def _packages(self, name: str) -> str:
        entries = self.third_party[name]
        packages = sorted({f"'{plain(entry.dist.name, 60)}'" if entry.dist else entry.module for entry in entries})
        return f"package{'s' if len(packages) > 1 else ''} {' and '.join(packages)}"


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

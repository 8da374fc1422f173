"""Finding plug-ins: one file is one plug-in, its name is the plug-in's name; nothing is imported before it is used.

Ours lie in one package per family (`component`, `check`, ...). Third parties announce theirs under the entry-point
group `rbxcompose.plugins` as `FAMILY.NAME = "package.module"` and use the same decorators.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "rbxcompose.plugins"


class Plugins:
    """The modules of one family, by name; importing one lets its decorator register what it holds."""

    def __init__(self, family: str, package: str) -> None:
        self.family, self.package = family, package

    @cached_property
    def shipped(self) -> frozenset[str]:
        """Names of the files in our own package."""
        package = importlib.import_module(self.package)
        return frozenset(module.name for module in pkgutil.iter_modules(package.__path__))

    @cached_property
    def third_party(self) -> dict[str, EntryPoint]:
        """Entry points of other distributions, by name."""
        from importlib.metadata import entry_points  # slow to import, and most commands need no plug-in

        prefix = f"{self.family}."
        found = [entry for entry in entry_points(group=GROUP) if entry.name.startswith(prefix)]
        return {entry.name.removeprefix(prefix): entry for entry in found}

    def names(self) -> list[str]:
        """Return all names, sorted."""
        return sorted(self.shipped | set(self.third_party))

    def load(self, name: str) -> bool:
        """Import the plug-in of this name; return whether there is one."""
        if name in self.shipped:
            importlib.import_module(f"{self.package}.{name}")
        elif name in self.third_party:
            self.third_party[name].load()
        else:
            return False
        return True

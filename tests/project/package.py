"""The files of the package and what they import, read once for all tests of the project."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "rbxcompose"
IMPORT = re.compile(r"^[ \t]*(?:import ([\w.]+)|from ([\w.]+) import (\([^)]*\)|.*))", re.MULTILINE)
"""A statement that imports, which ruff gives lines of its own; to parse all files takes 20 times as long."""


@cache
def files() -> tuple[Path, ...]:
    return tuple(sorted(PACKAGE.rglob("*.py")))


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def module_of(path: Path) -> str:
    """Return the name of a file's module below `rbxcompose`, that of a package with `__init__` behind it."""
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts)


@cache
def modules() -> tuple[ModuleType, ...]:
    """Import all modules."""
    names = [module.name for module in pkgutil.walk_packages([str(PACKAGE)], "rbxcompose.")]
    return tuple(importlib.import_module(name) for name in names if not name.endswith("__main__"))


@cache
def imported_by(path: Path) -> tuple[tuple[str, str], ...]:
    return tuple(imported(text_of(path)))


def imported(text: str) -> Iterator[tuple[str, str]]:
    """Yield the modules that a file imports anywhere, each with what is taken from it."""
    for whole, module, taken in IMPORT.findall(text):
        if whole:
            yield whole, ""
        for part in re.sub(r"#.*", "", taken).strip("()").split(","):
            if part.strip():
                yield module, part.split()[0]

"""The files of the package and what they import, read once for all tests of the project."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "rbxcompose"


@cache
def files() -> tuple[Path, ...]:
    return tuple(sorted(PACKAGE.rglob("*.py")))


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(text_of(path))


def module_of(path: Path) -> str:
    """Return the name of a file's module below `rbxcompose`, that of a package with `__init__` behind it."""
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts)


@cache
def imported_by(path: Path) -> tuple[tuple[str, str], ...]:
    return tuple(imported(tree_of(path)))


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield all statements below a node; expressions, of which there are many more, have none."""
    for field in ("body", "handlers", "orelse", "finalbody", "cases"):
        for node in getattr(tree, field, ()):
            yield node
            yield from statements(node)


def imported(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield the modules that a file imports anywhere, each with what is taken from it."""
    for node in statements(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from ((node.module, alias.name) for alias in node.names)

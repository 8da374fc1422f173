"""Finds where a source file reads a clock itself: components are given their time, or no run could be repeated."""

import ast
from collections.abc import Iterator
from pathlib import Path

_MODULES = {"sched", "time"}  # all names of these modules are forbidden
_NAMES = {
    "asyncio.sleep",
    "asyncio.timeout",
    "asyncio.timeout_at",
    "asyncio.wait_for",
    "datetime.date.today",
    "datetime.datetime.now",
    "datetime.datetime.today",
    "datetime.datetime.utcnow",
    "os.times",
    "signal.alarm",
    "signal.setitimer",
    "threading.Timer",
}


def clock_uses(path: Path) -> list[str]:
    """Return each place at which a source file reads a clock or waits: `FILE:LINE: time.monotonic`.

    Names are followed through imports, including renamed ones. Imports by string at run time are not detected.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
    imported = dict(_imported(tree))
    named = (found for node in ast.walk(tree) for found in _named(node, imported))
    found = {(line, name) for line, name in named if _is_clock(name)}
    return [f"{path.name}:{line}: {name}" for line, name in sorted(found)]


def _is_clock(name: str) -> bool:
    module, _, inner = name.partition(".")
    return name in _NAMES or (module in _MODULES and bool(inner))


def _imported(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield the full name of each imported name: `datetime.datetime.now` for `now`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                top = alias.name.partition(".")[0]
                yield (alias.asname, alias.name) if alias.asname else (top, top)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            for alias in node.names:
                yield alias.asname or alias.name, f"{node.module}.{alias.name}"


def _named(node: ast.AST, imported: dict[str, str]) -> Iterator[tuple[int, str]]:
    """Yield line and full name of what an expression or an import names, if it is imported."""
    if isinstance(node, ast.ImportFrom) and node.level == 0:
        yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)
    if not isinstance(node, ast.Attribute | ast.Name):
        return
    attributes: list[str] = []
    inner: ast.expr = node
    while isinstance(inner, ast.Attribute):
        attributes.append(inner.attr)
        inner = inner.value
    if isinstance(inner, ast.Name) and inner.id in imported:
        yield node.lineno, ".".join([imported[inner.id], *reversed(attributes)])

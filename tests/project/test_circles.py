"""No modules import each other in a circle: not for types alone and not inside of functions either."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "rbxcompose"

Imports = Mapping[str, set[str]]


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


def named(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield the modules that a text imports anywhere, each with what is taken from it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from ((node.module, alias.name) for alias in node.names)


def imports_of(texts: Mapping[str, str]) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for name, text in texts.items():
        pairs = named(ast.parse(text))
        modules = {f"{module}.{taken}" if f"{module}.{taken}" in texts else module for module, taken in pairs}
        found[name] = {one for one in modules if one in texts and one != name}
    return found


def circle(imports: Imports) -> list[str]:
    """Return a circle, in which each module is imported by the next one; nothing if there is none."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def all_imports() -> dict[str, set[str]]:
    return imports_of({name_of(path): path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))})


def test_there_is_no_circle() -> None:
    assert circle(all_imports()) == []


def test_a_circle_is_found_wherever_its_imports_stand() -> None:
    texts = {
        "a": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from b import B",
        "b": "def late():\n    import c.d",
        "c": "",
        "c.d": "from a import A",
    }
    assert set(circle(imports_of(texts))) == {"a", "b", "c.d"}
    assert circle(imports_of({**texts, "c.d": ""})) == []

"""No modules import each other in a circle: not for types alone and not inside of functions either."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter

from tests.project.package import files, imported, imported_by, module_of

Imports = Mapping[str, set[str]]


def imports_of(texts: Mapping[str, Iterable[tuple[str, str]]]) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for name, pairs in texts.items():
        modules = {f"{module}.{taken}" if f"{module}.{taken}" in texts else module for module, taken in pairs}
        found[name] = {module for module in modules if module in texts and module != name}
    return found


def circle(imports: Imports) -> list[str]:
    """Return a circle, in which each module is imported by the next one; nothing if there is none."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def all_imports() -> dict[str, set[str]]:
    return imports_of(
        {f"rbxcompose.{module_of(path)}".removesuffix(".__init__"): imported_by(path) for path in files()}
    )


def test_there_is_no_circle() -> None:
    assert circle(all_imports()) == []


def test_a_circle_is_found_wherever_its_imports_stand() -> None:
    texts = {
        "a": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from b import B",
        "b": "def late():\n    import c.d",
        "c": "",
        "c.d": "from a import A",
    }
    pairs = {name: tuple(imported(text)) for name, text in texts.items()}
    assert set(circle(imports_of(pairs))) == {"a", "b", "c.d"}
    assert circle(imports_of({**pairs, "c.d": ()})) == []

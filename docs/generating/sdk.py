"""The page of the SDK: all that the author of a component imports, with the first line of each docstring."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from docs.generating.markdown import code, page, table
from rbxcompose import sdk
from rbxcompose.sdk import Capability, Component, Port

HEAD = """Everything that the author of a component imports, from `rbxcompose.sdk`. For how to use it, see
[a component of your own](../sdk.md).
"""


def whole_page() -> str:
    """Return the page `sdk.md`."""
    things: dict[str, Any] = {name: getattr(sdk, name) for name in sdk.__all__}
    ports = {name: entry for name, entry in things.items() if isinstance(entry, type) and issubclass(entry, Port)}
    capabilities = {
        name: entry for name, entry in things.items() if isinstance(entry, type) and issubclass(entry, Capability)
    }
    methods = {name: entry for name, entry in vars(Component).items() if _is_method(name, entry)}
    shown = {*ports, *capabilities}
    others = {name: entry for name, entry in things.items() if name not in shown and _has_docstring(entry)}
    fields = ", ".join(code(name) for name, entry in things.items() if not _has_docstring(entry))
    return page(
        "The SDK",
        HEAD,
        _section("Ports", ports),
        _section("Methods of a component", methods),
        _section("Capabilities", capabilities),
        _section("The rest", others),
        f"## Types of fields\n{fields}; and all types that pydantic knows.\n",
    )


def _has_docstring(thing: object) -> bool:
    return inspect.isclass(thing) or inspect.isfunction(thing)  # the others are types with an annotation


def _is_method(name: str, thing: object) -> bool:
    return inspect.isfunction(thing) and not name.startswith("_")


def _section(title: str, things: Mapping[str, object]) -> str:
    rows = [(code(name), (inspect.getdoc(entry) or "").partition("\n")[0]) for name, entry in things.items()]
    return f"## {title}\n{table(('name', 'what it is'), rows)}"

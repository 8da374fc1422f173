"""Component types by name; only those that a manifest uses are imported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from rbxcompose.plugins import Plugins
from rbxcompose.sdk.component import Component

T = TypeVar("T", bound=type[Component[Any]])

PLUGINS = Plugins("component", "rbxcompose.components")
_TYPES: dict[str, type[Component[Any]]] = {}


def component(name: str) -> Callable[[T], T]:
    """Register a component class under its type's name.

    Raises:
        ValueError: if another class has this name.
    """

    def register(cls: T) -> T:
        other = _TYPES.get(name)
        if other is not None and (other.__module__, other.__qualname__) != (cls.__module__, cls.__qualname__):
            raise ValueError(f"two component types are named '{name}': {other.__module__} and {cls.__module__}")
        cls.type_name = name
        _TYPES[name] = cls
        return cls

    return register


def component_names() -> list[str]:
    """Return the names of all types, sorted; nothing is imported for it."""
    return sorted({*PLUGINS.names(), *_TYPES})


def component_type(name: str) -> type[Component[Any]]:
    """Import a type's file, if that is still to be done, and return its class.

    Raises:
        KeyError: if no type has this name.
    """
    if name not in _TYPES:
        PLUGINS.load(name)
    return _TYPES[name]

"""How a modifier is declared, and in which order modifiers stand around a node."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, ClassVar, TypeVar

from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader

# From the outside in, whatever the order in the text: a rule of the language.
MODULES = ("entering", "starting", "results", "hooks", "limits", "saving")


class Modifier(Task):
    """A task around another one of the same node; what happens to the inner one happens to it.

    `keys` are all that it reads: its own, which comes first, and those that only make sense with it.
    """

    __slots__ = ("inner",)
    keys: ClassVar[Mapping[str, str]] = {}  # keys beside its own, each with what it is for
    only_states: ClassVar[bool] = False  # it belongs to states of machines

    def __init__(self, site: Site, options: object, inner: Task) -> None:
        super().__init__(site)
        self.inner = inner

    @staticmethod
    def read(reader: NodeReader, key: str) -> object:
        """Read the modifier's value, which becomes the `options` of its task."""
        raise NotImplementedError

    def suspend(self, anew: bool) -> bool:
        """Begin anew together with a leaf that begins anew."""
        if self.current is not None and self.inner.suspend(anew):
            self.current = None
            return True
        return False

    def proceed(self) -> int:
        """Go on with the task inside."""
        return self.advance(self.inner)


MODIFIERS: dict[str, type[Modifier]] = {}
M = TypeVar("M", bound=type[Modifier])


def modifier(name: str) -> Callable[[M], M]:
    """Register a modifier under its key, inside of those of its module that were registered before."""

    def register(cls: M) -> M:
        MODIFIERS[name] = cls
        return cls

    return register


@cache
def modifiers() -> Mapping[str, type[Modifier]]:
    """Return all modifiers by their key, from the outside in."""
    found: dict[str, type[Modifier]] = {}
    for module in MODULES:
        name = importlib.import_module(f"rbxcompose.missions.modifiers.{module}").__name__
        found.update((key, cls) for key, cls in MODIFIERS.items() if cls.__module__ == name)
    return found


@cache
def modifier_keys() -> Mapping[str, type[Modifier]]:
    """Return every key that modifiers of nodes read, with the modifier that it belongs to."""
    found = ((key, cls) for name, cls in modifiers().items() for key in (name, *cls.keys) if not cls.only_states)
    return dict(found)

"""How a modifier is declared, and the order in which modifiers surround a node."""

import importlib
import inspect
from collections.abc import Callable, Mapping
from functools import cache
from typing import TypeVar

from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.program.modifier import Modifier

# Outermost first, whatever the order in the text: a rule of the language.
MODULES = ("state_hooks", "start_conditions", "results", "hooks", "limits", "kept_results")


class Decorator(Task):
    """A task around another task of the same node; it shares the fate of the inner one."""

    __slots__ = ("inner",)

    def __init__(self, site: Site, inner: Task) -> None:
        super().__init__(site)
        self.inner = inner

    def suspend(self, from_start: bool) -> bool:
        """Start again together with a leaf that starts again."""
        if self.current is not None and self.inner.suspend(from_start):
            self.current = None
            return True
        return False

    def proceed(self) -> int:
        """Continue with the task inside."""
        return self.advance(self.inner)


M = TypeVar("M", bound=Modifier)
MODIFIERS: dict[str, type[Modifier]] = {}
_DECORATORS: dict[type[Modifier], Callable[[Modifier, Site, Task], Task]] = {}


def modifier(
    name: str, task: Callable[[Site, M, Task], Task], *, only_states: bool = False
) -> Callable[[type[M]], type[M]]:
    """Register a modifier under its key, inside those that its module registered before.

    Raises:
        TypeError: if the modifier does not implement all abstract members.
    """

    def register(cls: type[M]) -> type[M]:
        if inspect.isabstract(cls):
            raise TypeError(f"the modifier '{name}' does not answer {', '.join(sorted(cls.__abstractmethods__))}")

        def make(options: Modifier, site: Site, inner: Task) -> Task:
            if not isinstance(options, cls):
                raise TypeError(f"'{site.node.path}' has no '{name}'")
            return task(site, options, inner)

        cls.bind(name)
        cls.only_states = only_states
        MODIFIERS[name], _DECORATORS[cls] = cls, make
        return cls

    return register


def decorator_of(options: Modifier, site: Site, inner: Task) -> Task:
    """Return the task that carries out a modifier of a node, around another one."""
    return _DECORATORS[type(options)](options, site, inner)


@cache
def modifiers() -> Mapping[str, type[Modifier]]:
    """Return all modifiers by key, outermost first."""
    found: dict[str, type[Modifier]] = {}
    for module in MODULES:
        name = importlib.import_module(f"rbxcompose.missions.modifiers.{module}").__name__
        found.update((key, cls) for key, cls in MODIFIERS.items() if cls.__module__ == name)
    return found


@cache
def modifier_keys() -> Mapping[str, type[Modifier]]:
    """Return every key that modifiers of nodes read, with its modifier."""
    found = ((key, cls) for cls in modifiers().values() for key in cls.fields if not cls.only_states)
    return dict(found)

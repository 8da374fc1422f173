"""The registries of the kinds of mission nodes and of their modifiers: how each is declared, and in which order."""

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeAlias, TypeVar

from rbxcompose.missions import kinds as package
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.grammar import BELOW, Takes
from rbxcompose.missions.program.program import Modifier, Step

StepType: TypeAlias = type[Step]
S = TypeVar("S", bound=Step)
SKILL = "skill"  # the kind of all nodes that are named after a skill of the robot
KINDS: dict[str, StepType] = {}
_TASKS: dict[StepType, Callable[[Site, Any], Task]] = {}


def kind(name: str, task: Callable[[Site, S], Task], *, is_inner: bool = False) -> Callable[[type[S]], type[S]]:
    """Register a kind under its word, with the task that runs it.

    A kind that `is_inner` has no word in the language.

    Raises:
        TypeError: if the kind does not answer everything that every kind must.
        ValueError: if another kind has this word.
    """

    def register(cls: type[S]) -> type[S]:
        _require_usable("kind", name, cls, KINDS)
        cls.bind(name)
        cls.is_inner = is_inner
        KINDS[name], _TASKS[cls] = cls, task
        _look_again()
        return cls

    return register


def _require_usable(what: str, name: str, cls: type[Any], known: Mapping[str, type[Any]]) -> None:
    """Raise an error if a class leaves questions open, or if another one has its name."""
    if inspect.isabstract(cls):
        raise TypeError(f"the {what} '{name}' does not answer {', '.join(sorted(cls.__abstractmethods__))}")
    other = known.get(name, cls)
    if (other.__module__, other.__qualname__) != (cls.__module__, cls.__qualname__):
        raise ValueError(f"two {what}s are named '{name}': {other.__module__} and {cls.__module__}")


def forget(name: str) -> None:
    """Unregister a kind, as tests do with theirs."""
    del _TASKS[KINDS.pop(name)]
    _look_again()


def _look_again() -> None:
    kinds.cache_clear()
    all_kinds.cache_clear()


def task_of(site: Site) -> Task:
    """Return the task that runs a node, with nothing around it."""
    return _TASKS[type(site.node.step)](site, site.node.step)


@cache
def kinds() -> dict[str, StepType]:
    """Return all kinds that a mission may use, by word, sorted."""
    return {name: found for name, found in all_kinds().items() if not found.is_inner}


@cache
def all_kinds() -> dict[str, StepType]:
    """Return all kinds of nodes in a program by name, sorted."""
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    return dict(sorted(KINDS.items()))


# Outermost first, whatever the order in the text: a rule of the language.
MODULES = ("starts", "results")
M = TypeVar("M", bound=Modifier)
MODIFIERS: dict[str, type[Modifier]] = {}
_DECORATORS: dict[type[Modifier], Callable[[Site, Any, Task], Task]] = {}


def modifier(
    name: str, task: Callable[[Site, M, Task], Task], *, only_states: bool = False
) -> Callable[[type[M]], type[M]]:
    """Register a modifier under its key, inside those that its module registered before.

    Raises:
        TypeError: if the modifier does not implement all abstract members.
        ValueError: if another modifier has this key.
    """

    def register(cls: type[M]) -> type[M]:
        _require_usable("modifier", name, cls, MODIFIERS)
        cls.bind(name)
        cls.only_states = only_states
        MODIFIERS[name], _DECORATORS[cls] = cls, task
        return cls

    return register


def decorator_of(options: Modifier, site: Site, inner: Task) -> Task:
    """Return the task that carries out a modifier of a node, around another one."""
    return _DECORATORS[type(options)](site, options, inner)


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


@cache
def anywhere() -> tuple[str, ...]:
    """Return the keys that any node may have."""
    return ("name", *modifier_keys())


@cache
def keys_taking(*taken: Takes) -> frozenset[str]:
    """Return the keys of steps, states, machines and interrupts that take one of these."""
    of_kinds = (field for kind in kinds().values() for field in kind.fields.values())
    below = ((key, slot.takes) for slots in BELOW.values() for key, slot in slots.items())
    return frozenset(
        key for key, takes in (*below, *((field.key, field.takes) for field in of_kinds)) if takes in taken
    )

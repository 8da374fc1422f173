"""The registry of mission node kinds: each is one file in `missions/kinds`, registered by a decorator."""

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from functools import cache
from typing import TypeAlias, TypeVar

from rbxcompose.missions import kinds as package
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.program.program import Step

StepType: TypeAlias = type[Step]
S = TypeVar("S", bound=Step)
SKILL = "skill"  # the kind of all nodes that are named after a skill of the robot
KINDS: dict[str, StepType] = {}
_TASKS: dict[StepType, Callable[[Site], Task]] = {}


def kind(name: str, task: Callable[[Site, S], Task], *, is_inner: bool = False) -> Callable[[type[S]], type[S]]:
    """Register a kind under its word, with the task that runs it.

    A kind that `is_inner` has no word in the language.

    Raises:
        TypeError: if the kind does not answer everything that every kind must.
    """

    def register(cls: type[S]) -> type[S]:
        if inspect.isabstract(cls):
            raise TypeError(f"the kind '{name}' does not answer {', '.join(sorted(cls.__abstractmethods__))}")

        def make(site: Site) -> Task:
            if not isinstance(site.node.step, cls):
                raise TypeError(f"'{site.node.path}' is no '{name}'")
            return task(site, site.node.step)

        cls.bind(name)
        cls.is_inner = is_inner
        KINDS[name], _TASKS[cls] = cls, make
        _look_again()
        return cls

    return register


def forget(name: str) -> None:
    """Unregister a kind, as tests do with theirs."""
    del _TASKS[KINDS.pop(name)]
    _look_again()


def _look_again() -> None:
    kinds.cache_clear()
    all_kinds.cache_clear()


def task_of(site: Site) -> Task:
    """Return the task that runs a node, with nothing around it."""
    return _TASKS[type(site.node.step)](site)


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

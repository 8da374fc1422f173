"""Finding the kinds of mission nodes: each is one file in `missions/kinds`, entered by one decorator."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from rbxcompose.missions import kinds as package
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.expressions.types import Type
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.program import Node
    from rbxcompose.missions.views import View


class KindTask(Protocol):
    """A task class that knows how its kind is read."""

    def __call__(self, site: Site, options: Any, /) -> Task:
        """Make the task of a node with these options."""
        ...

    def read(self, reader: NodeReader, /) -> object:
        """Read the kind's value and options."""
        ...

    def waits(self, node: Node, /) -> bool:
        """Tell whether a node of this kind takes time by itself."""
        ...

    def item_type(self, view: View, /) -> Type:
        """Return the type of the items of a loop."""
        ...


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of mission node: its word, the keys that belong to it with what each is for, and its task class.

    One that is `inner` stands only inside another one, as a state in a machine: it has no word of the language.
    """

    name: str
    options: Mapping[str, str]
    task: KindTask
    is_inner: bool = False


K = TypeVar("K", bound=KindTask)
_KINDS: dict[str, Kind] = {}


def kind(name: str, options: Mapping[str, str] = MappingProxyType({}), *, is_inner: bool = False) -> Callable[[K], K]:
    """Register a task class under the word of its kind; `options` tells in a sentence what each of its keys is for."""

    def register(task: K) -> K:
        _KINDS[name] = Kind(name, options, task, is_inner)
        return task

    return register


@cache
def kinds() -> dict[str, Kind]:
    """Return all kinds that a mission may write, by their word, sorted."""
    return {name: found for name, found in all_kinds().items() if not found.is_inner}


@cache
def all_kinds() -> dict[str, Kind]:
    """Return all kinds of nodes in a program by name, sorted."""
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    return dict(sorted(_KINDS.items()))

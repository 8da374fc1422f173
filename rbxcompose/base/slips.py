"""Slips: beginners' mistakes that are recognised, reported with their correction, and read as they were meant.

Compiler writers call them error productions: each is a function, beside the grammar instead of in it. A slip in a tree
looks at a node at one place of its grammar and returns a `Repair`: the findings, and the node to continue with. So the
reader that follows sees no slips, only the grammar. A family of slips is a package with one `Slips` as decorator.
"""

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from functools import cached_property
from graphlib import TopologicalSorter
from typing import Any, Generic, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report

Find = TypeVar("Find", bound=Callable[..., Any])
P = TypeVar("P")
N = TypeVar("N")


@dataclass(frozen=True, slots=True)
class Repair(Generic[N]):
    """The node that replaces one with a slip, and the findings about the slip."""

    node: N
    findings: tuple[Finding, ...]


class Slips(Generic[Find]):
    """The slips of one language, by the places of its grammar: the files of a package, declared by this decorator."""

    def __init__(self, package: str) -> None:
        self._package = package
        self._places: dict[Find, tuple[str, ...]] = {}
        self._earlier: dict[Find, set[Find]] = {}

    def __call__(self, *places: str, after: Iterable[Find] = (), before: Iterable[Find] = ()) -> Callable[[Find], Find]:
        """Declare a function that recognises a slip at some places; it runs `after` and `before` certain others."""

        def declare(find: Find) -> Find:
            self._places[find] = places
            self._earlier.setdefault(find, set()).update(after)
            for later in before:
                self._earlier.setdefault(later, set()).add(find)
            return find

        return declare

    def at(self, place: str) -> list[Find]:
        """Return the slips of a place in order: by name, unless `after` or `before` say otherwise."""
        return self._by_place.get(place, [])

    @cached_property
    def _by_place(self) -> dict[str, list[Find]]:
        for module in pkgutil.iter_modules(importlib.import_module(self._package).__path__):
            importlib.import_module(f"{self._package}.{module.name}")
        order: TopologicalSorter[Find] = TopologicalSorter()
        for find in sorted(self._places, key=_name):
            order.add(find, *sorted(self._earlier[find], key=_name))
        found: dict[str, list[Find]] = {}
        for find in order.static_order():
            for place in self._places[find]:
                found.setdefault(place, []).append(find)
        return found


def _name(find: Callable[..., Any]) -> str:
    return find.__name__


def repaired(slips: Iterable[Callable[[P, N], Repair[N] | None]], place: P, node: N, report: Report) -> N:
    """Return a node without slips, and report each of them.

    When one slip has repaired the node, the others look at it again; each repairs it at most once, so that this ends.
    """
    waiting = list(slips)
    index = 0
    while index < len(waiting):
        repair = waiting[index](place, node)
        if repair is None:
            index += 1
            continue
        report.extend(repair.findings)
        node = repair.node
        del waiting[index]
        index = 0
    return node

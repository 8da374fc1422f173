"""Rules: functions that find one kind of error, declared by a decorator; the docstring is the docs page of the code.

What a rule looks at depends on its family: the checks of `checks/` look at a robot, those of `missions/checks` at a
mission.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

from rbxcompose.findings import Finding, Kind, Severity, register_kind

S = TypeVar("S")


@dataclass(frozen=True, slots=True)
class Rule(Kind, Generic[S]):
    """A kind of finding together with the function that finds it."""

    find: Callable[[S], Iterable[Finding]] = lambda subject: ()

    def __call__(self, subject: S) -> Iterable[Finding]:
        """Yield what is wrong with `subject`."""
        return self.find(subject)


def declared(find: Callable[[S], Iterable[Finding]], code: str, severity: Severity, is_fixable: bool) -> Rule[S]:
    """Enter a rule and its docs page under a code.

    Raises:
        ValueError: if it has no docstring, or its code is taken.
    """
    if not find.__doc__:
        raise ValueError(f"check {code} has no docstring, so it would have no docs page")
    made: Rule[S] = Rule(code, inspect.cleandoc(find.__doc__), severity, is_fixable, find=find)
    register_kind(made)
    return made


def belonging(find: Callable[[S], Iterable[Finding]], kind: Kind) -> Rule[S]:
    """Return a rule for a kind of finding that is declared elsewhere, since others than rules find it as well."""
    return Rule(kind.code, kind.doc, kind.severity, kind.is_fixable, find=find)

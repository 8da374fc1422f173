"""Rules: functions that find one kind of error, declared by a decorator; the docstring is the docs page of the code.

The subject of a rule depends on its family: the checks in `checks/` examine a robot, those in `missions/checks` a
mission.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import islice
from typing import Generic, TypeVar

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, FindingKind, Severity, register_kind

S = TypeVar("S")
MOST = 100  # findings of one rule about one subject: a thousand things make a million pairs


@dataclass(frozen=True, slots=True)
class Rule(FindingKind, Generic[S]):
    """A kind of finding together with the function that finds it."""

    find: Callable[[S], Iterable[Finding]] = lambda subject: ()

    def __call__(self, subject: S) -> Iterable[Finding]:
        """Return what is wrong with `subject`: at most the first `MOST` findings."""
        found = list(islice(self.find(subject), MOST + 1))
        if len(found) > MOST:
            rest = f"there are more than these {MOST} findings of {self.code}"
            found[MOST - 1 :] = [replace(found[MOST - 1], help=f"{found[MOST - 1].help}; {rest}".removeprefix("; "))]
        return found


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


def belonging(find: Callable[[S], Iterable[Finding]], kind: FindingKind) -> Rule[S]:
    """Return a rule for a kind of finding that is declared elsewhere, because not only rules find it."""
    return Rule(kind.code, kind.doc, kind.severity, kind.is_fixable, find=find)

"""Rules: functions that find one kind of error, declared by a decorator.

The subject of a rule depends on its family: the checks in `checks/` examine a robot, those in `missions/checks` a
mission.
"""

import inspect
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import islice
from typing import Generic, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, FindingKind, Severity, clauses, register_kind

S = TypeVar("S")
WIRING, NAMES, MISSIONS, OWN, ALL = "wiring", "names", "missions", "own file", "everything"
"""What rules may take for known: all ports with their topics; the names of all components; all missions; the mission
file that a finding is in; everything. The name of a section means its contents."""
EVERYTHING = (ALL, WIRING, NAMES, MISSIONS, OWN)
OUR_CODES = "RBX"  # how the codes of this project begin
MOST = 100  # findings of one rule about one subject: a thousand things make a million pairs


@dataclass(frozen=True, slots=True)
class Rule(FindingKind, Generic[S]):
    """A kind of finding together with the function that finds it.

    `closed` is what it takes for known, because it concludes something from what is not there; with an error in that,
    it is silent. `None` stands for everything in warnings, for nothing in errors.
    """

    find: Callable[[S], Iterable[Finding]] = lambda subject: ()
    closed: tuple[str, ...] | None = None

    @property
    def relies_on(self) -> tuple[str, ...]:
        """Return what it takes for known."""
        if self.closed is None:
            return EVERYTHING if self.severity is Severity.WARNING else ()
        return self.closed

    def __call__(self, subject: S) -> Iterable[Finding]:
        """Return what is wrong with `subject`: at most the first `MOST` findings."""
        found = list(islice(self.find(subject), MOST + 1))
        if len(found) > MOST:
            rest = f"there are more than these {MOST} findings of {self.code}"
            found[MOST - 1 :] = [replace(found[MOST - 1], help=clauses(found[MOST - 1].help, rest))]
        return found


def declared(
    find: Callable[[S], Iterable[Finding]],
    code: str,
    severity: Severity,
    is_fixable: bool,
    closed: tuple[str, ...] | None = None,
) -> Rule[S]:
    """Enter a rule under a code. The docstring of a rule of another package is its docs page.

    Raises:
        ValueError: if it has no docstring, or its code is taken.
    """
    if not find.__doc__:
        raise ValueError(f"check {code} has no docstring, so it would have no docs page")
    doc = "" if code.startswith(OUR_CODES) else inspect.cleandoc(find.__doc__)
    origin = f"{find.__module__}.{find.__qualname__}"
    made: Rule[S] = Rule(code, severity, is_fixable, doc, origin, find=find, closed=closed)
    register_kind(made)
    return made


def belonging(
    find: Callable[[S], Iterable[Finding]], kind: FindingKind, closed: tuple[str, ...] | None = None
) -> Rule[S]:
    """Return a rule for a kind of finding that is declared elsewhere, because not only rules find it."""
    return Rule(kind.code, kind.severity, kind.is_fixable, kind.doc, kind.origin, find=find, closed=closed)

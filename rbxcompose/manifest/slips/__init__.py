"""Slips: beginners' mistakes that are recognised, reported with their correction, and read as they were meant.

Compiler writers call them error productions: each is a function, beside the grammar instead of in it. A slip in a tree
looks at a node at one place of its grammar and returns a `Repair`: the findings, and the node to continue with. So the
reader that follows sees no slips, only the grammar. A family of slips is a package with one `Slips` as decorator; those
of manifests are here: in their text, and in values that a model refuses.
"""

import importlib
import pkgutil
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from graphlib import TopologicalSorter
from typing import Any, Generic, NamedTuple, TypeVar

import yaml

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Fix, Report, Span, kind, replacement
from rbxcompose.manifest.tree import KeyPath, TreeNode

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


QUOTES_NEEDED = kind("RBX1101", is_fixable=True)
NOT_YAML = kind("RBX1102", is_fixable=True)
QUOTE_HELP = "put quotes around this"


class Trouble:
    """An error with its position and the lines of the text; lines and columns count from 0, those of spans from 1."""

    def __init__(self, error: yaml.MarkedYAMLError, text: str, file: str) -> None:
        self.problem = error.problem or ""
        self.context = error.context or ""
        self.file = file
        self.lines = text.split("\n")
        mark = error.problem_mark or error.context_mark
        self.line = mark.line if mark else 0
        self.column = mark.column if mark else 0
        self.start = error.context_mark

    @property
    def line_text(self) -> str:
        """The line of the error."""
        return self.lines[self.line] if self.line < len(self.lines) else ""

    @property
    def before(self) -> str:
        """The line of the error up to the error."""
        return self.line_text[: self.column]

    @property
    def here(self) -> Span:
        """The place of the error."""
        return self.span(self.line, self.column, self.column + 1)

    @property
    def opening(self) -> Span:
        """The place where the construct began that the parser was reading."""
        return self.span(self.start.line, self.start.column, self.start.column + 1) if self.start else self.here

    @property
    def value_column(self) -> int:
        """The column of the value that contains the error, after its key; 0 if no key precedes the error."""
        key = re.match(r"\s*+(- +)*+[^\s:][^:]*+: +", self.before)
        return key.end() if key and key.end() < len(self.before) else 0

    @property
    def is_behind_quote(self) -> bool:
        """Whether a quote was closed right before the error."""
        return self.before.rstrip().endswith(("'", '"'))

    def span(self, line: int, start: int, end: int) -> Span:
        """Return the place of a range of columns in a line."""
        return Span(self.file, line + 1, start + 1, line + 1, end + 1)

    def to_line_end(self, column: int) -> Span:
        """Return the place from a column of the error's line to the end of that line."""
        return self.span(self.line, column, max(len(self.line_text.rstrip()), column + 1))

    def above(self, line: int) -> Iterator[int]:
        """Yield the non-empty lines above a line, nearest first."""
        return (index for index in range(line - 1, -1, -1) if is_written(self.lines[index]))

    def next_line(self, line: int) -> str:
        """Return the next non-empty line, empty if there is none."""
        return next((one for one in self.lines[line + 1 :] if is_written(one)), "")

    def quoting(self, span: Span) -> Fix | None:
        """Return the fix that quotes a text ending its line, None if it may continue or its quotes are ambiguous."""
        written = self.line_text[span.column - 1 : span.end_column - 1]
        meant = written
        if written[:1] == written[-1:] == "'":
            if written.count("'") != 3:
                return None  # which of the quotes belong to the text?
            meant = written[1:-1]
        is_simple = '"' not in meant and "\\" not in meant
        quoted = f'"{meant}"' if is_simple else "'" + meant.replace("'", "''") + "'"
        below = next((line for line in self.lines[self.line + 1 :] if line.strip()), "")
        goes_on = indent(below) > indent(self.line_text)  # then the next line may belong to the same text
        return replacement(span, written, quoted) if written and " #" not in written and not goes_on else None


def indent(line: str) -> int:
    """Return the column in which a line begins."""
    return len(line) - len(line.lstrip(" "))


def behind_dashes(line: str) -> int:
    """Return the column in which a line begins after its dashes."""
    found = re.match(r" *+(- ++)*", line)
    return found.end() if found else 0


def is_written(line: str) -> bool:
    """Return whether a line contains more than a comment."""
    return bool(line.strip()) and not line.lstrip().startswith("#")


# Messages of the parser.
COLON = "mapping values are not allowed"
NO_COLON = "could not find expected ':'"
NO_DASH = "did not find expected '-' indicator"
NO_KEY = "did not find expected key"
ANY = ""


class RefusedValue(NamedTuple):
    """A place that a model refuses: its path in the file, and the finding to report if it is not a slip.

    For a key that is missing or unknown, the node is the map around it; `keys` are those that it takes, if unknown.
    """

    path: KeyPath
    finding: Finding
    keys: Sequence[str] = ()


text_slip: Slips[Callable[[Trouble], Finding | None]] = Slips("rbxcompose.manifest.slips")
value_slip: Slips[Callable[[RefusedValue, TreeNode], Repair[TreeNode] | None]] = Slips("rbxcompose.manifest.slips")

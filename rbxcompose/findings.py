"""Findings: what the compiler says of a manifest, as data with a place, and how it is written for a person.

A stage never prints or raises for a user's mistake; it adds a `Finding` to the `Report` that it was given.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

SIMILAR = 0.6  # difflib ratio from which on a name is offered as "did you mean"
MOST_NAMES = 6  # valid names listed when none is similar


class Severity(StrEnum):
    """How bad a finding is; only errors keep a robot from starting."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """A place in a text: lines and columns count from 1, the end is exclusive and on the same or a later line."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Related:
    """A second place that a finding is about, with a few words on what is there."""

    span: Span
    message: str


@dataclass(frozen=True, slots=True)
class Finding:
    """One mistake: `message` says what is wrong, `label` stands beside the caret, `help` says what to do."""

    code: str
    message: str
    span: Span | None = None
    label: str = ""
    help: str = ""
    related: tuple[Related, ...] = ()
    severity: Severity = Severity.ERROR


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of finding: a stable code and the text of its docs page (first line: title)."""

    code: str
    doc: str
    severity: Severity = Severity.ERROR

    def at(
        self, span: Span | None, message: str, *, label: str = "", help: str = "", related: Iterable[Related] = ()
    ) -> Finding:
        """Return a finding of this kind at `span`."""
        return Finding(self.code, message, span, label, help, tuple(related), self.severity)


KINDS: dict[str, Kind] = {}  # every kind that has been imported, by code


def kind(code: str, doc: str, severity: Severity = Severity.ERROR) -> Kind:
    """Declare a kind of finding beside the code that finds it.

    Raises:
        ValueError: if another kind has this code.
    """
    made = Kind(code, doc, severity)
    register_kind(made)
    return made


def register_kind(made: Kind) -> None:
    """Enter a kind into `KINDS`; a code belongs to one kind only."""
    if KINDS.setdefault(made.code, made).doc != made.doc:
        raise ValueError(f"two kinds of finding have the code {made.code}")


@dataclass(slots=True)
class Report:
    """Collects the findings of one run."""

    findings: list[Finding] = field(default_factory=list)

    def add(self, finding: Finding) -> None:
        """Keep one finding."""
        self.findings.append(finding)

    def extend(self, findings: Iterable[Finding]) -> None:
        """Keep several findings."""
        self.findings.extend(findings)

    @property
    def has_errors(self) -> bool:
        """Tell whether anything found keeps the robot from starting."""
        return any(finding.severity is Severity.ERROR for finding in self.findings)

    def __iter__(self) -> Iterator[Finding]:
        """Yield the findings once each, by place."""
        return iter(sorted(dict.fromkeys(self.findings), key=_place))


def _place(finding: Finding) -> tuple[bool, Span | None, str, str]:
    # Findings without a place come first: they are about the whole run.
    return (finding.span is not None, finding.span, finding.code, finding.message)


def suggest(name: str, valid: Iterable[str], what: str = "valid names") -> str:
    """Return the help for a misspelt `name`: the nearest of `valid`, else up to six of them, else nothing."""
    names = sorted(set(valid))
    near = difflib.get_close_matches(name, names, n=1, cutoff=SIMILAR)
    if near:
        return f"did you mean '{near[0]}'?"
    if not names:
        return ""
    rest = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"{what}: {', '.join(names[:MOST_NAMES])}{rest}"


Sources = Mapping[str, str]  # text of every file that a span may name

"""Fixes of findings as changes to texts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from rbxcompose.dataclass import dataclass
from rbxcompose.edits import apply
from rbxcompose.findings import Finding, Span
from rbxcompose.lsp.project import Project


@dataclass(frozen=True, slots=True)
class TextChange:
    """A text that replaces what is between two positions (line, column, from 0)."""

    start: tuple[int, int]
    end: tuple[int, int]
    text: str


@dataclass(frozen=True, slots=True)
class CodeAction:
    """An action that an editor offers for a finding."""

    title: str
    finding: Finding
    is_safe: bool
    changes: dict[Path, TextChange]


def actions(project: Project, findings: Iterable[Finding], first: int, last: int) -> Iterator[CodeAction]:
    """Yield the fixes of the findings on the lines `first` to `last` (from 0)."""
    for finding in findings:
        span, fix = finding.span, finding.fix
        if span is None or fix is None or not _meets(span, first, last):
            continue
        files = {edit.span.file: Path(edit.span.file).resolve() for edit in fix.edits}
        texts = {file: project.text(path) for file, path in files.items()}
        after = apply([fix], texts).texts
        changes = {files[file]: change_of(texts[file], after[file]) for file in files if texts[file] != after[file]}
        if changes:
            yield CodeAction(fix.title, finding, fix.is_safe, changes)


def _meets(span: Span, first: int, last: int) -> bool:
    return span.line - 1 <= last and span.end_line - 1 >= first


def change_of(before: str, after: str) -> TextChange:
    """Return the smallest single change that turns `before` into `after`."""
    shortest = min(len(before), len(after))
    start = next((index for index in range(shortest) if before[index] != after[index]), shortest)
    most = shortest - start
    tail = next((size for size in range(most) if before[-1 - size] != after[-1 - size]), most)
    end = len(before) - tail
    return TextChange(_position(before, start), _position(before, end), after[start : len(after) - tail])


def _position(text: str, offset: int) -> tuple[int, int]:
    return text.count("\n", 0, offset), offset - (text.rfind("\n", 0, offset) + 1)

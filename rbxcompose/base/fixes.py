"""Applying fixes to texts, byte-exact outside of what they replace. Pure: callers read and write the files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, replace

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Edit, Finding, Fix, Sources

COMMAND_LINE = "--"  # prefix of the names of texts that are not files, such as `--set`
_BYTE_ORDER_MARK = "\ufeff"
_QUOTES = "'\""


@dataclass(frozen=True, slots=True)
class EditPlace:
    """Where an edit applies: offsets in the text of a file, and the new text for them."""

    file: str
    start: int
    end: int
    text: str
    is_guard: bool = False

    def meets(self, other: EditPlace) -> bool:
        """Return whether the two edits overlap and at least one of them changes text."""
        if self.file != other.file or (self.is_guard and other.is_guard):
            return False
        return self.start == other.start or (self.start < other.end and other.start < self.end)


@dataclass(slots=True)
class Applied:
    """The result of applying fixes: the new texts, the fixes applied, and those postponed since they overlap others."""

    texts: dict[str, str]
    done: list[Fix] = field(default_factory=list)
    postponed: list[Fix] = field(default_factory=list)


def apply(fixes: Iterable[Fix], texts: Mapping[str, str]) -> Applied:
    """Apply each fix completely or not at all; of overlapping fixes, only the first.

    `texts` are whole files as they are on disk, with byte order mark and line endings. A fix is skipped if one of its
    edits is for another file, or does not find the text that it expects.
    """
    lines = {file: _Lines(text) for file, text in texts.items()}
    out = Applied(dict(texts))
    taken: list[EditPlace] = []
    for fix in dict.fromkeys(fixes):
        places = _places(fix, lines)
        if places is None:
            continue
        if any(edit_place.meets(other) for edit_place in places for other in taken):
            out.postponed.append(fix)
            continue
        taken.extend(places)
        out.done.append(fix)
    for place in sorted(taken, key=lambda place: place.start, reverse=True):
        if not place.is_guard:
            text = out.texts[place.file]
            out.texts[place.file] = text[: place.start] + place.text + text[place.end :]
    return out


def places(fixes: Iterable[Fix], texts: Mapping[str, str]) -> Iterator[list[EditPlace] | None]:
    """Yield where the edits of each fix apply; None for a fix that does not."""
    lines = {file: _Lines(text) for file, text in texts.items()}
    return (_places(fix, lines) for fix in fixes)


def safe_fixes(findings: Iterable[Finding], sources: Sources) -> list[Fix]:
    """Return the safe fixes that can be applied to the texts that were read, each once."""
    lines: dict[str, _Lines] = {}
    found = []
    for fix in dict.fromkeys(finding.fix for finding in findings):
        if fix is None or not fix.is_safe or any(edit.span.file.startswith(COMMAND_LINE) for edit in fix.edits):
            continue
        for edit in fix.edits:
            if edit.span.file in sources and edit.span.file not in lines:
                lines[edit.span.file] = _Lines(sources[edit.span.file])
        if _places(fix, lines) is not None:
            found.append(fix)
    return found


def exact(fix: Fix | None, sources: Sources) -> Fix | None:
    """Return a fix whose edits span exactly the text they replace (within quotes), None if they do not apply."""
    if fix is None:
        return None
    edits = []
    for edit in fix.edits:
        lines = _Lines(sources.get(edit.span.file, ""))
        place = lines.place(edit)
        start = lines.offset(edit.span.line, edit.span.column)
        if place is None or start is None:
            return None
        shift = place.start - start
        span = edit.span._replace(column=edit.span.column + shift, end_column=edit.span.end_column - shift)
        edits.append(replace(edit, span=span))
    return replace(fix, edits=tuple(edits))


def _places(fix: Fix, lines: Mapping[str, _Lines]) -> list[EditPlace] | None:
    """Return the places of all edits of a fix, None if one of them does not find the text that it expects."""
    found = [lines[edit.span.file].place(edit) if edit.span.file in lines else None for edit in fix.edits]
    places = [place for place in found if place is not None]
    return places if len(places) == len(found) else None


class _Lines:
    """A text by lines and columns, which count characters from 1; a byte order mark is not counted."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines = text.split("\n")
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line) + 1)
        self.mark = len(_BYTE_ORDER_MARK) if text.startswith(_BYTE_ORDER_MARK) else 0

    def offset(self, line: int, column: int) -> int | None:
        """Return the offset of a line and column, None if it is outside of the text."""
        if not 1 <= line <= len(self.lines):
            return None
        offset = column - 1 + (self.mark if line == 1 else 0)
        return self.starts[line - 1] + offset if 0 <= offset <= len(self.lines[line - 1]) else None

    def place(self, edit: Edit) -> EditPlace | None:
        """Return where an edit lands: at its span or, in quotes, within them."""
        span = edit.span
        start, end = self.offset(span.line, span.column), self.offset(span.end_line, span.end_column)
        if start is None or end is None or end < start:
            return None
        there = self.text[start:end].replace("\r\n", "\n")
        place = EditPlace(span.file, start, end, edit.text, edit.text == edit.old)
        if there == edit.old:
            return place
        is_plain = not set(edit.text) & set(_QUOTES + "\\")
        if is_plain and any(there == f"{quote}{edit.old}{quote}" for quote in _QUOTES):
            return replace(place, start=start + 1, end=end - 1)
        return None

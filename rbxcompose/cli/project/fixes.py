"""Write safe fixes into the files of a project until nothing fixable is left."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from rbxcompose.atomic_files import replace_file
from rbxcompose.edits import apply, safe_fixes
from rbxcompose.findings import Finding, Fix, Report, Sources, nearest
from rbxcompose.manifest.header import KINDS
from rbxcompose.manifest.limits import FILE_BYTES
from rbxcompose.printable import plain
from rbxcompose.regular_files import read_regular

_KIND = re.compile(r"^[ \t]*+(?:[{,]\s*+|\{[^\n]*?,\s*+)?+['\"]?kind['\"]?\s*+:\s*+['\"]?(\w++)", re.MULTILINE)
ROUNDS = 20  # one fix may reveal the next mistake
_WORDS = 200  # characters of a title

PrintLine = Callable[[str], None]


class CheckedTexts(Protocol):
    """The findings of a check, and the texts that it read."""

    @property
    def report(self) -> Report:
        """Return the findings."""
        ...

    @property
    def sources(self) -> Sources:
        """Return the texts by the names that findings show."""
        ...


def fix(check: Callable[[], CheckedTexts], say: PrintLine) -> None:
    """Check, apply and report all safe fixes, and repeat until none is left."""
    for _ in range(ROUNDS):
        checked = check()
        fixes = safe_fixes(checked.report, checked.sources)
        if not fixes or not _apply(fixes, checked.sources, say):
            return
    say(f"stopped after {ROUNDS} rounds: each fix leads to another")


def only_ours(findings: Iterable[Finding], sources: Sources, projects: Collection[Path]) -> Iterator[Finding]:
    """Yield the findings, but drop fixes that would change a file outside of `projects`, or one that is not ours."""
    for finding in findings:
        is_ours = finding.fix is None or _is_ours(finding.fix, sources, projects)
        yield finding if is_ours else replace(finding, fix=None)


def _is_ours(one: Fix, sources: Sources, projects: Collection[Path]) -> bool:
    files = {edit.span.file for edit in one.edits}
    if not all(_has_known_kind(sources[file]) for file in files if file in sources):
        return False
    paths = {Path(file).resolve() for file in files}
    return all(any(path.is_relative_to(project) for project in projects) for path in paths)


def _has_known_kind(text: str) -> bool:
    """Return whether a text is XML, which a robot names as its body, or a manifest of a kind that there is."""
    if text.lstrip().startswith("<"):
        return True
    written = _KIND.search(text)
    return written is not None and bool(nearest(written[1], KINDS))  # a misspelt one may be corrected


def _apply(fixes: list[Fix], sources: Sources, say: PrintLine) -> bool:
    """Write fixes and return whether any file has changed."""
    texts = {}
    for file in dict.fromkeys(edit.span.file for one in fixes for edit in one.edits):
        text = _unchanged_text(file, sources[file])
        if text is None:
            say(f"left {plain(file)} as it is: it has changed since it was read, or can no longer be read")
        else:
            texts[file] = text
    out = apply(fixes, texts)
    written = {file for file, text in out.texts.items() if text != texts[file] and _write(file, text, say)}
    for one in out.done:
        if all(edit.span.file in written for edit in one.edits):
            say(f"fixed {_told(one)}")
    for one in out.postponed:
        say(f"not yet {_told(one)}: it overlaps with another fix")
    return bool(written)


def _told(one: Fix) -> str:
    first = next(edit for edit in one.edits if edit.text != edit.old)
    return f"{plain(str(first.span))}: {plain(one.title, _WORDS)}"


def _unchanged_text(file: str, read: str) -> str | None:
    """Return the text of a file with its byte order mark and line ends; None if it differs from what was read."""
    try:
        text = read_regular(Path(file), FILE_BYTES).decode("utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    return text if text.removeprefix("\ufeff").replace("\r\n", "\n") == read else None


def _write(file: str, text: str, say: PrintLine) -> bool:
    try:
        replace_file(Path(file).resolve(), text.encode("utf-8"))
    except OSError as error:
        say(f"left {plain(file)} as it is: {error.strerror}")
        return False
    return True

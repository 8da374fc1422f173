"""Texts of a robot's project as editors see them: read with a hash, compared, replaced as a whole or not at all.

Only files of the project are changed, never through a link, and only while they are still what was read.
"""

from __future__ import annotations

import hashlib
import os
from difflib import unified_diff
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import open_regular, replace_file
from rbxcompose.base.findings import Finding
from rbxcompose.base.requests import Refused
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.tree import FILE_BYTES

BYTE_ORDER_MARK = "\ufeff"
_AROUND = 2  # lines shown around a change
_MOST_LINES = 2000  # of a difference


@dataclass(frozen=True, slots=True)
class ReadText:
    """A file as it is on disk; `text` has lines that end with a line feed, and no byte order mark."""

    path: Path
    text: str
    hash: str
    line_end: str
    has_mark: bool

    def encoded(self, text: str) -> bytes:
        """Return another text as this file has it.

        Raises:
            Refused: if it cannot be written.
        """
        whole = text.replace("\n", self.line_end)
        try:
            data = f"{BYTE_ORDER_MARK if self.has_mark else ''}{whole}".encode()
        except UnicodeEncodeError as error:
            raise Refused("the text has characters that no file can hold") from error
        if len(data) > FILE_BYTES:
            raise Refused(f"the text is larger than {FILE_BYTES:,} bytes")
        return data

    def difference(self, text: str) -> list[str]:
        """Return the lines that another text changes, with some around them."""
        return difference(self.text, text)


class ProjectTexts:
    """Reads and replaces the files of a project."""

    def __init__(self, project: Path) -> None:
        self.project = project

    def shown(self, path: Path) -> str:
        """Return the name of a file for people."""
        return str(path.relative_to(self.project)) if path.is_relative_to(self.project) else shown_name(path)

    def why_not(self, path: Path) -> str:
        """Return why a file cannot be changed; empty if it can."""
        shown = self.shown(path)
        if not path.is_relative_to(self.project):
            return f"'{shown}' belongs to the library: copy it into the project to change it"
        return "" if os.access(path, os.W_OK) else f"'{shown}' is not writable"

    def read(self, path: Path) -> ReadText:
        """Return a file.

        Raises:
            Refused: if it cannot be read, or not be edited as a text.
        """
        shown = self.shown(path)
        try:
            with open_regular(path, follow=False) as file:
                data = file.read(FILE_BYTES + 1)
        except OSError as error:
            raise Refused(f"'{shown}' cannot be read: {error.strerror}") from error
        if len(data) > FILE_BYTES:
            raise Refused(f"'{shown}' is larger than {FILE_BYTES:,} bytes")
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError as error:
            raise Refused(f"'{shown}' is not UTF-8: there is a wrong byte at {error.start}") from error
        has_mark = text.startswith(BYTE_ORDER_MARK)
        text = text.removeprefix(BYTE_ORDER_MARK)
        line_end = "\r\n" if "\r\n" in text else "\n"
        plain = text.replace("\r\n", "\n")
        if "\r" in plain or plain.replace("\n", line_end) != text:
            raise Refused(f"the lines of '{shown}' end in different ways: use another editor")
        return ReadText(path, plain, hash_of(data), line_end, has_mark)

    def require_unchanged(self, read: ReadText, known: str) -> None:
        """Refuse to go on with a file that may not be changed, or is another one than that with a known hash.

        Raises:
            Refused: with the reason.
        """
        if why := self.why_not(read.path):
            raise Refused(why)
        if read.hash != known:
            raise Refused(f"'{self.shown(read.path)}' has changed on disk since it was opened: load it again")

    def replace(self, path: Path, data: bytes) -> None:
        """Write a whole file or nothing.

        Raises:
            Refused: if it could not be written.
        """
        try:
            if path.resolve() != path:
                raise Refused(f"'{self.shown(path)}' has become a link")
            replace_file(path, data)
        except OSError as error:
            raise Refused(f"'{self.shown(path)}' was not saved: {error.strerror}") from error


def difference(old: str, new: str) -> list[str]:
    """Return the lines that differ between a text on disk and a new one, with some around them."""
    lines = list(unified_diff(old.split("\n"), new.split("\n"), "on disk", "here", n=_AROUND, lineterm=""))[2:]
    left = len(lines) - _MOST_LINES
    return lines if left <= 0 else [*lines[:_MOST_LINES], f"@@ and {left} more lines @@"]


def words_of(finding: Finding) -> dict[str, Any]:
    """Return a finding as data, without its place."""
    message = f"{finding.message} ({finding.label})" if finding.label else finding.message
    return {"code": finding.code, "severity": str(finding.severity), "message": message, "help": finding.help}


def hash_of(data: bytes) -> str:
    """Return what tells whether a file is still the one that was read."""
    return hashlib.sha256(data).hexdigest()

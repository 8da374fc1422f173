"""What the fenced process answers about a xacro file. It is not trusted: what was expanded may have made it up."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import UnreadableError, from_data

_PLACE = re.compile(r".*\|[1-9]\d{0,7}\|[1-9]\d{0,7}\|\d{1,8}", re.DOTALL)


@dataclass(frozen=True, slots=True)
class BareTag:
    """A tag by the place of its `<`, its name, and the line and column of the tag that closes it, if there is one."""

    line: int
    column: int
    name: str
    closed: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class BareFile:
    """The tags of a file that lack the prefix, in their order, and its root if that does not bind the prefix."""

    tags: tuple[BareTag, ...]
    root: BareTag | None = None


@dataclass(frozen=True, slots=True)
class XacroAnswer:
    """The files that were read, and either the expanded text or the error with its place."""

    files: tuple[str, ...] = ()
    text: str = ""
    error: str = ""
    place: str = ""
    bare: Mapping[str, BareFile] = field(default_factory=dict)
    arguments: tuple[str, ...] = ()
    """Names of the arguments that the files declare."""
    used: tuple[str, ...] = ()
    """All files and folders that it tried to read: while they are the same, so is the answer."""


def read_answer(data: bytes, roots: Sequence[str]) -> XacroAnswer | None:
    """Return an answer as far as it is about files below the roots; None if it is none."""
    try:
        answer: XacroAnswer = from_data(XacroAnswer, json.loads(data))
    except (UnreadableError, ValueError, RecursionError):
        return None
    return limited(answer, roots)


def limited(answer: XacroAnswer, roots: Sequence[str]) -> XacroAnswer:
    """Return an answer as far as it is about files below the roots."""
    real = [Path(root).resolve() for root in roots]
    files, used = (
        tuple(text for text in files if any(Path(text).is_relative_to(root) for root in real))
        for files in (answer.files, answer.used)
    )
    bare = {file: found for file, found in answer.bare.items() if file in files and found.tags}
    is_place = _PLACE.fullmatch(answer.place) and answer.place.rsplit("|", 3)[0] in files
    return replace(answer, files=files, used=used, bare=bare, place=answer.place if is_place else "")

"""xacro files to URDF text, by a fenced child process whose answers are kept."""

from __future__ import annotations

import json
import os
import re
import stat
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from pathlib import Path
from typing import NamedTuple

from xxhash import xxh3_128_hexdigest

import rbxcompose
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import open_regular, read_regular, replace_file
from rbxcompose.base.findings import Edit, Finding, Fix, Severity, Span, kind, once, suggest
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import UnreadableError, from_data, to_data
from rbxcompose.domains.body.xacro_answer import BareFile, XacroAnswer, limited, read_answer
from rbxcompose.domains.body.xml_reader import PLACE, XACRO, span_of_place
from rbxcompose.manifest.files import library_root, shown_name

MOST_FILES = 256
_LARGEST = 24_000_000  # [bytes]
NO_PREFIX = kind("RBX2014", Severity.WARNING, is_fixable=True)
BINDING = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
_SHOWN = 60  # characters of a name in a message
KEPT = 64  # answers
_LARGEST_READ = 8_000_000  # [bytes] of a file that xacro reads
NOT_EXPANDED = kind("RBX2007")
_NAMESPACE = "http://www.ros.org/wiki/xacro"
_UNKNOWN = (
    (re.compile(r"unknown macro name: (?:xacro:)?(\w+)"), "macro", "macros"),
    (re.compile(r"name '(\w+)' is not defined"), "property", "properties"),
    (re.compile(r"Undefined substitution argument (\w+)"), "arg", "arguments"),
)
"""What an error of xacro says of a name, the element that declares such names, and what they are called."""
_XACRO_LARGEST = 1_000_000  # [B] of a file whose names are proposed
_PLACES = re.compile(rf' {PLACE}="[^"]*"')
NO_ARGUMENT = kind("RBX2020", Severity.WARNING, is_fixable=True)


@dataclass(frozen=True, slots=True)
class KeptAnswer:
    """An answer, and digests of the files and folders that it was made of."""

    answer: XacroAnswer
    used: Mapping[str, str]


def read_kept(request: str, roots: Sequence[str]) -> KeptAnswer | None:
    """Return what was kept for a request; None if that is nothing, or not written by this user alone."""
    path = _path(request)
    try:
        with open_regular(path, follow=False) as file:
            about = os.fstat(file.fileno())
            if about.st_uid != os.getuid() or about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                return None
            kept: KeptAnswer = from_data(KeptAnswer, json.loads(file.read(_LARGEST)))
    except (OSError, ValueError, RecursionError, UnreadableError):
        return None
    answer = limited(kept.answer, roots)
    return replace(kept, answer=answer) if set(answer.used) == kept.used.keys() else None


def keep(request: str, kept: KeptAnswer) -> None:
    """Keep an answer for later commands; without a folder that can be written, there is none to keep it in."""
    path = _path(request)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        replace_file(path, json.dumps(to_data(kept)).encode(), mode=0o600)
        files = sorted(path.parent.iterdir(), key=lambda one: one.stat().st_mtime_ns)
        for old in files[:-MOST_FILES]:
            old.unlink()


def _path(request: str) -> Path:
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    return home / "rbxcompose/xacro" / f"{xxh3_128_hexdigest(f'{rbxcompose.__version__} {request}'.encode())}.json"


def missing_prefixes(files: Mapping[str, BareFile]) -> Iterator[Finding]:
    """Yield one finding for each file with bare tags, as the fenced process reports them."""
    for path, found in files.items():
        file, first, count = shown_name(Path(path)), found.tags[0], len(found.tags)
        others = "" if count == 1 else f", like {count - 1} other {'tag' if count == 2 else 'tags'} of this file"
        is_ours = not Path(path).is_relative_to(library_root())
        yield NO_PREFIX.at(
            Span(file, first.line, first.column, first.line, first.column + len(first.name) + 1),
            f"'<{plain(first.name, _SHOWN)}>' lacks the prefix '{XACRO}'{others}",
            help="write it, since xacro of ROS 2 needs it",
            fix=Fix(tuple(_edits(file, found)), True, f"prefix '{XACRO}' for {count} {'tag' if count == 1 else 'tags'}")
            if is_ours
            else None,
        )


def _edits(file: str, found: BareFile) -> Iterator[Edit]:
    if root := found.root:
        yield _edit(file, root.line, root.column, f"<{root.name}", f"<{root.name} {BINDING}")
    for tag in found.tags:
        yield _edit(file, tag.line, tag.column, f"<{tag.name}", f"<{XACRO}{tag.name}")
        if tag.closed is not None:
            yield _edit(file, *tag.closed, f"</{tag.name}", f"</{XACRO}{tag.name}")


def _edit(file: str, line: int, column: int, old: str, new: str) -> Edit:
    return Edit(Span(file, line, column, line, column + len(old)), old, new)


class XacroRequest(NamedTuple):
    """What is asked, as JSON, and the folders that the answer may be about."""

    text: str
    roots: tuple[str, ...]


_answers: OrderedDict[XacroRequest, KeptAnswer] = OrderedDict()


def answers(requests: Sequence[XacroRequest]) -> list[XacroAnswer | None]:
    """Return the answer to each request; None where the process did not end within its limits."""
    failed = _failed()
    known = {xacro_request: _kept(xacro_request) for xacro_request in requests}
    new = [xacro_request for xacro_request, answer in known.items() if answer is None and xacro_request not in failed]
    for request, answer in zip(new, _asked(new) if new else (), strict=True):
        known[request] = answer
        if answer is None:
            failed.add(request)
        else:
            kept = KeptAnswer(answer, {path: _digest(path) for path in answer.used})
            _remember(request, kept)
            keep(request.text, kept)
    return [known[xacro_request] for xacro_request in requests]


@once
def _failed() -> set[XacroRequest]:
    """Return the requests of this compile that had no answer: profiles are tried one after another."""
    return set()


def _kept(request: XacroRequest) -> XacroAnswer | None:
    kept = _answers.get(request) or read_kept(request.text, request.roots)
    if kept is None or any(_digest(path) != digest for path, digest in kept.used.items()):
        return None
    _remember(request, kept)
    return kept.answer


def _remember(request: XacroRequest, kept: KeptAnswer) -> None:
    _answers[request] = kept
    _answers.move_to_end(request)
    if len(_answers) > KEPT:
        _answers.popitem(last=False)


@once
def _digest(path: str) -> str:
    """Return a digest of what a file or folder contains; none for what cannot be read."""
    try:
        is_folder = os.path.isdir(path)
        data = "\0".join(sorted(os.listdir(path))).encode() if is_folder else read_regular(Path(path), _LARGEST_READ)
        return xxh3_128_hexdigest(data)
    except OSError:
        return ""


def _asked(requests: Sequence[XacroRequest]) -> list[XacroAnswer | None]:
    from rbxcompose.base.processes import fenced_answers  # which few robots need

    written = fenced_answers("rbxcompose.domains.body.xacro_child", [item.text for item in requests])
    return [read_answer(data, request.roots) for data, request in zip(written, requests, strict=True)]


@dataclass(frozen=True, slots=True)
class Expanded:
    """URDF text whose elements say where they were written; `notes` are what to say about the xacro files."""

    located: str
    notes: tuple[Finding, ...] = ()

    @property
    def text(self) -> str:
        """Return the URDF for other programs."""
        return _PLACES.sub("", self.located)


@dataclass(frozen=True, slots=True)
class XacroFile:
    """A xacro file, its arguments, and the folders that it may read: `roots` and those of packages.

    `span` is the place that names the file, for what has no place in it.
    """

    path: Path
    arguments: Mapping[str, str]
    packages: Mapping[str, Path]
    roots: Sequence[Path]
    span: Span
    spans: Mapping[str, Span] = field(default_factory=dict)
    """Places of the arguments."""

    @property
    def request(self) -> XacroRequest:
        """Return what the fenced process is asked."""
        packages = {name: str(folder) for name, folder in self.packages.items()}
        roots = tuple(str(root) for root in (*self.roots, *self.packages.values()))
        request = {"file": str(self.path), "arguments": dict(self.arguments), "packages": packages, "roots": roots}
        return XacroRequest(json.dumps(request), roots)


def expand_all(xacros: Sequence[XacroFile]) -> list[tuple[Expanded | Finding, Sequence[Path]]]:
    """Expand xacro files, or return why that is impossible; each with the files below its roots that were read."""
    return [
        _result(xacro, item) for xacro, item in zip(xacros, answers([xacro.request for xacro in xacros]), strict=True)
    ]


def _result(xacro: XacroFile, answer: XacroAnswer | None) -> tuple[Expanded | Finding, Sequence[Path]]:
    if answer is None:
        message = f"'{plain(shown_name(xacro.path))}' does not end within its limits of time and memory"
        return NOT_EXPANDED.at(xacro.span, message, help="does a macro call itself?"), ()
    files = tuple(dict.fromkeys(map(Path, answer.files)))
    if answer.error:
        place = span_of_place(answer.place) if answer.place else xacro.span
        message = " ".join(answer.error.split())
        return NOT_EXPANDED.at(place, plain(message, 300), help=_cure(message, files)), files
    return Expanded(answer.text, (*missing_prefixes(answer.bare), *_unused(xacro, answer))), files


def _cure(message: str, files: Sequence[Path]) -> str:
    """Return what to do about an error of xacro: the name that was probably meant, or what is missing."""
    if "unbound prefix" in message:
        return f"write '<robot xmlns:xacro=\"{_NAMESPACE}\" ...>'"
    for asked, element, what in _UNKNOWN:
        if found := asked.search(message):
            declared = re.compile(rf'<xacro:{element}\s[^>]*?\bname="(\w+)"')
            names = dict.fromkeys(name for text in _texts(files) for name in declared.findall(text))
            return suggest(found[1], names, what)
    return ""


def _texts(files: Sequence[Path]) -> Iterator[str]:
    for file in files:
        with suppress(OSError, ValueError):  # the file was read a moment ago; without it there is only no suggestion
            yield read_regular(file, _XACRO_LARGEST).decode()


def _unused(xacro: XacroFile, answer: XacroAnswer) -> Iterator[Finding]:
    """Yield the arguments that are given and that no file declares: they would have no effect."""
    for name in xacro.arguments:
        if name not in answer.arguments:
            message = f"'{plain(shown_name(xacro.path))}' has no argument '{plain(name, 60)}'"
            span = xacro.spans.get(name, xacro.span)
            yield NO_ARGUMENT.misspelt(span, message, name, answer.arguments, "its arguments", taken=xacro.arguments)

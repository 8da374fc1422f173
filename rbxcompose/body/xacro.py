"""xacro files -> URDF text, by a fenced child process."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from pathlib import Path

from rbxcompose.body.prefixes import missing_prefixes
from rbxcompose.body.xacro_answer import XacroAnswer
from rbxcompose.body.xacro_answers import XacroRequest, answers
from rbxcompose.body.xml_reader import PLACE, span_of_place
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Severity, Span, kind, suggest
from rbxcompose.manifest.files import shown_name
from rbxcompose.printable import plain
from rbxcompose.regular_files import read_regular

NOT_EXPANDED = kind("RBX2007")
_NAMESPACE = "http://www.ros.org/wiki/xacro"
_UNKNOWN = (
    (re.compile(r"unknown macro name: (?:xacro:)?(\w+)"), "macro", "macros"),
    (re.compile(r"name '(\w+)' is not defined"), "property", "properties"),
    (re.compile(r"Undefined substitution argument (\w+)"), "arg", "arguments"),
)
"""What an error of xacro says of a name, the element that declares such names, and what they are called."""
_LARGEST = 1_000_000  # [B] of a file whose names are proposed
_PLACES = re.compile(rf' {PLACE}="[^"]*"')


NO_ARGUMENT = kind("RBX2020", Severity.WARNING, is_fixable=True)


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
    return [_told(one, answer) for one, answer in zip(xacros, answers([one.request for one in xacros]), strict=True)]


def expand(
    path: Path, arguments: Mapping[str, str], packages: Mapping[str, Path], roots: Sequence[Path], span: Span
) -> tuple[Expanded | Finding, Sequence[Path]]:
    """Expand one xacro file."""
    return expand_all([XacroFile(path, arguments, packages, roots, span)])[0]


def _told(xacro: XacroFile, answer: XacroAnswer | None) -> tuple[Expanded | Finding, Sequence[Path]]:
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
            yield read_regular(file, _LARGEST).decode()


def _unused(xacro: XacroFile, answer: XacroAnswer) -> Iterator[Finding]:
    """Yield the arguments that are given and that no file declares: they would have no effect."""
    for name in xacro.arguments:
        if name not in answer.arguments:
            message = f"'{plain(shown_name(xacro.path))}' has no argument '{plain(name, 60)}'"
            span = xacro.spans.get(name, xacro.span)
            yield NO_ARGUMENT.misspelt(span, message, name, answer.arguments, "its arguments", taken=xacro.arguments)

"""Texts of XML files, read strictly into located elements: whether they are XML, and of a URDF its root."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field
from pathlib import Path
from xml.parsers import expat

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, FindingKind, Related, Span, kind, once
from rbxcompose.base.printable import plain
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.tree import DEPTH, URDF_ELEMENTS
from rbxcompose.manifest.yaml_nodes import TOO_LARGE

NOT_XML = kind("RBX2001")
NOT_URDF = kind("RBX2002")

ROOT = "robot"
XACRO = "xacro:"
_ENCODINGS = {"utf-8", "us-ascii", "ascii"}  # names for UTF-8 in a declaration
_WORDS = {
    expat.errors.XML_ERROR_NO_ELEMENTS: "there is no element in this file",
    expat.errors.XML_ERROR_UNCLOSED_TOKEN: "the file ends before this does",
    expat.errors.XML_ERROR_INVALID_TOKEN: "this does not belong here",
    expat.errors.XML_ERROR_DUPLICATE_ATTRIBUTE: "this attribute occurs twice",
    expat.errors.XML_ERROR_UNDEFINED_ENTITY: "this entity is not defined",
    expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT: "the root element has ended, and nothing may follow it",
    expat.errors.XML_ERROR_MISPLACED_XML_PI: "'<?xml' must be the very first thing in the file",
}
PLACE = "rbx-place"  # an attribute that an expanded xacro has: where its element was written
_SHOWN = 60  # characters of a name in a message


_IN_TEXT = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;"})
_IN_QUOTES = _IN_TEXT | str.maketrans({"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})


def escaped(text: str) -> str:
    """Return a text as it stands in an element: as `xml.sax.saxutils` does, which imports the network's modules."""
    return text.translate(_IN_TEXT)


def quoted(value: str) -> str:
    """Return the value of an attribute in quotes."""
    text = value.translate(_IN_QUOTES)
    if '"' in text and "'" not in text:
        return f"'{text}'"
    inside = text.replace('"', "&quot;")
    return f'"{inside}"'


def span_of_place(place: str) -> Span:
    """Return the span that `PLACE` holds: file, line, first column and length, with `|` between them."""
    file, line, column, length = place.rsplit("|", 3)
    return Span(shown_name(Path(file)), int(line), int(column), int(line), int(column) + int(length))


@dataclass(slots=True)
class XmlElement:
    """An element with the place of its tag. `text` is the text directly in it, before its first child."""

    name: str
    attributes: dict[str, str]
    span: Span
    children: list[XmlElement] = field(default_factory=list)
    text: str = ""

    def all(self, name: str) -> Iterator[XmlElement]:
        """Yield the children of this name."""
        return (child for child in self.children if child.name == name)

    def first(self, name: str) -> XmlElement | None:
        """Return the first child of this name, if there is one."""
        return next(self.all(name), None)


@once  # a profile rarely changes the body
def read_urdf(text: str, file: str) -> XmlElement | Finding:
    """Return the root of a URDF, or the first mistake that keeps a text from being one.

    `file` is its name in findings. Elements that carry a `PLACE` have that instead of their own.
    """
    return read_xml(text, file, URDF)


@dataclass(frozen=True, slots=True)
class XmlFormat:
    """A kind of XML files: the name of its root, what findings call a file, and the kind of those about its root."""

    root: str
    what: str
    wrong: FindingKind


URDF = XmlFormat(ROOT, "a URDF file", NOT_URDF)
ANY = XmlFormat("", "this file", NOT_XML)
"""XML with any root."""


def read_xml(text: str, file: str, format_: XmlFormat = ANY) -> XmlElement | Finding:
    """Return the root of a text of this format, or the first mistake that keeps it from being one."""
    try:
        return _Reader(file, format_).read(text)
    except _RefusedError as refused:
        return refused.finding


class _RefusedError(Exception):
    """Stops the parser, even from within its callbacks."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


class _Reader:
    """Builds the tree, within limits."""

    def __init__(self, file: str, format_: XmlFormat) -> None:
        self.file = file
        self.format = format_
        self.open: list[XmlElement] = []
        self.root: XmlElement | None = None
        self.elements = 0
        self.lines: list[str] = []
        self.parser = expat.ParserCreate("utf-8")
        self.parser.XmlDeclHandler = self._declared
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.StartElementHandler = self._begun
        self.parser.EndElementHandler = self._ended
        self.parser.CharacterDataHandler = self._texted

    def read(self, text: str) -> XmlElement:
        """Read a whole text and return its root.

        Raises:
            _RefusedError: with the first mistake.
        """
        self.lines = text.split("\n")
        try:
            self.parser.Parse(text, True)
        except expat.ExpatError as error:
            raise _RefusedError(self._malformed(error)) from None
        if self.root is None:
            raise _RefusedError(NOT_XML.at(Span(self.file, 1, 1, 1, 2), "there is no element in this file"))
        return self.root

    def _declared(self, version: str, encoding: str | None, standalone: int) -> None:
        if encoding is not None and encoding.lower() not in _ENCODINGS:
            message = f"this file declares the encoding '{plain(encoding, _SHOWN)}'; it must be UTF-8"
            raise _RefusedError(NOT_XML.at(self._here("<?xml"), message, help='write encoding="utf-8"'))

    def _doctype(self, name: str, system: str | None, public: str | None, has_subset: int) -> None:
        raise _RefusedError(NOT_XML.at(self._here(" "), f"{self.format.what} may not have a DOCTYPE", help="remove it"))

    def _begun(self, name: str, attributes: dict[str, str]) -> None:
        self.elements += 1
        if self.format.root and not self.open and name != self.format.root:
            message = (
                f"the root of {self.format.what} is '<{self.format.root}>', and here it is '<{plain(name, _SHOWN)}>'"
            )
            raise _RefusedError(self.format.wrong.at(self._tag(name), message))
        if self.format.root and name.startswith(XACRO):
            help_text = "name it as 'xacro: FILE' below 'body', or expand it first: 'xacro FILE.xacro -o FILE.urdf'"
            raise _RefusedError(NOT_URDF.at(self._tag(name), "xacro must expand this file first", help=help_text))
        if len(self.open) >= DEPTH:
            raise _RefusedError(TOO_LARGE.at(self._tag(name), f"elements are nested more than {DEPTH} levels deep"))
        if self.elements > URDF_ELEMENTS:
            raise _RefusedError(TOO_LARGE.at(self._tag(name), f"more than {URDF_ELEMENTS:,} elements in one file"))
        place = attributes.pop(PLACE, None)
        element = XmlElement(name, attributes, self._tag(name) if place is None else span_of_place(place))
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        self.open.append(element)

    def _ended(self, name: str) -> None:
        self.open.pop()

    def _texted(self, data: str) -> None:
        if self.open and not self.open[-1].children:
            self.open[-1].text += data

    def _malformed(self, error: expat.ExpatError) -> Finding:
        span = Span(self.file, error.lineno, error.offset + 1, error.lineno, error.offset + 2)
        if not self.open:
            return NOT_XML.at(span, _words(error))
        shown = plain(self.open[-1].name, _SHOWN)
        begun = Related(self.open[-1].span, f"'<{shown}>' starts here")
        problem = expat.ErrorString(error.code)
        if problem == expat.errors.XML_ERROR_TAG_MISMATCH:
            return self._mismatch(span, shown, begun)
        if problem == expat.errors.XML_ERROR_NO_ELEMENTS:
            return NOT_XML.at(span, f"the file ends before '<{shown}>' does", related=[begun])
        return NOT_XML.at(span, _words(error))

    def _mismatch(self, span: Span, shown: str, begun: Related) -> Finding:
        """Return the finding about an end tag: the innermost element is not closed, or the end tag is misspelt."""
        line = self.lines[span.line - 1].encode() if span.line <= len(self.lines) else b""
        ends = re.match(rb"/?\s*([^\s>]+)", line[span.column - 1 :])
        closing = ends[1].decode(errors="replace") if ends else ""
        if closing in [element.name for element in self.open[:-1]]:
            help_text = f"end it with '/>', or write '</{shown}>' before '</{plain(closing, _SHOWN)}>'"
            ended = [Related(span, "another element ends here")]
            return NOT_XML.at(begun.span, f"'<{shown}>' is never closed", help=help_text, related=ended)
        message = f"another element ends here before '<{shown}>' does"
        return NOT_XML.at(span, message, help=f"write '</{shown}>'", related=[begun])

    def _tag(self, name: str) -> Span:
        return self._here(f"<{name}")

    def _here(self, text: str) -> Span:
        """Return the parser's current place in the text."""
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        return Span(self.file, line, column, line, column + len(text))


def _words(error: expat.ExpatError) -> str:
    problem = expat.ErrorString(error.code)
    return f"this is not XML: {_WORDS.get(problem, problem)}"

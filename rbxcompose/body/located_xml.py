"""XML -> a document whose elements know where they were written."""

from __future__ import annotations

from typing import Any, NoReturn, cast
from xml.dom import expatbuilder

from rbxcompose.body.bare_tags import PLACE, PREFIX
from rbxcompose.manifest.limits import DEPTH

ELEMENTS = 50_000  # of one file


class RefusedXmlError(ValueError):
    """Raised at what a description may not have, with line and column as the parser's own errors have them."""

    def __init__(self, message: str, line: int, column: int) -> None:
        super().__init__(message)
        self.lineno, self.offset = line, column


class LocatedXml(expatbuilder.ExpatBuilderNS):
    """Builds the document of one file, within limits; a DOCTYPE could make a small file grow without bounds."""

    def __init__(self, path: str, data: bytes) -> None:
        super().__init__()
        self._path, self._data = path, data
        self._depth, self._elements = 0, 0

    def start_element_handler(self, name: str, attributes: list[str]) -> None:
        """Give an element its place, and one that is URDF the attribute that brings the place through the expansion."""
        self._depth, self._elements = self._depth + 1, self._elements + 1
        if self._depth > DEPTH:
            self._refuse(f"elements are nested more than {DEPTH} levels deep")
        if self._elements > ELEMENTS:
            self._refuse(f"more than {ELEMENTS:,} elements in one file")
        super().start_element_handler(name, attributes)
        parser, element = self.getParser(), cast(Any, self.curNode)
        place = f"{self._path}|{parser.CurrentLineNumber}|{parser.CurrentColumnNumber + 1}|{len(element.tagName) + 1}"
        element.place = place
        if not element.tagName.startswith(PREFIX):
            element.setAttribute(PLACE, place.replace("${", "$${").replace("$(", "$$("))

    def end_element_handler(self, name: str) -> None:
        """Remember where an element is closed, unless its own tag does that."""
        self._depth -= 1
        parser, element = self.getParser(), cast(Any, self.curNode)
        end = parser.CurrentByteIndex
        closes_itself = not element.childNodes and self._data[end - 2 : end] == b"/>"
        element.closed = None if closes_itself else (parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        super().end_element_handler(name)

    def start_doctype_decl_handler(self, *_: object) -> None:
        """Refuse it."""
        self._refuse("a description may not have a DOCTYPE")

    def _refuse(self, message: str) -> NoReturn:
        parser = self.getParser()
        raise RefusedXmlError(message, parser.CurrentLineNumber, parser.CurrentColumnNumber)

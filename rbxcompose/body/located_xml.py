"""XML -> a document whose elements know where they were written."""

from __future__ import annotations

from typing import Any, cast
from xml.dom import expatbuilder

from rbxcompose.body.bare_tags import PLACE, PREFIX


class DoctypeError(ValueError):
    """Raised at a DOCTYPE, with its line and column as the parser's own errors have them."""

    def __init__(self, line: int, column: int) -> None:
        super().__init__("a description may not have a DOCTYPE")
        self.lineno, self.offset = line, column


class LocatedXml(expatbuilder.ExpatBuilderNS):
    """Builds the document of one file. Refuses a DOCTYPE, since it can make a small file grow without bounds."""

    def __init__(self, path: str, data: bytes) -> None:
        super().__init__()
        self._path, self._data = path, data

    def start_element_handler(self, name: str, attributes: list[str]) -> None:
        """Give an element its place, and one that is URDF the attribute that brings the place through the expansion."""
        super().start_element_handler(name, attributes)
        parser, element = self.getParser(), cast(Any, self.curNode)
        place = f"{self._path}|{parser.CurrentLineNumber}|{parser.CurrentColumnNumber + 1}|{len(element.tagName) + 1}"
        element.place = place
        if not element.tagName.startswith(PREFIX):
            element.setAttribute(PLACE, place.replace("${", "$${").replace("$(", "$$("))

    def end_element_handler(self, name: str) -> None:
        """Remember where an element is closed, unless its own tag does that."""
        parser, element = self.getParser(), cast(Any, self.curNode)
        end = parser.CurrentByteIndex
        closes_itself = not element.childNodes and self._data[end - 2 : end] == b"/>"
        element.closed = None if closes_itself else (parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        super().end_element_handler(name)

    def start_doctype_decl_handler(self, *_: object) -> None:
        """Refuse it."""
        parser = self.getParser()
        raise DoctypeError(parser.CurrentLineNumber, parser.CurrentColumnNumber)

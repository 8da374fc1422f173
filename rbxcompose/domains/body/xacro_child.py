"""Expands a xacro file in a process of its own: xacro evaluates Python, so it must not run in ours."""

from __future__ import annotations

import glob
import os
import re
import xml.dom.minidom
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn, cast
from xml.dom import expatbuilder, minidom

import xacro
from xacro import substitution_args

from rbxcompose.base.files import read_regular
from rbxcompose.base.processes import answer_all, fence, is_below
from rbxcompose.base.requests import to_data
from rbxcompose.domains.body.xacro_answer import BareFile, BareTag, XacroAnswer
from rbxcompose.manifest.tree import DEPTH

PREFIX = "xacro:"
PLACE = "rbx-place"  # an attribute of elements of the expansion: where they were written
_WORDS = {"macro": ("name",), "property": ("name",), "include": ("filename",), "if": ("value",), "unless": ("value",),
          "insert_block": ("name",), "arg": ("name", "default")}  # fmt: skip
"""The tags of xacro that ROS 1 knew, with the attributes that they need."""
_OPEN = {"link", "joint", "visual", "collision", "inertial", "geometry", "material"}  # macros may be called in these
_CLOSED = {"origin", "mass", "inertia", "box", "cylinder", "capsule", "sphere", "mesh", "color", "texture", "parent",
           "child", "axis", "calibration", "dynamics", "limit", "mimic", "safety_controller", "verbose",
           "collision_checking", "contact_coefficients", "robot", "gazebo", "transmission", "sensor", "ros2_control",
           "model_state", "group", "gripper_state"}  # fmt: skip
"""Tags that are no calls whatever macros there are; what is in them belongs to others, such as a simulator."""
ELEMENTS = 50_000  # of one file
OUTPUT = 8_000_000  # [bytes] of expanded text
FILE = 2_000_000  # [bytes] of one file
XACRO_CHILD_DEPTH = 16  # of files that include each other
TOO_MUCH = "it needs more memory or deeper macros than a description may"
_NOISE = re.compile(r"^<class '[^']*'>: | \(<\w+>, line \d+\)")  # what is written around some messages


class BareTags:
    """The bare tags of one expansion that xacro means, by file."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[dict[tuple[int, int], BareTag], BareTag | None]] = {}
        self._macros: set[str] = set()
        self._waiting: dict[str, list[Any]] = defaultdict(list)
        self._pending: list[Any] = []

    def give_prefixes(self, document: minidom.Document, file: str) -> None:
        """Give bare tags of a file, and calls in earlier files of macros that it defines, their prefix."""
        root: Any = document.documentElement
        unbound = None if root.hasAttribute("xmlns:xacro") else _tag(root)
        self._files.setdefault(file, ({}, unbound))
        self._pending.append(root)
        while self._pending:
            for child in self._pending.pop().childNodes:
                if child.nodeType == child.ELEMENT_NODE:
                    self._look_at(child)

    def by_file(self) -> dict[str, BareFile]:
        """Return the files that have such tags."""
        found = {file: (tags, root) for file, (tags, root) in self._files.items() if tags}
        return {file: BareFile(tuple(tags[at] for at in sorted(tags)), root) for file, (tags, root) in found.items()}

    def _look_at(self, element: Any) -> None:
        name = element.tagName
        if name in _WORDS and all(map(element.hasAttribute, _WORDS[name])):
            self._give_prefix(element)
        elif name.startswith(PREFIX) or name in _OPEN:
            self._pending.append(element)
        elif name in self._macros:
            self._give_prefix(element)
        elif name not in _CLOSED and ":" not in name:
            self._waiting[name].append(element)
        if element.tagName == f"{PREFIX}macro":
            self._learn(element.getAttribute("name").removeprefix(PREFIX))

    def _give_prefix(self, element: Any) -> None:
        tag = _tag(element)
        tags, _ = self._files[element.getUserData(PLACE).rsplit("|", 3)[0]]
        tags[tag.line, tag.column] = tag
        element.tagName = element.nodeName = PREFIX + element.tagName
        element.removeAttribute(PLACE)
        self._pending.append(element)

    def _learn(self, macro: str) -> None:
        if macro not in self._macros and macro not in _OPEN | _CLOSED:
            self._macros.add(macro)
            for call in self._waiting.pop(macro, ()):
                self._give_prefix(call)


def _tag(element: Any) -> BareTag:
    _, line, column, _ = element.getUserData(PLACE).rsplit("|", 3)
    return BareTag(int(line), int(column), element.tagName, element.closed)


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
        element.setUserData(PLACE, place, self)
        if not element.tagName.startswith(PREFIX):
            element.setAttribute(PLACE, place.replace("${", "$${").replace("$(", "$$("))

    def handle(self, operation: int, key: str, place: str, element: Any, copy: Any) -> None:
        """Give a copy of an element its place, as where a macro is called."""
        copy.setUserData(key, place, self)

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


class _Expansion:
    """The files of one expansion, and the elements that are being evaluated."""

    def __init__(self, packages: dict[str, str], roots: list[str]) -> None:
        self.packages, self.roots = packages, [os.path.realpath(root) for root in roots]
        self.files: list[str] = []
        self.evaluated: list[xml.dom.minidom.Element] = []
        self.place = ""
        self.bare = BareTags()
        self.arguments: set[str] = set()

    def parse(self, inp: object, filename: str | None = None) -> xml.dom.minidom.Document:
        """Read a file in the place of `xacro.parse`: only one below the roots; each element keeps its place."""
        path = os.path.realpath(filename or "")
        if not is_below(path, self.roots):
            raise xacro.XacroException(f"'{filename}' is outside the project and its packages")
        if len(xacro.filestack) > XACRO_CHILD_DEPTH:
            raise xacro.XacroException(f"files include each other more than {XACRO_CHILD_DEPTH} deep")
        try:
            data = read_regular(Path(path), FILE)
        except OSError as error:
            xacro.filestack.pop()
            message = f"'{filename}' cannot be read: {error.strerror}"
            raise xacro.XacroException(message, exc=OSError()) from None  # xacro knows an optional file by the type
        self.files.append(path)
        builder = LocatedXml(path, data)
        try:
            document = builder.parseString(data)
        except RefusedXmlError as error:
            self.place = f"{path}|{error.lineno}|{error.offset + 1}|1"
            raise xacro.XacroException(str(error)) from None
        except Exception as error:
            self.place = f"{path}|{getattr(error, 'lineno', 1)}|{getattr(error, 'offset', 0) + 1}|1"
            raise xacro.XacroException(f"this is not XML: {error}") from None
        self.bare.give_prefixes(document, path)
        self.arguments |= {element.getAttribute("name") for element in document.getElementsByTagName("xacro:arg")}
        return document

    def included(self, written: str, symbols: Any) -> Iterator[str]:
        """Yield the files of an include in the place of `xacro.get_include_files`: one, or those of a pattern."""
        path = xacro.abs_filename_spec(xacro.eval_text(written, symbols))
        if not glob.has_magic(path) or os.path.lexists(path):
            yield path
            return
        root = next((root for root in self.roots if path.startswith(f"{root}/")), None)
        files = [] if root is None else glob.glob(path.removeprefix(f"{root}/"), root_dir=root)
        if not files and self.evaluated[-1].getAttribute("optional") not in ("true", "True", "1"):
            raise xacro.XacroException(f"no file of the project fits '{written}'")
        yield from (os.path.join(root or "", file) for file in sorted(files))

    def find(self, package: str) -> str:
        """Return the folder of a package for `$(find PACKAGE)`."""
        if package not in self.packages:
            raise substitution_args.SubstitutionException(f"the package '{package}' is not known")
        return self.packages[package]

    def remembering(self, original: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function of xacro that remembers its node; after an error, the innermost stays on top."""

        def work_on(node: Any, *rest: Any) -> Any:
            depth = len(self.evaluated)
            self.evaluated.append(node)
            result = original(node, *rest)
            del self.evaluated[depth:]
            return result

        return work_on

    def noting(self, original: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function of xacro after which it works on a node, such as a condition, in a call for its parent."""

        def begin(node: Any, *rest: Any) -> Any:
            self.evaluated.append(node)
            return original(node, *rest)

        return begin

    def where(self) -> str:
        """Return the place of the innermost element that was evaluated and has one."""
        places = (node.getUserData(PLACE) or node.getAttribute(PLACE) for node in reversed(self.evaluated))
        return self.place or next((place for place in places if place), "")


def expand(request: dict[str, Any]) -> XacroAnswer:
    """Return the expanded text, or the error with its place; and the files that were read."""
    expansion = _Expansion(request["packages"], request["roots"])
    xacro.parse = expansion.parse
    xacro.eval_all = expansion.remembering(xacro.eval_all)
    xacro.get_include_files = expansion.included
    xacro.process_include = expansion.remembering(xacro.process_include)
    xacro.reqd_attrs = expansion.noting(xacro.reqd_attrs)
    xacro.handle_macro_call = expansion.remembering(xacro.handle_macro_call)
    substitution_args._eval_find = expansion.find
    try:
        document = xacro.process_file(request["file"], mappings=dict(request["arguments"]))
        text = document.toxml()
    except BaseException as error:  # its expressions may raise anything
        return XacroAnswer(tuple(expansion.files), error=_reason(error), place=expansion.where())
    if len(text.encode(errors="replace")) > OUTPUT:
        return XacroAnswer(tuple(expansion.files), error=f"it expands to more than {OUTPUT:,} bytes")
    return XacroAnswer(
        tuple(expansion.files), text, bare=expansion.bare.by_file(), arguments=tuple(sorted(expansion.arguments))
    )


def _reason(error: BaseException) -> str:
    """Return what to say about an error; xacro wraps errors, and those about memory have no words of their own."""
    one: BaseException | None = error
    while one is not None:
        if isinstance(one, MemoryError | RecursionError):
            return TOO_MUCH
        one = one.__cause__ or one.__context__
    words = _NOISE.sub("", str(error)) or type(error).__name__
    half = len(words) // 2
    return words[:half] if words[:half] == words[half + 1 :] else words  # xacro says some things twice


def main() -> None:
    """Answer requests."""
    answer_all(_answer)


def _answer(request: dict[str, Any], start: float) -> Any:
    used: set[str] = set()
    fence(request["roots"], used, start)
    return to_data(replace(expand(request), used=tuple(sorted(used))))

"""Expands a xacro file in a process of its own: xacro evaluates Python, so that it must not run among what we trust.

It reads requests as JSON from its standard input and writes the answers to its standard output. Each request has a
process that limits its time and memory, and refuses whatever a description has no use for, before it reads the
first byte of xacro. This is a fence against mistakes and simple attacks, no sandbox.
"""

from __future__ import annotations

import glob
import json
import os
import re
import sys
import xml.dom.minidom
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import xacro
from xacro import substitution_args

from rbxcompose.body.bare_tags import PLACE, BareTags
from rbxcompose.body.located_xml import LocatedXml, RefusedXmlError
from rbxcompose.body.xacro_answer import XacroAnswer
from rbxcompose.fence import fence, is_below, processor_time
from rbxcompose.regular_files import read_regular
from rbxcompose.typed_json import to_data

OUTPUT = 8_000_000  # [bytes] of expanded text
FILE = 2_000_000  # [bytes] of one file
DEPTH = 16  # of files that include each other
TOO_MUCH = "it needs more memory or deeper macros than a description may"
_CLASS = re.compile(r"^<class '[^']*'>: ")  # what xacro writes before some messages


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
        if len(xacro.filestack) > DEPTH:
            raise xacro.XacroException(f"files include each other more than {DEPTH} deep")
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
        self.arguments |= {one.getAttribute("name") for one in document.getElementsByTagName("xacro:arg")}
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
            self.evaluated.append(node)
            result = original(node, *rest)
            self.evaluated.pop()
            return result

        return work_on

    def where(self) -> str:
        """Return the place of the innermost element that was evaluated and has one."""
        places = (getattr(node, "place", "") or node.getAttribute(PLACE) for node in reversed(self.evaluated))
        return self.place or next((place for place in places if place), "")


def expand(request: dict[str, Any]) -> XacroAnswer:
    """Return the expanded text, or the error with its place; and the files that were read."""
    expansion = _Expansion(request["packages"], request["roots"])
    xacro.parse = expansion.parse
    xacro.eval_all = expansion.remembering(xacro.eval_all)
    xacro.get_include_files = expansion.included
    xacro.process_include = expansion.remembering(xacro.process_include)
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
        tuple(expansion.files), text, bare=expansion.bare.told(), arguments=tuple(sorted(expansion.arguments))
    )


def _reason(error: BaseException) -> str:
    """Return what to say about an error; xacro wraps errors, and those about memory have no words of their own."""
    one: BaseException | None = error
    while one is not None:
        if isinstance(one, MemoryError | RecursionError):
            return TOO_MUCH
        one = one.__cause__ or one.__context__
    words = _CLASS.sub("", str(error)) or type(error).__name__
    half = len(words) // 2
    return words[:half] if words[:half] == words[half + 1 :] else words  # xacro says some things twice


def main() -> None:
    """Answer requests, each in a process of its own: the length in 8 bytes and the answer, or 0 if there is none."""
    start = processor_time()
    answers = [_begun(request, start) for request in json.load(sys.stdin)]
    for process, file in answers:
        _, status = os.waitpid(process, 0)
        answer = os.pread(file, os.fstat(file).st_size, 0) if status == 0 else b""
        sys.stdout.buffer.write(len(answer).to_bytes(8, "little") + answer)
    sys.stdout.buffer.flush()


def _begun(request: dict[str, Any], start: float) -> tuple[int, int]:
    """Return the process that answers a request, and the file that it writes the answer to."""
    file = os.memfd_create("answer")  # a file, since its size can be limited
    process = os.fork()
    if process == 0:
        os.closerange(3, file)  # those of other requests
        for standard in (0, 1, 2):
            os.dup2(os.open(os.devnull, os.O_RDWR), standard)
        used: set[str] = set()
        fence(request["roots"], used, start)
        found = to_data(replace(expand(request), used=tuple(sorted(used))))
        answer = json.dumps(found, ensure_ascii=False).encode(errors="replace")
        os._exit(0 if os.write(file, answer) == len(answer) else 1)
    return process, file

"""Expands a xacro file in a process of its own: xacro evaluates Python, so that it must not run among what we trust.

It reads a request as JSON from its standard input and writes the answer to its standard output. Before it reads the
first byte of xacro, it limits its processor time and memory, and refuses whatever a description has no use for. This
is a fence against mistakes and simple attacks, no sandbox.
"""

from __future__ import annotations

import glob
import json
import os
import resource
import sys
import xml.dom.minidom
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import xacro
from xacro import substitution_args

from rbxcompose.body.bare_tags import PLACE, BareTags
from rbxcompose.body.located_xml import LocatedXml
from rbxcompose.regular_files import read_regular

SECONDS = 2  # of processor time
MEMORY = 256_000_000  # [bytes] of address space beyond what it has at its start
OUTPUT = 8_000_000  # [bytes] of expanded text
FILE = 2_000_000  # [bytes] of one file
DEPTH = 16  # of files that include each other
NO_TIME = 3  # exit code
_REFUSED = ("socket.", "subprocess.", "os.exec", "os.system", "os.fork", "os.posix_spawn", "os.kill", "os.remove",
            "os.rename", "os.mkdir", "os.rmdir", "os.chmod", "os.link", "os.symlink", "os.truncate", "os.putenv",
            "ctypes.", "shutil.", "import", "sys._getframe")  # fmt: skip
_LISTED = ("os.listdir", "os.scandir")


class _Expansion:
    """The files of one expansion, and the elements that are being evaluated."""

    def __init__(self, packages: dict[str, str], roots: list[str]) -> None:
        self.packages, self.roots = packages, [os.path.realpath(root) for root in roots]
        self.files: list[str] = []
        self.evaluated: list[xml.dom.minidom.Element] = []
        self.place = ""
        self.bare = BareTags()

    def parse(self, inp: object, filename: str | None = None) -> xml.dom.minidom.Document:
        """Read a file in the place of `xacro.parse`: only one below the roots; each element keeps its place."""
        path = os.path.realpath(filename or "")
        if not _is_below(path, self.roots):
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
        except Exception as error:
            self.place = f"{path}|{getattr(error, 'lineno', 1)}|{getattr(error, 'offset', 0) + 1}|1"
            raise xacro.XacroException(f"this is not XML: {error}") from None
        self.bare.give_prefixes(document, path)
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


def expand(request: dict[str, Any]) -> dict[str, Any]:
    """Return the expanded `text`, or the `error` with its `place`; and the `files` that were read."""
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
    except (MemoryError, RecursionError):
        return {"error": "it needs more memory or deeper macros than a description may", "place": expansion.where(),
                "files": expansion.files}  # fmt: skip
    except BaseException as error:  # its expressions may raise anything
        return {"error": str(error) or type(error).__name__, "place": expansion.where(), "files": expansion.files}
    if len(text) > OUTPUT:
        return {"error": f"it expands to more than {OUTPUT:,} bytes", "place": "", "files": expansion.files}
    return {"text": text, "files": expansion.files, "bare": expansion.bare.told()}


def _is_below(path: str, roots: list[str]) -> bool:
    return any(os.path.commonpath([path, root]) == root for root in roots)


def fence(roots: list[str]) -> None:
    """Limit what this process can use, and refuse what a description has no use for."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    most = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    for limit in (resource.RLIMIT_FSIZE, resource.RLIMIT_CORE):
        resource.setrlimit(limit, (0, 0))
    resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))
    real = [os.path.realpath(root) for root in roots]

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str | bytes):
            path = os.path.realpath(os.fsdecode(arguments[0]))
            is_read = not arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
            if not (is_read and _is_below(path, real)):
                raise PermissionError("a description may only read files of its project")
        elif event in _LISTED and isinstance(arguments[0], str | bytes):
            if not _is_below(os.path.realpath(os.fsdecode(arguments[0])), real):
                raise PermissionError("a description may only list folders of its project")
        elif event.startswith((*_REFUSED, *_LISTED)):
            raise PermissionError(f"a description may not use {event}")

    sys.addaudithook(audit)


def main() -> None:
    """Answer one request."""
    request = json.load(sys.stdin)
    fence(request["roots"])
    sys.stdout.write(json.dumps(expand(request)))
    sys.stdout.flush()
    os._exit(0)

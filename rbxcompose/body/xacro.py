"""xacro files -> URDF text, by a fenced child process."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rbxcompose
from rbxcompose.body.prefixes import missing_prefixes
from rbxcompose.body.xml_reader import PLACE, span_of_place
from rbxcompose.findings import Finding, Span, kind
from rbxcompose.manifest.files import shown_name
from rbxcompose.per_compile import once
from rbxcompose.printable import plain

NOT_EXPANDED = kind(
    "RBX2007",
    """A xacro file cannot be expanded

An expression is wrong, a macro or a property does not exist, an included file is missing, or the expansion takes more
than 1.2 s of processor time or 140 MB. `$(find PACKAGE)` looks up `packages:` of the `body`; the environment is not
read.

A xacro file is a program. It runs in a process of its own without the environment, may read files of the project and of
its packages only, and writes nothing. That fences it, but does not make a stranger's file safe.

Bad:
```xml
<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="${prefix}_base"/>
</robot>
```
Good:
```xml
<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="prefix" value="left"/>
  <link name="${prefix}_base"/>
</robot>
```
""",
)
DEADLINE = 4.0  # [s] of real time; the child limits its processor time itself
_RUN = "import sys; sys.path.insert(0, sys.argv[1]); from rbxcompose.body.xacro_child import main; main()"
_PLACES = re.compile(rf' {PLACE}="[^"]*"')


@dataclass(frozen=True, slots=True)
class Expanded:
    """URDF text whose elements say where they were written; `notes` are what to say about the xacro files."""

    located: str
    notes: tuple[Finding, ...] = ()

    @property
    def text(self) -> str:
        """Return the URDF for other programs."""
        return _PLACES.sub("", self.located)


def expand(
    path: Path, arguments: Mapping[str, str], packages: Mapping[str, Path], roots: Sequence[Path], span: Span
) -> tuple[Expanded | Finding, Sequence[Path]]:
    """Expand a xacro file, or return why that is impossible; and the files, all below `roots`, that were read.

    `span` is the place that names the file, for what has no place in it.
    """
    request = {
        "file": str(path),
        "arguments": dict(arguments),
        "packages": {name: str(folder) for name, folder in packages.items()},
        "roots": [str(root) for root in (*roots, *packages.values())],
    }
    answer = _answer(json.dumps(request))
    if answer is None:
        message = f"'{plain(shown_name(path))}' does not end within its limits of time and memory"
        return NOT_EXPANDED.at(span, message, help="does a macro call itself?"), ()
    files = tuple(dict.fromkeys(map(Path, answer["files"])))
    if "error" in answer:
        place = span_of_place(answer["place"]) if answer["place"] else span
        return NOT_EXPANDED.at(place, plain(" ".join(answer["error"].split()), 300)), files
    return Expanded(answer["text"], tuple(missing_prefixes(answer["bare"]))), files


@once  # profiles are tried one after another, and few change the body
def _answer(request: str) -> dict[str, Any] | None:
    """Return the child's answer to a request in JSON; None if it does not end within its limits."""
    package = str(Path(rbxcompose.__file__).parents[1])
    with os.fdopen(os.memfd_create("xacro"), "rb") as output:  # a file, since its size can be limited
        try:
            child = subprocess.run(
                [sys.executable, "-E", "-s", "-B", "-c", _RUN, package],
                input=request.encode(),
                stdout=output,
                stderr=subprocess.DEVNULL,  # xacro warns there of what is deprecated
                timeout=DEADLINE,
                env={},
                check=False,
            )
        except subprocess.TimeoutExpired:
            return None
        output.seek(0)
        return _read(output.read()) if child.returncode == 0 else None


def _read(answer: bytes) -> dict[str, Any] | None:
    """Return the answer; None if it is none, since what a file brings along may have ended the process."""
    try:
        read = json.loads(answer)
    except ValueError:
        return None
    return read if isinstance(read, dict) and read.keys() >= {"files"} else None

"""Tags of xacro without a prefix: what `check` says about them, and the edits that write the prefix."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from rbxcompose.body.xacro_answer import BareFile
from rbxcompose.body.xml_reader import XACRO
from rbxcompose.findings import Edit, Finding, Fix, Severity, Span, kind
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.library import library_root
from rbxcompose.printable import plain

NO_PREFIX = kind("RBX2014", Severity.WARNING, is_fixable=True)
BINDING = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
_SHOWN = 60  # characters of a name in a message


def missing_prefixes(files: Mapping[str, BareFile]) -> Iterator[Finding]:
    """Yield one finding for each file with bare tags, as the fenced process tells them."""
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

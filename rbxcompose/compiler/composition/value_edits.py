"""Write another value where a manifest says it: edits of single values in the files of a robot. Pure.

A value is written in the layer in effect: the robot's file, `with:` of a part, a profile or an overlay. A value that is
an argument is written where that argument gets its value. One that no file writes is added to its component.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from enum import Enum

from rbxcompose.base.findings import Edit, Fix, Sources, Span
from rbxcompose.base.units import UNITS, Dimension, example, format_number, needs_unit, to_si, written_unit
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_manifest import HistoryStep, RobotManifest, argument_of
from rbxcompose.manifest.files import PARTS, library_root
from rbxcompose.manifest.shapes import is_nearly, rounder_unit
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, at, plain_value

_SECTION_AND_NAME = 2
_FLOW_SIGNS = frozenset(",[]{}")


class UnsavableError(ValueError):
    """Raised with the reason why a value cannot be written into a file, and what to do instead."""

    def __init__(self, reason: str, help: str = "", span: Span | None = None) -> None:
        super().__init__(reason)
        self.reason, self.help, self.span = reason, help, span


def edit_of(
    manifest: RobotManifest, sources: Sources, path: KeyPath, value: object, dimension: Dimension | None
) -> Edit:
    """Return the edit that makes the value at `path` another one; numbers are SI.

    Raises:
        UnsavableError: if no file of the project can say it.
    """
    steps = manifest.history.of(path)
    written = steps[-1].node if steps else None
    if isinstance(written, ScalarNode) and "${" in written.text:
        argument = argument_of(written)
        if argument is None:
            reason = f"it is computed: '{written.text}'"
            raise UnsavableError(reason, "change what it is computed from, or write the value itself", written.span)
        scope = written.scope
        if not scope:
            return edit_of(manifest, sources, ("args", argument, "default"), value, dimension)
        above: KeyPath = ("include", scope, "with")
        if at(manifest.include, (*above, argument)) is None and at(manifest.include, above) is None:
            reason = f"the part '{scope}' has its own default for the argument '{argument}'"
            raise UnsavableError(reason, f"give it to the part: 'with: {{{argument}: ...}}'", written.span)
        return edit_of(manifest, sources, (*above, argument), value, dimension)
    if written is None:
        return _added(manifest, sources, path, value, dimension)
    return _replaced(manifest, sources, path, written, value, dimension)


def merged(edits: Iterable[Edit]) -> Fix:
    """Return edits as one; what is added at the same place is added together.

    Raises:
        UnsavableError: if two of them want different texts for one value.
    """
    found: dict[Span, Edit] = {}
    for edit in edits:
        there = found.get(edit.span)
        if there is None:
            found[edit.span] = edit
        elif not edit.old:
            found[edit.span] = replace(there, text=_joined(there.text, edit.text))
        elif there.text != edit.text:
            raise UnsavableError(f"one place would need both '{there.text}' and '{edit.text}'", span=edit.span)
    return Fix(tuple(found.values()), is_safe=True, title="live values")


def _joined(there: str, text: str) -> str:
    """Return what is added at one place: two lines, or one group of settings with those of both."""
    head, brace, inner = text.partition(": {")
    if not brace or f"{head}{brace}" not in there:
        return there + text
    before, _, end = there.rpartition("}")
    return f"{before}, {inner[: inner.rindex('}')]}}}{end}"


def _replaced(
    manifest: RobotManifest,
    sources: Sources,
    path: KeyPath,
    written: TreeNode,
    value: object,
    dimension: Dimension | None,
) -> Edit:
    lines = _lines_to_edit(manifest, sources, path, written.span)
    old = _slice(lines, written.span)
    is_line = written.span.line == written.span.end_line
    if not is_line or not isinstance(written, ScalarNode | SequenceNode):
        raise UnsavableError("it is written over several lines", "write it by hand", written.span)
    text = written.text if isinstance(written, ScalarNode) else ""
    return Edit(written.span, old, value_text(value, dimension, text))


def _added(
    manifest: RobotManifest, sources: Sources, path: KeyPath, value: object, dimension: Dimension | None
) -> Edit:
    there, text = path, value_text(value, dimension)
    steps: Sequence[HistoryStep] = ()
    while len(there) > _SECTION_AND_NAME and not (steps := manifest.history.of(there[:-1])):
        there, text = there[:-1], f"{{{there[-1]}: {text}}}"  # a group of settings that no file has yet
    above = steps[-1].node if steps else None
    if not isinstance(above, MappingNode):
        raise UnsavableError(f"no file has '{'.'.join(map(str, path[:-1]))}:' as a map to which it could be added")
    lines = _lines_to_edit(manifest, sources, path, above.span)
    key = str(there[-1])
    if _slice(lines, above.span).startswith("{"):
        return _added_to_flow(above, f"{key}: {text}")
    return _added_to_block(above, lines, f"{key}: {text}")


def _added_to_flow(above: MappingNode, text: str) -> Edit:
    """Return the edit that adds an entry to `{a: 1}`: behind its last one."""
    span = above.span
    if above.entries:
        last = list(above.entries.values())[-1].value.span
        return Edit(last._replace(line=last.end_line, column=last.end_column), "", f", {text}")
    inside = span._replace(column=span.column + 1, end_line=span.line, end_column=span.column + 1)
    return Edit(inside, "", text)


def _added_to_block(above: MappingNode, lines: list[str], text: str) -> Edit:
    """Return the edit that adds a line: below the last entry that is one, else above the first."""
    entries = list(above.entries.values())
    for entry in reversed(entries):
        there, line = entry.value.span, entry.key.span.line
        if (there.line, there.end_line) == (line, line):
            column, indent = len(lines[line - 1]) + 1, " " * (entry.key.span.column - 1)
            return Edit(Span(there.file, line, column, line, column), "", f"\n{indent}{text}")
    first = entries[0].key.span
    return Edit(Span(first.file, first.line, 1, first.line, 1), "", f"{' ' * (first.column - 1)}{text}\n")


def _lines_to_edit(manifest: RobotManifest, sources: Sources, path: KeyPath, span: Span) -> list[str]:
    """Return the lines of a file of the project.

    Raises:
        UnsavableError: if the place is not in one, or is shared by several robots.
    """
    if span.file == SET:
        raise UnsavableError("it was given by '--set', which is in no file", "start the robot without it, to keep it")
    file = manifest.files.get(span.file)
    if file is None or span.file not in sources:
        raise UnsavableError(f"'{span.file}' is no file of the robot", span=span)
    root = library_root()
    if file.is_relative_to(root / PARTS) or (root.name == "library" and file.is_relative_to(root)):
        keys = "".join(f"{{{key}: " for key in path[1:])
        where = f"'{path[0]}: {keys}...{'}' * (len(path) - 1)}'"
        help_text = f"put it over the part, in the robot's file or an overlay: {where}"
        raise UnsavableError("it is written in a file of the library, which other robots share", help_text, span)
    return sources[span.file].split("\n")


def _slice(lines: list[str], span: Span) -> str:
    """Return the text at a place of one line; of a longer one, its first line."""
    line = lines[span.line - 1]
    return line[span.column - 1 : span.end_column - 1 if span.end_line == span.line else None]


def value_text(value: object, dimension: Dimension | None, old: str = "") -> str:
    """Return a value as a manifest says it: in the unit of the `old` text if that is exact, else in a usual one."""
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float() if dimension is not None:
            return _quantity_text(float(value), dimension, old)
        case float():
            short = format_number(value)
            return short if float(short) == value else repr(value)
        case tuple() | list():
            return f"[{', '.join(value_text(each, dimension) for each in value)}]"
        case Enum():
            return value_text(value.value, dimension)
        case str():
            return _word(value.replace("$", "$$"))
    return str(value)


def _quantity_text(value: float, dimension: Dimension, old: str) -> str:
    unit = written_unit(old)
    if unit is None and old and not needs_unit(dimension):
        return value_text(value, None)
    ours = UNITS[rounder_unit(value, dimension, unit) or example(dimension).split()[1]]
    number = ours.from_si(value)
    texts = (f"{digits} {ours.name}" for digits in (format_number(number), f"{number:.15g}"))
    return next(text for text in texts if is_nearly(to_si(text, dimension), value))


def is_same(one: object, other: object) -> bool:
    """Return whether two values are the same but for the last digits of a number, which a text may lose."""
    if isinstance(one, tuple | list) and isinstance(other, tuple | list):
        return len(one) == len(other) and all(map(is_same, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return is_nearly(one, other)
    return one == other


def _word(text: str) -> str:
    node = ScalarNode(text, Span("", 1, 1, 1, 1))
    is_plain = text.isprintable() and text.replace("_", "").replace("/", "").replace(" ", "").isalnum()
    is_plain = is_plain and text == text.strip() and plain_value(node) == text and not _FLOW_SIGNS & set(text)
    return text if is_plain else json.dumps(text, ensure_ascii=False)

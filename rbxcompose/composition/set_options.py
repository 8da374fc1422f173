"""Single values that a command changes: `--set PATH=VALUE`."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.composition.overlay import NOTHING_TO_CHANGE, SET, is_removal
from rbxcompose.findings import Report, Span, kind, suggest
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.registry import section_named, sections
from rbxcompose.manifest.section import ROBOT, SetScope
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.sections.include import include

BAD_SET = kind("RBX1303")

HEADER = ("about",)  # keys of the header that it may change


def read_sets(
    sets: Sequence[str], root: MappingNode, report: Report, sources: dict[str, str], *, of_include: bool = False
) -> list[tuple[MappingNode, str]]:
    """Return one overlay for each `PATH=VALUE`; together they are one source text, with a line for each.

    Those of `include` need a call of their own, since parts are read before all else is composed.
    """
    if sets:
        sources[SET] = "\n".join(text.replace("\n", " ") for text in sets)
    overlays = (
        _set_overlay(text.replace("\n", " "), line, root, report)
        for line, text in enumerate(sets, 1)
        if (text.partition("=")[0].strip().partition(".")[0] == include.name) is of_include
    )
    return [(overlay, f"'{SET}'") for overlay in overlays if overlay]


def _set_overlay(text: str, line: int, root: MappingNode, report: Report) -> MappingNode | None:
    written, equals, value_text = text.partition("=")
    span = Span(SET, line, 1, line, len(written) + 1)
    names = written.strip().split(".")
    if not equals or not all(names):
        meant = ".".join(filter(None, names))
        message = f"'{SET} {text}' is not a path and a value"
        report.add(BAD_SET.at(span, message, help=f"write {SET} {meant or 'PATH'}={value_text or 'VALUE'}"))
        return None
    path = _set_path(names, span, root, report)
    if path is None:
        return None
    value = _set_value(value_text, line, len(written) + 1, report)
    if value is None:
        return None
    section = section_named(path[0]) if len(path) == 2 else None
    if section and section.scope in (SetScope.KEYS, SetScope.BARE) and not is_removal(value):
        message = f"'{SET}' does not say what of '{path[1]}' to change"
        report.add(BAD_SET.at(span, message, help=f"write {SET} {path[1]}.KEY=VALUE"))
        return None
    for name in reversed(path):
        value = MappingNode({name: Entry(ScalarNode(name, span), value)}, span)
    return value if isinstance(value, MappingNode) else None


def _set_path(names: list[str], span: Span, root: MappingNode, report: Report) -> list[str] | None:
    """Return the path from the root; if it leads nowhere, report that and return None."""
    section = section_named(names[0]) if names[0] not in HEADER else None
    scope = section.scope if section else SetScope.NOTHING
    if names[0] in HEADER or (section and scope is not SetScope.NOTHING and not section.is_map):
        return names
    if section is None or scope is SetScope.NOTHING:
        section, rest = next(one for one in sections() if one.scope is SetScope.BARE), names
    else:
        rest = names[1:]
    there = list(section.names_in(root))
    if not rest or rest[0] not in there:
        message = f"'{SET}' changes '{'.'.join(names)}', which the robot does not have"
        choices = there if section.name == names[0] else [*there, *settable()]
        fix = in_section(names, root) or suggest(rest[0] if rest else "", choices, "a path starts with")
        report.add(NOTHING_TO_CHANGE.at(span, message, help=fix))
        return None
    return [section.name, *rest]


def settable() -> list[str]:
    """Return the words that may begin a path of `--set`, besides the names of components."""
    return [*HEADER, *(one.name for one in sections(ROBOT) if one.scope is not SetScope.NOTHING)]


def in_section(names: Sequence[str], root: MappingNode) -> str:
    """Return the help for a path that begins with an entry's name but lacks its section; else nothing."""
    for section in sections():
        if section.is_map and section.scope is not SetScope.NOTHING and names[0] in section.names_in(root):
            return f"did you mean '{section.name}.{'.'.join(names)}'?"
    return ""


def _set_value(text: str, line: int, column: int, report: Report) -> TreeNode | None:
    """Read the value of a `--set`; blank lines and columns before it give it the positions of the argument."""
    if not text.strip():
        return ScalarNode("", Span(SET, line, column, line, column + 1))
    node, findings = read_text("\n" * (line - 1) + " " * column + text, SET)
    report.extend(findings)
    return node

"""What a launch file says, whatever its language: entities with attributes and children, each with its place."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.base.processes import fenced_answers
from rbxcompose.commands.importing.foreign_files import ForeignFile, Given
from rbxcompose.commands.importing.importer import OTHER_PROGRAM
from rbxcompose.domains.body.xml_reader import XmlElement, read_xml
from rbxcompose.domains.programs.launch_files.substitutions import (
    LaunchText,
    SubstitutionCall,
    SubstitutionContext,
    UnknownValueError,
    read_launch_text,
)
from rbxcompose.manifest.tree import DEPTH, MappingNode, ScalarNode, SequenceNode, TreeNode, plain_value
from rbxcompose.manifest.validate import MISSING_KEY, WRONG_TYPE, label_of

NOT_KNOWN = kind("RBX2254")
NOT_RUN = kind("RBX2257")

ROOT = "launch"
TEXT = " text"  # the name of what stands in an element, as an attribute
_MOST = 20_000  # entities of one file
_DEADLINE = 8.0  # [s] of real time for a launch file in Python
_CHILD = "rbxcompose.domains.programs.launch_files.python_child"


@dataclass(frozen=True, slots=True)
class LaunchEntity:
    """An action of a launch file, or a part of one, such as a parameter. Words in `kind` have underscores."""

    kind: str
    span: Span
    attributes: Mapping[str, Given[LaunchText]] = field(default_factory=dict)
    children: tuple[LaunchEntity, ...] = ()

    def all(self, *kinds: str) -> Iterator[LaunchEntity]:
        """Yield the children of some kinds."""
        return (child for child in self.children if child.kind in kinds)


def entities_of(file: ForeignFile, context: SubstitutionContext, report: Report) -> tuple[LaunchEntity, ...]:
    """Return what a file says, in its order; nothing, after a finding, if it is no launch file.

    The context counts only for one in Python, which is run to know what it declares.
    """
    if file.name.endswith(".py"):
        return _of_python(file, context, report)
    if isinstance(file.root, MappingNode) and not file.root.entries:
        found = read_xml(file.text, file.name)
        if isinstance(found, XmlElement) and found.name != ROOT:
            words = f"the root of a launch file is '<{ROOT}>', and here it is '<{plain(found.name, 60)}>'"
            found = OTHER_PROGRAM.at(found.span, words)
        if isinstance(found, Finding):
            report.add(found)
            return ()
        return tuple(_of_element(child, report) for child in found.children)
    root = file.root.get(ROOT) if isinstance(file.root, MappingNode) else None
    if not isinstance(root, SequenceNode):
        words = f"'{plain(file.name)}' is no launch file: its only key is 'launch', with a list"
        report.add(OTHER_PROGRAM.at(file.root.span, words))
        return ()
    return tuple(_items(root, report))


def _text(text: str, span: Span, report: Report) -> Given[LaunchText]:
    try:
        return Given(read_launch_text(text), span)
    except UnknownValueError as error:
        report.add(NOT_KNOWN.at(span, f"this text cannot be read: {error}"))
        return Given((text.replace("$(", "("),), span)


def _kind(name: str) -> str:
    return name.replace("-", "_")


def _of_element(element: XmlElement, report: Report) -> LaunchEntity:
    given = {name: _text(value, element.span, report) for name, value in element.attributes.items()}
    if words := element.text.strip():
        given[TEXT] = Given((words,), element.span)
    children = tuple(_of_element(child, report) for child in element.children)
    return LaunchEntity(_kind(element.name), element.span, given, children)


def _items(node: SequenceNode, report: Report) -> Iterator[LaunchEntity]:
    """Yield the entities of a list: each item is a map with one key, its kind."""
    for item in node.items:
        if isinstance(item, MappingNode) and len(item.entries) == 1:
            [(name, entry)] = item.entries.items()
            yield _of_tree(_kind(name), entry.key.span, entry.value, report)
        else:
            report.add(WRONG_TYPE.at(item.span, "an action is a map with one key", label=label_of(item)))


def _of_tree(kind: str, span: Span, node: TreeNode, report: Report) -> LaunchEntity:
    """Return an entity as YAML has it: scalars are attributes, and lists hold children of one kind."""
    if isinstance(node, SequenceNode):
        return LaunchEntity(kind, span, {}, tuple(_items(node, report)))
    if not isinstance(node, MappingNode):
        report.add(WRONG_TYPE.at(node.span, f"'{plain(kind, 60)}' is a map or a list", label=label_of(node)))
        return LaunchEntity(kind, span)
    given, children = dict[str, Given[LaunchText]](), list[LaunchEntity]()
    for name, entry in node.entries.items():
        value = entry.value
        if isinstance(value, ScalarNode):
            given[name] = _text(value.text, value.span, report)
            if name == "value" and kind == "param" and not value.plain and "$(" not in value.text:
                given.setdefault("type", Given(("str",), value.span))
        elif name == "children" and isinstance(value, SequenceNode):
            children += _items(value, report)
        elif name == "value" and isinstance(value, SequenceNode):
            children += (_item(each, report) for each in value.items)
        elif isinstance(value, SequenceNode):
            children += (_of_tree(_kind(name), each.span, each, report) for each in value.items)
        else:
            children.append(_of_tree(_kind(name), entry.key.span, value, report))
    return LaunchEntity(kind, span, given, tuple(children))


def _item(node: TreeNode, report: Report) -> LaunchEntity:
    if not isinstance(node, ScalarNode):
        report.add(WRONG_TYPE.at(node.span, "a list of a parameter has only values", label=label_of(node)))
        return LaunchEntity("item", node.span)
    given = {"value": _text(node.text, node.span, report)}
    if isinstance(plain_value(node), str) and not node.plain:
        given["type"] = Given(("str",), node.span)
    return LaunchEntity("item", node.span, given)


def _of_python(file: ForeignFile, context: SubstitutionContext, report: Report) -> tuple[LaunchEntity, ...]:
    here = Span(file.name, 1, 1, 1, 2)
    above = next((each for each in context.file.parents if (each / "package.xml").is_file()), context.file).parent
    request = {
        "file": str(context.file),
        "text": file.text,
        "values": context.values,
        "prefixes": [str(prefix) for prefix in context.prefixes],
        "roots": [str(above), *map(str, context.prefixes)],
    }
    [answer] = fenced_answers(_CHILD, [json.dumps(request)], context.environment, _DEADLINE)
    try:
        found = json.loads(answer)
        errors = [(plain(str(words), 300), _place(line, file.name)) for words, line in found["errors"]]
        entities = _decoded(found["entities"], file.name)
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        words = f"'{plain(file.name)}' does not end within its limits of time and memory, or ends the process"
        report.add(NOT_RUN.at(here, words, help="a launch file may only declare what is to be started"))
        return ()
    report.extend(NOT_RUN.at(span, f"'{plain(file.name)}' cannot be run here: {words}") for words, span in errors)
    return entities


def _place(line: Any, file: str) -> Span:
    if not isinstance(line, int) or not 0 < line < 1_000_000:
        raise ValueError("this is no line")
    return Span(file, line, 1, line, 2)


def _decoded(data: Any, file: str, depth: int = 0) -> tuple[LaunchEntity, ...]:
    """Return entities that the fenced process gives; it is not trusted, so anything else is an error."""
    if depth > DEPTH or not isinstance(data, list) or len(data) > _MOST:
        raise ValueError("these are no entities")
    return tuple(_decoded_entity(each, file, depth) for each in data)


def _decoded_entity(data: Any, file: str, depth: int) -> LaunchEntity:
    span = _place(data["line"], file)
    given = {str(name): Given(_decoded_text(text), span) for name, text in data["attributes"].items()}
    return LaunchEntity(str(data["kind"]), span, given, _decoded(data["children"], file, depth + 1))


def _decoded_text(data: Any) -> LaunchText:
    return tuple(piece if isinstance(piece, str) else _decoded_call(*piece) for piece in list(data))


def _decoded_call(name: str, arguments: Sequence[Any]) -> SubstitutionCall:
    return SubstitutionCall(str(name), tuple(map(_decoded_text, arguments)))


def attribute(entity: LaunchEntity, name: str, report: Report) -> Given[LaunchText] | None:
    """Return an attribute that an entity needs; None after a finding."""
    if name not in entity.attributes:
        report.add(MISSING_KEY.at(entity.span, f"'{plain(entity.kind, 60)}' needs '{name}'"))
    return entity.attributes.get(name)

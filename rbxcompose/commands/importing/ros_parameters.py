"""Files of ROS parameters, and their values as values of a manifest."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import PurePath

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.printable import FORBIDDEN
from rbxcompose.base.units import MOST
from rbxcompose.commands.importing.foreign_files import FLAGS, OCTAL, ForeignFile, Given
from rbxcompose.commands.importing.manifest_text import flag, flow_list, key, number, word
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, number_trouble, plain_value

ParameterData = bool | int | float | str | list[bool | int | float | str]
_LONGEST = 10_000  # items of a list, as a manifest has them
ROS_2 = "ros__parameters"
_OF_OCTAL = frozenset("+-01234567")
_DUMPED = "dictitems"  # what Python's classes of maps are written as
_GROUPS = "groups"
_OF_A_GROUP = frozenset({"id", "name", "parameters", "parent", "state", "type"})
_TOPIC = re.compile(r"/?[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)*")


def topic_name(topic: str) -> str:
    """Return a topic as a manifest may have it: the same one, or that which is most like it."""
    if _TOPIC.fullmatch(topic):
        return topic
    parts = (re.sub(r"^[0-9_]+|[^a-z0-9_]+", "_", part.lower()).strip("_") for part in topic.split("/"))
    slash = "/" if topic.startswith("/") else ""
    return f"{slash}{'/'.join(part for part in parts if part) or 'topic'}"


def value_of(node: TreeNode) -> Given[ParameterData] | None:
    """Return the value of a parameter: a word, a number, or a list of such; None if it is none of these."""
    match node:
        case ScalarNode():
            value = _scalar(node)
        case SequenceNode(items=items) if len(items) <= _LONGEST:
            values = [_scalar(item) for item in items]
            value = None if None in values else [one for one in values if one is not None]  # type: ignore[assignment]
        case _:
            return None
    return None if value is None else Given(value, node.span)


def _scalar(node: TreeNode) -> bool | int | float | str | None:
    if not isinstance(node, ScalarNode) or was_refused(node):
        return None
    if node.plain and OCTAL.fullmatch(node.text):
        return int(node.text, 8) if _OF_OCTAL.issuperset(node.text) else None
    value = FLAGS.get(node.text.lower(), plain_value(node)) if node.plain else node.text
    if isinstance(value, int | float) and not isinstance(value, bool) and not abs(value) < MOST:
        return None
    return value


def was_refused(node: TreeNode) -> bool:
    """Return whether a value was refused when the file was read."""
    return isinstance(node, ScalarNode) and bool(number_trouble(node) or FORBIDDEN.search(node.text))


def argument_type(value: ParameterData) -> str:
    """Return the type of an argument that takes a value and others like it."""
    match value:
        case bool():
            return "flag"
        case int():
            return "count" if value >= 0 else "number"
        case float():
            return "number"
        case str():
            return "text"
    return "list"


def written(value: ParameterData) -> str:
    """Return a value as a manifest has it."""
    match value:
        case bool():
            return flag(value)
        case int():
            return str(value)
        case float():
            return number(value)
        case str():
            return word(value)
    return flow_list([written(item) for item in value])


def shown_name(path: tuple[str, ...]) -> str:
    """Return the name of a parameter as ROS 2 writes it."""
    return ".".join(key(text) for text in path)


@dataclass(frozen=True, slots=True)
class NodeParameters:
    """The parameters of one node: its name with the namespaces above it, the place of the name, and the map."""

    node: str
    span: Span
    root: MappingNode


def parameters_of(file: ForeignFile) -> list[NodeParameters]:
    """Return the parameters of each node that a file names; without such names, all are of one node.

    That one has the name of the file. Keys with dots become maps, and dumps of `dynamic_reconfigure` lose what Python
    and its groups add.
    """
    if not isinstance(file.root, MappingNode):
        return []
    root = plain_dump(file.root)
    found = list(_nodes(root, ""))
    return found or [NodeParameters(PurePath(file.name).stem, root.span, without_dots(root))]


def _nodes(root: MappingNode, above: str) -> Iterator[NodeParameters]:
    for name, entry in root.entries.items():
        if not isinstance(entry.value, MappingNode):
            continue
        path = name if name.startswith("/") or not above else f"{above}/{name}"
        own = entry.value.get(ROS_2)
        if isinstance(own, MappingNode):
            yield NodeParameters(path, entry.key.span, without_dots(own))
        if own is None:
            yield from _nodes(entry.value, path)


def parameters_with(
    file: ForeignFile, is_wanted: Callable[[MappingNode], bool]
) -> tuple[list[NodeParameters], list[NodeParameters]]:
    """Return the parameters of the nodes that are wanted, and those of the other nodes.

    ROS 1 has no word for the nodes in a file, so those that are wanted may be anywhere below the names of others.
    """
    wanted: list[NodeParameters] = []
    others: list[NodeParameters] = []
    for node in parameters_of(file):
        found = list(_wanted(node, is_wanted))
        wanted += found
        others += [] if found else [node]
    return wanted, others


def _wanted(node: NodeParameters, is_wanted: Callable[[MappingNode], bool]) -> Iterator[NodeParameters]:
    if is_wanted(node.root):
        yield node
        return
    for name, entry in node.root.entries.items():
        if isinstance(entry.value, MappingNode):
            yield from _wanted(NodeParameters(name, entry.key.span, entry.value), is_wanted)


def without_dots(node: MappingNode) -> MappingNode:
    """Return a map in which `a.b: 1` is `a: {b: 1}`, as ROS 2 takes it.

    A key with dots stays as it is where that place is taken, so that nothing is lost.
    """
    whole = MappingNode({}, node.span, node.tag)
    dotted: list[tuple[str, Entry]] = []
    for name, entry in node.entries.items():
        value = without_dots(entry.value) if isinstance(entry.value, MappingNode) else entry.value
        if "." in name and all(name.split(".")):
            dotted.append((name, Entry(entry.key, value)))
        else:
            whole.entries[name] = Entry(entry.key, value)
    for name, entry in dotted:
        changed = _put(whole, name.split("."), entry)
        whole = changed or MappingNode({**whole.entries, name: entry}, whole.span, whole.tag)
    return whole


def _put(node: MappingNode, steps: Sequence[str], entry: Entry) -> MappingNode | None:
    """Return a map with one more entry some levels below; None if its place is taken."""
    first, rest = steps[0], steps[1:]
    known = node.get(first)
    below: TreeNode | None = known
    if rest and (known is None or isinstance(known, MappingNode)):
        below = _put(known or MappingNode({}, entry.value.span), rest, entry)
    elif known is None:
        below = entry.value
    elif isinstance(known, MappingNode) and isinstance(entry.value, MappingNode):
        whole: MappingNode | None = known
        for name, one in entry.value.entries.items():
            whole = None if whole is None else _put(whole, [name], one)
        below = whole
    else:
        below = None
    if below is None:
        return None
    key = node.entries[first].key if first in node.entries else entry.key
    return MappingNode({**node.entries, first: Entry(key, below)}, node.span, node.tag)


def plain_dump(node: MappingNode) -> MappingNode:
    """Return what a dump of `dynamic_reconfigure` says, without the classes of Python and the groups for display."""
    inner = _undressed(node)
    groups = inner.get(_GROUPS)
    if isinstance(groups, MappingNode) and _undressed(groups).entries.keys() >= _OF_A_GROUP:
        inner = MappingNode({name: entry for name, entry in inner.entries.items() if name != _GROUPS}, inner.span)
    return inner


def _undressed(node: MappingNode) -> MappingNode:
    inner = node.get(_DUMPED)
    if isinstance(inner, MappingNode) and node.entries.keys() <= {_DUMPED, "state"}:
        return MappingNode(inner.entries, node.span)
    return node


def scalars_of(node: MappingNode, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Entry]]:
    """Yield all values that are no maps, with their names from the root."""
    for name, entry in node.entries.items():
        if isinstance(entry.value, MappingNode) and entry.value.entries:
            yield from scalars_of(entry.value, (*above, name))
        else:
            yield (*above, name), entry

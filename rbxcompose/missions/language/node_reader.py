"""Reads the values and options of one mission node; each kind reads its own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from rbxcompose.base.expressions.text import Template, parse_template
from rbxcompose.base.expressions.tree import Expression, ExpressionError
from rbxcompose.base.expressions.types import UNKNOWN
from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.asked import Asked, Assignment, WrittenArgument, expression_of
from rbxcompose.missions.language.grammar import is_reported
from rbxcompose.missions.language.value_reader import Nodes, ValueReader, read_expression
from rbxcompose.missions.program.answers import DEEDS, LEVELS, OPTIONS, Deeds, Moments
from rbxcompose.missions.program.machines import MessageTemplate, TemplateShape, WrittenValue


class NodeReader(ValueReader):
    """Reads one mapping of a mission, with the nodes below it."""

    def __init__(self, mapping: MappingNode, key: str, number: int, nodes: Nodes) -> None:
        super().__init__(mapping, key, nodes)
        self.number = number
        self.children: list[int] = []
        self.item = ""

    def map_of(self, key: str, what: str) -> MappingNode | None:
        """Return an option that must be a map with entries; None, with a finding, if it is not."""
        value = self.mapping.get(key)
        if isinstance(value, MappingNode) and value.entries:
            return value
        if not is_reported(value):
            self.add(codes.WRONG_SHAPE.at(self.key_span(key), f"'{key}' needs {what}"))
        return None

    def inside(self, mapping: MappingNode, keys: Iterable[str], what: str) -> NodeReader:
        """Return a reader of a map below this node; unknown keys are findings."""
        for key, entry in mapping.entries.items():
            if key not in keys:
                message, of = f"unknown key '{key}' in {what}", f"keys of {what}"
                taken = mapping.entries
                self.add(codes.UNKNOWN_KEY.misspelt(entry.key.span, message, key, keys, of, taken=taken))
        return NodeReader(mapping, self.key, self.number, self.nodes)

    def child_node(self, node: TreeNode, step: str) -> None:
        """Read a child of this node."""
        self.children.append(self.nodes.child(node, step, self.number))

    def state(self, name: str, entry: Entry) -> None:
        """Read a state of a machine."""
        self.children.append(self.nodes.state(name, entry, self.number))

    def held(self, expression: Expression) -> None:
        """Read the nodes in the data that an expression may yield."""
        self.children.extend(self.nodes.held(expression, self.number, self.span))

    def branches(self, key: str) -> tuple[str, ...]:
        """Read the branches of a parallel, a list or a map, and return the names in a map."""
        value = self.mapping.get(key)
        if not isinstance(value, MappingNode):
            self._list(value)
            return ()
        if not value.entries:
            self.add(codes.MISSING.at(value.span, f"'{self.key}' needs at least one branch"))
        for name, entry in value.entries.items():
            self.check_name(entry.key)
            self.child_node(entry.value, name)
        self.names = tuple(value.entries)
        return self.names

    def cases(self, key: str) -> tuple[Asked, ...]:
        """Read a map from values to nodes, and return the values in the order of the children."""
        value = self.map_of(key, "values below it, each with what is done then")
        if value is None:
            return ()
        read = []
        for name, entry in value.entries.items():
            expression = read_expression(entry.key, self.nodes)
            if expression is not None:
                read.append(Asked(expression, UNKNOWN, entry.key))
                self.child_node(entry.value, name)
        self.asked.extend(asked for asked in read if asked.expression.names)  # a bare word need not be a place
        return tuple(read)

    def asked_later(self, mapping: MappingNode, key: str) -> Asked | None:
        """Read a condition whose names only the kind knows; the kind has to check it."""
        reader = NodeReader(mapping, key, self.number, self.nodes)
        reader.condition(key)
        return reader.asked[0] if reader.asked else None

    def message(self, target: str, body: str) -> MessageTemplate:
        """Read the target and the contents of a message."""
        scalar = self.scalar(target, "the name of a topic or a service")
        value = self.mapping.get(body)
        shape = None if value is None else self._shape(value)
        keys = {} if value is None else dict(_keys_of(value))
        return MessageTemplate(scalar or ScalarNode("", self.key_span(target)), shape, keys)

    def moments(self, keys: Iterable[str]) -> Moments:
        """Read hooks: what is set, logged or published at these moments."""
        return Moments({key: self._deeds(key) for key in keys if self.has(key)})

    def _deeds(self, key: str) -> Deeds:
        what = "an action: 'set', 'log' or 'publish' below it, without a dash"
        value = self.map_of(key, what)
        if value is None:
            return Deeds()
        inner = self.inside(value, (*DEEDS, *OPTIONS), f"'{key}'")
        for option, deed in OPTIONS.items():
            if inner.has(option) and not inner.has(deed):
                self.add(codes.UNKNOWN_KEY.at(inner.key_span(option), f"'{option}' belongs to '{deed}'"))
        deeds = Deeds(
            inner.assignments("set") if inner.has("set") else (),
            inner.template("log") if inner.has("log") else None,
            inner.choice("level", LEVELS),
            inner.message("publish", "message") if inner.has("publish") else None,
        )
        self.asked.extend(inner.asked)
        return deeds

    def _shape(self, node: TreeNode) -> TemplateShape:
        match node:
            case MappingNode(entries=entries):
                return {name: self._shape(entry.value) for name, entry in entries.items()}
            case SequenceNode(items=items):
                return tuple(self._shape(item) for item in items)
            case ScalarNode():
                try:
                    expression = expression_of(node)
                except ExpressionError:
                    expression = None
                return WrittenValue(node, self._quiet_template(node), expression)

    def _quiet_template(self, scalar: ScalarNode) -> Template:
        try:
            return parse_template(scalar.text)
        except ExpressionError:
            return Template(scalar.text, (scalar.text,))

    def child(self, key: str) -> None:
        """Read the node under a key, which is required."""
        value = self.mapping.get(key)
        if value is None or (isinstance(value, ScalarNode) and value.plain and not value.text):
            span = self.key_span(key) if value else self.span
            self.nodes.add(codes.MISSING.at(span, f"'{self.key}' needs '{key}': what to do"))
            return
        self.children.append(self.nodes.child(value, key, self.number))

    def steps(self, key: str) -> None:
        """Read a list of nodes."""
        self._list(self.mapping.get(key))

    def _list(self, value: TreeNode | None) -> None:
        items = value.items if isinstance(value, SequenceNode) else ()
        for index, item in enumerate(items):
            self.child_node(item, str(index))
        if value and not items and not is_reported(value):
            self.add(codes.MISSING.at(value.span, f"'{self.key}' needs at least one step"))

    def item_name(self, key: str) -> str:
        """Read the name under which the nodes below see a loop's item."""
        scalar = self.scalar(key, "a name for the item")
        if scalar and self.check_name(scalar):
            self.item = scalar.text
        return self.item

    def items(self, key: str) -> Expression | tuple[Expression, ...]:
        """Read a literal list, or an expression that yields one (for a map: its keys)."""
        value = self.mapping.get(key)
        if not isinstance(value, SequenceNode):
            expression = self.expression(key, UNKNOWN, "a list")
            self.nodes.loop(self.item, expression)
            return expression
        items = []
        for item in value.items:
            if isinstance(item, ScalarNode):
                items.append(self._asked(item, UNKNOWN))
            else:
                self.nodes.add(codes.WRONG_SHAPE.at(item.span, "an item must be a word, a number or '$name'"))
        return tuple(items)

    def assignments(self, key: str) -> tuple[Assignment, ...]:
        """Read a map from names of data to expressions."""
        value = self.mapping.get(key)
        if is_reported(value):
            return ()
        if not isinstance(value, MappingNode) or not value.entries:
            message = f"'{key}' needs names and their values"
            help_text = f"write 'name: value' on the line below '{key}:', further right and without a dash"
            self.nodes.add(codes.WRONG_SHAPE.at(self.key_span(key), message, help=help_text))
            return ()
        inner = NodeReader(value, key, self.number, self.nodes)
        read: list[Assignment] = []
        for name, entry in value.entries.items():
            inner.expression(name, UNKNOWN, "a value")
            read.extend(Assignment(name, entry.key.span, asked) for asked in inner.asked[len(read) :])
        self.asked.extend(replace(asked, is_assigned=True) for asked in inner.asked)
        return tuple(read)

    def inputs(self, key: str) -> tuple[WrittenArgument, ...]:
        """Read the values for the inputs of another mission."""
        given = self.map_of(key, "a map from inputs to values")
        if given is None:
            span = self.key_span(key)
            return (WrittenArgument("", ScalarNode("", span), span),)  # what is given could not be read
        return tuple(WrittenArgument(name, entry.value, entry.key.span) for name, entry in given.entries.items())

    def record(self, key: str, what: str, keys: Mapping[str, str]) -> tuple[ScalarNode, ...]:
        """Read a map with these keys, each with what it needs; a scalar that is not there has no text."""
        mapping, empty = self.map_of(key, what), ScalarNode("", self.key_span(key))
        if mapping is None:
            return (empty,) * len(keys)
        inner = self.inside(mapping, keys, f"'{key}'")
        return tuple(inner.scalar(name, needs) or empty for name, needs in keys.items())

    def arguments(self) -> tuple[WrittenArgument, ...]:
        """Read the arguments of a skill: one value, or a map of several."""
        match self.mapping.get(self.key):
            case MappingNode(entries=entries):
                return tuple(WrittenArgument(name, entry.value, entry.key.span) for name, entry in entries.items())
            case ScalarNode(text="", plain=True) | None:
                return ()
            case value:
                return (WrittenArgument("", value, value.span),)


def _keys_of(node: TreeNode, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Span]]:
    """Yield the places of all keys of maps in maps, by their paths."""
    for name, entry in node.entries.items() if isinstance(node, MappingNode) else ():
        yield (*path, name), entry.key.span
        yield from _keys_of(entry.value, (*path, name))

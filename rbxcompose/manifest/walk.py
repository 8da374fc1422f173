"""PyYAML's node tree -> the located tree, with findings for what YAML allows and a manifest does not.

The tree is at most `DEPTH` levels deep, aliases included, so that all later code may recurse.
"""

import re
from collections.abc import Collection, Iterable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import yaml

from rbxcompose.base.findings import Finding, Related, Severity, Span, kind, replacement
from rbxcompose.base.printable import FORBIDDEN, code_point, plain
from rbxcompose.manifest import tree
from rbxcompose.manifest.foreign_words import help_for_tag
from rbxcompose.manifest.slips import QUOTE_HELP, QUOTES_NEEDED
from rbxcompose.manifest.tree import number_trouble
from rbxcompose.manifest.yaml_nodes import TOO_LARGE

TWICE = kind("RBX1104")
NOT_A_KEY = kind("RBX1105")
CHARACTER = kind("RBX1106", is_fixable=True)
TAG = kind("RBX1107")
ALIAS = kind("RBX1108")
NUMBER = kind("RBX1109")
HASH = kind("RBX1110", Severity.WARNING)

REMOVE, REPLACE = "!remove", "!replace"
_UNKNOWN = "!"  # what a tag that was reported is taken for
_MOST_FINDINGS = 100  # of one file: nobody makes more of these mistakes by hand
_SWALLOWED = re.compile(r" +(#[^\s#].*)")
_TIGHT = re.compile(r"([a-z][a-z0-9_]*:)(?!//)(?=\S)")  # `x:1`, without the space that makes x a key


def span_of(node: yaml.Node, file: str) -> Span:
    """Return the place of one of PyYAML's nodes."""
    start, end = node.start_mark, node.end_mark
    return _new(Span, (file, start.line + 1, start.column + 1, end.line + 1, end.column + 1))


_new = tuple.__new__  # in half the time of `Span(...)`: every node has a span


class Walk:
    """One walk over a composed document; the findings are in `findings`.

    `known_tags` are those of files of other programs, which say nothing that the tree does not.
    """

    def __init__(self, text: str, file: str, known_tags: Collection[str] = ()) -> None:
        self.text = text
        self.file = file
        lines = enumerate(text.split("\n"), 1) if "#" in text else ()
        self.commented = {number: line for number, line in lines if " #" in line}
        self.may_repeat = "&" in text  # without an anchor there are no aliases, so nothing has to be remembered
        self.may_tag = "!" in text
        self.known_tags = known_tags
        self.findings: list[Finding] = []
        self._done: dict[
            int, tuple[tree.TreeNode, int, int]
        ] = {}  # by id: the node, how many nodes it has, how deep it is
        self._open: set[int] = set()  # ids of the nodes being walked, from the root to the current one
        self._alias_nodes = 0

    def add(self, finding: Finding) -> None:
        """Add a finding, unless there are too many to read."""
        if len(self.findings) < _MOST_FINDINGS:
            self.findings.append(finding)

    def node(self, node: yaml.Node) -> tree.TreeNode:
        """Return a node with all below it; a second visit is an alias and is counted."""
        return self._visit(node)[0]

    def _visit(self, node: yaml.Node) -> tuple[tree.TreeNode, int, int]:
        if not self.may_repeat:
            return self._read(node)
        if id(node) in self._open:
            self._refuse_alias(node, "this alias leads back to what contains it")
            return tree.MappingNode({}, span_of(node, self.file)), 1, 1
        if (done := self._done.get(id(node))) is not None:
            return self._repeat(node, done)
        self._open.add(id(node))
        done = self._read(node)
        self._open.remove(id(node))
        if self._first_character(node) in ("&", "!"):  # only a node with an anchor is visited again
            self._done[id(node)] = done
        return done

    def _first_character(self, node: yaml.Node) -> str:
        index = node.start_mark.index
        return self.text[index : index + 1]

    def _repeat(self, node: yaml.Node, done: tuple[tree.TreeNode, int, int]) -> tuple[tree.TreeNode, int, int]:
        _, size, height = done
        self._alias_nodes += size
        if self._alias_nodes > tree.ALIAS_NODES:
            self._refuse_alias(node, f"the aliases of this file repeat more than {tree.ALIAS_NODES:,} values")
        elif len(self._open) + height > tree.DEPTH:
            self._refuse_alias(node, f"with its aliases values are nested more than {tree.DEPTH} levels deep")
        else:
            return done
        return tree.MappingNode({}, span_of(node, self.file)), 1, 1

    def _refuse_alias(self, node: yaml.Node, message: str) -> None:
        if not any(finding.code == ALIAS.code for finding in self.findings):  # a single bomb makes thousands of them
            place, anchor = self._alias_places(node)
            self.add(ALIAS.at(place, message, related=[Related(anchor, "what it repeats is marked here")]))

    def _alias_places(self, node: yaml.Node) -> tuple[Span, Span]:
        """Return the places of the first alias of a node and of its anchor; the composer does not keep the former."""
        anchor = span_of(node, self.file)
        name = ""
        events: Iterable[Any] = yaml.parse(self.text, Loader=yaml.CSafeLoader)
        for event in events:
            start, end = event.start_mark, event.end_mark
            if (start.line + 1, start.column + 1) == (anchor.line, anchor.column):
                name = getattr(event, "anchor", None) or name
            elif isinstance(event, yaml.AliasEvent) and event.anchor == name:
                return Span(self.file, start.line + 1, start.column + 1, end.line + 1, end.column + 1), anchor
        return anchor, anchor

    def _read(self, node: yaml.Node) -> tuple[tree.TreeNode, int, int]:
        tag = self._tag(node) if self.may_tag else ""
        if tag == REMOVE:
            return tree.MappingNode({}, span_of(node, self.file), REMOVE), 1, 1
        kept = "" if tag == _UNKNOWN else tag
        match node:
            case yaml.ScalarNode():
                scalar = self._scalar(node)
                return replace(scalar, filled=tree.BROKEN) if tag == _UNKNOWN else scalar, 1, 1
            case yaml.SequenceNode():
                return self._sequence(node, kept)
            case yaml.MappingNode():
                return self._mapping(node, kept)
        raise AssertionError(f"PyYAML composes no {type(node).__name__}")

    def _tag(self, node: yaml.Node) -> str:
        written: str = node.tag or ("!" if self._first_character(node) == "!" else "")
        is_alone = isinstance(node, yaml.ScalarNode) and not node.value
        if not written or written == REPLACE or (written == REMOVE and is_alone):
            return written
        short = written.replace("tag:yaml.org,2002:", "!!")
        if short in self.known_tags:
            return ""
        if short == REMOVE:
            message, help_text = "'!remove' takes no value", "remove the value after it"
        else:
            message = f"manifests have no tag '{plain(short, 60)}'"
            help_text = help_for_tag(short, node.value if isinstance(node, yaml.ScalarNode) else "")
        self.add(TAG.at(span_of(node, self.file), message, help=help_text))
        return _UNKNOWN

    def _scalar(self, node: yaml.ScalarNode) -> tree.ScalarNode:
        text: str = node.value
        scalar = tree.ScalarNode(text, span_of(node, self.file), not node.style)
        if len(text) > tree.TEXT:
            message = f"this text has {len(text):,} characters, {tree.TEXT:,} are the limit"
            self.add(TOO_LARGE.at(scalar.span, message))
        if not text.isprintable() and (found := FORBIDDEN.search(text)):
            message = f"this text contains the invisible character {code_point(found.group())}"
            self.add(CHARACTER.at(scalar.span, message))
        if trouble := number_trouble(scalar):
            self.add(NUMBER.at(scalar.span, f"this number {trouble}"))
        return scalar

    def _check_comment(self, value: tree.TreeNode) -> None:
        span = value.span
        line = self.commented.get(span.end_line)
        if line is None or not isinstance(value, tree.ScalarNode) or not value.plain:
            return
        if found := _SWALLOWED.match(line, span.end_column - 1):
            start, end = found.span(1)
            place = Span(self.file, span.end_line, start + 1, span.end_line, end + 1)
            help_text = "put quotes around the whole text, or a space after the '#'"
            self.add(HASH.at(place, "this is a comment, not part of the value", help=help_text))

    def _check_cut(self, items: list[yaml.Node]) -> None:
        """Find text with brackets that is cut in two by a comma inside `{}` or `[]`."""
        for item, following in pairwise(items):
            if isinstance(item, yaml.ScalarNode) and not item.style and item.value.count("(") > item.value.count(")"):
                start, end = span_of(item, self.file), span_of(following, self.file)
                span = Span(self.file, start.line, start.column, end.end_line, end.end_column)
                message = "inside {} and [] a comma ends the text, so this is cut in two"
                self.add(QUOTES_NEEDED.at(span, message, label=QUOTE_HELP))
                return

    def _sequence(self, node: yaml.SequenceNode, tag: str) -> tuple[tree.TreeNode, int, int]:
        if node.flow_style:
            self._check_cut(node.value)
        items, size, height = [], 1, 0
        for child in node.value:
            item, item_size, item_height = self._visit(child)
            self._check_comment(item)
            items.append(item)
            size += item_size
            height = max(height, item_height)
        return tree.SequenceNode(tuple(items), span_of(node, self.file), tag), size, height + 1

    def _mapping(self, node: yaml.MappingNode, tag: str) -> tuple[tree.TreeNode, int, int]:
        own: dict[str, tree.Entry] = {}
        merged: dict[str, tree.Entry] = {}
        size, height = 1, 0
        cut = len(self.findings)
        if node.flow_style:
            self._check_cut([part for pair in node.value for part in pair])
        is_cut = len(self.findings) > cut
        if len(node.value) > tree.KEYS:
            last = span_of(node.value[tree.KEYS][0], self.file)
            self.add(TOO_LARGE.at(last, f"more than {tree.KEYS:,} keys in one map; those from here on are not read"))
        for key_node, value_node in node.value[: tree.KEYS]:
            value, value_size, value_height = self._visit(value_node)
            size += value_size + 1
            height = value_height if value_height > height else height
            if isinstance(key_node, yaml.ScalarNode) and key_node.value == "<<" and not key_node.style:
                self._merge(merged, value, value_node, span_of(key_node, self.file))
                continue
            key = self._key(key_node)
            if key is None:
                continue
            entry: tree.Entry | None = tree.Entry(key, value)
            if node.flow_style and not is_cut and self._is_missing(value) and not self._has_colon(key_node):
                entry = self._without_value(key, value, is_first=not own, is_alone=len(node.value) == 1)
            if entry is not None:
                self._check_comment(entry.value)
                if (first := own.setdefault(entry.key.text, entry)) is not entry:
                    related = [Related(first.key.span, "the first")]
                    message = f"the key '{plain(entry.key.text, 60)}' is written twice"
                    self.add(TWICE.at(entry.key.span, message, label="the second", related=related))
        return tree.MappingNode({**merged, **own}, span_of(node, self.file), tag), size + len(merged), height + 1

    def _without_value(
        self, key: tree.ScalarNode, value: tree.TreeNode, *, is_first: bool, is_alone: bool
    ) -> tree.Entry | None:
        """Report a key inside `{}` that has no value; return what was meant: of `x:1`, the key and its value."""
        if key.plain and (tight := _TIGHT.match(key.text)):
            middle = key.span.column + tight.end(1)
            before = key.span._replace(end_line=key.span.line, end_column=middle)
            fix = replacement(before, tight[1], f"{tight[1]} ")
            self.add(NOT_A_KEY.at(before, "a space is missing after this colon", help="write 'key: value'", fix=fix))
            meant = replace(key, text=key.text[tight.end(1) :], span=key.span._replace(column=middle))
            return tree.Entry(replace(key, text=tight[1][:-1], span=before), meant)
        if key.plain and not is_first and " " in key.text:  # no key of ours has a space
            help_text = "inside {} and [] a comma ends a text: put quotes around the whole text"
            self.add(QUOTES_NEEDED.at(key.span, "this was cut off from the text before it", help=help_text))
            return None
        alone = f"; for the value of a name in a mission, write '${key.text}'" if is_alone else ""
        help_text = f"inside {{}}, each key needs a value: 'key: value'{plain(alone, 120)}"
        self.add(NOT_A_KEY.at(key.span, f"'{plain(key.text, 60)}' has no value", help=help_text))
        return tree.Entry(key, value)

    def _has_colon(self, key: yaml.Node) -> bool:
        """Return whether a colon follows a key, so that its value was left out on purpose."""
        return self.text[key.end_mark.index : key.end_mark.index + 80].lstrip().startswith(":")

    def _is_missing(self, value: tree.TreeNode) -> bool:
        return isinstance(value, tree.ScalarNode) and value.plain and not value.text

    def _key(self, node: yaml.Node) -> tree.ScalarNode | None:
        if self.may_tag:
            self._tag(node)
        if not isinstance(node, yaml.ScalarNode):
            help_text = "put quotes around it if it is text"
            self.add(NOT_A_KEY.at(span_of(node, self.file), "a key is one word", help=help_text))
            return None
        key = self._scalar(node)
        if len(key.text) > tree.KEY:
            message = f"this key has {len(key.text):,} characters, {tree.KEY} are the limit"
            self.add(TOO_LARGE.at(key.span, message))
        if not key.text:
            self.add(NOT_A_KEY.at(key.span, "a key is missing before the colon"))
        return key

    def _merge(self, merged: dict[str, tree.Entry], value: tree.TreeNode, node: yaml.Node, span: Span) -> None:
        """Add the entries of the map or maps that `<<` names; the earlier one wins."""
        sources = value.items if isinstance(value, tree.SequenceNode) else (value,)
        for source in sources:
            if not isinstance(source, tree.MappingNode):
                related = [Related(span_of(node, self.file), "this is no map")]
                self.add(ALIAS.at(span, "'<<' takes a map, or a list of maps", related=related))
                return
            self._alias_nodes += len(source.entries)
            if self._alias_nodes > tree.ALIAS_NODES:
                self._refuse_alias(node, f"the aliases of this file repeat more than {tree.ALIAS_NODES:,} values")
                return
            for name, entry in source.entries.items():
                merged.setdefault(name, entry)

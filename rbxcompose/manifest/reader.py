"""Reading a manifest: bytes to text to a located tree, with every error as a finding.

PyYAML's node tree becomes the located tree, with findings for what YAML allows and a manifest does not. It is at most
`DEPTH` levels deep, aliases included, so that all later code may recurse.
"""

import errno
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, MutableMapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from rbxcompose.base.files import NotRegularError, open_regular
from rbxcompose.base.findings import Edit, Finding, Fix, Related, Severity, Span, kind, once, replacement
from rbxcompose.base.printable import FORBIDDEN, code_point, plain
from rbxcompose.manifest import tree
from rbxcompose.manifest.foreign_words import foreign_text, help_for_tag
from rbxcompose.manifest.slips import NOT_YAML, QUOTE_HELP, QUOTES_NEEDED
from rbxcompose.manifest.tree import number_trouble
from rbxcompose.manifest.yaml_nodes import TOO_LARGE, compose

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

    `known_tags` are those of files of other programs, which say nothing that the tree does not. With `takes_infinity`,
    `.inf` and `.nan` are no mistakes.
    """

    def __init__(self, text: str, file: str, known_tags: Collection[str] = (), *, takes_infinity: bool = False) -> None:
        self.text = text
        self.file = file
        lines = enumerate(text.split("\n"), 1) if "#" in text else ()
        self.commented = {number: line for number, line in lines if " #" in line}
        self.may_repeat = "&" in text  # without an anchor there are no aliases, so nothing has to be remembered
        self.may_tag = "!" in text
        self.known_tags, self.takes_infinity = known_tags, takes_infinity
        self.findings: list[Finding] = []
        # By id: the node, how many nodes it has, how deep it is.
        self._done: dict[int, tuple[tree.TreeNode, int, int]] = {}
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
        if (trouble := number_trouble(scalar)) and not (self.takes_infinity and trouble == tree.NOT_FINITE):
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
                entry = self._decimal(own, key) or self._without_value(
                    key, value, is_first=not own, is_alone=len(node.value) == 1
                )
            if entry is not None:
                self._check_comment(entry.value)
                if (first := own.setdefault(entry.key.text, entry)) is not entry:
                    related = [Related(first.key.span, "the first")]
                    message = f"the key '{plain(entry.key.text, 60)}' is written twice"
                    self.add(TWICE.at(entry.key.span, message, label="the second", related=related))
        return tree.MappingNode({**merged, **own}, span_of(node, self.file), tag), size + len(merged), height + 1

    def _decimal(self, own: dict[str, tree.Entry], key: tree.ScalarNode) -> tree.Entry | None:
        """Report a decimal comma, which ends the value before it; take that entry out, and return what was meant."""
        last = own[next(reversed(own))] if own else None
        if last is None or not isinstance(value := last.value, tree.ScalarNode) or not (value.plain and key.plain):
            return None
        is_next = (value.span.end_line, value.span.end_column + 1) == (key.span.line, key.span.column)
        if not is_next or "." in value.text or not (value.text[-1:].isdigit() and key.text[:1].isdigit()):
            return None
        span = value.span._replace(end_line=key.span.end_line, end_column=key.span.end_column)
        meant = replace(value, text=f"{value.text}.{key.text}", span=span)
        self.add(QUOTES_NEEDED.at(span, "inside {} a comma ends a number", help=f"write '{plain(meant.text, 60)}'"))
        own.popitem()
        return tree.Entry(last.key, meant)

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


PASSWORD = kind("RBX1321", Severity.WARNING)

_WITH_PASSWORD = re.compile(r"[A-Za-z][A-Za-z0-9+.-]{0,20}://[^\s/:@]{0,60}:(?P<password>[^\s/@]{1,200})@")


def passwords(text: str, root: tree.TreeNode) -> Iterator[Finding]:
    """Yield a finding for each password in the values of a file; `text` is that of the whole file."""
    if "://" not in text or not _WITH_PASSWORD.search(text):
        return
    for node in tree.all_nodes(root):
        if isinstance(node, tree.ScalarNode):
            yield from _within(node)


def _within(scalar: tree.ScalarNode) -> Iterator[Finding]:
    for found in _WITH_PASSWORD.finditer(scalar.text):
        if not re.fullmatch(r"\*+|\$.*|<.*>", found["password"]):  # what stands for a password is none
            yield PASSWORD.at(
                tree.part_span(scalar, *found.span("password")),
                "this address contains a password, which everybody sees who sees this file",
                help="where a secret is taken, put the whole address into 'secrets/NAME' and write '${secret.NAME}'",
            )


NOT_UTF8 = kind("RBX1111")
UNREADABLE = kind("RBX1301", is_fixable=True)

_ODD_INDENT = re.compile(
    r"^ *([\u00a0\u2000-\u200a\u202f\u205f\u3000])[ \u00a0\u2000-\u200a\u202f\u205f\u3000]*", re.MULTILINE
)
INDENT = "  "  # of one level
ParsedText = tuple[tree.TreeNode | None, list[Finding]]


class Texts(dict[str, str]):
    """The texts of the files that were read, by the names used in findings.

    `unsaved` are texts in an editor: each replaces that of its file. `parsed` are trees of texts that were read before.
    """

    def __init__(self, unsaved: Mapping[Path, str], parsed: dict[tuple[str, str], ParsedText] | None = None) -> None:
        super().__init__()
        self.unsaved = unsaved
        _unsaved().update(unsaved)  # for the rest of this compile, they are there
        self.parsed = {} if parsed is None else parsed
        self.total_values = 0  # of all uses of these files

    def use(self, shown: str, root: tree.TreeNode) -> Finding | None:
        """Count the values of a file that is used once more; return the finding if they are too many."""
        self.total_values += tree.count(root)
        if self.total_values <= tree.ALL_VALUES:
            return None
        help_text = f"a text with '${{...}}' counts as one for each {tree.FILL_TEXT} characters"
        return TOO_LARGE.at(None, f"with '{shown}' this robot has more than {tree.ALL_VALUES:,} values", help=help_text)


@once
def _unsaved() -> set[Path]:
    """Return the files of this compile that have a text in an editor."""
    return set()


def is_there(path: Path) -> bool:
    """Return whether there is a file, on disk or only in an editor."""
    return path in _unsaved() or path.is_file()


def read_file(path: Path, shown: str, sources: MutableMapping[str, str]) -> ParsedText:
    """Read one manifest and enter its text into `sources` under the name that findings show."""
    text, findings = read_source(path, shown, sources)
    if text is None:
        return None, findings
    if not isinstance(sources, Texts):
        return read_text(text, shown)
    if sources.total_values > tree.ALL_VALUES:
        return None, []  # reported with the file before
    if (shown, text) not in sources.parsed:
        sources.parsed[shown, text] = read_text(text, shown)
    root, findings = sources.parsed[shown, text]
    finding = sources.use(shown, root) if root is not None else None
    return (None, [*findings, finding]) if finding else (root, findings)


def read_source(
    path: Path, shown: str, sources: MutableMapping[str, str], most: int = tree.FILE_BYTES, what: str = "a manifest"
) -> tuple[str | None, list[Finding]]:
    """Read the text of one file and enter it into `sources`; return None with findings if it is not text.

    `most` is the limit [B] for a file of this kind, `what` names the kind.
    """
    data = _bytes(path, shown, sources, most, what)
    if isinstance(data, Finding):
        return None, [data]
    text, findings = _decode(data, shown)
    sources[shown] = text
    return (None, findings) if findings else (text, [])


def _bytes(path: Path, shown: str, sources: MutableMapping[str, str], most: int, what: str) -> bytes | Finding:
    if len(sources) >= tree.FILES:
        return TOO_LARGE.at(
            None, f"'{shown}' would be file number {tree.FILES + 1} of this robot, {tree.FILES} are the limit"
        )
    if isinstance(sources, Texts) and path in sources.unsaved:
        data = sources.unsaved[path].encode(errors="surrogatepass")
    elif isinstance(saved := _saved(path, shown, most), Finding):
        return saved
    else:
        data = saved
    if len(data) > most:
        return TOO_LARGE.at(None, f"'{shown}' is larger than {most:,} bytes, the limit of {what}")
    if sum(map(len, sources.values())) + len(data) > tree.ALL_BYTES:
        return TOO_LARGE.at(
            None, f"with '{shown}' the files of this robot are larger than {tree.ALL_BYTES:,} bytes together"
        )
    return data


@once  # a profile reads the same files again
def _saved(path: Path, shown: str, most: int) -> bytes | Finding:
    try:
        with open_regular(path) as file:
            return file.read(most + 1)
    except NotRegularError:
        return UNREADABLE.at(None, f"'{shown}' is not a regular file")
    except OSError as error:
        is_missing = error.errno == errno.ENOENT
        reason = "does not exist" if is_missing else f"cannot be read: {os.strerror(error.errno or 0)}"
        return UNREADABLE.at(None, f"'{shown}' {reason}")


@once
def _decode(data: bytes, file: str) -> tuple[str, list[Finding]]:
    """Return the text with newlines only, and the findings if it is not UTF-8."""
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n"), []
    except UnicodeDecodeError as error:
        text = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n")
        before = data[: error.start].decode("utf-8-sig").replace("\r\n", "\n")
        span = _character_span(before, len(before), file)
        message = "this file is not UTF-8 text"
        return text, [NOT_UTF8.at(span, message, label=f"byte 0x{data[error.start]:02x}", help="save it as UTF-8")]


def read_text(
    text: str | bytes, file: str, known_tags: Collection[str] = (), *, takes_infinity: bool = False
) -> ParsedText:
    """Read the text of one manifest into a located tree; columns count characters from 1.

    The tree is None if the text cannot be read to its end; with other findings it holds what could be read.
    `known_tags` are tags that may be left out; others are findings, and so are `.inf` and `.nan`
    unless it `takes_infinity`.
    """
    if isinstance(text, bytes):
        text, findings = _decode(text, file)
        if findings:
            return None, findings
    elif text.startswith("\ufeff"):
        text = text[1:]
    if len(text) > tree.FILE_BYTES:
        return None, [TOO_LARGE.at(None, f"'{file}' is larger than {tree.FILE_BYTES:,} bytes, the limit of a manifest")]
    if foreign := foreign_text(text, file):
        return None, [foreign]
    if findings := list(_trouble_in_characters(text, file)):
        return None, findings
    root, failure = compose(text, file)
    if failure:
        return None, [failure]
    if root is None:
        return None, [NOT_YAML.at(Span(file, 1, 1, 1, 2), "this file is empty")]
    walk = Walk(text, file, known_tags, takes_infinity=takes_infinity)
    node = walk.node(root)
    return node, [*walk.findings, *passwords(text, node)]


def _trouble_in_characters(text: str, file: str) -> Iterator[Finding]:
    """Find characters that must not reach the parser, which would stop at a byte position or let them pass."""
    if found := FORBIDDEN.search(text):
        message = f"a manifest may not contain the character {code_point(found.group())}"
        yield CHARACTER.at(_character_span(text, found.start(), file), message, help="remove it")
    tab = text.find("\t")
    if tab >= 0:
        span = _character_span(text, tab, file)
        lines = sum("\t" in line for line in text.split("\n"))
        label = f"and {lines - 1} more {'line' if lines == 2 else 'lines'}" if lines > 1 else ""
        help_text = r'use spaces (in text with double quotes a tab is written "\t")'
        message, fix = "there is a tab here; manifests have no tabs", _spaces_for_tabs(text, file)
        yield CHARACTER.at(span, message, label=label, help=help_text, fix=fix)
    if found := _ODD_INDENT.search(text):
        message, fix = "this line is indented by other characters than spaces", _plain_spaces(text, file)
        help_text = f"write spaces for {code_point(found[1])}, as web pages and word processors have"
        yield CHARACTER.at(_character_span(text, found.start(1), file), message, help=help_text, fix=fix)
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("%"):
            span = Span(file, number, 1, number, len(line) + 1)
            yield NOT_YAML.at(span, "a manifest has no lines that start with '%'", help="remove this line")
        if line.strip() and not line.lstrip().startswith("#"):
            return  # directives precede everything else


def _plain_spaces(text: str, file: str) -> Fix:
    """Return the fix for indentation of spaces with other widths: each becomes one space."""
    found = ((number, _ODD_INDENT.match(line)) for number, line in enumerate(text.split("\n"), 1))
    lines = [(number, one[0]) for number, one in found if one]
    edits = [Edit(Span(file, number, 1, number, len(old) + 1), old, " " * len(old)) for number, old in lines]
    return Fix(tuple(edits), True, f"spaces in {len(edits)} {'line' if len(edits) == 1 else 'lines'}")


def _spaces_for_tabs(text: str, file: str) -> Fix | None:
    """Return the fix for a text indented by tabs only; mixed with spaces, the intended width of a tab is unknown."""
    indents = [line[: len(line) - len(line.lstrip(" \t"))] for line in text.split("\n")]
    if not any(indents) or " " in "".join(indents):
        return None
    edits = [
        Edit(Span(file, number, 1, number, len(tabs) + 1), tabs, INDENT * len(tabs))
        for number, tabs in enumerate(indents, 1)
        if tabs
    ]
    return Fix(tuple(edits), True, f"tabs -> spaces in {len(edits)} lines")


def _character_span(text: str, offset: int, file: str) -> Span:
    line = text.count("\n", 0, offset) + 1
    column = offset - (text.rfind("\n", 0, offset) + 1) + 1
    return Span(file, line, column, line, column + 1)

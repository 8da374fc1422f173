"""Files of other programs as located trees: each value with its place, and the names they use."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from dataclasses import field
from pathlib import Path
from typing import Generic, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Severity, Span, kind
from rbxcompose.base.printable import FORBIDDEN, plain
from rbxcompose.base.units import MOST
from rbxcompose.commands.new_files import LONGEST_NAME, name_like
from rbxcompose.manifest import validate
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import TAG, read_source, read_text
from rbxcompose.manifest.tree import (
    KEY,
    Entry,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    number_trouble,
    plain_value,
)

PYTHON_OBJECT = kind("RBX2292", Severity.WARNING)
_AS_TEXT = (".srdf", ".urdf", ".xml", ".launch", ".py")  # others are YAML
_PYTHON = "!!python/"
_OF_YAML = ("str", "int", "float", "bool", "null", "seq", "map")
_OF_PYTHON = ("unicode", "str", "bytes", "int", "long", "float", "bool", "none", "tuple", "list", "dict")
_PLAIN_TAGS = frozenset(
    {
        "!!python/object/new:dynamic_reconfigure.encoding.Config",
        "!!python/object:dynamic_reconfigure.encoding.Config",
        *(f"!!{text}" for text in _OF_YAML),
        *(f"{_PYTHON}{text}" for text in _OF_PYTHON),
    }
)
OCTAL = re.compile(r"[-+]?0[0-9]+")
FLAGS = {
    **dict.fromkeys(("yes", "on", "true", "y"), True),
    **dict.fromkeys(("no", "off", "false", "n"), False),
}  # of YAML 1.1, in any case


class FreeNames:
    """Gives names that manifests may have, each once, and none that `is_reserved`."""

    def __init__(self, is_reserved: Callable[[str], bool] = lambda _: False) -> None:
        self._is_reserved = is_reserved
        self._taken: set[str] = set()
        self._counts: dict[str, int] = {}  # how often each was wanted that was taken

    def take(self, wanted: str, otherwise: str) -> str:
        """Return the name that is most like a wanted one and not taken; `otherwise` if none is like it."""
        name = first = name_like(wanted) or otherwise
        count = self._counts.get(first, 1)
        while name in self._taken or self._is_reserved(name):
            count += 1
            end = f"_{count}"
            name = f"{first[: LONGEST_NAME - len(end)]}{end}"
        self._counts[first] = count
        self._taken.add(name)
        return name


T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Given(Generic[T]):
    """A value that a file gives, and its place; two are equal if their values are."""

    value: T
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class ForeignFile:
    """A file of another program: its name in findings, its tree if it is YAML, its text, and its path.

    `arguments` are those that were given with it, and `out` is the folder of the manifest if it becomes a file.
    """

    name: str
    root: TreeNode
    text: str = ""
    path: Path | None = None
    arguments: Mapping[str, str] = field(default_factory=dict)
    out: Path | None = None


def read_files(paths: Iterable[Path], report: Report, sources: MutableMapping[str, str]) -> list[ForeignFile]:
    """Return the files that could be read; `sources` gets the texts of all."""
    return [file for path in paths if (file := _read(path, report, sources)) is not None]


def _read(path: Path, report: Report, sources: MutableMapping[str, str]) -> ForeignFile | None:
    shown = shown_name(path)
    text, findings = read_source(path, shown, sources, what="an imported file")
    root: TreeNode | None = None
    if text is not None and path.suffix in _AS_TEXT:
        return ForeignFile(shown, MappingNode(), text, path.absolute())
    if text is not None:
        root, findings = read_text(text, shown, _PLAIN_TAGS)
    report.extend(_without_objects(finding, shown) for finding in findings)
    return None if root is None else ForeignFile(shown, root, text or "", path.absolute())


def _without_objects(finding: Finding, shown: str) -> Finding:
    """Return the finding about a tag of Python: the object is not made, its parts are read as plain data."""
    if finding.code != TAG.code or _PYTHON not in finding.message:
        return finding
    words = f"'{plain(shown)}' asks for an object of Python here, which is not made"
    return PYTHON_OBJECT.at(finding.span, words, help="its parts are read as plain data")


class ForeignMap:
    """A map in a foreign file. After all known keys were read, `report_unknown_keys` reports the others.

    A value of the wrong type is reported and then counts as not given. `what` names the map in findings.
    """

    def __init__(self, node: MappingNode, what: str, span: Span, report: Report) -> None:
        self.node, self.what, self.span, self.report = node, what, span, report
        self._asked: dict[str, None] = {}

    def __contains__(self, key: object) -> bool:
        return key in self.node

    def number(self, key: str) -> Given[float] | None:
        """Return a number of a size that manifests have."""
        found = self._scalar(key, float, "a number")
        return self._within(key, found, lambda value: abs(value) < MOST, f"below {MOST:g}")

    def above_zero(self, key: str) -> Given[float] | None:
        """Return a number greater than 0."""
        return self._within(key, self.number(key), lambda value: value > 0, "greater than 0")

    def whole(self, key: str, least: int, most: int) -> Given[int] | None:
        """Return a whole number within a range."""
        found = self._scalar(key, int, "a whole number")
        return self._within(key, found, lambda value: least <= value <= most, f"{least} to {most}")

    def flag(self, key: str) -> Given[bool] | None:
        """Return whether something is so, in the words of YAML 1.1."""
        return self._scalar(key, bool, "true or false")

    def is_set(self, key: str) -> bool:
        """Return whether a flag is given and true."""
        found = self.flag(key)
        return found is not None and found.value

    def text(self, key: str) -> Given[str] | None:
        """Return a text."""
        return self._scalar(key, str, "text")

    def choice(self, key: str, choices: Iterable[str]) -> Given[str] | None:
        """Return one of a few words."""
        found = self.text(key)
        if found is not None and found.value not in (known := list(choices)):
            self.add(validate.not_a_choice(found.span, key, self.node.get(key), known))
            return None
        return found

    def texts(self, key: str) -> list[Given[str]]:
        """Return the texts of a list, with those that are none left out."""
        node = self._ask(key)
        if node is None:
            return []
        if not isinstance(node, SequenceNode):
            self._wrong(key, node, "a list")
            return []
        found = [(item, _value(item, str)) for item in node.items]
        for item, value in found:
            if value is None:
                self._wrong(key, item, "a list of texts")
        return [Given(value, item.span) for item, value in found if value is not None]

    def maps(self, key: str, what: str) -> Iterator[tuple[str, ForeignMap]]:
        """Yield the maps in a map by their names; `what` is what each of them is."""
        node = self._ask(key)
        if isinstance(node, MappingNode):
            yield from maps_in(node, what, self.report)
        elif node is not None:
            self._wrong(key, node, "a map of keys and values")

    def places(self, *keys: str) -> dict[str, Span]:
        """Return the places of those of some keys that are given, whatever their values are."""
        return {key: self.node.entries[key].key.span for key in keys if self._ask(key) is not None}

    def needs(self, key: str, found: T | None) -> T | None:
        """Return what was found under a key, after a finding if the key is not there at all."""
        if key not in self:
            self.add(validate.MISSING_KEY.at(self.span, f"{self.what} needs the key '{key}'"))
        return found

    def add(self, finding: Finding) -> None:
        """Add a finding."""
        self.report.add(finding)

    def rest(self) -> dict[str, Entry]:
        """Return the entries that nobody has asked for."""
        return {key: entry for key, entry in self.node.entries.items() if key not in self._asked}

    def report_unknown_keys(self) -> None:
        """Add a finding for each key that nobody has asked for."""
        for key, entry in self.rest().items():
            message = f"unknown key '{plain(key, 60)}' in {self.what}"
            self.add(validate.UNKNOWN_KEY.misspelt(entry.key.span, message, key, self._asked, validate.KEYS))

    def _ask(self, key: str) -> TreeNode | None:
        self._asked[key] = None
        return self.node.get(key)

    def _scalar(self, key: str, wanted: type[T], what: str) -> Given[T] | None:
        node = self._ask(key)
        if node is None:
            return None
        value = _value(node, wanted)
        if value is None:
            self._wrong(key, node, what)
            return None
        return Given(value, node.span)

    def _within(self, key: str, found: Given[T] | None, is_within: Callable[[T], bool], words: str) -> Given[T] | None:
        if found is None or is_within(found.value):
            return found
        self.add(validate.OUT_OF_RANGE.at(found.span, f"'{key}' of {self.what} must be {words}"))
        return None

    def _wrong(self, key: str, node: TreeNode, what: str) -> None:
        if isinstance(node, ScalarNode) and (number_trouble(node) or _is_refused(node.text)):
            return
        label = "YAML takes this for an octal number" if _is_octal(node) else validate.label_of(node)
        self.add(validate.WRONG_TYPE.at(node.span, f"'{key}' of {self.what} must be {what}", label=label))


def maps_in(node: MappingNode, what: str, report: Report) -> Iterator[tuple[str, ForeignMap]]:
    """Yield the maps in a map by their names; `what` is what each of them is."""
    for name, entry in node.entries.items():
        if not name or _is_refused(name):
            continue
        if isinstance(entry.value, MappingNode):
            yield name, ForeignMap(entry.value, f"{what} '{plain(name, 60)}'", entry.key.span, report)
        else:
            message = f"{what} '{plain(name, 60)}' must be a map of keys and values"
            report.add(validate.WRONG_TYPE.at(entry.value.span, message, label=validate.label_of(entry.value)))


def _is_refused(text: str) -> bool:
    """Return whether a text was reported when the file was read."""
    return len(text) > KEY or bool(FORBIDDEN.search(text))


def _is_octal(node: TreeNode) -> bool:
    return isinstance(node, ScalarNode) and node.plain and bool(OCTAL.fullmatch(node.text))


def _value(node: TreeNode, wanted: type[T]) -> T | None:
    """Return the value of a scalar if it has the wanted type; whole numbers are numbers, too."""
    if not isinstance(node, ScalarNode) or _is_octal(node) or _is_refused(node.text):
        return None
    value: object = plain_value(node)
    if wanted is bool and node.plain:
        value = FLAGS.get(node.text.lower(), value)
    if wanted is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if wanted is int and isinstance(value, float) and value.is_integer():
        value = int(value)
    is_it = isinstance(value, wanted) and isinstance(value, bool) == (wanted is bool)
    return value if is_it and isinstance(value, wanted) else None

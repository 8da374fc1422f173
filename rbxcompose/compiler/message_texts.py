"""The texts of a robot's own messages, services and actions: where folders have them, and whether they are right.

What is wrong in a text is left out of what is returned, line by line, so that its type exists all the same: a name is
not unknown because there is a mistake in its text.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, replace
from itertools import pairwise
from keyword import iskeyword
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Related, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.files import folder_named, resolve, shown_name
from rbxcompose.manifest.reader import read_source
from rbxcompose.manifest.section import Reading
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import KINDS, DefinitionError, FieldShape, Structure, code_of, interface_names, parse
from rbxcompose.msgs.packages import short

NO_PACKAGE = kind("RBX1322")
NO_TEXT = kind("RBX3026")
NO_TYPE = kind("RBX3027")
CIRCLE = kind("RBX3028")
OTHER_TYPE = kind("RBX3029")

DEEPEST = 30  # messages inside each other
MOST_VALUES = 1_000_000  # of a message whose lists are empty
MOST_MISTAKES = 10  # in one text, which is not read any further
LARGEST = 100_000  # [B] of a text
_PACKAGE = re.compile(r"(?!.*__)[a-z][a-z0-9_]*(?<!_)")
_TYPE = re.compile(r"[A-Z][A-Za-z0-9]*")
_WORD = "a word of Python, which could not import it"
NOTHING = {"msg": "", "srv": "---\n", "action": "---\n---\n"}


def packages_in(folder: Path) -> list[Path]:
    """Return the folders of packages: this one, if it has interfaces, else those in it that have some."""
    inside = [folder] if _has_interfaces(folder) else sorted(folder.glob("*/"))
    return [package for package in inside if _has_interfaces(package)]


def _has_interfaces(folder: Path) -> bool:
    return any(True for _ in files_in(folder))


def files_in(package: Path) -> Iterator[tuple[str, Path]]:
    """Yield the files of interfaces in the folder of a package, each with the name of its type."""
    for kind_ in KINDS:
        for path in sorted((package / kind_).glob(f"*.{kind_}")):
            yield f"{package.name}/{kind_}/{path.stem}", path


def wrong_package(name: str) -> str:
    """Return why a package cannot have this name, or nothing."""
    if not _PACKAGE.fullmatch(name):
        return f"'{plain(name, 60)}' cannot be the name of a package: small letters, digits and single '_'"
    if iskeyword(name):
        return f"a package cannot be named '{name}', {_WORD}"
    return f"a package cannot be named '{name}': 'rbxcompose.msgs.{name}' is ours" if name in registry.TAKEN else ""


def wrong_type(name: str) -> str:
    """Return why a type cannot have this name, or nothing."""
    if _TYPE.fullmatch(name):
        return f"a type cannot be named '{name}', {_WORD}" if iskeyword(name) else ""
    return f"'{plain(name, 60)}' cannot be the name of a type: a capital letter, then letters and digits"


@dataclass(slots=True)
class TypeText:
    """The text of a type, and the file that has it, by its name in findings."""

    file: str
    text: str
    structures: tuple[Structure, ...] = ()

    def span(self, line: int = 1, *, first: bool = False) -> Span:
        """Return the place of what stands in a line, or only of its first word."""
        written = self.text.split("\n")[line - 1]
        code = code_of(written) or written.strip()
        column = len(written) - len(written.lstrip()) + 1
        return Span(self.file, line, column, line, column + max(1, len(code.split()[0] if first and code else code)))


@dataclass(slots=True)
class Examination:
    """Examines all texts of a robot by the names of their types; `texts` are what is left of them."""

    written: Mapping[str, TypeText]
    texts: dict[str, str] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    _mistakes: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        for name, source in self.written.items():
            if words := wrong_type(name.split("/")[2]):
                self.findings.append(NO_TEXT.at(source.span(), words, help="rename the file"))
            else:
                self._read(name, source)
        for name in sorted(self.texts):
            self._judge_names(name)
        for name in sorted(name for name in self.texts if self._is_standard(name)):
            del self.texts[name]
        self._weigh(self._in_order())

    def _read(self, name: str, source: TypeText) -> None:
        """Keep the text of a type without its wrong lines."""
        self.texts[name] = source.text
        while True:
            try:
                source.structures = parse(name, self.texts[name])
                return
            except DefinitionError as error:
                self.findings.append(NO_TEXT.at(source.span(error.line or 1), plain(error.problem)))
                self._leave_out(name, error.line)

    def _leave_out(self, name: str, line: int) -> None:
        """Leave a line out of a text; everything, if it is 0 or there have been too many."""
        self._mistakes[name] += 1
        line = 0 if self._mistakes[name] >= MOST_MISTAKES else line
        lines = self.texts[name].split("\n")
        lines[line - 1 : line] = [""]
        self.texts[name] = "\n".join(lines) if line else NOTHING[name.split("/")[1]]

    def _without(self, name: str, line: int) -> None:
        """Leave a right line, or all lines, out of a type."""
        self._leave_out(name, line)
        self.written[name].structures = parse(name, self.texts[name])

    def _judge_names(self, name: str) -> None:
        """Find fields of types that there are not."""
        source, package = self.written[name], f"{name.split('/')[0]}/"
        for line, base in _uses(source):
            if "/msg/" in base and (base in self.texts or base in registry.SHIPPED):
                continue
            messages = {*interface_names("msg"), *(known for known in self.texts if "/msg/" in known)}
            valid, shown = sorted(map(short, messages)), short(base)
            span, message = source.span(line, first=True), f"there is no message type '{shown}'"
            near = [known.removeprefix(package) for known in valid if known.split("/")[1] == shown.split("/")[1]]
            help_text = f"write {' or '.join(map(repr, near))}"
            finding = NO_TYPE.misspelt(span, message, shown, valid, "message types")
            self.findings.append(NO_TYPE.at(span, message, help=help_text) if near else finding)
            self._without(name, line)
            if self._mistakes[name] >= MOST_MISTAKES:
                return

    def _is_standard(self, name: str) -> bool:
        """Return whether a type has the name of a standard one, after a finding if it is another one."""
        standard, source = registry.standard_text(name), self.written[name]
        if standard is not None and _content(parse(name, standard)) != _content(source.structures):
            message = f"'{short(name)}' is a standard type with other fields or constants"
            self.findings.append(OTHER_TYPE.at(source.span(), message, help="rename it, or its package"))
        return standard is not None

    def _in_order(self) -> list[str]:
        """Return the names of all types, each after those inside it; a field that makes a circle is left out."""
        done: dict[str, None] = {}
        for root in sorted(self.texts):
            path = {} if root in done else {root: self._inside(root)}
            while path:
                name = next(reversed(path))
                line, base = next(path[name], (0, ""))
                if not base:
                    done[name] = None
                    del path[name]
                elif base in path:
                    self._report_circle([*path][[*path].index(base) :], line)
                elif base not in done:
                    path[base] = self._inside(base)
        return list(done)

    def _inside(self, name: str) -> Iterator[tuple[int, str]]:
        return iter([(line, base) for line, base in _uses(self.written[name]) if base in self.texts])

    def _report_circle(self, names: list[str], line: int) -> None:
        if self._mistakes[names[-1]] >= MOST_MISTAKES:
            return
        related = [
            Related(self.written[name].span(at, first=True), f"'{short(inner)}' is inside it here")
            for name, inner in pairwise(names)
            for at, base in _uses(self.written[name])
            if base == inner
        ]
        span, words = self.written[names[-1]].span(line, first=True), " -> ".join(map(short, (*names, names[0])))
        self.findings.append(CIRCLE.at(span, f"a message cannot contain itself: {words}", related=related))
        self._without(names[-1], line)

    def _weigh(self, ordered: Iterable[str]) -> None:
        """Find messages that are too deep or too large to be made."""
        sizes: dict[str, tuple[int, int]] = {}
        for name in ordered:
            source = self.written[name]
            depth, values = 1, 0
            for each in (each for structure in source.structures for each in structure.fields):
                inside_depth, inside = sizes.get(each.type.base, (1, 1))
                depth = max(depth, inside_depth + 1)
                count = each.type.length if each.type.shape is FieldShape.ARRAY else 1
                values += inside * (count if each.type.shape in (FieldShape.ARRAY, FieldShape.SINGLE) else 0) + 1
            if depth > DEEPEST or values > MOST_VALUES:
                words = f"is more than {DEEPEST} deep" if depth > DEEPEST else f"has more than {MOST_VALUES:,} values"
                self.findings.append(NO_TEXT.at(source.span(), f"this message {words}, which is the limit"))
                self._without(name, 0)
                depth, values = 1, 1
            sizes[name] = depth, values


def _uses(source: TypeText) -> list[tuple[int, str]]:
    """Return the messages inside a type, each with the line of the field."""
    fields = [each for structure in source.structures for each in structure.fields]
    return [(each.line, each.type.base) for each in fields if each.type.is_message]


def _content(structures: tuple[Structure, ...]) -> object:
    return [
        ([(each.name, each.type) for each in part.fields], {each.name: each.value for each in part.constants})
        for part in structures
    ]


def texts_in(folders: Mapping[str, str], reading: Reading[Any]) -> Mapping[str, str]:
    """Return the texts of the types in the folders that the section `msgs` names, and report what is wrong."""
    report, documents = reading.report, reading.contents.documents
    written: dict[str, TypeText] = {}
    packages: dict[str, tuple[Path, Span]] = {}
    for name, folder_name in folders.items():
        span = reading.value("msgs", name, "folder")
        writer = documents.writer(span, reading.contents.file)
        folder = folder_named(folder_name, writer, span)
        if not isinstance(folder, Path):
            report.add(folder)
            continue
        found = packages_in(folder)
        if not found:
            message = f"'{folder_name}' has no messages, services or actions"
            report.add(NO_PACKAGE.at(span, message, help="they are files such as 'PACKAGE/msg/NAME.msg'"))
        for package in found:
            first, place = packages.setdefault(package.name, (package, span))
            if first != package:
                words = f"there are two packages '{package.name}': '{shown_name(first)}' and '{shown_name(package)}'"
                report.add(NO_PACKAGE.at(span, words, related=[Related(place, "the first one")]))
            elif words := wrong_package(package.name):
                report.add(NO_PACKAGE.at(span, words, help="rename the folder"))
            else:
                written |= _texts(package, writer, span, documents)
    examination = Examination(written)
    report.extend(examination.findings)
    return examination.texts


def _texts(package: Path, writer: Path, span: Span, documents: Documents) -> dict[str, TypeText]:
    found = {}
    for name, path in files_in(package):
        file = resolve(str(path), writer, span)
        if isinstance(file, Finding):  # a link to elsewhere
            documents.report.add(file)
            continue
        shown = shown_name(file)
        text, findings = read_source(file, shown, documents.sources, LARGEST, "a type of messages")
        documents.report.extend(replace(finding, span=finding.span or span) for finding in findings)
        found[name] = TypeText(shown, NOTHING[name.split("/")[1]] if text is None else text)
    return found

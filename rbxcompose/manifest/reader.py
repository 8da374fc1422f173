"""Reading a manifest: bytes to text to a located tree, with every error as a finding."""

import errno
import os
import re
from collections.abc import Collection, Iterator, Mapping, MutableMapping
from pathlib import Path

from rbxcompose.base.files import NotRegularError, open_regular
from rbxcompose.base.findings import Edit, Finding, Fix, Severity, Span, kind, once
from rbxcompose.base.printable import FORBIDDEN, code_point
from rbxcompose.manifest import tree
from rbxcompose.manifest.foreign_words import foreign_text
from rbxcompose.manifest.slips import NOT_YAML
from rbxcompose.manifest.walk import CHARACTER, Walk
from rbxcompose.manifest.yaml_nodes import TOO_LARGE, compose

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


def read_text(text: str | bytes, file: str, known_tags: Collection[str] = ()) -> ParsedText:
    """Read the text of one manifest into a located tree; columns count characters from 1.

    The tree is None if the text cannot be read to its end; with other findings it holds what could be read.
    `known_tags` are tags that may be left out; others are findings.
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
    walk = Walk(text, file, known_tags)
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

"""YAML text -> PyYAML's node tree, by its C parser, with limits enforced meanwhile; its errors in plain words."""

import re
from collections.abc import Callable
from typing import Any

import yaml

from rbxcompose.base.findings import Finding, Related, Report, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.manifest import slips
from rbxcompose.manifest.tree import DATA_NODES, DEPTH, NODES, TreeNode, entries_of, is_larger

_NO_SIGIL = "@`%>|"  # at the beginning of a text; `&`, `*` and `!` may have been meant as such
_TWO_KEYS = re.compile(r"[\w.$-]+ +([a-z_]+: [^:]+)")  # the value of one key, and another key
_HEADER = ("rbx:", "kind:")  # keys that each manifest has
_CLOSES = {"sequence": ("list", "[", "]"), "mapping": ("map", "{", "}")}


def explain(error: yaml.YAMLError, text: str, file: str) -> Finding:
    """Return the one finding for a parser error in `text`: that of a slip, or what the parser means."""
    if not isinstance(error, yaml.MarkedYAMLError):
        return slips.NOT_YAML.at(Span(file, 1, 1, 1, 2), "this file cannot be read as YAML")
    trouble = slips.Trouble(error, text, file)
    words = next((name for name in _ANSWERS if name in trouble.problem or name in trouble.context), slips.ANY)
    known = (*slips.text_slip.at(slips.ANY), *(slips.text_slip.at(words) if words else ()))
    found = next((finding for slip in known if (finding := slip(trouble))), None)
    if found or words:
        return found or _ANSWERS[words](trouble)
    return slips.NOT_YAML.at(trouble.here, "this is not valid YAML", label=plain(trouble.problem))


def _colon(trouble: slips.Trouble) -> Finding:
    if column := trouble.value_column:
        span = trouble.to_line_end(column)
        message = "text with a colon and a space needs quotes"
        if two := _TWO_KEYS.fullmatch(trouble.line_text[column:].rstrip()):
            message, help_text = "two keys are on one line", f"write '{plain(two[1], 60)}' on a line of its own"
            return slips.QUOTES_NEEDED.at(
                span, message, help=f"{help_text}; text with a colon and a space needs quotes"
            )
        return slips.QUOTES_NEEDED.at(span, message, label=slips.QUOTE_HELP, fix=trouble.quoting(span))
    message = "this key cannot be here: the line above already holds a value"
    begin = slips.indent(trouble.line_text)
    span = trouble.span(trouble.line, begin, max(begin, trouble.column))
    return slips.NOT_YAML.at(span, message, help="start it in the same column as the key that it belongs with")


def _first_character(trouble: slips.Trouble) -> Finding:
    character = trouble.line_text[trouble.column : trouble.column + 1]
    message = f"text that starts with '{plain(character)}' needs quotes"
    span = trouble.to_line_end(trouble.column)
    fix = trouble.quoting(span) if character in _NO_SIGIL else None
    return slips.QUOTES_NEEDED.at(span, message, label=slips.QUOTE_HELP, fix=fix)


def _sigil(trouble: slips.Trouble) -> Finding:
    trouble.line, trouble.column = trouble.opening.line - 1, trouble.opening.column - 1
    if tag := re.match(r"(!remove|!replace)[,\]}]", trouble.line_text[trouble.column :]):
        return slips.NOT_YAML.at(trouble.here, f"a space is missing after '{tag[1]}'")
    return _first_character(trouble)


def _unknown_alias(trouble: slips.Trouble) -> Finding:
    span = trouble.to_line_end(trouble.column)
    help_text = "put quotes around it if it is text; an alias needs its anchor ('&name') above it"
    return slips.QUOTES_NEEDED.at(span, "'*' here means an alias, but nothing has this name", help=help_text)


def _unclosed_bracket(trouble: slips.Trouble) -> Finding:
    what, opening, closing = _CLOSES["mapping" if "mapping" in trouble.context else "sequence"]
    begun = (Related(trouble.opening, f"the {what} starts here"),)
    is_key = re.fullmatch(r"\s*[\w.-]+", trouble.before)
    if is_key and slips.indent(trouble.line_text) <= slips.indent(trouble.lines[trouble.opening.line - 1]):
        here = (Related(trouble.here, "a new key starts here"),)
        return slips.NOT_YAML.at(trouble.opening, f"the closing '{closing}' of this {what} is missing", related=here)
    message = f"a ',' or the closing '{closing}' of this {what} is missing before this place"
    help_text = f"text with brackets, commas or quotes inside '{opening}{closing}' needs quotes"
    return slips.NOT_YAML.at(trouble.here, message, help=help_text, related=begun)


def _after_value(trouble: slips.Trouble) -> Finding:
    if trouble.is_behind_quote:
        begin = re.match(r"\s*(- +)*([^\s:'\"][^:]*: +)?", trouble.before)
        span = trouble.to_line_end(begin.end() if begin else 0)
        help_text = "put the other kind of quotes around the whole text"
        message, fix = "there is text after the closing quote", trouble.quoting(span)
        return slips.QUOTES_NEEDED.at(span, message, label=slips.QUOTE_HELP, help=help_text, fix=fix)
    message = "this line does not fit the lines above it"
    begun = (Related(trouble.opening, "what it would belong to starts here"),)
    return slips.NOT_YAML.at(
        trouble.here,
        message,
        help="check the indentation: keys that belong together start in one column",
        related=begun,
    )


def _missing_dash(trouble: slips.Trouble) -> Finding:
    begun = (Related(trouble.opening, "the list starts here"),)
    key = re.match(r" *([a-z][a-z0-9_]*):", trouble.line_text)
    help_text = "put a dash here"
    if key:
        where = "move it right if it belongs to the item above, left if it belongs next to the list"
        help_text = f"{where}; put a dash here if '{key[1]}' is an item of its own"
    return slips.NOT_YAML.at(trouble.here, "this list item has no dash", help=help_text, related=begun)


def _missing_colon(trouble: slips.Trouble) -> Finding:
    trouble.line = trouble.opening.line - 1
    span = trouble.to_line_end(trouble.opening.column - 1)
    return slips.NOT_YAML.at(span, "a colon is missing after this key", help="write 'key: value'")


def _no_content(trouble: slips.Trouble) -> Finding:
    if character := trouble.line_text[trouble.column : trouble.column + 1]:
        return slips.NOT_YAML.at(trouble.here, f"a value is missing before this '{plain(character)}'")
    help_text = "close what '[' and '{' have opened"
    return slips.NOT_YAML.at(trouble.here, "a value is missing at the end of the file", help=help_text)


def _anchor_twice(trouble: slips.Trouble) -> Finding:
    first = (Related(trouble.opening, "the first"),)
    return slips.NOT_YAML.at(trouble.here, "two anchors ('&') have the same name", related=first)


def _plainly(message: str, help_text: str = "") -> Callable[[slips.Trouble], Finding]:
    """Return an explainer that gives the same words wherever the error is."""
    return lambda trouble: slips.NOT_YAML.at(trouble.here, message, help=help_text)


def _unclosed_quote(trouble: slips.Trouble) -> Finding:
    return slips.NOT_YAML.at(
        trouble.opening, "this quote is never closed", help="put the same quote at the end of the text"
    )


def _second_document(trouble: slips.Trouble) -> Finding:
    help_text = "a file holds one manifest: remove the '---'"
    before, rest = trouble.lines[: trouble.line], trouble.lines[trouble.line + 1 :]
    if any(all(any(line.startswith(key) for line in lines) for lines in (before, rest)) for key in _HEADER):
        help_text = "a file holds one manifest: move what follows, without the '---', to a file of its own"
    elif not any(map(slips.is_written, rest)):
        help_text = "nothing follows: remove the '---'"
    return slips.NOT_YAML.at(trouble.here, "a second document starts here", help=help_text)


_ESCAPE = _plainly(
    "a backslash in double quotes starts an escape, but this is not one",
    "a path is written with '/'; elsewhere write the backslash twice, or use single quotes",
)
_ANSWERS: dict[str, Callable[[slips.Trouble], Finding]] = {
    slips.COLON: _colon,
    "while scanning a block scalar": _sigil,
    "found character that cannot start any token": _first_character,
    "found undefined alias": _unknown_alias,
    "while scanning an anchor": _sigil,
    "while scanning an alias": _sigil,
    "while scanning a tag": _sigil,
    "while parsing a tag": _sigil,
    "found undefined tag handle": _sigil,
    "found unexpected end of stream": _unclosed_quote,
    "found unexpected document indicator": _unclosed_quote,
    "did not find expected ',' or": _unclosed_bracket,
    slips.NO_DASH: _missing_dash,
    slips.NO_KEY: _after_value,
    slips.NO_COLON: _missing_colon,
    "block sequence entries are not allowed": _plainly(
        "a list cannot start on the line of its key",
        "start a list on the line below its key; text that starts with '- ' needs quotes",
    ),
    "did not find expected <document start>": _plainly("there is extra text here, after the end of the manifest"),
    "did not find expected node content": _no_content,
    "unknown escape character": _ESCAPE,
    "did not find expected hexdecimal number": _ESCAPE,
    "found duplicate anchor": _anchor_twice,
    "but found another document": _second_document,
}


TOO_LARGE = kind("RBX1103")


class _LimitError(Exception):
    """Raised inside the parser to stop it; carries the place and the message."""

    def __init__(self, mark: Any, message: str) -> None:
        super().__init__(message)
        self.mark = mark


class _LimitedLoader(yaml.CSafeLoader):
    """Composes without resolving tags; counts nodes and depth in the callbacks that the C code makes for each node."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.nodes = 0
        self.depth = 0

    def descend_resolver(self, current_node: Any, current_index: Any) -> None:
        self.nodes += 1
        self.depth += 1
        if self.depth > DEPTH:
            raise _LimitError(current_node.start_mark, f"values are nested more than {DEPTH} levels deep")
        if self.nodes > NODES:
            siblings = current_node.value
            last = siblings[-1] if siblings else current_node
            last = last[1] if isinstance(last, tuple) else last
            raise _LimitError(last.start_mark, f"more than {NODES:,} values in one file")

    def ascend_resolver(self) -> None:
        self.depth -= 1

    def resolve(self, kind: Any, value: Any, implicit: Any) -> str:
        return ""  # an explicit tag does not come through here


def compose(text: str, file: str) -> tuple[yaml.Node | None, Finding | None]:
    """Return the node tree of one document, or the finding that says why there is none; both None if it is empty."""
    loader = _LimitedLoader(text)
    try:
        return loader.get_single_node(), None
    except _LimitError as error:
        line, column = error.mark.line + 1, error.mark.column + 1
        return None, TOO_LARGE.at(Span(file, line, column, line, column + 1), str(error))
    except yaml.YAMLError as error:
        return None, explain(error, text, file)
    finally:
        loader.dispose()


def is_moderate(section: TreeNode | None, what: str, report: Report) -> bool:
    """Return whether every entry of a section is small enough for a mission, after a finding for each that is not."""
    entries = entries_of(section).values()
    large = [entry for entry in entries if is_larger(entry.value, DATA_NODES)]
    for entry in large:
        message = f"the {what} '{entry.key.text}' holds more than {DATA_NODES:,} values"
        report.add(TOO_LARGE.at(entry.key.span, message, help="a mission reads, checks and copies all of them at once"))
    return not large

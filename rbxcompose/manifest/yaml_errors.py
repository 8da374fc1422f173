"""What the YAML parser objects to, said in plain words with the fix."""

from __future__ import annotations

import re

import yaml

from rbxcompose.findings import Finding, Related, Span, kind
from rbxcompose.plain import plain

QUOTES_NEEDED = kind(
    "RBX1101",
    """Text that needs quotes

Some characters mean something to YAML: a colon with a space behind it, ` #`, and a quote, `>`, `|`, `@`, `%`, `*`, `&`
or `!` at the beginning; inside `{}` and `[]` also commas and brackets. Text that holds one of them stands in quotes.

Bad:
```yaml
about: Note: drives slowly
```
Good:
```yaml
about: "Note: drives slowly"
```
""",
)
NOT_YAML = kind(
    "RBX1102",
    """Not valid YAML

The file cannot be read from the marked place on. Usually a bracket, a quote, a colon or the indentation is wrong there
or just above.

Bad:
```yaml
match: [battery, charger
```
Good:
```yaml
match: [battery, charger]
```
""",
)
QUOTE_HELP = "put quotes round this"

_CLOSES = {"sequence": ("list", "[", "]"), "mapping": ("map", "{", "}")}


class _Trouble:
    """One error of the parser with the text around it."""

    def __init__(self, error: yaml.MarkedYAMLError, text: str, file: str) -> None:
        self.problem = error.problem or ""
        self.context = error.context or ""
        self.file = file
        self.lines = text.split("\n")
        mark = error.problem_mark or error.context_mark
        self.line = mark.line if mark else 0
        self.column = mark.column if mark else 0
        self.start = error.context_mark

    @property
    def line_text(self) -> str:
        return self.lines[self.line] if self.line < len(self.lines) else ""

    @property
    def here(self) -> Span:
        return Span(self.file, self.line + 1, self.column + 1, self.line + 1, self.column + 2)

    @property
    def opening(self) -> Span:
        """The place where what the parser was reading began."""
        if not self.start:
            return self.here
        line, column = self.start.line + 1, self.start.column + 1
        return Span(self.file, line, column, line, column + 1)

    def to_line_end(self, column: int) -> Span:
        end = max(len(self.line_text.rstrip()), column + 1)
        return Span(self.file, self.line + 1, column + 1, self.line + 1, end + 1)


def explain(error: yaml.YAMLError, text: str, file: str) -> Finding:
    """Return the one finding for an error of the parser in `text`."""
    if not isinstance(error, yaml.MarkedYAMLError):
        return NOT_YAML.at(Span(file, 1, 1, 1, 2), "this file cannot be read as YAML")
    trouble = _Trouble(error, text, file)
    for words, answer in _ANSWERS:
        if words in trouble.problem or words in trouble.context:
            return answer(trouble)
    return NOT_YAML.at(trouble.here, "this is not valid YAML", label=plain(trouble.problem))


def _colon(trouble: _Trouble) -> Finding:
    before = trouble.line_text[: trouble.column]
    key = re.match(r"\s*(- +)*[^\s:][^:]*: +", before)
    if key and key.end() < len(before):
        span = trouble.to_line_end(key.end())
        return QUOTES_NEEDED.at(span, "text with a colon and a space needs quotes", label=QUOTE_HELP)
    message = "this key cannot stand here: the line above already holds a value"
    return NOT_YAML.at(trouble.here, message, help="begin it in the same column as the key that it belongs beside")


def _first_character(trouble: _Trouble) -> Finding:
    character = trouble.line_text[trouble.column : trouble.column + 1]
    message = f"text that begins with '{plain(character)}' needs quotes"
    return QUOTES_NEEDED.at(trouble.to_line_end(trouble.column), message, label=QUOTE_HELP)


def _sigil(trouble: _Trouble) -> Finding:
    trouble.line, trouble.column = trouble.opening.line - 1, trouble.opening.column - 1
    if tag := re.match(r"(!remove|!replace)[,\]}]", trouble.line_text[trouble.column :]):
        return NOT_YAML.at(trouble.here, f"a space is missing behind '{tag[1]}'")
    return _first_character(trouble)


def _unknown_alias(trouble: _Trouble) -> Finding:
    span = trouble.to_line_end(trouble.column)
    help_text = "put quotes round it if it is text; an alias needs its anchor ('&name') above it"
    return QUOTES_NEEDED.at(span, "'*' here means an alias, and nothing has this name", help=help_text)


def _unclosed_quote(trouble: _Trouble) -> Finding:
    return NOT_YAML.at(trouble.opening, "this quote is never closed", help="put the same quote at the end of the text")


def _unclosed_bracket(trouble: _Trouble) -> Finding:
    what, opening, closing = _CLOSES["mapping" if "mapping" in trouble.context else "sequence"]
    begun = (Related(trouble.opening, f"the {what} begins here"),)
    message = f"a ',' or the closing '{closing}' of this {what} is missing before this place"
    help_text = f"text with brackets, commas or quotes inside '{opening}{closing}' needs quotes"
    return NOT_YAML.at(trouble.here, message, help=help_text, related=begun)


def _after_value(trouble: _Trouble) -> Finding:
    before = trouble.line_text[: trouble.column]
    if before.rstrip().endswith(("'", '"')):
        begin = re.match(r"\s*(- +)*([^\s:'\"][^:]*: +)?", before)
        span = trouble.to_line_end(begin.end() if begin else 0)
        help_text = "put quotes of the other kind round the whole text"
        return QUOTES_NEEDED.at(span, "text goes on after its closing quote", label=QUOTE_HELP, help=help_text)
    message = "this line does not fit the lines above it"
    begun = (Related(trouble.opening, "what it would belong to begins here"),)
    return NOT_YAML.at(
        trouble.here, message, help="check the indentation: keys of one map begin in one column", related=begun
    )


def _missing_dash(trouble: _Trouble) -> Finding:
    begun = (Related(trouble.opening, "the list begins here"),)
    return NOT_YAML.at(trouble.here, "this stands in a list and has no dash", help="put a dash here", related=begun)


def _missing_colon(trouble: _Trouble) -> Finding:
    trouble.line = trouble.opening.line - 1
    span = trouble.to_line_end(trouble.opening.column - 1)
    return NOT_YAML.at(span, "a colon is missing after this key", help="write 'key: value'")


def _list_on_key_line(trouble: _Trouble) -> Finding:
    help_text = "begin a list on the line below its key; text that begins with '- ' needs quotes"
    return NOT_YAML.at(trouble.here, "a list cannot begin on the line of its key", help=help_text)


def _nothing_open(trouble: _Trouble) -> Finding:
    return NOT_YAML.at(trouble.here, "there is something left over here, after the end of the manifest")


def _no_content(trouble: _Trouble) -> Finding:
    character = trouble.line_text[trouble.column : trouble.column + 1]
    return NOT_YAML.at(trouble.here, f"a value is missing before this '{plain(character)}'")


def _escape(trouble: _Trouble) -> Finding:
    help_text = "write the backslash twice, or use single quotes"
    return NOT_YAML.at(trouble.here, "a backslash in double quotes begins an escape, and this is none", help=help_text)


def _anchor_twice(trouble: _Trouble) -> Finding:
    first = (Related(trouble.opening, "the first"),)
    return NOT_YAML.at(trouble.here, "two anchors ('&') have the same name", related=first)


def _second_document(trouble: _Trouble) -> Finding:
    return NOT_YAML.at(
        trouble.here, "a second document begins here", help="a file holds one manifest: remove the '---'"
    )


_ANSWERS = (
    ("mapping values are not allowed", _colon),
    ("while scanning a block scalar", _sigil),
    ("found character that cannot start any token", _first_character),
    ("found undefined alias", _unknown_alias),
    ("while scanning an anchor", _sigil),
    ("while scanning an alias", _sigil),
    ("while scanning a tag", _sigil),
    ("while parsing a tag", _sigil),
    ("found undefined tag handle", _sigil),
    ("found unexpected end of stream", _unclosed_quote),
    ("found unexpected document indicator", _unclosed_quote),
    ("did not find expected ',' or", _unclosed_bracket),
    ("did not find expected '-' indicator", _missing_dash),
    ("did not find expected key", _after_value),
    ("could not find expected ':'", _missing_colon),
    ("block sequence entries are not allowed", _list_on_key_line),
    ("did not find expected <document start>", _nothing_open),
    ("did not find expected node content", _no_content),
    ("unknown escape character", _escape),
    ("did not find expected hexdecimal number", _escape),
    ("found duplicate anchor", _anchor_twice),
    ("but found another document", _second_document),
)

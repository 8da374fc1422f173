"""What the YAML parser objects to, said in plain words with the fix."""

from __future__ import annotations

import re

import yaml

from rbxcompose.findings import Edit, Finding, Fix, Related, Span, kind, replacement
from rbxcompose.manifest.yaml_slips import Slip, key_in_line, missing_dash, too_far_left
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
    is_fixable=True,
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
    is_fixable=True,
)
QUOTE_HELP = "put quotes round this"

_NO_SIGIL = "@`%>|"  # at the beginning of a text; `&`, `*` and `!` may have been meant as such
_ITEM = re.compile(r" *(- +)*")
_TIGHT_DASH = re.compile(r"( *)-([a-z][a-z0-9_]*)(?=: |:? *$)")
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

    def quoting(self, span: Span) -> Fix | None:
        """Return the fix that puts quotes round a text that goes to the end of its line, if that is all of it."""
        written = self.line_text[span.column - 1 : span.end_column - 1]
        meant = written
        if written[:1] == written[-1:] == "'":
            if written.count("'") != 3:
                return None  # which of the quotes belong to the text?
            meant = written[1:-1]
        is_simple = '"' not in meant and "\\" not in meant
        quoted = f'"{meant}"' if is_simple else "'" + meant.replace("'", "''") + "'"
        is_whole = " #" not in written and not self.goes_on
        return replacement(span, written, quoted) if written and is_whole else None

    @property
    def goes_on(self) -> bool:
        """Tell whether the next line lies deeper than this one, so that it may belong to the same text."""
        below = next((line for line in self.lines[self.line + 1 :] if line.strip()), "")
        return _indent(below) > _indent(self.line_text)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def explain(error: yaml.YAMLError, text: str, file: str) -> Finding:
    """Return the one finding for an error of the parser in `text`."""
    if not isinstance(error, yaml.MarkedYAMLError):
        return NOT_YAML.at(Span(file, 1, 1, 1, 2), "this file cannot be read as YAML")
    trouble = _Trouble(error, text, file)
    if tight := _tight_dashes(trouble):
        return tight
    for words, answer in _ANSWERS:
        if words in trouble.problem or words in trouble.context:
            return answer(trouble)
    return NOT_YAML.at(trouble.here, "this is not valid YAML", label=plain(trouble.problem))


def _tight_dashes(trouble: _Trouble) -> Finding | None:
    """Return the finding for dashes without a space, in the column in which the parser met with trouble."""
    near = {line for line in (trouble.line, trouble.opening.line - 1) if line < len(trouble.lines)}
    indents = {len(found[1]) for line in near if (found := _TIGHT_DASH.match(trouble.lines[line]))}
    if not indents or "block scalar" in trouble.context:
        return None
    tight = [
        (line, found) for line in _siblings(trouble, indents.pop()) if (found := _TIGHT_DASH.match(trouble.lines[line]))
    ]
    edits = []
    for line, found in tight:
        place = Span(trouble.file, line + 1, len(found[1]) + 1, line + 1, found.end() + 1)
        edits.append(Edit(place, f"-{found[2]}", f"- {found[2]}"))
    first = edits[0]
    fix = Fix(tuple(edits), True, f"'{first.old}' -> '{first.text}'")
    message = "a space is missing behind this dash"
    return NOT_YAML.at(first.span, message, help=f"write '{first.text}'", fix=fix)


def _siblings(trouble: _Trouble, indent: int) -> list[int]:
    """Return the lines around the trouble that begin in a column, as far as no line begins before it."""
    first = last = min(trouble.line, len(trouble.lines) - 1)
    while first > 0 and not _leaves(trouble.lines[first - 1], indent):
        first -= 1
    while last + 1 < len(trouble.lines) and not _leaves(trouble.lines[last + 1], indent):
        last += 1
    return [line for line in range(first, last + 1) if _indent(trouble.lines[line]) == indent]


def _leaves(line: str, indent: int) -> bool:
    return bool(line.strip()) and _indent(line) < indent


def _colon(trouble: _Trouble) -> Finding:
    before = trouble.line_text[: trouble.column]
    key = re.match(r"\s*(- +)*[^\s:][^:]*: +", before)
    if key and key.end() < len(before):
        if slip := key_in_line(trouble.lines, trouble.line, trouble.file):
            return _told(slip)
        span = trouble.to_line_end(key.end())
        message = "text with a colon and a space needs quotes"
        return QUOTES_NEEDED.at(span, message, label=QUOTE_HELP, fix=trouble.quoting(span))
    above = trouble.lines[trouble.line - 1] if trouble.line else ""
    item = _ITEM.match(above)
    if item and (tight := _tight_colon(trouble, trouble.line - 1, item.end())):
        return tight
    if found := _step_above(trouble):
        step, value = found
        word = trouble.lines[step.line - 1][step.column - 1 : step.end_column - 1]
        fix = replacement(step, word, f"{word}:", is_safe=not value)  # with a value, it may be a text as well
        message, help_text = (
            "with settings below it, a step needs a colon",
            f"write '{word}: {value}'".replace(": '", ":'"),
        )
        below = (Related(trouble.here, "this stands below it"),)
        return NOT_YAML.at(step, message, label="put a colon here", help=help_text, related=below, fix=fix)
    if slip := _too_far_left(trouble):
        return _told(slip)
    message = "this key cannot stand here: the line above already holds a value"
    begin = _indent(trouble.line_text)
    span = Span(trouble.file, trouble.line + 1, begin + 1, trouble.line + 1, max(begin, trouble.column) + 1)
    return NOT_YAML.at(span, message, help="begin it in the same column as the key that it belongs beside")


def _step_above(trouble: _Trouble) -> tuple[Span, str] | None:
    """Return the step without a colon right above a line that stands below it: the place of its word, and its value."""
    line = trouble.line - 1
    above = trouble.lines[line] if line >= 0 else ""
    step = re.fullmatch(r"(?P<before> *(- +)*)(?P<word>[a-z][a-z0-9_]*)(?P<value> +[^\s:#][^:#]*)? *", above)
    if not step or _indent(trouble.line_text) < len(step["before"]):
        return None
    start = len(step["before"])
    place = Span(trouble.file, line + 1, start + 1, line + 1, start + len(step["word"]) + 1)
    return place, (step["value"] or "").strip()


def _too_far_left(trouble: _Trouble) -> Slip | None:
    """Return the slip of this line, or of the one above it, that stands further left than its neighbours."""
    below = next((one for one in range(trouble.line + 1, len(trouble.lines)) if trouble.lines[one].strip()), None)
    lines = (trouble.line, below)
    found = (too_far_left(trouble.lines, line, trouble.file) for line in lines if line is not None)
    return next((slip for slip in found if slip), None)


def _told(slip: Slip) -> Finding:
    return NOT_YAML.at(slip.span, slip.message, help=slip.help, fix=slip.fix)


def _first_character(trouble: _Trouble) -> Finding:
    character = trouble.line_text[trouble.column : trouble.column + 1]
    message = f"text that begins with '{plain(character)}' needs quotes"
    span = trouble.to_line_end(trouble.column)
    fix = trouble.quoting(span) if character in _NO_SIGIL else None
    return QUOTES_NEEDED.at(span, message, label=QUOTE_HELP, fix=fix)


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
    is_key = re.fullmatch(r"\s*[\w.-]+", trouble.line_text[: trouble.column])
    if is_key and _indent(trouble.line_text) <= _indent(trouble.lines[trouble.opening.line - 1]):
        here = (Related(trouble.here, "a new key begins here"),)
        return NOT_YAML.at(trouble.opening, f"the closing '{closing}' of this {what} is missing", related=here)
    message = f"a ',' or the closing '{closing}' of this {what} is missing before this place"
    help_text = f"text with brackets, commas or quotes inside '{opening}{closing}' needs quotes"
    return NOT_YAML.at(trouble.here, message, help=help_text, related=begun)


def _after_value(trouble: _Trouble) -> Finding:
    before = trouble.line_text[: trouble.column]
    if before.rstrip().endswith(("'", '"')):
        begin = re.match(r"\s*(- +)*([^\s:'\"][^:]*: +)?", before)
        span = trouble.to_line_end(begin.end() if begin else 0)
        help_text = "put quotes of the other kind round the whole text"
        message, fix = "text goes on after its closing quote", trouble.quoting(span)
        return QUOTES_NEEDED.at(span, message, label=QUOTE_HELP, help=help_text, fix=fix)
    if slip := _too_far_left(trouble):
        return _told(slip)
    message = "this line does not fit the lines above it"
    begun = (Related(trouble.opening, "what it would belong to begins here"),)
    return NOT_YAML.at(
        trouble.here,
        message,
        help="check the indentation: keys that belong together begin in one column",
        related=begun,
    )


def _missing_dash(trouble: _Trouble) -> Finding:
    if slip := _too_far_left(trouble):
        return _told(slip)
    begun = (Related(trouble.opening, "the list begins here"),)
    key = re.match(r" *([a-z][a-z0-9_]*):", trouble.line_text)
    help_text = "put a dash here"
    if key:
        where = "move it right if it belongs to the item above, left if it belongs beside the list"
        help_text = f"{where}; put a dash here if '{key[1]}' is an item of its own"
    return NOT_YAML.at(trouble.here, "this stands in a list and has no dash", help=help_text, related=begun)


def _missing_colon(trouble: _Trouble) -> Finding:
    trouble.line = trouble.opening.line - 1
    if slip := missing_dash(trouble.lines, trouble.line, trouble.file):
        return _told(slip)
    span = trouble.to_line_end(trouble.opening.column - 1)
    tight = _tight_colon(trouble, trouble.line, span.column - 1)
    return tight or NOT_YAML.at(span, "a colon is missing after this key", help="write 'key: value'")


def _tight_colon(trouble: _Trouble, line: int, column: int) -> Finding | None:
    """Return the finding for a key with a colon and no space behind it, if one begins there."""
    tight = re.match(r"[a-z][a-z0-9_]*:(?!//)(?=\S)", trouble.lines[line][column:])
    if tight is None:
        return None
    colon = Span(trouble.file, line + 1, column + 1, line + 1, column + tight.end() + 1)
    fix = replacement(colon, tight[0], f"{tight[0]} ")
    return NOT_YAML.at(colon, "a space is missing behind this colon", help="write 'key: value'", fix=fix)


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

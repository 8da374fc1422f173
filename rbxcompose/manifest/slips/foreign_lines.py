"""Lines that are not YAML: comments of other languages, and the marks of a merge that git could not finish."""

from __future__ import annotations

from rbxcompose.findings import Edit, Finding, Fix
from rbxcompose.manifest.parser_error import NOT_YAML, Trouble
from rbxcompose.manifest.slips import ANY, text_slip

_COMMENTS = ("//", "/*", "<!--")
_MARKS = ("<<<<<<< ", ">>>>>>> ")


@text_slip(ANY)
def foreign_lines(trouble: Trouble) -> Finding | None:
    """Recognise a comment at the error or just above it, and marks of git anywhere in the text."""
    marked = [number for number, line in enumerate(trouble.lines) if line.startswith(_MARKS)]
    if len(marked) > 1:
        message = "git has left a merge here for you to decide"
        help_text = f"keep one of the two versions, and remove the lines with '{'<' * 7}', '{'=' * 7}' and '{'>' * 7}'"
        return NOT_YAML.at(trouble.span(marked[0], 0, len(trouble.lines[marked[0]])), message, help=help_text)
    near = (trouble.line, trouble.opening.line - 1, next(trouble.above(trouble.line), 0))
    for number in near:
        line = trouble.lines[number] if number < len(trouble.lines) else ""
        text = line.strip()
        if text.startswith(_COMMENTS):
            start = len(line) - len(line.lstrip())
            span = trouble.span(number, start, len(line.rstrip()))
            fix = None
            if text.startswith(_COMMENTS[0]):
                edit = Edit(span, text, f"#{text.removeprefix(_COMMENTS[0])}")
                fix = Fix((edit,), True, "'//' -> '#'")
            return NOT_YAML.at(span, "this is not how a comment begins in YAML", help="begin it with '#'", fix=fix)
    return None

"""Pieces of Markdown: tables, fenced examples, and docstrings taken apart."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterable, Sequence

MARK = "Made by `make docs` from the code; what is explained in one go stands in [the language](../language.md).\n"
_EXAMPLE = "Example:\n"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table without the columns that are empty in all rows, or nothing if there are no rows."""
    cells = [[" ".join(cell.split()).replace("|", "\\|") for cell in row] for row in rows]
    kept = [index for index in range(len(head)) if any(row[index] for row in cells)]
    lines = [[head[index] for index in kept], ["---"] * len(kept), *([row[index] for index in kept] for row in cells)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines) if cells else ""


def code(text: str) -> str:
    """Return a word as code, nothing for nothing."""
    return f"`{text}`" if text else ""


def example(text: str, words: str) -> str:
    """Return a fenced block, which a test checks as its words say."""
    return f"```{words}\n{text.strip()}\n```\n" if text.strip() else ""


def about(documented: object) -> str:
    """Return a docstring up to its example."""
    return (inspect.getdoc(documented) or "").partition(_EXAMPLE)[0].strip()


def example_of(documented: object) -> str:
    """Return the example that a docstring shows, or nothing."""
    return textwrap.dedent((inspect.getdoc(documented) or "").partition(_EXAMPLE)[2]).strip()


def lowered(text: str) -> str:
    """Return a sentence as it goes on behind a colon."""
    return f"{text[0].lower()}{text[1:]}"


def indented(text: str, levels: int = 1) -> str:
    """Return a text with its lines further to the right."""
    return textwrap.indent(text, "  " * levels)


def page(title: str, *parts: str) -> str:
    """Return a page; its parts stand apart by an empty line."""
    return "\n".join([f"# {title}\n", MARK, *(f"{part.strip()}\n" for part in parts if part.strip())])

"""The reference of the commands: what `--help` tells of each."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from docs.generating.markdown import code, lowered, page, table
from rbxcompose.commands.verbs import load, parser_of, verbs


def whole_page() -> str:
    """Return the page."""
    return page("Commands", overview(), *(of_command(parser, 2) for parser in parsers()))


def parsers() -> Iterator[argparse.ArgumentParser]:
    """Give the parser of each verb, as the command line makes it."""
    for name in verbs():
        yield parser_of(name, load(name))


def overview() -> str:
    """Return a table of all commands."""
    return table(("command", "what it does"), (row for parser in parsers() for row in leaves(parser)))


def leaves(parser: argparse.ArgumentParser, words: str = "") -> Iterator[tuple[str, str]]:
    """Give the row of a command, or those of the commands below it."""
    below = [one for one in parser._actions if isinstance(one, argparse._SubParsersAction)]
    for action in below:
        helps = {choice.dest: choice.help or "" for choice in action._choices_actions}
        for name, inner in action.choices.items():
            yield from leaves(inner, helps[name])
    if not below:
        values = [written(one).strip("`") for one in parser._actions if not one.option_strings]
        name = " ".join([parser.prog.partition(" ")[2], *values])
        does = words or (parser.description or "").strip().partition("\n")[0].rstrip(".")
        yield f"[{code(name)}](#{parser.prog.replace(' ', '-')})", lowered(does)


def of_command(parser: argparse.ArgumentParser, level: int, about: str = "") -> str:
    """Return what is known of a command, then of the commands below it."""
    title, space, rest = (parser.description or about).strip().partition("\n\n")
    words = f"{'#' * level} {code(parser.prog)}\n{title}{space}{rest}\n"
    own = [one for one in parser._actions if not isinstance(one, argparse._HelpAction | argparse._SubParsersAction)]
    parts = [words, table(("argument", "what it is"), [(written(one), one.help or "") for one in own])]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            helps = {choice.dest: choice.help or "" for choice in action._choices_actions}
            parts += [of_command(below, level + 1, sentence(helps[name])) for name, below in action.choices.items()]
    return "\n".join(part for part in parts if part)


def sentence(words: str) -> str:
    """Return words as a sentence."""
    return f"{words[:1].upper()}{words[1:]}."


def written(action: argparse.Action) -> str:
    """Return an argument as it is written: `-f FILE`, `--file FILE`, `[PATH ...]`."""
    value = action.metavar if isinstance(action.metavar, str) else "|".join(map(str, action.choices or [action.dest]))
    if action.option_strings:
        return ", ".join(code(option if action.nargs == 0 else f"{option} {value}") for option in action.option_strings)
    shapes = {"*": f"[{value} ...]", "?": f"[{value}]", "+": f"{value} ..."}
    return code(shapes.get(str(action.nargs), value))

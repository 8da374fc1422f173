"""Candidates to complete a command line: verbs, options and choices of the parsers, else `CandidateValues`."""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from typing import Protocol

from rbxcompose.cli.verbs import load, parser_of, verbs
from rbxcompose.dataclass import dataclass

_GENERAL = ("--help", "--version")
_BREAKS = re.compile(r".*[:=]", re.DOTALL)  # bash treats these as ends of words and replaces only what follows
_SEVERAL = ("*", "+")


class CandidateValues(Protocol):
    """Finds candidates for the value of an argument."""

    def of(self, metavar: str, dest: str, current: str, given: Mapping[str, str]) -> Iterable[str]:
        """Return the candidates; `given` has the options typed so far by `dest`, other words by metavar."""
        ...


@dataclass(slots=True)
class _Place:
    """The position of the current word in a command line."""

    parser: argparse.ArgumentParser
    option: argparse.Action | None = None  # the option that waits for its value
    given: dict[str, str] = field(default_factory=dict)
    positionals: list[argparse.Action] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.positionals = [one for one in self.parser._actions if not one.option_strings]

    def go(self, word: str) -> None:
        """Step over a word."""
        options = self.parser._option_string_actions
        name, equals, value = word.partition("=")
        if name in options:
            action = options[name]
            self.option = None if equals or action.nargs == 0 else action
            self.given.update({action.dest: value} if equals else {})
        elif self.option is not None:
            self.given[self.option.dest] = word
            self.option = self.option if self.option.nargs in _SEVERAL else None
        elif self.positionals:
            self._positional(word)

    def _positional(self, word: str) -> None:
        first = self.positionals[0]
        if isinstance(first, argparse._SubParsersAction):
            if word in first.choices:
                self.parser = first.choices[word]
                self.__post_init__()
        else:
            self.given.setdefault(str(first.metavar), word)
            if first.nargs not in _SEVERAL:
                self.positionals.pop(0)

    def fitting(self, current: str, values: CandidateValues) -> Iterable[str]:
        """Yield the candidates for the current word."""
        options = self.parser._option_string_actions
        name, equals, value = current.partition("=")
        if equals and name in options:
            yield from (f"{name}={one}" for one in self._values(options[name], value, values))
        elif self.option is not None and not (current.startswith("-") and self.option.nargs in _SEVERAL):
            yield from self._values(self.option, current, values)
        elif current.startswith("-") or not self.positionals:
            yield from (one for one in options if one.startswith("--"))
        else:
            yield from self._values(self.positionals[0], current, values)

    def _values(self, action: argparse.Action, current: str, values: CandidateValues) -> Iterable[str]:
        if action.choices is not None:
            return map(str, action.choices)
        return values.of(str(action.metavar or ""), action.dest, current, self.given)


def candidates(words: Sequence[str], values: CandidateValues) -> list[str]:
    """Return the sorted candidates for the last of `words`, the words after `rbxcompose`."""
    *before, current = words
    if not before:
        found: Iterable[str] = _GENERAL if current.startswith("-") else verbs()
    elif before[0] not in verbs():
        found = ()
    else:
        place = _Place(parser_of(before[0], load(before[0])))
        for word in before[1:]:
            place.go(word)
        found = place.fitting(current, values)
    return sorted({one for one in found if one.startswith(current)})


def for_shell(shell: str, words: Sequence[str], find: Callable[[Sequence[str]], list[str]]) -> list[str]:
    """Return the candidates as a shell wants them: bash passes the line, the others its words with `rbxcompose`."""
    if shell != "bash":
        return find(list(words[1:]) or [""])
    typed = _split(words[0] if words else "")
    broken = _BREAKS.match(typed[-1])
    return [one[broken.end() if broken else 0 :] for one in find(typed)]


def _split(line: str) -> list[str]:
    """Return the words of a line after the first; the last one may be incomplete."""
    for ending in ("", "'", '"'):
        try:
            words = shlex.split(line + ending)
        except ValueError:
            continue  # a quote is open
        return words[1:] + [""] * (not ending and (line[-1:].isspace() or len(words) < 2))
    return [""]

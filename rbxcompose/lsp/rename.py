"""Renaming a name of the project in every file that has it, or the reason why it cannot be renamed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from rbxcompose.compiler import Compilation, compile_robot
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Severity
from rbxcompose.lsp.fixes import TextChange
from rbxcompose.lsp.project_files import ROBOT, ProjectFiles
from rbxcompose.lsp.symbol_index import SymbolIndex
from rbxcompose.lsp.symbols import Mention, Symbol
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.registry import section_named
from rbxcompose.manifest.tree import NOWHERE, ScalarNode
from rbxcompose.missions.language.names import NAME, no_name
from rbxcompose.missions.program.registry import kinds

Compile = Callable[[Path, Mapping[Path, str]], Compilation]


class CannotRenameError(Exception):
    """Raised with the reason why a name cannot be renamed."""


@dataclass(frozen=True, slots=True)
class Renamed:
    """The changes of each file, in the order of its text, and the new texts."""

    changes: dict[Path, list[TextChange]]
    texts: dict[Path, str]


def prepare(index: SymbolIndex, path: Path, line: int, column: int) -> Mention:
    """Return the name at a position (from 0) that can be renamed.

    Raises:
        CannotRenameError: if there is none.
    """
    found = index.at(path, line, column)
    if not found:
        raise CannotRenameError(
            "there is no name of this project here: words of the language and names from plug-ins, such as types and "
            "skills, cannot be renamed"
        )
    together = list(index.together([one.symbol for one in found]))
    for symbol in together:
        _refuse_foreign(index.files, symbol)
    _refuse_ambiguous(index, together)
    return found[0]


def rename(index: SymbolIndex, path: Path, line: int, column: int, new: str, compiled: Compile) -> Renamed:
    """Return the changes that rename what is at a position (from 0).

    The robots concerned are compiled before and after: a rename that changes what `check` says is refused.

    Raises:
        CannotRenameError: if the name cannot be renamed, or not to `new`.
    """
    found = prepare(index, path, line, column)
    old = found.symbol.name
    _refuse_name(new)
    if new == old:
        return Renamed({}, {})
    symbols = index.together([one.symbol for one in index.at(path, line, column)])
    for symbol in symbols:
        _refuse_taken(index, symbol, new)
    places: dict[Path, set[tuple[int, int]]] = {}
    for one in (one for symbol in symbols for one in index.of(symbol)):
        places.setdefault(one.file, set()).add((one.start, one.end))
    made = _made(index.files, places, new)
    robots: dict[tuple[Path, bool], Compilation] = {}

    def once(robot: Path, texts: Mapping[Path, str]) -> Compilation:
        key = robot, texts is made.texts
        if key not in robots:
            robots[key] = compiled(robot, texts)
        return robots[key]

    _refuse_changed(index.files, made.texts, once)
    after = SymbolIndex(index.files.changed(made.texts), lambda robot: once(robot, made.texts).robot)
    _refuse_other_meanings(index, after, symbols, new)
    return made


def _made(files: ProjectFiles, places: Mapping[Path, set[tuple[int, int]]], new: str) -> Renamed:
    changes: dict[Path, list[TextChange]] = {}
    texts = {}
    for file, there in sorted(places.items()):
        found, text = files.places(file), files.text(file)
        changes[file] = [TextChange(found.position(start), found.position(end), new) for start, end in sorted(there)]
        for start, end in sorted(there, reverse=True):
            text = f"{text[:start]}{new}{text[end:]}"
        texts[file] = text
    return Renamed(changes, texts)


def _refuse_foreign(files: ProjectFiles, symbol: Symbol) -> None:
    section = section_named(symbol.sort)
    if not files.is_own(symbol.file):
        raise CannotRenameError(
            f"'{symbol.name}' comes from {shown_name(symbol.file)}, which does not belong to this project"
        )
    if section is not None and section.has_topics:
        raise CannotRenameError(
            f"'{symbol.name}' is a topic: ports, other programs and parts know it by this name; write `connect:` for a "
            "part or component that needs another one"
        )


def _refuse_ambiguous(index: SymbolIndex, symbols: list[Symbol]) -> None:
    sorts = list(dict.fromkeys(one.sort for one in symbols))
    if len(sorts) > 1:
        where = _where(index, symbols)
        raise CannotRenameError(f"'{symbols[0].name}' has several meanings ({', '.join(sorts)}){where}")
    mentions = sorted({(one.file, one.start, one.end) for symbol in symbols for one in index.of(symbol)})
    for file, start, _ in mentions:
        if start < 0:
            raise CannotRenameError(
                f"'{symbols[0].name}' stands in a text of {shown_name(file)} that is folded or has escapes; change it "
                "by hand"
            )
        if not index.files.is_own(file):
            raise CannotRenameError(
                f"'{symbols[0].name}' is used in {shown_name(file)}, which does not belong to this project"
            )


def _where(index: SymbolIndex, symbols: list[Symbol]) -> str:
    """Return the place where a name of one sort is one of another, too."""
    seen: dict[tuple[Path, int], str] = {}
    for symbol in symbols:
        for one in index.of(symbol):
            if seen.setdefault((one.file, one.start), symbol.sort) != symbol.sort and one.start >= 0:
                line, column = index.files.places(one.file).position(one.start)
                return f" at {shown_name(one.file)}:{line + 1}:{column + 1}"
    return ""


def _refuse_name(new: str) -> None:
    if not NAME.fullmatch(new):
        told = no_name(ScalarNode(new, NOWHERE))
        raise CannotRenameError(f"{told.message}: {told.help}")
    if new in kinds() or new in ("true", "false", "null"):
        raise CannotRenameError(f"'{new}' is a word of the language")


def _refuse_taken(index: SymbolIndex, symbol: Symbol, new: str) -> None:
    taken = Symbol(symbol.file, symbol.sort, new, symbol.at)
    definition = next((one for one in index.of(taken) if one.is_definition), None)
    if definition is not None:
        line, column = index.files.places(definition.file).position(max(definition.start, 0))
        place = f"{shown_name(definition.file)}:{line + 1}:{column + 1}"
        raise CannotRenameError(f"'{new}' is taken: {place}")


def _refuse_changed(files: ProjectFiles, texts: Mapping[Path, str], compiled: Compile) -> None:
    before = {path: files.text(path) for path in texts}
    for robot in files.of_kind(ROBOT):
        concerned = {*files.within(robot)}
        concerned |= {mission for one in tuple(concerned) for _, mission in files.missions(one)}
        if not concerned.isdisjoint(texts):
            _refuse_other(robot, compiled(robot, before), compiled(robot, texts))


def _refuse_other_meanings(index: SymbolIndex, after: SymbolIndex, symbols: Collection[Symbol], new: str) -> None:
    """Refuse what makes a word mean the new name that meant something else before, or the other way round."""
    was = Counter(
        (one.file, one.symbol.file, one.symbol.sort, new if one.symbol in symbols else one.symbol.name)
        for one in index.mentions
    )
    now = {(one.file, one.symbol.file, one.symbol.sort, one.symbol.name): one for one in after.mentions}
    found = Counter((one.file, one.symbol.file, one.symbol.sort, one.symbol.name) for one in after.mentions)
    for key in (found - was) | (was - found):
        place = ""
        if (one := now.get(key)) and one.start >= 0:
            line, column = after.files.places(one.file).position(one.start)
            place = f", as at {shown_name(one.file)}:{line + 1}:{column + 1}"
        raise CannotRenameError(f"'{new}' has another meaning already{place}")


def _refuse_other(robot: Path, old: Compilation, new: Compilation) -> None:
    """Refuse what changes the findings of a robot, or the amount of what it runs."""
    was, now = (Counter((one.code, one.severity) for one in made.report) for made in (old, new))
    if more := now - was:
        code = next(iter(more))[0]
        told = next(one for one in new.report if one.code == code)
        place = f"{told.span}: " if told.span else ""
        raise CannotRenameError(f"then `check` would say: {place}{told.message}")
    if was - now:
        code, severity = next(iter(was - now))
        what = "error" if severity is Severity.ERROR else "warning"
        raise CannotRenameError(
            f"the name is part of a mistake: correct the {what} {code} in {shown_name(robot)} first"
        )


def compiler(environment: Mapping[str, str], unsaved: Mapping[Path, str]) -> Compile:
    """Return a function that compiles a robot with other texts, over those in the editor."""

    def compiled(robot: Path, texts: Mapping[Path, str]) -> Compilation:
        return compile_robot(str(robot), environment=environment, unsaved={**unsaved, **texts})

    return compiled

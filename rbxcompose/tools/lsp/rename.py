"""Renaming a name of the project in every file that has it, and fixes as changes to texts."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Severity, apply_fixes
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.registry import section_named
from rbxcompose.manifest.section import ROBOT
from rbxcompose.manifest.tree import NOWHERE, ScalarNode
from rbxcompose.missions.language.node_reader import NAME, invalid_name
from rbxcompose.missions.program.registry import kinds
from rbxcompose.tools.lsp.mentions import Mention, SymbolIndex
from rbxcompose.tools.lsp.project import Project
from rbxcompose.tools.lsp.project_files import ProjectFiles, ScalarPlaces, Symbol


@dataclass(frozen=True, slots=True)
class TextChange:
    """A text that replaces what is between two positions (line, column, from 0)."""

    start: tuple[int, int]
    end: tuple[int, int]
    text: str


@dataclass(frozen=True, slots=True)
class CodeAction:
    """An action that an editor offers for a finding."""

    title: str
    finding: Finding
    is_safe: bool
    changes: dict[Path, TextChange]


def actions(project: Project, findings: Iterable[Finding], first: int, last: int) -> Iterator[CodeAction]:
    """Yield the fixes of the findings on the lines `first` to `last` (from 0)."""
    for finding in findings:
        span, fix = finding.span, finding.fix
        if span is None or fix is None or not (span.line - 1 <= last and span.end_line - 1 >= first):
            continue
        files = {edit.span.file: Path(edit.span.file).resolve() for edit in fix.edits}
        texts = {file: project.text(path) for file, path in files.items()}
        after = apply_fixes([fix], texts).texts
        changes = {files[file]: change_of(texts[file], after[file]) for file in files if texts[file] != after[file]}
        if changes:
            yield CodeAction(fix.title, finding, fix.is_safe, changes)


def change_of(before: str, after: str) -> TextChange:
    """Return the smallest single change that turns `before` into `after`."""
    shortest = min(len(before), len(after))
    start = next((index for index in range(shortest) if before[index] != after[index]), shortest)
    most = shortest - start
    tail = next((size for size in range(most) if before[-1 - size] != after[-1 - size]), most)
    end = len(before) - tail
    position = ScalarPlaces(before).position
    return TextChange(position(start), position(end), after[start : len(after) - tail])


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
    together = list(index.together([mention.symbol for mention in found]))
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
    for mention in (one for symbol in symbols for one in index.of(symbol)):
        places.setdefault(mention.file, set()).add((mention.start, mention.end))
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
        where = shown_name(symbol.file)
        raise CannotRenameError(f"'{symbol.name}' comes from {where}, which does not belong to this project")
    if section is not None and section.has_topics:
        raise CannotRenameError(
            f"'{symbol.name}' is a topic: ports, other programs and parts know it by this name; write `connect:` for a "
            "part or component that needs another one"
        )


def _refuse_ambiguous(index: SymbolIndex, symbols: list[Symbol]) -> None:
    sorts = list(dict.fromkeys(symbol.sort for symbol in symbols))
    if len(sorts) > 1:
        where = _where(index, symbols)
        raise CannotRenameError(f"'{symbols[0].name}' has several meanings ({', '.join(sorts)}){where}")
    mentions = {(mention.file, mention.start, mention.end) for symbol in symbols for mention in index.of(symbol)}
    for file, start, _ in sorted(mentions):
        if start < 0:
            raise CannotRenameError(
                f"'{symbols[0].name}' stands in a text of {shown_name(file)} that is folded or has escapes; change it "
                "by hand"
            )
        if not index.files.is_own(file):
            used = f"'{symbols[0].name}' is used in {shown_name(file)}"
            raise CannotRenameError(f"{used}, which does not belong to this project")


def _where(index: SymbolIndex, symbols: list[Symbol]) -> str:
    """Return the place where a name of one sort is one of another, too."""
    seen: dict[tuple[Path, int], str] = {}
    for symbol in symbols:
        for mention in index.of(symbol):
            if seen.setdefault((mention.file, mention.start), symbol.sort) != symbol.sort and mention.start >= 0:
                return f" at {_place(index, mention)}"
    return ""


def _place(index: SymbolIndex, mention: Mention) -> str:
    line, column = index.files.places(mention.file).position(max(mention.start, 0))
    return f"{shown_name(mention.file)}:{line + 1}:{column + 1}"


def _refuse_name(new: str) -> None:
    if not NAME.fullmatch(new):
        finding = invalid_name(ScalarNode(new, NOWHERE))
        raise CannotRenameError(f"{finding.message}: {finding.help}")
    if new in kinds() or new in ("true", "false", "null"):
        raise CannotRenameError(f"'{new}' is a word of the language")


def _refuse_taken(index: SymbolIndex, symbol: Symbol, new: str) -> None:
    taken = Symbol(symbol.file, symbol.sort, new, symbol.at)
    definition = next((mention for mention in index.of(taken) if mention.is_definition), None)
    if definition is not None:
        raise CannotRenameError(f"'{new}' is taken: {_place(index, definition)}")


def _refuse_changed(files: ProjectFiles, texts: Mapping[Path, str], compiled: Compile) -> None:
    before = {path: files.text(path) for path in texts}
    for robot in files.of_kind(ROBOT):
        concerned = {*files.within(robot)}
        concerned |= {mission for path in tuple(concerned) for _, mission in files.missions(path)}
        if not concerned.isdisjoint(texts):
            _refuse_other(robot, compiled(robot, before), compiled(robot, texts))


def _refuse_other_meanings(index: SymbolIndex, after: SymbolIndex, symbols: Collection[Symbol], new: str) -> None:
    """Refuse what makes a word mean the new name that meant something else before, or the other way round."""

    def key_of(mention: Mention, name: str) -> tuple[Path, Path, str, str]:
        return mention.file, mention.symbol.file, mention.symbol.sort, name

    was = Counter(key_of(old, new if old.symbol in symbols else old.symbol.name) for old in index.mentions)
    now = {key_of(mention, mention.symbol.name): mention for mention in after.mentions}
    found = Counter(key_of(mention, mention.symbol.name) for mention in after.mentions)
    for key in (found - was) | (was - found):
        place = ""
        if (one := now.get(key)) and one.start >= 0:
            place = f", as at {_place(after, one)}"
        raise CannotRenameError(f"'{new}' has another meaning already{place}")


def _refuse_other(robot: Path, old: Compilation, new: Compilation) -> None:
    """Refuse what changes the findings of a robot, or the amount of what it runs."""
    was, now = (Counter((finding.code, finding.severity) for finding in made.report) for made in (old, new))
    if more := now - was:
        code = next(iter(more))[0]
        finding = next(finding for finding in new.report if finding.code == code)
        place = f"{finding.span}: " if finding.span else ""
        raise CannotRenameError(f"then `check` would say: {place}{finding.message}")
    if was - now:
        code, severity = next(iter(was - now))
        what = "error" if severity is Severity.ERROR else "warning"
        mistake = f"{what} {code} in {shown_name(robot)}"
        raise CannotRenameError(f"the name is part of a mistake: correct the {mistake} first")


def compiler(environment: Mapping[str, str], unsaved: Mapping[Path, str]) -> Compile:
    """Return a function that compiles a robot with other texts, over those in the editor."""

    def compiled(robot: Path, texts: Mapping[Path, str]) -> Compilation:
        return compile_robot(str(robot), environment=environment, unsaved={**unsaved, **texts}, tries_profiles=True)

    return compiled

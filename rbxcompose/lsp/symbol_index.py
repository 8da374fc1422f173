"""Where the names of a project are written, and which of them belong together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

from rbxcompose.lsp.manifest_mentions import ManifestMentions
from rbxcompose.lsp.mission_mentions import MissionMentions, Skills
from rbxcompose.lsp.project_files import MISSION, OVERLAY, PART, ROBOT, TEST, ProjectFiles
from rbxcompose.lsp.symbols import Mention, Symbol
from rbxcompose.lsp.trial_mentions import TrialMentions
from rbxcompose.model.robot import Robot

MentionPlace = tuple[Path, int, int]


class SymbolIndex:
    """All mentions of names in the manifests of a project.

    `robot_of` returns the robot of a file as last read, if it could be: a mission does not say which arguments of
    skills are places.
    """

    def __init__(self, files: ProjectFiles, robot_of: Callable[[Path], Robot | None]) -> None:
        self.files = files
        self._robot_of = cache(robot_of)
        self.mentions = list(dict.fromkeys(one for path in files.all for one in self._of(path)))
        self._of_symbol: dict[Symbol, list[Mention]] = {}
        self._at: dict[MentionPlace, list[Mention]] = {}
        for one in self.mentions:
            self._of_symbol.setdefault(one.symbol, []).append(one)
            if one.start >= 0:
                self._at.setdefault((one.file, one.start, one.end), []).append(one)

    def _of(self, path: Path) -> Iterator[Mention]:
        kind = self.files.kind(path)
        if kind in (ROBOT, PART, OVERLAY):
            yield from ManifestMentions(self.files, path).all()
        elif kind == MISSION:
            yield from MissionMentions(self.files, path, self._skills(self.files.robots_of(path))).all()
        elif kind == TEST and (robot := self.files.file_named(path, "robot")) is not None:
            yield from TrialMentions(self.files, path, self._skills([robot])).all()

    def _skills(self, robots: Iterable[Path]) -> Skills:
        found = (self._robot_of(robot) for robot in robots)
        return {name: skill for robot in found if robot for name, skill in robot.names.skills.items()}

    @property
    def symbols(self) -> list[Symbol]:
        """Return all names of the project."""
        return list(self._of_symbol)

    def at(self, path: Path, line: int, column: int) -> list[Mention]:
        """Return the mentions at a position (from 0); several if the name there has several meanings."""
        offset = self.files.places(path).offset(line, column)
        found = [one for one in self.mentions if one.file == path and one.start <= offset <= one.end]
        # Between two names, as at the end of the one of an instance, the one that begins there is meant.
        inside = [one for one in found if one.start <= offset < one.end] or found
        nearest = max((one.start for one in inside), default=0)
        return [one for one in inside if one.start == nearest]

    def of(self, symbol: Symbol) -> list[Mention]:
        """Return all places where the name of a symbol is written."""
        return self._of_symbol.get(symbol, [])

    def together(self, symbols: list[Symbol]) -> dict[Symbol, None]:
        """Return symbols with all that share a place with one of them: robots that share a mission, for example."""
        found, waiting = dict.fromkeys(symbols), list(symbols)
        while waiting:
            for one in self.of(waiting.pop()):
                for other in self._at.get((one.file, one.start, one.end), ()):
                    if other.symbol not in found:
                        found[other.symbol] = None
                        waiting.append(other.symbol)
        return found


def references(index: SymbolIndex, path: Path, line: int, column: int, *, with_definitions: bool) -> list[Mention]:
    """Return where the name at a position (from 0) is written, in all files of the project."""
    symbols = dict.fromkeys(one.symbol for one in index.at(path, line, column))
    found = (one for symbol in symbols for one in index.of(symbol))
    places = {
        (one.file, one.start, one.end): one
        for one in found
        if one.start >= 0 and (with_definitions or not one.is_definition)
    }
    return [places[key] for key in sorted(places)]

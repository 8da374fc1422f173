"""Which paths a client may name: those of files in the project, and of the library."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from rbxcompose.base.findings import Finding
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import Refused
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.targets import Targets, robot_path, robots_below, targets
from rbxcompose.manifest.files import PREFIX, find
from rbxcompose.manifest.tree import ALL_BYTES
from rbxcompose.tools.mission_tests.finding_files import tests_of


def words_of_finding(finding: Finding) -> str:
    """Return why something is refused, and what helps."""
    return f"{finding.message}; {finding.help}" if finding.help else finding.message


class ProjectPaths:
    """The paths of the project in the current folder; each method raises `Refused` for what leads out of it."""

    def __init__(self) -> None:
        self.root = Path.cwd().resolve()

    def file(self, written: str) -> str:
        """Return the path of a file or folder of the project, relative to it."""
        try:
            real = (self.root / written).resolve()
            is_there = real.exists()
        except (OSError, ValueError, RuntimeError) as error:  # such as a name too long, a zero byte, a circle of links
            raise Refused(f"'{plain(written)}' is not a path") from error
        self._require_inside(real, written)
        if not is_there:
            raise Refused(f"'{plain(written)}' does not exist")
        return f"./{real.relative_to(self.root)}"  # never an option

    def checked(self, written: Iterable[str]) -> list[str]:
        """Return paths that `check` takes: all that they mean must be in the project, or in the library."""
        paths = [path if path.startswith(PREFIX) else self.file(path) for path in written]
        for path in _named(targets(paths)):
            self._require_inside(Path(path).resolve(), path)
        return paths

    def tests(self, written: Iterable[str]) -> list[str]:
        """Return paths of tests, or of folders of tests."""
        paths = [self.file(path) for path in written]
        for path in tests_of(map(Path, paths)):
            self._require_inside(path.resolve(), str(path))
        return paths

    def robot(self, written: str) -> str:
        """Return the path of a robot; without one, that of the only robot here."""
        try:
            path = written or robot_path(None, may_run=False)
        except NotDoneError as error:
            raise Refused(words_of_finding(error.finding)) from error
        path = path if path.startswith(PREFIX) else self.file(path)
        found = find(path)
        if isinstance(found, Finding):
            raise Refused(words_of_finding(found))
        if not path.startswith(PREFIX):
            self._require_inside(found, written)
        return path

    def robots(self) -> list[str]:
        """Return the paths of the robots of the project."""
        return [path for path in robots_below(Path()) if Path(path).resolve().is_relative_to(self.root)]

    def texts(self, unsaved: Mapping[str, str]) -> dict[str, str]:
        """Return texts in place of those of files, by their paths."""
        if sum(map(len, unsaved.values())) > ALL_BYTES:
            raise Refused(f"these texts have more than {ALL_BYTES:,} characters")
        texts = {self.file(path): text for path, text in unsaved.items()}
        for path in texts:
            if not Path(path).is_file():
                raise Refused(f"'{plain(path)}' is not a file")
        return texts

    def _require_inside(self, real: Path, written: str) -> None:
        if not real.is_relative_to(self.root):
            named = Path(os.path.normpath(self.root / written))
            how = "leads through a link out of" if named.is_relative_to(self.root) else "is outside"
            raise Refused(f"'{plain(written)}' {how} the project '{plain(str(self.root))}'")


def _named(found: Targets) -> Iterator[str]:
    """Yield the files of a project that targets mean."""
    for paths in (found.robots, *found.overlays, found.users, found.files, found.tests, found.systems):
        yield from (path for path in paths if not path.startswith(PREFIX))

"""The robots that `check` checks: by file, by folder, or because they use a file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import field
from pathlib import Path

from rbxcompose.cli.project.kinds import kind_of
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Severity, Span, kind
from rbxcompose.manifest.files import ROBOT_FILE, find, project_of, shown_name
from rbxcompose.manifest.library import PREFIX
from rbxcompose.manifest.section import SYSTEM, TEST

UNUSED = kind("RBX9007", Severity.WARNING)

_USE = "name it in a robot ('missions:', 'include:')"
_MANIFESTS = ("*.yaml", "*.yml")
_ROBOTS, _SYSTEMS = "robots", "systems"


@dataclass(slots=True)
class Targets:
    """What to check: `robots`, `tests` of missions, `systems`; and `users`, but only if they use one of `files`."""

    robots: list[str] = field(default_factory=list)
    users: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    tests: list[str] = field(default_factory=list)
    systems: list[str] = field(default_factory=list)

    def unused(self, read: Iterable[str]) -> Iterator[Finding]:
        """Yield a finding for each of `files` that is not among the `read` names."""
        known = set(read)
        for file in self.files:
            if file not in known:
                message, how = f"no robot of the project uses '{file}'", _USE
                if kind_of(Path(file)) == "Overlay":
                    message = f"'{file}' is an overlay, and does not say for which robot"
                    how = f"name the robot, too: 'rbxcompose check ROBOT -f {file}'"
                yield UNUSED.at(Span(file, 1, 1, 1, 2), message, help=how)


def targets(paths: Iterable[str]) -> Targets:
    """Return the targets that command-line paths name.

    A path is a robot's file or folder, `rbx:robots/NAME`, a folder with robots or else tests below it, or any other
    manifest, which means the robots of its project that use it.
    """
    out = Targets()
    for written in paths:
        path = Path(written)
        if written.startswith(PREFIX) or not path.exists():
            out.robots.append(written)
        elif path.is_dir():
            robots = [written] if (path / ROBOT_FILE).exists() else robots_below(path)
            tests = [] if robots else tests_below(path)
            out.tests += tests
            systems = systems_of(path)
            out.systems += systems
            out.robots += robots if robots or tests or systems else [written]
        elif kind_of(path) in ("Robot", ""):
            out.robots.append(written)
        elif kind_of(path) == TEST:
            out.tests.append(written)
        elif kind_of(path) == SYSTEM:
            out.systems.append(written)
        else:
            out.files.append(shown_name(path.resolve()))
            out.users += robots_below(project_of(path))
    out.robots = list(dict.fromkeys(out.robots))
    out.users = [user for user in dict.fromkeys(out.users) if user not in out.robots]
    return out


def robots_below(folder: Path) -> list[str]:
    """Return the robot files of a project, or of a folder of robots; at most two folders deep."""
    base = folder / _ROBOTS if (folder / _ROBOTS).is_dir() else folder
    files = (path for depth in ("", "*/", "*/*/") for pattern in _MANIFESTS for path in base.glob(depth + pattern))
    return sorted(shown_name(path.resolve()) for path in files if kind_of(path) == "Robot")


def systems_of(folder: Path) -> list[str]:
    """Return the systems of a project, or of a folder of systems."""
    base = folder / _SYSTEMS if (folder / _SYSTEMS).is_dir() else folder
    files = (path for pattern in _MANIFESTS for path in base.glob(pattern))
    return sorted(shown_name(path.resolve()) for path in files if kind_of(path) == SYSTEM)


def systems_here() -> list[str]:
    """Return the systems of the project around the current folder."""
    return systems_of(Path())


def tests_below(folder: Path) -> list[str]:
    """Return the tests of missions in a folder, at any depth."""
    files = (path for pattern in _MANIFESTS for path in folder.rglob(pattern))
    return sorted(shown_name(path.resolve()) for path in files if kind_of(path) == TEST)


def projects_of(paths: Iterable[str]) -> list[Path]:
    """Return the project folders of robots; files that ship with the package belong to no project."""
    files = [find(path) for path in paths if not path.startswith(PREFIX)]
    return list(dict.fromkeys(project_of(file) for file in files if isinstance(file, Path)))

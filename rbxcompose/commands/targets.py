"""The robots that a verb is about: by file, by folder, or the only one here; and the layers put over them."""

from __future__ import annotations

import argparse
import json
import os
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypedDict

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Severity, Span, kind, surely_meant
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import NotDoneError, ReportedError, write_report
from rbxcompose.commands.options import is_manifest, is_system, unsaved_of
from rbxcompose.commands.options import kind_of as written_kind_of
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.manifest.documents import KINDS, OTHER_KIND
from rbxcompose.manifest.files import PREFIX, ROBOT_FILE, find, project_of, shown_name
from rbxcompose.manifest.reader import Texts, read_file
from rbxcompose.manifest.section import OVERLAY, ROBOT, SYSTEM, TEST
from rbxcompose.manifest.tree import MappingNode, ScalarNode
from rbxcompose.sdk.capabilities import NeedsExtra

if TYPE_CHECKING:
    from rbxcompose.compiler.systems.model import System
    from rbxcompose.runtime.folder import ChosenLayers

UNUSED = kind("RBX9007", Severity.WARNING)
_USE = "name it in a robot ('missions:', 'include:')"
_MANIFESTS = ("*.yaml", "*.yml")
_ROBOTS, _SYSTEMS, _MISSIONS = "robots", "systems", "missions"
_TESTS = (".test.yaml", ".test.yml")
_SUFFIXES = (".yaml", ".yml")
UNNAMED = kind("RBX9031")
_MOST = 5  # robots that are listed
_ABOUT = "the robot's file, its folder, or rbx:robots/NAME of the library; without it, the only one"
NO_EXTRA = kind("RBX2253")


@dataclass(slots=True)
class Targets:
    """What to check: `robots`, `tests` of missions, `systems`; and `users`, but only if they use one of `files`.

    `overlays` are checked on the robots beside them, which stand before them.
    """

    robots: list[str] = field(default_factory=list)
    overlays: list[tuple[str, str]] = field(default_factory=list)
    users: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    tests: list[str] = field(default_factory=list)
    systems: list[str] = field(default_factory=list)

    def unused(self, sources: dict[str, str], unsaved: Mapping[Path, str] = MappingProxyType({})) -> Iterator[Finding]:
        """Yield why each of `files` that is not in `sources` is no manifest, or else that nothing uses it.

        Their texts are added to `sources`.
        """
        known = set(sources)
        for file in self.files:
            if file not in known:
                root, findings = read_file(Path(file).resolve(), file, texts := Texts(unsaved))
                sources.update(texts)
                written = root.get("kind") if isinstance(root, MappingNode) else None
                if isinstance(written, ScalarNode) and written.text not in KINDS:
                    message = f"there is no manifest of kind '{plain(written.text, 60)}'"
                    findings = [OTHER_KIND.misspelt(written.span, message, written.text, KINDS, "kinds"), *findings]
                yield from findings
                if findings:
                    continue
                message, how = f"no robot of the project uses '{file}'", _USE
                if kind_of(Path(file)) == OVERLAY:
                    message = f"'{file}' is an overlay, and does not say for which robot"
                    how = f"name the robot, too: 'rbxcompose check ROBOT -f {file}'"
                yield UNUSED.at(Span(file, 1, 1, 1, 2), message, help=how)


def targets(paths: Iterable[str]) -> Targets:
    """Return the targets that command-line paths name.

    A path is a robot's file or folder, `rbx:robots/NAME`, a project, a folder with robots or else tests below it, or
    any other manifest, which means the robots of its project that use it. Other files mean the robot in whose folder
    they are.
    """
    out = Targets()
    for written in paths:
        path = Path(written)
        if written.startswith(PREFIX) and is_system(written):
            out.systems.append(written)
        elif written.startswith(PREFIX) or not path.exists():
            out.robots.append(written)
        elif path.is_dir():
            robots = [written] if os.path.lexists(path / ROBOT_FILE) else robots_below(path)
            tests = tests_of(filter(Path.is_dir, [path / _MISSIONS if robots else path]))
            out.tests += map(shown_name, tests)
            systems = systems_of(path)
            out.systems += systems
            out.robots += robots if robots or tests or systems else [written]
        elif (written_kind := kind_of(path)) == TEST or path.name.endswith(_TESTS):
            out.tests += map(shown_name, tests_of([path]))
        elif written_kind == ROBOT or (written_kind == "" and is_manifest(path)):
            out.robots.append(written)
        elif written_kind == OVERLAY and (beside := path.parent / ROBOT_FILE).is_file():
            out.overlays.append((str(beside), written))
        elif written_kind == SYSTEM:
            out.systems.append(written)
        elif written_kind == "" and (robot := _robot_around(path)):
            out.robots.append(robot)
        else:
            out.files.append(shown_name(path.resolve()))
            out.users += robots_below(project_of(path))
    out.robots = list(dict.fromkeys(out.robots))
    out.users = [user for user in dict.fromkeys(out.users) if user not in out.robots]
    return out


def _robot_around(path: Path) -> str:
    """Return the robot in whose folder a file is, at any depth; nothing if there is none in the project."""
    path = path.resolve()
    folders = (folder for folder in path.parents if folder.is_relative_to(project_of(path)))
    return next((shown_name(folder / ROBOT_FILE) for folder in folders if (folder / ROBOT_FILE).is_file()), "")


def kind_of(path: Path) -> str:
    """Return the kind that a manifest names, or surely means; empty if it names none or cannot be read."""
    written = written_kind_of(path)
    return written if written in KINDS else surely_meant(written, KINDS) or written


def robots_below(folder: Path) -> list[str]:
    """Return the robot files of a project, or of a folder of robots; elsewhere than there, two folders deep.

    What has the name of one counts whatever it contains: reading it gives the finding.
    """
    base = folder / _ROBOTS if (folder / _ROBOTS).is_dir() else folder
    depths = ("", "*/", "*/*/", *(["**/"] if base.resolve().name == _ROBOTS else ()))
    return _manifests(base, depths, lambda path: path.stem == Path(ROBOT_FILE).stem or kind_of(path) == ROBOT)


def systems_of(folder: Path) -> list[str]:
    """Return the systems of a project, or of a folder of systems, where a file without a kind counts, too."""
    base = folder / _SYSTEMS if (folder / _SYSTEMS).is_dir() else folder
    kinds = (SYSTEM, "") if base.resolve().name == _SYSTEMS else (SYSTEM,)
    return _manifests(base, [""], lambda path: kind_of(path) in kinds)


def _manifests(base: Path, depths: Iterable[str], is_wanted: Callable[[Path], bool]) -> list[str]:
    """Return the names of the wanted YAML files below a folder that are not hidden, at some depths."""
    files = {path for depth in depths for pattern in _MANIFESTS for path in base.glob(depth + pattern)}
    seen = (path for path in files if not any(part.startswith(".") for part in path.relative_to(base).parts))
    return sorted({shown_name(_reached(path)) for path in seen if is_wanted(path)})


def systems_here() -> list[str]:
    """Return the systems of the project around the current folder."""
    return systems_of(Path())


def tests_of(paths: Iterable[Path]) -> list[Path]:
    """Return the tests that paths mean; a file that is named is one, whatever it contains.

    So is what has the name of one, such as an empty file or a pipe: reading it gives the finding.
    """
    found: dict[Path, None] = {}
    for path in paths:
        below = sorted(filter(_may_be_test, path.rglob("*"))) if path.is_dir() else [path]
        found.update((_reached(each), None) for each in below)
    return list(found)


def _reached(path: Path) -> Path:
    """Return the file that a path leads to, or the path itself if that cannot be read."""
    return path.absolute() if _is_odd(path) else path.resolve()


def _may_be_test(path: Path) -> bool:
    """Return whether a file is a test, or is called one; hidden ones are left out: editors keep theirs there."""
    is_one = path.suffix in _SUFFIXES and path.is_file() and kind_of(path) == TEST
    is_called_one = path.name.endswith(_TESTS) and not path.name.startswith(".")
    return is_one or (is_called_one and (path.is_file() or _is_odd(path)))


def _is_odd(path: Path) -> bool:
    """Return whether a path leads to a pipe, a device or nothing that can be read."""
    try:
        mode = path.stat().st_mode
    except OSError:  # such as a link to itself
        return path.is_symlink()
    return not ((stat.S_ISREG(mode) and os.access(path, os.R_OK)) or stat.S_ISDIR(mode))


def projects_of(paths: Iterable[str]) -> list[Path]:
    """Return the project folders of robots; files that ship with the package belong to no project."""
    files = [find(path) for path in paths if not path.startswith(PREFIX)]
    return list(dict.fromkeys(project_of(file) for file in files if isinstance(file, Path)))


def add_path_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the robot's path, which may be left out."""
    parser.add_argument("path", nargs="?", metavar="PATH", help=_ABOUT)


def robot_path(written: str | None, *, may_run: bool = True) -> str:
    """Return the path of a robot: as written, or of the only robot here.

    With `may_run`, it is the only robot that is up if the folder has none.

    Raises:
        NotDoneError: if no path is written, and there is no robot or more than one.
    """
    if written is not None:
        return written
    from rbxcompose.commands.lookup import find_robot, known_state, robots_up  # `check` asks no robot that runs

    here = [ROBOT_FILE] if Path(ROBOT_FILE).is_file() else robots_below(Path())
    if len(here) == 1:
        return here[0]
    if may_run and len(robots_up()) == 1 and (state := known_state(find_robot(None))) is not None:
        return state.file
    more = f" and {len(here) - _MOST} more" if len(here) > _MOST else ""
    words = f"this folder has several robots: {', '.join(here[:_MOST])}{more}" if here else "this folder has no robot"
    raise NotDoneError(UNNAMED.at(None, f"no robot is named, and {words}", help="give the path of one"))


def put_robot_last(arguments: argparse.Namespace, asked: str, robot: str = "path") -> None:
    """Exchange what is `asked` about a robot and the robot if they are written the other way round."""
    first, last = getattr(arguments, asked), getattr(arguments, robot)
    if last is not None and _is_robot(first) and not _is_robot(last):
        setattr(arguments, asked, last)
        setattr(arguments, robot, first)


def _is_robot(word: str) -> bool:
    return "/" in word or isinstance(find(word), Path)


class Layers(TypedDict):
    """The arguments of `compile_robot` besides the robot's file."""

    profiles: Sequence[str]
    overlays: Sequence[str]
    sets: Sequence[str]
    real: bool
    environment: Mapping[str, str]
    unsaved: Mapping[Path, str]


def add_layer_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--profile`, `-f`, `--set`, `--world`, `--simulator` and `--real`."""
    parser.add_argument("--profile", action="append", default=[], metavar="P", help="apply this profile")
    parser.add_argument(
        "-f", "--file", action="append", default=[], dest="overlays", metavar="FILE", help="apply this overlay"
    )
    parser.add_argument("--set", action="append", default=[], dest="sets", metavar="K=V", help="change one value")
    parser.add_argument(
        "--world", action="append", type=_world, dest="sets", metavar="FILE", help="put the simulated robot into it"
    )
    words = "move it by this: ideal, or physics"
    parser.add_argument("--simulator", action="append", type=_simulator, dest="sets", metavar="NAME", help=words)
    parser.add_argument("--real", action="store_true", help="use the real devices; without it, they are simulated")


def _simulator(name: str) -> str:
    """Return the `--set` that chooses what moves the robot."""
    return f"simulator={json.dumps(name)}"


def _world(file: str) -> str:
    """Return the `--set` that puts a robot into the world of a file; the ending may be left out."""
    whole = file if file.endswith((".yaml", ".yml")) else f"{file}.yaml"
    return f"world={json.dumps(whole if whole.startswith(PREFIX) else os.path.abspath(whole))}"


def layers_of(arguments: argparse.Namespace) -> Layers:
    """Return all layers that a command puts over the robot's file."""
    return {
        "profiles": arguments.profile,
        "overlays": arguments.overlays,
        "sets": arguments.sets,
        "real": arguments.real,
        "environment": os.environ,
        "unsaved": unsaved_of(arguments),
    }


def chosen_layers(arguments: argparse.Namespace) -> ChosenLayers:
    """Return the same layers for the robot to remember; from any folder they mean the same files."""
    from rbxcompose.runtime.folder import ChosenLayers  # which only a robot that runs needs

    overlays = tuple(
        overlay if overlay.startswith(PREFIX) else os.path.abspath(overlay) for overlay in arguments.overlays
    )
    return ChosenLayers(tuple(arguments.profile), overlays, tuple(arguments.sets), arguments.real)


def compiled(robot: str, arguments: argparse.Namespace, *overlays: str, tries_profiles: bool = False) -> Compilation:
    """Compile a robot with all layers that a command puts over its file, and more `overlays`."""
    layers = layers_of(arguments)
    layers["overlays"] = [*layers["overlays"], *overlays]
    return compile_robot(robot, **layers, tries_profiles=tries_profiles)


def without_errors(found: Compilation) -> tuple[Robot, Plan]:
    """Report the findings of a robot, and return it with its plan.

    Raises:
        ReportedError: if it has errors.
    """
    write_report(found.report, found.sources)
    if found.report.has_errors or found.robot is None or found.plan is None:
        raise ReportedError
    return found.robot, found.plan


def system_without_errors(
    path: str, profiles: Sequence[str], *, real: bool = False, unsaved: Mapping[Path, str] = MappingProxyType({})
) -> System:
    """Compile a system, report its findings, and return it.

    Raises:
        ReportedError: if it has errors.
    """
    from rbxcompose.compiler.systems.reader import compile_system  # only needed for systems

    system = compile_system(path, environment=os.environ, real=real, profiles=profiles, unsaved=unsaved)
    write_report(system.report, system.sources)
    if system.report.has_errors:
        raise ReportedError
    return system


def missing_extras(robot: Robot) -> Iterator[Finding]:
    """Yield a finding for each component whose extra is not installed."""
    for component, needed in robot.declared(NeedsExtra):
        if find_spec(needed.module.value) is None:
            message = f"'{component.name}' needs the package '{needed.module.value}', which is not installed"
            help_text = f"pip install 'rbxcompose[{needed.extra.value}]'"
            yield NO_EXTRA.at(robot.component_span(component.name), message, help=help_text)

"""Paths written in manifests: relative to their file, inside the project or the shipped library."""

import os
import re
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

from rbxcompose.base.findings import Finding, Span, kind, need, once, replacement
from rbxcompose.base.printable import plain
from rbxcompose.manifest.reader import UNREADABLE, is_there

PREFIX = "rbx:"
PARTS = "parts"  # the library's folder of parts
_PACKAGE = Path(__file__).resolve().parent.parent


def library_root() -> Path:
    """Return the folder that `rbx:` refers to: inside the installed package, or beside it in a checkout."""
    inside = _PACKAGE / "library"
    return inside if inside.is_dir() else _PACKAGE.parent


PROFILE = "--profile"
"""What stands for a file in findings about profiles that a command chooses."""
OUTSIDE = kind("RBX1306")
ROBOT_FILE = "robot.yaml"  # the file that a folder means
_ROBOTS = "robots"  # the folder of a project's robots
_ENDINGS = (".yaml", ".yml")
_DRIVE = re.compile(r"[A-Za-z]:[/\\]")
BACKSLASH = "\\"
_MOST_NEIGHBOURS = 1000
_MOST_NAMESAKES = 3


@once
def shown_name(path: Path) -> str:
    """Return the name of a file in findings: relative to the current folder if it is below it, else as it was named."""
    relative = os.path.relpath(path)
    if relative.startswith("..") and path.is_relative_to(library_root() / PARTS):
        return PREFIX + path.relative_to(library_root()).as_posix()
    return str(path) if relative.startswith("..") else relative


@once
def project_of(path: Path) -> Path:
    """Return the nearest folder above a file that contains `robots/` or `missions/`, else the file's own folder."""
    return _project_around(path.resolve().parent)


def _project_around(folder: Path) -> Path:
    above = (one for one in (folder, *folder.parents) if any((one / name).is_dir() for name in ("robots", "missions")))
    return next(above, folder)


def resolve(written: str, writer: Path, span: Span, *, may_be_robot: bool = False) -> Path | Finding:
    """Return the file that a manifest names, or the finding that says why it must not or cannot be used.

    With `may_be_robot`, a folder with a robot names that one.
    """
    path = _absolute(written, _real(writer).parent)
    is_inside = path and any(path.is_relative_to(root) for root in (project_of(writer), library_root()))
    if path is not None and not is_inside and _is_named_inside(written, writer):
        message, leads_to = f"'{plain(written)}' leads through a link out of the project", plain(shown_name(path))
        return OUTSIDE.at(span, message, help=f"it leads to '{leads_to}': put a copy of that file in its place")
    if path is None or not is_inside or _DRIVE.match(written):
        message, folder = f"'{plain(written)}' is outside the project", plain(shown_name(project_of(writer)))
        where = f"'{folder}'" if folder != "." else "this folder"
        if namesakes := files_named(Path(written).name, writer):
            return OUTSIDE.at(span, message, help=f"did you mean {_either(namesakes)}?")
        return OUTSIDE.at(span, message, help=f"the project is {where}: move the file there, or use what 'rbx:' has")
    if not is_there(path):
        return _missing(written, path, span, writer)
    home = _real(writer).parent
    named = library_root() / written.removeprefix(PREFIX) if written.startswith(PREFIX) else home / written
    if (is_folder := named.is_dir()) and not may_be_robot:
        return _no_robot(written, path.parent, span, writer)
    need(str(home), os.path.join(written, ROBOT_FILE) if is_folder else written)
    return path


def _is_named_inside(written: str, writer: Path) -> bool:
    """Return whether a path lies in the writer's project if links are not followed."""
    named = Path(os.path.normpath(_real(writer).parent / written))
    return not written.startswith(PREFIX) and named.is_relative_to(project_of(writer))


def folder_named(written: str, writer: Path, span: Span) -> Path | Finding:
    """Return the folder that a manifest names, or the finding that says why it must not or cannot be used."""
    is_library = written.startswith(PREFIX)
    base = library_root() if is_library else _real(writer).parent
    try:
        folder = (base / written.removeprefix(PREFIX)).resolve()
        is_there = folder.is_dir()
    except (OSError, ValueError, RuntimeError):  # a name too long for the system, a zero byte, a circle of links
        return UNREADABLE.at(span, f"'{plain(written)}' is not a folder")
    if not any(folder.is_relative_to(root) for root in (project_of(writer), library_root())):
        return OUTSIDE.at(span, f"'{plain(written)}' is outside the project")
    if is_there:
        return folder
    return UNREADABLE.at(span, f"the folder '{plain(written)}' does not exist", help=_nearest_folder(folder))


def find(written: str) -> Path | Finding:
    """Return the file that a command names: a manifest, a robot's folder, or `rbx:...`."""
    path = _absolute(written, Path.cwd())
    if path is None:
        return OUTSIDE.at(None, f"'{plain(written)}' is outside the library")
    if not is_there(path):
        return _missing(written, path, None)
    link = _link(written)
    if link is None or path.is_relative_to(_project_around(link.parent.resolve())):
        return path
    message = f"'{plain(written)}' is a link to a file outside its project"
    return OUTSIDE.at(
        Span(shown_name(link), 1, 1, 1, 1), message, help=f"name the file itself: '{plain(shown_name(path))}'"
    )


def _link(written: str) -> Path | None:
    """Return the file that a command names if it is a link itself; folders above it may be links to anywhere."""
    named = Path.cwd() / written
    file = named / ROBOT_FILE if named.is_dir() else named
    return file if not written.startswith(PREFIX) and file.is_symlink() else None


@once
def _real(path: Path) -> Path:
    return path.resolve()


@once
def _absolute(written: str, folder: Path) -> Path | None:
    """Return the real path (of its robot file, if it is a folder); None if it is impossible or leaves the library."""
    is_library = written.startswith(PREFIX)
    base = library_root() if is_library else folder
    try:
        path = (base / written.removeprefix(PREFIX)).resolve()
        if path.is_dir():
            path = (path / ROBOT_FILE).resolve()
    except (OSError, ValueError, RuntimeError):  # a name too long for the system, a zero byte, a circle of links
        return None
    return None if is_library and not path.is_relative_to(base) else path


def _missing(written: str, path: Path, span: Span | None, writer: Path | None = None) -> Finding:
    if path.name == ROBOT_FILE and Path(written).name != ROBOT_FILE and path.parent.is_dir() and not path.is_symlink():
        return _no_robot(written, path.parent, span, writer)
    if os.path.lexists(path):  # a pipe, a device, a dangling link
        return UNREADABLE.at(span, f"'{plain(written)}' is not a regular file")
    if writer is not None and BACKSLASH in written and span is not None:
        return _with_backslashes(written, span, writer)
    if writer is not None and (namesakes := files_named(path.name, writer)):
        message = f"'{plain(written)}' does not exist"
        return UNREADABLE.at(span, message, help=f"did you mean {_either(namesakes)}?")
    if (library_root() / written).is_file() and written.startswith(f"{PARTS}/"):
        fix = replacement(span, written, f"{PREFIX}{written}") if span else None
        message, meant = f"'{plain(written)}' does not exist", f"{PREFIX}{plain(written)}"
        return UNREADABLE.at(span, message, help=f"did you mean '{meant}'? Our parts are in the library", fix=fix)
    if (neighbours := _names_in(path.parent)) is None:
        return UNREADABLE.at(span, f"'{plain(written)}' does not exist", help=_nearest_folder(path))
    message, there = f"'{plain(written)}' does not exist", f"in '{plain(shown_name(path.parent))}'"
    whole = [name for name in neighbours if Path(name).stem == path.name and name.endswith(_ENDINGS)]
    if len(whole) == 1:
        meant = f"{written.removesuffix(path.name)}{whole[0]}"
        fix = replacement(span, written, meant) if span else None
        return UNREADABLE.at(span, message, help=f"did you mean '{plain(meant)}'?", fix=fix)
    return UNREADABLE.misspelt(span, message, path.name, neighbours, there, within=written)


def _no_robot(written: str, folder: Path, span: Span | None, writer: Path | None) -> Finding:
    """Return the finding for a folder that was named like a robot, and is none, or where a file is meant."""
    where = "this folder" if folder == Path.cwd() and writer is None else f"the folder '{plain(written)}'"
    names = sorted(_names_in(folder) or ())
    if writer is not None:
        names = [name for name in names if name.endswith(_ENDINGS) and name != ROBOT_FILE]
        files = [f"'{plain(written.rstrip('/'))}/{plain(name)}'" for name in names]
        help_text = f"name a file in it: {', '.join(files[:_MOST_NAMESAKES])}" if files else "name a file"
        return UNREADABLE.at(span, f"{where} is no file", help=help_text)
    robots = _robots_in(folder) or [f"{_ROBOTS}/{robot}" for robot in _robots_in(folder / _ROBOTS)]
    base = "" if written in (".", "./") else f"{written.rstrip('/')}/"
    listed = _either(plain(base + robot) for robot in robots[:_MOST_NAMESAKES])
    help_text = f"did you mean {listed}?" if robots else f"'rbxcompose new robot NAME' makes one in '{_ROBOTS}/NAME'"
    return UNREADABLE.at(span, f"there is no robot in {where}: it has no {ROBOT_FILE}", help=help_text)


def _either(names: Iterable[str]) -> str:
    return " or ".join(f"'{name}'" for name in names)


def _robots_in(folder: Path) -> list[str]:
    """Return the folders in a folder that are robots."""
    return sorted(name for name in _names_in(folder) or () if (folder / name / ROBOT_FILE).is_file())


def _with_backslashes(written: str, span: Span, writer: Path) -> Finding:
    """Return the finding about a path as Windows has them; there is a fix if the file is there."""
    forward = written.replace(BACKSLASH, "/")
    found = resolve(forward, writer, span)
    if isinstance(found, Finding) and found.code == OUTSIDE.code:
        return found
    fix = replacement(span, written, forward) if isinstance(found, Path) else None
    message = f"'{plain(written)}' has backslashes; paths are written with '/'"
    return UNREADABLE.at(span, message, help=f"write '{plain(forward)}'", fix=fix)


def files_named(name: str, writer: Path) -> list[str]:
    """Return the files of a name elsewhere in the writer's project, as the writer has to name them."""
    file = _real(writer)
    found = [path for path in _by_name(project_of(writer)).get(name, ()) if path != file]
    return [plain(Path(os.path.relpath(path, file.parent)).as_posix()) for path in found[:_MOST_NAMESAKES]]


@once
def _by_name(project: Path) -> dict[str, list[Path]]:
    """Return the files of a project by their names, of a large one only the first."""
    found: dict[str, list[Path]] = {}
    looked_at = 0
    for above, folders, files in os.walk(project):
        folders[:] = sorted(folder for folder in folders if not folder.startswith("."))
        looked_at += len(folders) + len(files)
        for name in files:
            found.setdefault(name, []).append(Path(above, name))
        if looked_at > _MOST_NEIGHBOURS:
            break
    return found


@once
def _names_in(folder: Path) -> list[str] | None:
    """Return the names in a folder, of a large one only the first; None if it cannot be read."""
    try:
        with os.scandir(folder) as entries:
            return sorted(entry.name for entry in islice(entries, _MOST_NEIGHBOURS))
    except OSError:
        return None


def _nearest_folder(path: Path) -> str:
    there = next((folder for folder in path.parents if folder.is_dir()), path.parent)
    return f"the path ends at the folder '{plain(shown_name(there))}'"

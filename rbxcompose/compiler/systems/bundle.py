"""The files of a system as one archive, named by its content: what travels to the hosts. Data only, and no links.

A file that manifests name by way of a link has the path that is written there, with the contents of the link's target.
"""

import hashlib
import io
import os
import tarfile
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import NeededFile, kind
from rbxcompose.compiler.systems.model import System
from rbxcompose.manifest.files import PREFIX, project_of, shown_name
from rbxcompose.manifest.fill import SECRETS_FOLDER

NOT_EXPORTED = kind("RBX6115")
LARGEST = 512 * 1024 * 1024  # [B] of all files
MOST = 10_000  # files
CACHE = "__pycache__"
_PLAIN, _EXECUTABLE = 0o644, 0o755


@dataclass(frozen=True, slots=True)
class BundledFile:
    """The contents of a file, and its mode."""

    data: bytes
    mode: int = _PLAIN


@dataclass(frozen=True, slots=True)
class Bundle:
    """An archive, its name, and the path of the system's file in it."""

    digest: str
    archive: bytes
    system: str


def bundle_of(system: System) -> Bundle:
    """Return the files that a system was compiled from, relative to its project; each host has the library itself.

    Raises:
        ValueError: as `files_of`.
    """
    name, files = files_of(system)
    return Bundle(digest_of(files), archive_of(files), name)


def files_of(system: System) -> tuple[str, dict[str, BundledFile]]:
    """Return the path of a system's file in its project, and all files of the project that it needs.

    Raises:
        ValueError: if there is no system, or one cannot be read, or not be where manifests look for it.
    """
    if system.path is None:
        raise ValueError("the system could not be read")
    root = project_of(system.path)
    shown = [Path(name).resolve() for name in system.sources if not name.startswith(PREFIX)]
    own = {path for path in (system.path, *shown) if path.is_file() and path.is_relative_to(root)}
    paths = _with_needed({_within(path, root): path for path in own}, system.needed, root)
    if sum(map(os.path.getsize, paths.values())) > LARGEST:
        raise ValueError(f"its files have more than {LARGEST // 2**20} MiB")
    return _within(system.path, root), {name: _read(path) for name, path in paths.items()}


def _read(path: Path) -> BundledFile:
    try:
        return BundledFile(read_regular(path, LARGEST), _EXECUTABLE if os.access(path, os.X_OK) else _PLAIN)
    except OSError as error:
        raise ValueError(f"{shown_name(path)}: {error.strerror}") from error


def _with_needed(own: Mapping[str, Path], needed: Collection[NeededFile], root: Path) -> dict[str, Path]:
    """Return files by their names in the archive, with those that the ones in the same folder name, and so on.

    A folder that a link leads to is there twice, and so is what its files name from there.
    """
    beside: dict[str, list[str]] = {}
    for folder, text in sorted(needed):
        beside.setdefault(folder, []).append(os.path.relpath(text, folder) if os.path.isabs(text) else text)
    found, waiting = dict(own), [*own.items()]
    done = set[tuple[str, Path]]()
    while waiting:
        name, path = waiting.pop()
        here = os.path.dirname(name), path.parent
        if here in done:
            continue
        done.add(here)
        for written in beside.get(str(path.parent), ()):
            new = {
                os.path.normpath(f"{here[0]}/{written}{below}".lstrip("/")): file
                for below, file in _files(path.parent / written, root)
            }
            if any(one.startswith("../") for one in new):
                raise ValueError(f"'{written}' passes a link, behind which it leaves the project")
            waiting += [one for one in new.items() if one[0] not in found]
            found = {**new, **found}
            if len(found) > MOST:
                raise ValueError(f"it has more than {MOST:,} files")
    return found


def _files(path: Path, root: Path) -> Iterator[tuple[str, Path]]:
    """Yield the real file at a path of the project, or those in a folder with their paths behind it; never a secret."""
    inside = [Path(above, name) for above, _, names in os.walk(path) for name in names]
    for file in inside or [path]:
        below, real = file.relative_to(path), file.resolve()
        is_hidden = any(part.startswith(".") or part == CACHE for part in below.parts)
        is_secret = real.is_relative_to(root / SECRETS_FOLDER)
        if real.is_file() and real.is_relative_to(root) and not is_secret and not is_hidden:
            yield ("" if file == path else f"/{below.as_posix()}"), real


def _within(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def digest_of(files: Mapping[str, BundledFile]) -> str:
    """Return a name for files that changes with any of their names, modes or contents."""
    lines = (f"{hashlib.sha256(one.data).hexdigest()} {one.mode:o} {name}\n" for name, one in sorted(files.items()))
    return hashlib.sha256("".join(lines).encode()).hexdigest()[:32]


def archive_of(files: Mapping[str, BundledFile]) -> bytes:
    """Return a tar archive of files, with nothing in it that depends on this machine or the time."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for folder in _folders(files):
            info = tarfile.TarInfo(folder)
            info.type, info.mode = tarfile.DIRTYPE, _EXECUTABLE
            archive.addfile(info)
        for name, one in sorted(files.items()):
            info = tarfile.TarInfo(name)
            info.size, info.mode = len(one.data), one.mode
            archive.addfile(info, io.BytesIO(one.data))
    return out.getvalue()


def _folders(names: Iterable[str]) -> list[str]:
    above = {str(folder) for name in names for folder in Path(name).parents}
    return sorted(above - {"."})

"""The files of a system as one archive, named by its content: what travels to the hosts. Data only, and no links."""

import hashlib
import io
import tarfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.compiler.systems.model import System
from rbxcompose.manifest.files import PREFIX, project_of

LARGEST = 50_000_000  # [B] of a file


@dataclass(frozen=True, slots=True)
class Bundle:
    """An archive, its name, and the path of the system's file in it."""

    digest: str
    archive: bytes
    system: str


def bundle_of(system: System) -> Bundle:
    """Return the files that a system was compiled from, relative to its project; each host has the library itself.

    Raises:
        OSError: if one cannot be read.
        ValueError: if there is no system.
    """
    name, files = files_of(system)
    return Bundle(digest_of(files), archive_of(files), name)


def files_of(system: System) -> tuple[str, dict[str, bytes]]:
    """Return the path of a system's file in its project, and all files of the project that it was compiled from.

    Raises:
        OSError: if one cannot be read.
        ValueError: if there is no system.
    """
    if system.path is None:
        raise ValueError("the system could not be read")
    root = project_of(system.path)
    shown = [Path(name).resolve() for name in system.sources if not name.startswith(PREFIX)]
    own = {path for path in (system.path, *shown) if path.is_file() and path.is_relative_to(root)}
    return _within(system.path, root), {_within(path, root): read_regular(path, LARGEST) for path in own}


def _within(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def digest_of(files: Mapping[str, bytes]) -> str:
    """Return a name for files that changes with any of their names or contents."""
    lines = (f"{hashlib.sha256(data).hexdigest()} {name}\n" for name, data in sorted(files.items()))
    return hashlib.sha256("".join(lines).encode()).hexdigest()[:32]


def archive_of(files: Mapping[str, bytes], mode: int = 0o644) -> bytes:
    """Return a tar archive of files of this mode, with nothing in it that depends on this machine or the time."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for folder in _folders(files):
            info = tarfile.TarInfo(folder)
            info.type, info.mode = tarfile.DIRTYPE, 0o755
            archive.addfile(info)
        for name, data in sorted(files.items()):
            info = tarfile.TarInfo(name)
            info.size, info.mode = len(data), mode
            archive.addfile(info, io.BytesIO(data))
    return out.getvalue()


def _folders(names: Iterable[str]) -> list[str]:
    above = {str(folder) for name in names for folder in Path(name).parents}
    return sorted(above - {"."})

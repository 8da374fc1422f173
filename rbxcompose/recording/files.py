"""Files of recordings. A file being written has `.part` appended to its name and is locked by its writer.

So an unlocked part was never finished; it is recovered and then gets its name.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from rbxcompose.atomic_files import sync_folder
from rbxcompose.dataclass import dataclass
from rbxcompose.printable import plain
from rbxcompose.recording.reader import NotARecordingError
from rbxcompose.recording.recovery import recover
from rbxcompose.regular_files import open_regular

ENDING, PART = ".mcap", ".part"
_NEW = ".new"


@dataclass(frozen=True, slots=True)
class Recovered:
    """The outcome for an unfinished file: its new name and number of messages, or why it was left unchanged."""

    path: Path
    messages: int = 0
    problem: str = ""


def part_of(path: Path) -> Path:
    """Return the name of a file until it is finished."""
    return path.with_name(path.name + PART)


def create(path: Path) -> IO[bytes]:
    """Create the part of a new file and lock it.

    Raises:
        FileExistsError: if the file or its part already exists.
        OSError: if it cannot be created.
    """
    if path.exists():
        raise FileExistsError(f"{path} already exists")
    file = part_of(path).open("xb")
    fcntl.flock(file.fileno(), fcntl.LOCK_EX)
    return file


def write_problem(path: Path) -> str:
    """Return why `create` would fail, or nothing; to be reported before a run begins."""
    name = plain(str(path))
    if path.exists() or part_of(path).exists():
        return f"'{name}' already exists"
    if not path.parent.is_dir():
        return f"'{name}' cannot be written: there is no folder '{plain(str(path.parent))}'"
    return "" if os.access(path.parent, os.W_OK) else f"'{name}' cannot be written: its folder is read-only"


def complete(path: Path, file: IO[bytes]) -> None:
    """Give a finished file its name, so that it exists completely or not at all, even after a power failure."""
    os.fsync(file.fileno())
    os.rename(part_of(path), path)
    file.close()
    sync_folder(path.parent)


def recover_all(folder: Path) -> Iterator[Recovered]:
    """Recover the unfinished files in a folder that nobody is writing."""
    for part in sorted(folder.glob(f"*{ENDING}{PART}")):
        path = part.with_name(part.name.removesuffix(PART))
        try:
            with open_regular(part, follow=False) as file:
                if _is_ours(file, part):
                    yield Recovered(path, _recover(file, part, path))
        except (OSError, NotARecordingError) as error:
            yield Recovered(part, problem=str(error))


def _is_ours(file: IO[bytes], part: Path) -> bool:
    """Lock a part and return whether it is ours: not if its writer still has it, or has finished it meanwhile."""
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return part.exists() and os.path.samestat(os.fstat(file.fileno()), os.stat(part))


def _recover(file: IO[bytes], part: Path, path: Path) -> int:
    if path.exists():
        raise FileExistsError(f"{path} already exists")
    new = part.with_name(part.name + _NEW)
    new.unlink(missing_ok=True)  # left by an interrupted recovery
    with new.open("xb") as whole:
        try:
            messages = recover(file, whole)
        except NotARecordingError:
            new.unlink()
            raise
        os.fsync(whole.fileno())
    os.rename(new, part)  # now the part is complete, and recovering it again would change nothing
    os.rename(part, path)
    sync_folder(path.parent)
    return messages

"""Writing new files: all of them or none, and never over an existing one."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path

from rbxcompose.findings import Finding, kind
from rbxcompose.manifest.files import shown_name
from rbxcompose.printable import plain

EXISTS = kind("RBX9101")
NOT_WRITTEN = kind("RBX9104")


def taken(folder: Path, names: Iterable[str]) -> Finding | None:
    """Return the finding about the first of some paths below `folder` that exists, before work is spent on them."""
    return next((_exists(folder / name) for name in names if os.path.lexists(folder / name)), None)


def _exists(path: Path) -> Finding:
    return EXISTS.at(
        None,
        f"'{plain(shown_name(path))}' already exists; nothing was written",
        help="choose another name, or another folder with '--into'",
    )


def write_new(folder: Path, files: Mapping[str, str]) -> Finding | None:
    """Write texts by their paths below `folder`; if that fails, leave nothing behind and return the reason."""
    try:
        with ExitStack() as undo:
            waiting = [_prepare(folder / name, text, undo) for name, text in files.items()]
            for temporary, path in waiting:
                os.link(temporary, path)  # unlike a rename, it fails if the file exists
                undo.callback(path.unlink)
            undo.pop_all()
    except FileExistsError as error:
        return _exists(Path(error.filename2 or error.filename))
    except OSError as error:
        message = f"'{plain(str(error.filename or folder))}' cannot be written: {error.strerror}"
        return NOT_WRITTEN.at(None, message, help="nothing was written")
    for temporary, _ in waiting:
        with suppress(OSError):  # everything is written; one more name of it does no harm
            temporary.unlink()
    return None


def _prepare(path: Path, text: str, undo: ExitStack) -> tuple[Path, Path]:
    """Write the text to a temporary file beside its destination."""
    if os.path.lexists(path):
        raise FileExistsError(0, "", str(path))
    for folder in _missing_folders(path):
        folder.mkdir(exist_ok=True)
        undo.callback(_remove_if_empty, folder)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with temporary.open("x", encoding="utf-8", newline="\n") as file:
        undo.callback(temporary.unlink)
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    return temporary, path


def _missing_folders(path: Path) -> Iterator[Path]:
    yield from reversed([folder for folder in path.parents if not folder.exists()])


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):  # somebody else has put a file into it
        folder.rmdir()

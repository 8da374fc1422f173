"""Whether others may open what is private to this user."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import plain
from rbxcompose.manifest.files import project_of, shown_name
from rbxcompose.manifest.secrets import FOLDER
from rbxcompose.tools.doctor import HostFacts, examination

OPEN_TO_OTHERS = kind("RBX9410")


@examination
def permissions(facts: HostFacts) -> Iterator[str | Finding]:
    """Check the folders of robots and the secrets of their projects."""
    folders = [path for path in (facts.base, *(robot.folder.path for robot in facts.running)) if path.exists()]
    secrets = [path for folder in _secret_folders(facts) if folder.is_dir() for path in sorted(folder.iterdir())]
    wrong = [*_wrong(folders, "700"), *_wrong(secrets, "600")]
    yield from wrong
    if not wrong:
        yield f"{len(folders)} folders of robots and {len(secrets)} secrets are private"


def _secret_folders(facts: HostFacts) -> list[Path]:
    files = (Path(robot.manifest.root.span.file) for robot in facts.robots)
    return list(dict.fromkeys(project_of(file) / FOLDER for file in files))


def _wrong(paths: list[Path], mode: str) -> Iterator[Finding]:
    for path in paths:
        try:
            found = path.lstat()
        except FileNotFoundError:
            continue  # removed meanwhile
        name = plain(shown_name(path))
        if found.st_uid != os.getuid():
            yield OPEN_TO_OTHERS.at(None, f"'{name}' belongs to another user", help=f"chown $USER {name}")
        elif stat.S_IMODE(found.st_mode) & 0o077:
            words = f"others may open '{name}' (mode {stat.S_IMODE(found.st_mode):04o})"
            yield OPEN_TO_OTHERS.at(None, words, help=f"chmod {mode} {name}")

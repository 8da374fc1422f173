"""Which files are tests: those that are named, and all tests in folders."""

import os
import stat
from collections.abc import Iterable
from pathlib import Path

from rbxcompose.commands.options import kind_of
from rbxcompose.manifest.section import TEST

_TESTS = (".test.yaml", ".test.yml")
_SUFFIXES = (".yaml", ".yml")


def tests_of(paths: Iterable[Path]) -> list[Path]:
    """Return the tests that paths mean; a file that is named is one, whatever it contains.

    So is what has the name of one, such as an empty file or a pipe: reading it gives the finding.
    """
    found: dict[Path, None] = {}
    for path in paths:
        below = sorted(filter(_may_be_test, path.rglob("*"))) if path.is_dir() else [path]
        found.update((one.absolute() if _is_odd(one) else one.resolve(), None) for one in below)
    return list(found)


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

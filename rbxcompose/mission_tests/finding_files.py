"""Which files are tests: those that are named, and all tests in folders."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from rbxcompose.manifest.test_file import TEST
from rbxcompose.regular_files import open_regular

_KIND = re.compile(rb"^kind:[ \t]*['\"]?(\w+)", re.MULTILINE)
_HEAD = 4096  # [B] at the start of a file that contain its kind
_SUFFIXES = (".yaml", ".yml")


def tests_of(paths: Iterable[Path]) -> list[Path]:
    """Return the tests that paths mean; a file that is named is one, whatever it contains."""
    found: dict[Path, None] = {}
    for path in paths:
        below = sorted(one for one in path.rglob("*") if is_test(one)) if path.is_dir() else [path]
        found.update((one.resolve(), None) for one in below)
    return list(found)


def is_test(path: Path) -> bool:
    """Return whether a file says that it is a test."""
    if path.suffix not in _SUFFIXES or not path.is_file():
        return False
    with open_regular(path) as file:
        kind = _KIND.search(file.read(_HEAD))
    return kind is not None and kind[1].decode() == TEST

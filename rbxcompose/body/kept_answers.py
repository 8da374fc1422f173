"""Expanded xacro files in the user's folder of caches, by what was asked. Losing them costs time only."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from xxhash import xxh3_128_hexdigest

import rbxcompose
from rbxcompose.atomic_files import replace_file
from rbxcompose.body.xacro_answer import XacroAnswer, limited
from rbxcompose.dataclass import dataclass
from rbxcompose.regular_files import open_regular
from rbxcompose.typed_json import UnreadableError, from_data, to_data

MOST_FILES = 256
_LARGEST = 24_000_000  # [bytes]


@dataclass(frozen=True, slots=True)
class KeptAnswer:
    """An answer, and digests of the files and folders that it was made of."""

    answer: XacroAnswer
    used: Mapping[str, str]


def read_kept(request: str, roots: Sequence[str]) -> KeptAnswer | None:
    """Return what was kept for a request; None if that is nothing, or not written by this user alone."""
    path = _path(request)
    try:
        with open_regular(path, follow=False) as file:
            about = os.fstat(file.fileno())
            if about.st_uid != os.getuid() or about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                return None
            kept: KeptAnswer = from_data(KeptAnswer, json.loads(file.read(_LARGEST)))
    except (OSError, ValueError, RecursionError, UnreadableError):
        return None
    answer = limited(kept.answer, roots)
    return replace(kept, answer=answer) if set(answer.used) == kept.used.keys() else None


def keep(request: str, kept: KeptAnswer) -> None:
    """Keep an answer for later commands; without a folder that can be written, there is none to keep it in."""
    path = _path(request)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        replace_file(path, json.dumps(to_data(kept)).encode(), mode=0o600)
        files = sorted(path.parent.iterdir(), key=lambda one: one.stat().st_mtime_ns)
        for old in files[:-MOST_FILES]:
            old.unlink()


def _path(request: str) -> Path:
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    return home / "rbxcompose/xacro" / f"{xxh3_128_hexdigest(f'{rbxcompose.__version__} {request}'.encode())}.json"

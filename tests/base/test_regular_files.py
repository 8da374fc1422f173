from __future__ import annotations

import ast
import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import rbxcompose
from rbxcompose.base.files import NotRegularError, TooLargeError, open_regular, read_regular

PACKAGE = Path(rbxcompose.__file__).parent
OPENING = re.compile(r"(?<![\w.])(?<!def )open\(|\bos\.open\(|\.open\(\s*[a-zA-Z]*[\"']|\.read_(?:text|bytes)\(")
# What these open is no file that a user names: the package's own data, what the system tells, files of a running robot.
MAY_OPEN = {
    "base/files.py",
    "base/plugins.py",
    "base/processes.py",
    "bus/shared_memory.py",
    "commands/finding_pages.py",
    "commands/main.py",
    "commands/new_files.py",
    "commands/verbs.py",
    "domains/arms/motion/linker.py",
    "domains/arms/motion/numba_cache.py",
    "domains/console/access.py",
    "domains/console/components/gateway.py",
    "domains/console/feeds.py",
    "missions/view/tested.py",
    "domains/devices/serial_ports.py",
    "domains/programs/child.py",
    "domains/programs/keeper.py",
    "missions/execution/snapshots.py",
    "msgs/definitions.py",
    "msgs/registry.py",
    "runtime/control.py",
    "runtime/folder.py",
    "runtime/log.py",
    "runtime/process_group/group.py",
    "runtime/processes.py",
    "runtime/recording/files.py",
    "runtime/supervision/launch.py",
    "runtime/supervision/prefork.py",
    "runtime/supervision/supervisor.py",
    "testing/clocks.py",
    "testing/golden.py",
    "tools/doctor.py",
    "tools/mission_editor/dry_run.py",
    "tools/mission_editor/new_mission.py",
}


def test_a_regular_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_bytes(b"abc")
    assert read_regular(path, 3) == b"abc"
    with pytest.raises(TooLargeError, match="2 bytes"):
        read_regular(path, 2)


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", "/", "FIFO"])
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, path: str) -> None:
    if path == "FIFO":
        os.mkfifo(tmp_path / path)
    with pytest.raises(NotRegularError):
        open_regular(tmp_path / path)


def test_a_link_is_followed_only_where_that_is_wanted(tmp_path: Path) -> None:
    (tmp_path / "text").write_bytes(b"abc")
    (tmp_path / "link").symlink_to(tmp_path / "text")
    assert read_regular(tmp_path / "link", 3) == b"abc"
    with pytest.raises(OSError, match="symbolic links"):
        open_regular(tmp_path / "link", follow=False)


def test_nobody_else_opens_files_of_users() -> None:
    found = {str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py") if any(opens_in(path))}
    assert found == MAY_OPEN


def opens_in(path: Path) -> Iterator[int]:
    """Lines that open a file by Python's own means; `something.open()` without arguments opens no file."""
    text = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(text)) if OPENING.search(text) else ():
        match node:
            case ast.Call(func=ast.Name("open")):
                yield node.lineno
            case ast.Call(func=ast.Attribute(attr="open", value=ast.Name("os")), args=[_, *_]):
                yield node.lineno
            case ast.Call(func=ast.Attribute(attr="open"), args=[ast.Constant(str())]):
                yield node.lineno
            case ast.Call(func=ast.Attribute(attr="read_text" | "read_bytes")):
                yield node.lineno

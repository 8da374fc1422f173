"""All files or none, and never in the place of one that is there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rbxcompose.commands.new_files import write_new

FILES = {"a/one.txt": "1\n", "a/b/two.txt": "2\n", "three.txt": "3 ä\n"}


def everything(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_it_writes_all_files_and_their_folders(tmp_path: Path) -> None:
    assert write_new(tmp_path / "new", FILES) is None
    assert {name: (tmp_path / "new" / name).read_bytes().decode() for name in FILES} == FILES
    assert everything(tmp_path / "new") == ["a", "a/b", "a/b/two.txt", "a/one.txt", "three.txt"]


@pytest.mark.parametrize("name", FILES)
def test_nothing_is_written_if_one_of_them_is_there(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("mine")
    before = everything(tmp_path)
    found = write_new(tmp_path, FILES)
    assert found
    assert found.code == "RBX9101"
    assert name in found.message
    assert everything(tmp_path) == before
    assert path.read_text() == "mine"


def test_a_link_that_leads_nowhere_is_there(tmp_path: Path) -> None:
    (tmp_path / "three.txt").symlink_to(tmp_path / "elsewhere")
    found = write_new(tmp_path, FILES)
    assert found
    assert found.code == "RBX9101"
    assert everything(tmp_path) == ["three.txt"]


def test_a_file_where_a_folder_should_be_is_told(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    found = write_new(tmp_path, FILES)
    assert found
    assert found.code in ("RBX9101", "RBX9104")
    assert everything(tmp_path) == ["a"]


@pytest.mark.parametrize("good", [0, 1, 2])
def test_what_was_written_before_a_failure_is_taken_back(
    good: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    link = os.link
    done: list[Path] = []

    def fails(source: Path, target: Path) -> None:
        if len(done) == good:
            raise OSError(28, "No space left on device", str(target))
        done.append(target)
        link(source, target)

    monkeypatch.setattr(os, "link", fails)
    found = write_new(tmp_path, FILES)
    assert found
    assert found.code == "RBX9104"
    assert "No space left" in found.message
    assert everything(tmp_path) == []


def test_a_file_that_came_at_the_last_moment_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    link = os.link

    def late(source: Path, target: Path) -> None:
        if target.name == "three.txt":
            target.write_text("mine")
        link(source, target)

    monkeypatch.setattr(os, "link", late)
    found = write_new(tmp_path, FILES)
    assert found
    assert found.code == "RBX9101"
    assert everything(tmp_path) == ["three.txt"]
    assert (tmp_path / "three.txt").read_text() == "mine"

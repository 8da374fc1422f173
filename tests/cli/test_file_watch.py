"""Files that are written in place, or by a new file that gets the name."""

from __future__ import annotations

import os
from pathlib import Path

from rbxcompose.tools.robot_changes import FileWatch


def changed(watch: FileWatch) -> bool:
    """Tell whether two looks, between which nothing happens, find a change."""
    return watch.look() or watch.look()


def test_nothing_is_told_of_files_that_stay(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("a")
    assert not changed(FileWatch([file]))


def test_a_change_is_told_once_and_only_when_it_is_over(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("a")
    watch = FileWatch([file])
    file.write_text("ab")
    assert not watch.look()
    file.write_text("abc")
    assert not watch.look()
    assert watch.look()
    assert not changed(watch)


def test_an_editor_may_give_the_name_to_another_file(tmp_path: Path) -> None:
    file, new = tmp_path / "robot.yaml", tmp_path / ".robot.yaml.new"
    file.write_text("a")
    watch = FileWatch([file])
    for text in ("b", "cc"):
        file.unlink()
        assert not watch.look()
        new.write_text(text)
        os.utime(new, ns=(1, 1))
        os.replace(new, file)
        assert changed(watch)


def test_a_change_before_the_files_are_others_is_not_lost(tmp_path: Path) -> None:
    file, other = tmp_path / "robot.yaml", tmp_path / "part.yaml"
    file.write_text("a")
    watch = FileWatch([file])
    file.write_text("ab")
    watch.follow([file, other])
    assert changed(watch)
    other.write_text("new")
    assert changed(watch)

"""Files that are written in place, or by a new file that gets the name."""

from __future__ import annotations

import os
from pathlib import Path

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.tools.robot_changes import FileWatch, files_of


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


def test_a_file_that_is_missing_for_a_moment_is_still_followed(tmp_path: Path) -> None:
    robot, mission = tmp_path / "robots/one/robot.yaml", tmp_path / "missions/go.yaml"
    for file, text in (
        (robot, "rbx: 1\nkind: Robot\nname: one\nmissions: {go: ../../missions/go.yaml}\n"),
        (mission, "rbx: 1\nkind: Mission\nname: go\ndo: [{log: hello}]\n"),
    ):
        file.parent.mkdir(parents=True)
        file.write_text(text)
    followed = files_of(compile_robot(str(robot), environment={}))
    assert mission in followed
    text = mission.read_text()
    mission.unlink()
    broken = compile_robot(str(robot), environment={})
    assert broken.plan is None
    watch = FileWatch(files_of(broken, followed))
    mission.write_text(text)
    assert changed(watch)
    assert files_of(compile_robot(str(robot), environment={}), {tmp_path / "gone"}) == followed

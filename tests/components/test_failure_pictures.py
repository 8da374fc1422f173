"""A stage of picking that fails leaves a picture of the scene, and only the newest pictures stay."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.domains.arms.hand import MOST, numbered, picture_of_failure
from rbxcompose.domains.arms.reasons import GraspReason, MotionReason, StageFailure
from rbxcompose.msgs.rbxcompose_msgs import PickObject
from rbxcompose.sdk.bound import Outcome
from rbxcompose.testing import Bench
from tests.motion.pi_hand import HandBench
from tests.parts.project import Project
from tests.shipped import robot_and_plan

FAILURE = StageFailure("lift", MotionReason.PATH_IN_COLLISION, "'box1' and 'target'")


def size_of(file: Path) -> tuple[int, int]:
    """Return width and height of a PNG."""
    data = file.read_bytes()
    assert data.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", data[16:24])
    return width, height


@pytest.mark.timeout(120)
def test_the_text_of_a_failed_goal_names_its_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.body.picture.SIZE", 300)
    _, plan = robot_and_plan("pi_robot", "table")
    instances: dict[str, Any] = {
        instance.type: instance for instance in plan.instances if instance.type in ("arm", "servo_bus", "scene")
    }
    config, folder = instances["arm"].config, tmp_path / "new" / "pictures"
    hand = config.hand.model_copy(update={"pictures": str(folder)})
    bench = Bench(
        *(instances | {"arm": replace(instances["arm"], config=config.model_copy(update={"hand": hand}))}).values()
    )
    bench.advance(0.5)
    ends: list[Any] = []
    bench.bus.action_client("me", "/right_arm/pick", PickObject)(PickObject.Goal(object="table"), ends.append)
    assert bench.run_until(lambda: bool(ends), 10.0)
    assert ends[0].outcome is Outcome.ABORTED
    [file] = folder.iterdir()
    assert file.name.startswith("right_arm-0001-")
    assert ends[0].result.message.endswith(f"; picture: {file}")
    assert min(size_of(file)) > 200


def test_the_oldest_pictures_go_and_other_files_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.arms.hand.draw_arm", lambda shown: b"png")
    others = [tmp_path / "notes.txt", tmp_path / "left_arm-0001-lift-path_in_collision.png"]
    for other in others:
        other.write_text("mine")
    works = HandBench().works
    for _ in range(MOST + 5):
        said = picture_of_failure(tmp_path, "right_arm", works, {}, FAILURE)
        assert Path(said.removeprefix("picture: ")).read_bytes() == b"png"
    assert sorted(numbered(tmp_path, "right_arm")) == list(range(6, MOST + 6))
    assert len(list(tmp_path.iterdir())) == MOST + len(others)


@pytest.mark.timeout(120)
def test_why_there_is_no_picture_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.body.picture.SIZE", 100)
    (tmp_path / "taken").write_text("a file")
    said = picture_of_failure(tmp_path / "taken", "right_arm", HandBench().works, {}, FAILURE)
    assert said.startswith("no picture: ")
    nothing = StageFailure("choose", GraspReason.UNKNOWN_OBJECT, "there is no object 'cup'")
    assert picture_of_failure(tmp_path, "right_arm", HandBench().works, {}, nothing).startswith("picture: ")


def test_the_folder_is_relative_to_the_file_that_names_it(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(
        'buses: {servos: {type: dynamixel}}\ninclude:\n  arm: {part: "rbx:parts/servo_arm.yaml", with: {bus: servos}}\n'
        '  hand: {part: "rbx:parts/servo_gripper.yaml", with: {bus: servos}, attach: {to: arm_tip}}\n'
        "arms: {arm: {gripper: hand_controller, pictures: failures}}\n"
    )
    assert project.findings == []
    assert project.checked
    found: list[Any] = [instance.config for instance in project.checked.plan.instances if instance.type == "arm"]
    [config] = found
    assert Path(config.hand.pictures).name == "failures"
    assert Path(config.hand.pictures).is_relative_to(tmp_path.resolve())

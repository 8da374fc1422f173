"""`rbxcompose arm calibrate-camera`: from frames on the bus to where the camera is."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.base.transforms import NotConnectedError, TransformTree, UnknownFrameError
from rbxcompose.commands import main as command
from rbxcompose.domains.arms.command_camera import CameraFrames, CameraResult, HandEye, measured, show

MOUNTED = Transform3((0.05, 0.0, 0.12), quaternion_from_rpy(0.0, 0.6, 0.1))  # of the camera on the neck
OPTICAL = Transform3((0.0, 0.02, 0.0), (-0.5, 0.5, -0.5, 0.5))
TAG = Transform3((0.03, 0.0, 0.05), quaternion_from_rpy(0.2, -1.4, 0.3))


class Robot:
    """A robot whose arm goes from one pose to the next while its neck turns; its description has the camera wrong."""

    def __init__(self) -> None:
        self.tree, self.now = TransformTree(), 0.0
        self.fix("neck", "camera", Transform3((0.0, 0.0, 0.1)))
        self.fix("camera", "optical", OPTICAL)

    def fix(self, parent: str, child: str, pose: Transform3) -> None:
        self.tree.set(parent, child, pose, stamp=self.now, static=True)

    def stand(self, hand: Transform3, neck: Transform3, seconds: float, frames: CameraFrames | None = None) -> None:
        for _ in range(round(seconds * 10)):
            self.now += 0.1
            seen = neck.compose(MOUNTED).compose(OPTICAL).inverse().compose(hand).compose(TAG)
            for parent, child, pose in (("base", "neck", neck), ("base", "hand", hand), ("optical", "tag", seen)):
                self.tree.set(parent, child, pose, stamp=self.now, static=False)
            if frames is not None:
                frames.look(self.now)


def test_the_camera_is_found_on_a_neck_that_moves_and_its_description_does_not_matter() -> None:
    robot, random = Robot(), np.random.default_rng(2)
    robot.stand(Transform3(), Transform3((0.0, 0.0, 1.0)), 0.1)
    frames = CameraFrames(robot.tree, "hand", "tag", "camera", None)
    assert (frames.seen_in, frames.parent) == ("optical", "neck")
    for _ in range(8):
        roll, pitch, yaw, turn = random.uniform(-0.7, 0.7, 4).tolist()
        x, y, z = random.uniform((0.3, -0.2, 0.6), (0.6, 0.2, 0.9)).tolist()
        hand = Transform3((x, y, z), quaternion_from_rpy(roll, pitch, yaw))
        robot.stand(hand, Transform3((0.0, 0.0, 1.0), quaternion_from_rpy(0.0, 0.0, turn)), 1.5, frames)
    found = measured(frames.standing.pairs)
    placed = frames.placed(found)
    assert len(found.off) == 8
    assert placed.translation == pytest.approx(MOUNTED.translation, abs=1e-5)
    assert placed.inverse().compose(MOUNTED).rotation[:3] == pytest.approx((0, 0, 0), abs=1e-5)


def test_frames_that_are_not_there_are_told() -> None:
    robot = Robot()
    with pytest.raises(UnknownFrameError, match="there is no frame 'tag'"):
        CameraFrames(robot.tree, "hand", "tag", None, None)
    robot.stand(Transform3(), Transform3(), 0.1)
    with pytest.raises(UnknownFrameError, match="there is no frame 'wrist'"):
        CameraFrames(robot.tree, "wrist", "tag", None, None)
    robot.fix("elsewhere", "post", Transform3())
    with pytest.raises(NotConnectedError):
        CameraFrames(robot.tree, "hand", "tag", None, "post")


def test_the_result_is_told_as_a_description_takes_it_and_a_pose_that_is_far_off_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    off = (*[(0.001, 0.002)] * 20, (0.05, 0.002))
    result = CameraResult("neck", "camera", MOUNTED, HandEye(MOUNTED, TAG, off, (0.001, 0.01)))
    file = tmp_path / "camera.yaml"
    assert show(result, argparse.Namespace(out=str(file), json=False)) == 0
    assert "poses that are far off: 21" in capsys.readouterr().out
    written = yaml.safe_load(file.read_text())
    assert (written["parent"], written["frame"], written["poses"]) == ("neck", "camera", 21)
    assert written["at"]["x"] == "50.0 mm"
    assert written["origin"] == {"xyz": "0.05000 0.00000 0.12000", "rpy": "0.00000 0.60000 0.10000"}
    assert show(result, argparse.Namespace(out=None, json=True)) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["misses"][0] == pytest.approx(math.sqrt((20 * 1e-6 + 25e-4) / 21))


@pytest.mark.parametrize(
    ("words", "told", "code"),
    [
        (("--arm", "right_arm"), "--arm and --poses are given together", 2),
        (("--router", "tcp/127.0.0.1:1"), "router", 1),
    ],
)
def test_what_cannot_begin_is_refused(
    words: tuple[str, ...], told: str, code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main(["arm", "calibrate-camera", "hand", "tag", *words]) == code
    assert told in capsys.readouterr().err

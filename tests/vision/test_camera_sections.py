"""`cameras` and `tags` in manifests: what they make, simulated and real, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.domains.vision.calibration import calibration_text
from rbxcompose.domains.vision.components.usb_camera import UsbCameraConfig
from rbxcompose.domains.worlds.components.camera_sim import CameraSimConfig
from rbxcompose.domains.worlds.optics import Intrinsics
from rbxcompose.msgs.vision_msgs import Detection3DArray
from rbxcompose.testing import Bench
from tests.loops import for_all
from tests.parts.project import Project

ROBOT = """world: ../../room.yaml
components:
  base: {type: diff_drive_sim}
cameras:
  front: {frame: base_footprint, size: [320, 240], rate: 10 Hz}
tags: {size: 16 cm, names: {box: 7}}
"""
WORLD = """rbx: 1
kind: World
name: room
objects: {crate: {box: [20 cm, 20 cm, 20 cm], at: {x: 1 m}, tags: {back: {number: 7, size: 16 cm}}}}
"""
RATIONAL = (-0.1, 0.02, 0.0, 0.0, 0.0, 0.05, 0.01, 0.002)
FINDER = "  finder: {type: tabletop_detector, points: front/points, frame: base_footprint_optical_frame}\n"
DOCK = "  dock_at: {type: tag_docking, frame: base_footprint_optical_frm}\n"
LENS = Intrinsics(320, 240, 300.0, 310.0, 170.0, 110.0, RATIONAL)
STRONG = Intrinsics(320, 240, 200.0, 200.0, 159.5, 119.5, (-0.9, 0.0, 0.0, 0.0, 0.0))


def project(folder: Path) -> Project:
    (folder / "room.yaml").write_text(WORLD)
    (folder / "front.yaml").write_text(calibration_text(LENS))
    (folder / "strong.yaml").write_text(calibration_text(STRONG))
    return Project(folder)


def test_a_simulated_camera_finds_a_named_tag(tmp_path: Path) -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed")
    plan = project(tmp_path).check(ROBOT).compilation.plan
    assert plan is not None
    bench = Bench(plan=plan)
    seen = bench.collect("/tags", Detection3DArray)
    bench.advance(1.0)
    assert [one.id for one in seen[-1].detections] == ["box"]


def test_a_calibrated_camera_has_its_lens_in_the_simulation(tmp_path: Path) -> None:
    text = ROBOT.replace("rate: 10 Hz", "rate: 10 Hz, calibration: ../../front.yaml")
    checked = project(tmp_path).check(text)
    assert checked.compilation.plan is not None, checked.text
    (config,) = (one.config for one in checked.compilation.plan.instances if one.type == "camera_sim")
    assert isinstance(config, CameraSimConfig)
    assert config.intrinsics == LENS


def test_without_a_world_it_is_the_real_one_with_the_same_topics(tmp_path: Path) -> None:
    text = ROBOT.replace("world: ../../room.yaml\n", "").replace("rate: 10 Hz", "calibration: ../../front.yaml")
    checked = project(tmp_path).check(text)
    assert checked.compilation.plan is not None, checked.text
    (config,) = (one.config for one in checked.compilation.plan.instances if one.type == "usb_camera")
    assert isinstance(config, UsbCameraConfig)
    assert (config.topic, config.info) == ("front/image_raw", "front/camera_info")
    assert Path(config.calibration).is_absolute()


@for_all(
    "old, new, code, said",
    [
        ("rate: 10 Hz", "calibration: ../../back.yaml", "RBX1301", "back.yaml"),
        ("rate: 10 Hz", "calibration: ../../room.yaml", "RBX3721", "its 'image_width' is no number of pixels"),
        ("rate: 10 Hz", "calibration: ../../strong.yaml", "RBX1003", "no lens bends a picture like this"),
        ("size: [320, 240]", "size: [3840, 2160]", "RBX1005", "'size[0]' must be at most 2048"),
        ("size: [320, 240], rate: 10 Hz", "calibration: ../../front.yaml", "RBX3721", "it is of 320 x 240 pixels"),
        ("size: 16 cm, names", "camera: back, size: 16 cm, names", "RBX1004", "back"),
        ("  front: {frame", "  back: {frame: base_footprint}\n  front: {frame", "RBX3722", "one of back, front"),
        ("names: {box: 7}", "names: {box: 7}, sizes: {box: 0 cm}", "RBX1005", "'box' must be greater than 0 m"),
        ("names: {box: 7}", "names: {box: 587}", "RBX1003", "tag36h11 has the tags 0 to 586, and no 587"),
        ("names: {box: 7}", "boards: {box: {tags: [{number: 587}]}}", "RBX1003", "tag36h11 has the tags 0 to 586"),
        ("names: {box: 7}", "names: {box: 7, dock: 7}", "RBX1003", "the same number"),
        (
            "cameras:",
            f"{FINDER}cameras:",
            "RBX3010",
            "'finder' needs '/front/points', which nothing in the robot provides",
        ),
        ("cameras:", f"{DOCK}cameras:", "RBX2019", "did you mean 'base_footprint_optical_frame'?"),
    ],
)
def test_mistakes_are_findings_at_their_place(tmp_path: Path, old: str, new: str, code: str, said: str) -> None:
    checked = project(tmp_path).check(ROBOT.replace(old, new))
    found = [finding for finding in checked.compilation.report if finding.code == code]
    assert found, checked.text
    assert said in checked.text
    assert found[0].span is not None
    assert found[0].span.file.endswith("robot.yaml")


def test_all_mistakes_in_tags_are_found_at_once(tmp_path: Path) -> None:
    tags = "names: {box: 7, big: 999, crate: 7}, sizes: {bxo: 30 cm}, boards: {box: {tags: [{number: 587}]}}"
    checked = project(tmp_path).check(ROBOT.replace("names: {box: 7}", tags))
    assert [finding.message for finding in checked.compilation.report] == [
        "'big': tag36h11 has the tags 0 to 586, and no 999",
        "'crate': 'box' has the same number",
        "'names' has no tag 'bxo'",
        "'box': a tag has the same name: box",
        "'number': tag36h11 has the tags 0 to 586, and no 587",
    ]


@for_all("wrong", ["size: [320]", "rate: fast", "calibration: ../../room.yaml", "calibration: ../../back.yaml"])
@for_all("which", ["", "camera: front, "])
def test_tags_have_a_camera_that_has_mistakes(tmp_path: Path, wrong: str, which: str) -> None:
    text = ROBOT.replace("size: [320, 240], rate: 10 Hz", wrong).replace("tags: {", f"tags: {{{which}")
    [code] = {finding.code for finding in project(tmp_path).check(text).compilation.report} - {"RBX3010"}
    assert code in ("RBX1003", "RBX1301", "RBX3721")


def test_who_needs_to_know_where_tags_are_without_a_size_is_told(tmp_path: Path) -> None:
    follower = "  follow_tag: {type: tag_follower, frame: base_footprint_optical_frame}\ncameras:\n"
    text = ROBOT.replace("size: 16 cm, ", "")
    assert "RBX3741" not in project(tmp_path).check(text).text
    checked = Project(tmp_path).check(text.replace("cameras:\n", follower))
    assert "the tags of 'tags' have no size, so 'follow_tag' does not learn where they are" in checked.text

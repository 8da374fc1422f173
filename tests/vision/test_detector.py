"""A detector runs the network of a user: here networks that the tests make, whose answers are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.domains.vision.components.detector import (
    AnswerForm,
    Letterbox,
    Network,
    NetworkError,
    fitted,
    form_of,
    names_in,
    things_of,
)
from rbxcompose.msgs.sensor_msgs import Image
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.vision_msgs import Detection2DArray
from rbxcompose.testing import Bench, instance
from tests.parts.project import Project

pytest.importorskip("cv2", reason="OpenCV is not installed")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")
onnx = pytest.importorskip("onnx", reason="onnx is not installed")
EMPTY = Letterbox(1.0, 0, 0)
PICTURE = np.zeros((48, 64, 3), np.uint8)


def network(path: Path, answers: Any, side: int = 64, names: str = "{0: 'cup', 1: 'box'}", inputs: int = 3) -> Path:
    """Write a network that gives the same answers to each picture."""
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    answers = np.asarray(answers, np.float32)
    value = helper.make_tensor("value", kind, answers.shape, answers.ravel().tolist())
    zero = helper.make_tensor("zero", kind, [1], [0.0])
    nodes = [
        helper.make_node("Constant", [], ["known"], value=value),
        helper.make_node("Constant", [], ["nothing"], value=zero),
        helper.make_node("ReduceMean", ["picture"], ["mean"], keepdims=0),
        helper.make_node("Mul", ["mean", "nothing"], ["none"]),
        helper.make_node("Add", ["known", "none"], ["answers"]),
    ]
    wanted = helper.make_tensor_value_info("picture", kind, [1, inputs, side, side])
    given = helper.make_tensor_value_info("answers", kind, list(answers.shape))
    made = helper.make_model(
        helper.make_graph(nodes, "fixed", [wanted], [given]), opset_imports=[helper.make_opsetid("", 13)]
    )
    made.ir_version = 8
    if names:
        helper.set_model_props(made, {"names": names})
    onnx.save(made, str(path))
    return path


def scored(*rows: tuple[float, ...], count: int = 20) -> Any:
    table = np.zeros((1, count, 7), np.float32)
    table[0, : len(rows)] = np.reshape(rows, (-1, 7))
    return table


def test_the_three_forms_of_answers_say_the_same() -> None:
    names = ["cup", "box"]
    one = scored((32, 24, 10, 8, 0.9, 0.1, 1.0))
    plain = np.zeros((1, 6, 20), np.float32)
    plain[0, :, 0] = 32, 24, 10, 8, 0.09, 0.9
    final = np.zeros((1, 20, 6), np.float32)
    final[0, 0] = 27, 20, 37, 28, 0.9, 1
    found = [things_of(each, EMPTY, names, 0.4, 0.5, (64, 48)) for each in (one, plain, final)]
    for (thing,) in found:
        assert (thing.name, thing.x, thing.y, thing.width, thing.height) == ("box", 32, 24, 10, 8)
        assert thing.score == pytest.approx(0.9)


def test_of_boxes_that_overlap_the_surest_of_a_class_counts() -> None:
    answers = scored(
        (30, 24, 10, 10, 0.9, 1.0, 0.0),
        (31, 24, 10, 10, 0.7, 1.0, 0.0),
        (31, 24, 10, 10, 0.8, 0.0, 1.0),
        (50, 24, 10, 10, 0.6, 1.0, 0.0),
        (10, 24, 10, 10, 0.3, 1.0, 0.0),
    )
    found = things_of(answers, EMPTY, ["cup", "box"], 0.4, 0.5, (64, 48))
    assert [(thing.name, round(thing.score, 2)) for thing in found] == [("cup", 0.9), ("box", 0.8), ("cup", 0.6)]


@given(st.integers(16, 300), st.integers(16, 300), st.integers(1, 4).map(lambda n: 32 * n))
def test_a_box_comes_back_to_where_it_was_in_the_picture(width: int, height: int, side: int) -> None:
    planes, box = fitted(np.full((height, width, 3), 255, np.uint8), side, side)
    assert planes.shape == (1, 3, side, side)
    x, y = width / 2 * box.scale + box.left, height / 2 * box.scale + box.top
    answers = scored((x, y, width * box.scale / 2, height * box.scale / 2, 1.0, 1.0, 0.0))
    (thing,) = things_of(answers, box, ["a", "b"], 0.4, 0.5, (width, height))
    assert (thing.x, thing.y) == pytest.approx((width / 2, height / 2), abs=1.0 / box.scale)
    assert thing.width == pytest.approx(width / 2, abs=2.0 / box.scale)
    assert planes[0, :, int(min(y, side - 1)), int(min(x, side - 1))] == pytest.approx(1.0)


@pytest.mark.parametrize("shape", [(1, 10), (2, 100, 7), (1, 100, 9), (1, 5, 5), (1, 100, 4)])
def test_answers_that_are_not_understood_are_told(shape: tuple[int, ...]) -> None:
    with pytest.raises(NetworkError, match=f"the shape {'x'.join(map(str, shape))}"):
        form_of(shape, 2)


def test_forms_are_told_apart_by_the_number_of_classes() -> None:
    assert form_of((1, 8400, 85), 80) is AnswerForm.SCORED
    assert form_of((1, 84, 8400), 80) is AnswerForm.PLAIN
    assert form_of((1, 300, 6), 80) is AnswerForm.FINAL
    assert form_of((1, 8400, 6), 1) is AnswerForm.SCORED


def test_names_are_those_that_exporters_write() -> None:
    assert names_in("{0: 'cat', 1: 'dog'}") == ["cat", "dog"]
    assert names_in("['cat']") == ["cat"]
    assert names_in("{5: 'cat'}") == names_in("no names") == names_in("") == []


class Looking:
    """A detector before a camera."""

    def __init__(self, model: Path, **config: Any) -> None:
        self.bench = Bench(instance("detector", "detector", {"model": str(model), **config}))
        self.found = self.bench.collect("/detections", Detection2DArray)
        self.statuses = self.bench.statuses("detector")
        self.bench.advance(0.1)

    def sees(self, encoding: str = "rgb8") -> list[str]:
        header = Header(frame_id="camera_optical_frame")
        self.bench.publish("/camera/image_raw", Image(header, 48, 64, encoding, 0, 192, PICTURE.tobytes()))
        self.bench.advance(1.2)
        return [one.id for one in self.found[-1].detections] if self.found else []


def test_it_publishes_what_its_network_finds_by_the_names_in_the_file(tmp_path: Path) -> None:
    path = network(tmp_path / "fixed.onnx", scored((32, 32, 10, 8, 0.9, 1.0, 0.0), (50, 32, 10, 8, 0.8, 0.0, 1.0)))
    looking = Looking(path)
    assert looking.sees() == ["cup", "box"]
    box = looking.found[-1].detections[0].bbox
    assert (box.center.position.x, box.center.position.y, box.size_x, box.size_y) == (32, 24, 10, 8)
    assert looking.found[-1].header.frame_id == "camera_optical_frame"
    assert Looking(path, only=["box"]).sees() == ["box"]
    assert Looking(path, labels=["mug", "crate"], confidence="85 %").sees() == ["mug"]
    assert looking.statuses[-1].level == Level.OK


def test_what_cannot_be_used_is_reported(tmp_path: Path) -> None:
    text = tmp_path / "text.onnx"
    text.write_text("no network")
    for path, said in [
        (tmp_path / "nowhere.onnx", "there is no file"),
        (text, "'text.onnx' is no network in ONNX"),
        (network(tmp_path / "grey.onnx", scored(), inputs=1), "and not one picture as float 1x3xHxW"),
    ]:
        looking = Looking(path)
        assert looking.sees() == []
        looking.bench.advance(1.5)
        assert looking.statuses[-1].level == Level.ERROR
        assert said in looking.statuses[-1].message
    looking = Looking(network(tmp_path / "odd.onnx", np.zeros((1, 4))))
    looking.sees()
    assert "its answers have the shape 1x4" in looking.statuses[-1].message
    looking = Looking(network(tmp_path / "fine.onnx", scored()))
    looking.sees("mono8")
    assert looking.found == []
    looking.bench.advance(4.0)
    assert looking.statuses[-1].message.startswith("no picture for")


def test_a_network_is_run_with_the_size_that_it_wants(tmp_path: Path) -> None:
    made = Network(network(tmp_path / "fixed.onnx", scored(), side=96))
    assert (made.width, made.height, made.names) == (96, 96, ["cup", "box"])
    planes, _ = fitted(PICTURE, made.width, made.height)
    assert made.answers(planes).shape == (1, 20, 7)
    with pytest.raises(NetworkError, match="the network fails"):
        made.answers(planes[:, :, :10])


def test_check_finds_a_network_that_cannot_be_used(tmp_path: Path) -> None:
    robot = "components:\n  eye: {{type: test_picture, topic: camera/image_raw}}\n  it: {{type: detector, model: {}}}\n"
    network(tmp_path / "good.onnx", np.zeros((1, 6, 8)))
    network(tmp_path / "grey.onnx", np.zeros((1, 6, 8)), inputs=1)
    (tmp_path / "text.onnx").write_text("no network")
    said = {}
    for model in ("good.onnx", "grey.onnx", "text.onnx", "none.onnx"):
        for written in (f"../../{model}", str(tmp_path / model)):
            report = Project(tmp_path).check(robot.format(written)).compilation.report
            said[written] = next((found.message for found in report if found.code == "RBX3743"), "")
    for folder in ("../..", str(tmp_path)):
        assert said[f"{folder}/good.onnx"] == ""
        assert "and not one picture" in said[f"{folder}/grey.onnx"]
        assert "'text.onnx' is no network in ONNX" in said[f"{folder}/text.onnx"]
    assert said["../../none.onnx"] == "there is no file '../../none.onnx'"
    assert said[f"{tmp_path}/none.onnx"] == ""  # it is one on the computer of the robot

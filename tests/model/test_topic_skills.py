"""Topics as skills: what their declaration needs, and what missions know of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.schema.mission import skills_of
from rbxcompose.missions.program.goals import topic_skill
from rbxcompose.missions.sources import Orders, OrderTopic, SkillWay
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.geometry_msgs import PoseStamped, Twist
from rbxcompose.msgs.std_msgs import Bool, Empty, Float64, String
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk import Component, Config, In, Out, ServesAction, ServesTopic, component
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import check_text
from rbxcompose.tools.inspection.diagram import diagram_of
from rbxcompose.tools.inspection.why import why_port
from rbxcompose.tools.lsp.answers import define
from rbxcompose.tools.lsp.document import Document
from tests.executive.toy_gripper import GripEnd, Gripper, GripperConfig

ROBOT = """
rbx: 1
kind: Robot
name: hand
components:
  gripper: {type: toy_gripper, connect: {gripped: hand/ended}}
missions: {test: test.yaml}
"""
MISSION = "rbx: 1\nkind: Mission\nname: test\ndo:\n  - grip: 0.02\n  - beep: done\n"


def robot(folder: Path, mission: str = MISSION, text: str = ROBOT) -> Robot:
    found = check_text(text, folder, others={"test.yaml": mission})
    assert found.compilation.robot, found.text
    assert not found.codes, found.text
    return found.compilation.robot


# Declaring


def test_orders_are_events_that_may_come_from_anywhere() -> None:
    port = ServesTopic(Float64, "grip")
    assert (port.qos, port.is_open, port.kind) == (Qos.EVENT, True, "serves_topic")
    assert ServesTopic(Float64, "grip", qos="command").qos is Qos.COMMAND


def test_an_end_tells_whether_it_is_a_success() -> None:
    with pytest.raises(ValueError, match="std_msgs/msg/Bool has no flag 'success'"):
        ServesTopic(Float64, "grip", ends=Out(Bool, "ended"))


SILENT = Out(SetBool.Response, "ended")
TELLING = Out(GripEnd, "ended")


@pytest.mark.parametrize(
    ("ends", "outcomes", "words"),
    [
        (None, {"empty": "failure"}, "nothing can report an outcome"),
        (SILENT, {"empty": "failure"}, "SetBool_Response has no text field 'outcome'"),
        (TELLING, {"empty": "maybe"}, "counts as success or failure, not as maybe"),
    ],
    ids=["no ends", "no field", "counts as nothing"],
)
def test_outcomes_need_a_field_in_the_end(ends: Out[GripEnd] | None, outcomes: Mapping[str, str], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ServesTopic(Float64, "grip", ends=ends, outcomes=outcomes)


def test_what_ends_at_once_cannot_be_halted() -> None:
    with pytest.raises(ValueError, match="'halts' would never be used"):
        ServesTopic(Float64, "grip", halts=In(Empty, "halt"))


@pytest.mark.parametrize("word", ["ends", "halts"])
def test_ends_and_halts_are_ports_of_the_same_class(word: str) -> None:
    class Hand(Component[Config]):
        """A hand with a port of somebody else's."""

        grip = ServesTopic(Float64, "grip", ends=TELLING, halts=In(Empty, "halt"))
        if word == "halts":
            told = TELLING

    with pytest.raises(ValueError, match=f"'{word}' of the port 'grip' is not a port of this class"):
        component("toy_broken_hand")(Hand)


@pytest.mark.parametrize(
    ("name", "topic", "problem"),
    [
        ("stop", "stop", r"Wrong\.stop hides what every component has"),
        ("config", "config", r"Wrong\.config hides what every component has"),
        ("raw", "my raw", r"Wrong\.raw: 'my raw' is not a ROS name"),
    ],
)
def test_a_port_hides_nothing_that_components_have_and_has_a_topic_of_ros(name: str, topic: str, problem: str) -> None:
    wrong = type("Wrong", (Component,), {name: In(Empty, topic)})
    with pytest.raises(ValueError, match=problem):
        component("toy_wrong_port")(wrong)


@pytest.mark.parametrize(("method", "meant"), [("on_rwa", "on_raw"), ("accept_gripp", "accept_grip")])
def test_a_misspelt_handler_is_refused(method: str, meant: str) -> None:
    class Misspelt(Component[Config]):
        raw = In(Empty, "raw")
        grip = ServesAction(FollowJointTrajectory, "grip")

    setattr(Misspelt, method, lambda self, message: None)
    with pytest.raises(ValueError, match=f"Misspelt.{method} is for no port: did you mean '{meant}'?"):
        component("toy_misspelt")(Misspelt)


def test_a_method_for_several_ports_and_one_for_the_component_itself_are_no_slips() -> None:
    @component("toy_several_scans")
    class SeveralScans(Component[Config]):
        """Reads the newest scans."""

        scan_left, scan_right = In(Empty, "left"), In(Empty, "right")

        def on_scan(self, message: Empty) -> None: ...

        def on_timer(self) -> None: ...

    @component("toy_any_message")
    class AnyMessage(Component[Config]):
        """Handles all messages alike."""

        raw = In(Empty, "raw")

        def received(self, port: str, message: Empty) -> None: ...

        def on_rwa(self) -> None: ...


# What missions know


def test_the_fields_of_a_message_are_the_arguments_and_those_of_the_end_the_results() -> None:
    skill = topic_skill(Float64, "grip", GripEnd, "arm", restartable=False, outcomes={"empty": "failure"})
    assert (list(skill.arguments), skill.main, skill.required) == (["data"], "data", frozenset())
    assert list(skill.results) == ["success", "outcome", "message", "force"]
    assert (skill.claims, skill.restartable, skill.pausable) == ("arm", False, False)
    assert skill.outcomes == {"empty": "failure"}


@pytest.mark.parametrize(
    ("message", "main", "is_needed"), [(PoseStamped, "pose", True), (Twist, "", False), (String, "data", False)]
)
def test_a_pose_that_is_the_main_argument_has_to_be_given(message: type, main: str, is_needed: bool) -> None:
    skill = topic_skill(message, "one")
    assert (skill.main, bool(skill.required)) == (main, is_needed)
    assert skill.results == {}


def test_a_skill_knows_the_topics_as_they_are_wired(tmp_path: Path) -> None:
    found = robot(tmp_path).skills
    assert (found["grip"].way, found["grip"].topic, found["grip"].action) == (SkillWay.TOPIC, "/grip", Float64.TYPE)
    ends, halts = OrderTopic("/hand/ended", GripEnd.TYPE, "event"), OrderTopic("/grip/halt", Empty.TYPE, "event")
    assert found["grip"].orders == Orders("event", ("gripper",), ends, halts)
    assert found["beep"].orders == Orders("event", ("gripper",))


def test_arguments_and_outcomes_are_checked_as_those_of_any_skill(tmp_path: Path) -> None:
    wrong = MISSION.replace("grip: 0.02", "grip: wide").replace("beep: done", "beep: {tone: high}")
    found = check_text(ROBOT, tmp_path, others={"test.yaml": wrong})
    assert len(found.codes) == 2, found.text
    assert "this must be a number; nothing is named 'wide'" in found.text
    assert "its arguments: data" in found.text


def test_a_graph_shows_orders_ends_and_halts(tmp_path: Path) -> None:
    wires = {
        wire.name: ([tip.box for tip in wire.sources], [tip.box for tip in wire.targets])
        for wire in diagram_of(robot(tmp_path)).wires
    }
    assert wires["/grip"] == wires["/grip/halt"] == (["mission:test"], ["gripper"])
    assert wires["/hand/ended"] == (["gripper"], ["mission:test"])


def test_why_tells_what_is_done_at_such_a_port_and_who_orders(tmp_path: Path) -> None:
    answer = why_port(robot(tmp_path), ("gripper", "grip"))
    assert answer
    assert answer.value == "carries out std_msgs/msg/Float64 at /grip, as event"
    assert ("ordered by", "mission.skill_grip") in answer.hints
    asked = why_port(robot(tmp_path), ("mission", "skill_grip"))
    assert asked
    assert ("read by", "gripper.grip") in asked.hints


def test_schemas_propose_it(tmp_path: Path) -> None:
    skill, about = skills_of(["toy_gripper"])["grip"]
    assert list(skill.arguments) == ["data"]
    assert about == "Skill of `toy_gripper`: Grips for a second."


def test_an_editor_finds_its_component(tmp_path: Path) -> None:
    known = robot(tmp_path)
    file = tmp_path / "test.yaml"
    place = define(Document(file, file.read_text(encoding="utf-8"), known), 4, 6)
    assert place is not None
    assert (Path(place.file).name, place.line) == ("robot.yaml", 6)


def test_a_toy_of_these_tests_is_a_component_like_any_other() -> None:
    assert {port.kind for port in Gripper.ports(GripperConfig()).values()} == {"in", "out", "serves_topic"}


# The checks of the robot

HAND = "rbx: 1\nkind: Part\nname: hand\nprovides:\n  skills: [{}]\ncomponents:\n  gripper: {{type: toy_gripper}}\n"
WITH_HAND = "rbx: 1\nkind: Robot\nname: one\ninclude:\n  hand: hand.yaml\n"


@pytest.mark.parametrize(("skill", "codes"), [("grip", set()), ("beep", set()), ("wave", {"RBX3022"})])
def test_a_part_may_promise_one(skill: str, codes: set[str], tmp_path: Path) -> None:
    found = check_text(WITH_HAND, tmp_path, others={"hand.yaml": HAND.format(skill)})
    assert set(found.codes) == codes, found.text


def test_two_of_one_name_are_told(tmp_path: Path) -> None:
    text = ROBOT.partition("missions")[0] + "  spare: {type: toy_gripper, connect: {grip: spare/grip, gripped: done}}\n"
    assert "RBX3024" in check_text(text, tmp_path).codes


def test_two_that_take_the_same_orders_are_told_if_they_tell_ends(tmp_path: Path) -> None:
    text = ROBOT.partition("missions")[0] + "  spare: {type: toy_gripper}\n"
    found = [finding.message for finding in check_text(text, tmp_path).compilation.report if finding.code == "RBX3008"]
    assert found == [f"'spare' and 'gripper' both serve '/{name}'" for name in ("grip", "press")]  # not `beep`

"""What a check says where its usual words would lead astray."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.findings import Finding
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk import Component, Config, In, Out, component
from rbxcompose.testing.manifests import check_text

HEAD = "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  base: {type: diff_drive_sim}\n  go_to: {type: go_to}\n"
TELEOP = "muxes:\n  cmd_vel:\n    inputs:\n      teleop: {priority: 100, timeout: 0.5 s}\n"


@component("toy_relay")
class Relay(Component[Config]):
    """Passes a level on."""

    taken = In(Float32, "taken")
    given = Out(Float32, "given")


def only(text: str, folder: Path) -> Finding:
    [finding] = check_text(text, folder).compilation.report
    return finding


def test_a_writer_beside_a_mux_is_told_to_become_an_input_of_it(tmp_path: Path) -> None:
    finding = only(HEAD + TELEOP, tmp_path)
    assert finding.code == "RBX3001"
    assert finding.help == "the mux 'cmd_vel' has to decide: give it an input 'from: go_to'"


def test_two_writers_beside_a_mux_are_both_told_to_become_inputs_of_it(tmp_path: Path) -> None:
    follow = "  follow: {type: go_to, connect: {go_to: follow}}\n"
    helps = [finding.help for finding in check_text(HEAD + follow + TELEOP, tmp_path).compilation.report]
    assert helps == [
        "the mux 'cmd_vel' has to decide: give it an input 'from: go_to' and 'from: follow'",
        "the mux 'cmd_vel' has to decide: give it an input 'from: go_to'",
    ]


def test_a_lock_named_like_an_input_is_told_at_both_places(tmp_path: Path) -> None:
    go = "      go: {from: go_to, priority: 10, timeout: 0.5 s}\n"
    finding = only(HEAD + TELEOP + go + "    locks:\n      teleop: {priority: 200, timeout: 1 s}\n", tmp_path)
    assert finding.code == "RBX3002"
    assert finding.message.startswith("mux 'cmd_vel' uses the name 'teleop' twice, for an input and for a lock")
    assert finding.span
    assert (finding.span.line, [related.span.line for related in finding.related]) == (13, [10])


def test_a_component_is_not_told_to_listen_to_itself(tmp_path: Path) -> None:
    robot = "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  relay: {type: toy_relay}\n"
    assert only(robot, tmp_path).help == "add the component that provides it"
    other = "  other: {type: toy_relay, connect: {taken: given, given: level}}\n"
    assert only(robot + other, tmp_path).help == "connect it: 'connect: {taken: level}'"
    third = "  third: {type: toy_relay, connect: {taken: given, given: upper/level}}\n"
    inside = robot.replace("components:", "bus: {namespace: inside}\ncomponents:")
    both = "'connect: {taken: level}', 'connect: {taken: upper/level}'"
    assert only(inside + other + third, tmp_path).help == f"connect it: one of {both}"


OVERLAY = "rbx: 1\nkind: Overlay\nname: over\n"
PLACES = "places:\n  corner_3: {x: 1 m, y: 1 m}\n  corner_4: {x: 2 m, y: 1 m}\n"
MISSION = (
    "rbx: 1\nkind: Mission\nname: tour\ninputs: {last: {type: place, default: corner_3}}\ndo:\n  go_to: corner_3\n"
)


@pytest.mark.parametrize("removal", ["places:\n  corner_3: !remove\n", "places:\n  !remove\n"])
def test_a_place_that_an_overlay_removes_points_to_the_overlay(removal: str, tmp_path: Path) -> None:
    over = tmp_path / "over.yaml"
    over.write_text(OVERLAY + removal, encoding="utf-8")
    text = HEAD + PLACES + "missions:\n  tour: tour.yaml\n"
    others = {"tour.yaml": MISSION}
    assert not check_text(text, tmp_path, others=others).compilation.report.has_errors
    found = list(check_text(text, tmp_path, others=others, overlays=[str(over)]).compilation.report)
    assert [finding.code for finding in found] == ["RBX4103", "RBX4103"]
    for finding in found:
        assert (finding.message, finding.help) == ("there is no place 'corner_3' any more", "")
        assert [(related.span.file, related.message) for related in finding.related] == [(str(over), "removed here")]


def test_a_place_that_nobody_removed_is_misspelt_as_ever(tmp_path: Path) -> None:
    text = HEAD + PLACES + "missions:\n  tour: tour.yaml\n"
    others = {"tour.yaml": MISSION.replace("go_to: corner_3", "go_to: corner_33")}
    [finding] = check_text(text, tmp_path, others=others).compilation.report
    assert finding.help == "did you mean 'corner_3'?"


ENOUGH = "a few times the time between two commands is enough, such as '0.5 s'"


@pytest.mark.parametrize(
    ("speed", "timeout", "line", "help_text"),
    [
        ("0.5 m/s", "5 s", 8, ENOUGH),
        ("20 m/s", "5 s", 8, f"{ENOUGH}, and drive at 4 m/s at most"),
        ("20 m/s", "0.5 s", 7, "drive at 4 m/s at most"),
        ("20 m/s", "0.3 s", 7, "drive at 6.66 m/s at most"),
        ("4 m/s", "0.5 s", None, ""),
        ("6.66 m/s", "0.3 s", None, ""),
    ],
)
def test_a_base_that_brakes_late_is_told_its_timeout_or_where_that_is_short_its_speed(
    speed: str, timeout: str, line: int | None, help_text: str, tmp_path: Path
) -> None:
    base = f"    type: diff_drive_sim\n    max_speed: {speed}\n    command_timeout: {timeout}\n"
    text = HEAD.replace("  base: {type: diff_drive_sim}\n", f"  base:\n{base}")
    found = [each for each in check_text(text, tmp_path).compilation.report if each.code == "RBX3509"]
    assert [(each.span and each.span.line, each.help) for each in found] == ([(line, help_text)] if line else [])


SENSORS = """world: rbx:worlds/one_wall.yaml
components:
  base: {type: diff_drive_sim}
  laser: {type: laser_sim, frame: FRAME}
"""
PLACING = """  placing:
    type: program
    command: [./placing]
    publishes: {/tf: tf2_msgs/TFMessage}
"""


@pytest.mark.parametrize(
    ("frame", "more", "help_text"),
    [
        ("base_footprint", "", None),
        ("base_link", "", "write 'frame: base_footprint', or add a 'body' that has it"),
        ("base_link", PLACING, None),
    ],
)
def test_without_a_body_a_simulated_sensor_is_at_the_base_or_where_somebody_places_it(
    frame: str, more: str, help_text: str | None, tmp_path: Path
) -> None:
    robot = "rbx: 1\nkind: Robot\nname: one\n" + SENSORS.replace("FRAME", frame) + more
    found = [each for each in check_text(robot, tmp_path).compilation.report if each.code == "RBX2019"]
    assert [each.help for each in found] == [help_text] * (help_text is not None)


def test_a_frame_that_hangs_on_a_misspelt_frame_is_no_remedy_for_that(tmp_path: Path) -> None:
    text = GAZER.replace("frame: neck_top", "frame: face_cam").replace("HEAD", "{}")
    text += "body: {pieces: {face: {urdf: face.urdf, attach: {to: neck_top}}}}\n"
    (tmp_path / "face.urdf").write_text('<robot name="face"><link name="camera"/></robot>')
    found = [each for each in check_text(text, tmp_path).compilation.report if "'face_cam'" in each.message]
    assert [each.help for each in found] == ["did you mean 'face_camera'?"]


GAZER = """rbx: 1
kind: Robot
name: gazer
world: rbx:worlds/one_wall.yaml
buses: {servos: {type: dynamixel}}
include:
  neck: {part: rbx:parts/pan_tilt.yaml, with: {bus: servos}}
cameras: {front: {frame: neck_top}}
tags: {size: 12 cm, names: {visitor: 7}}
heads:
  neck_head: HEAD
"""


@pytest.mark.parametrize(
    ("head", "code", "wrong", "help_text"),
    [
        ("{tracks: {frame: tag_visitr}}", "RBX2019", "tag_visitr", "did you mean 'tag_visitor'?"),
        ("{frames: [odom, mapp]}", "RBX2019", "mapp", "did you mean 'map'?"),
        ("{tracks: {topic: target_posee}}", "RBX3010", "target_posee", None),
    ],
)
def test_what_a_robot_writes_about_a_head_of_a_part_is_wrong_where_it_is_written(
    head: str, code: str, wrong: str, help_text: str | None, tmp_path: Path
) -> None:
    text = GAZER.replace("HEAD", head)
    [finding] = [each for each in check_text(text, tmp_path).compilation.report if wrong in each.message]
    assert finding.code == code
    assert finding.span
    assert Path(finding.span.file).name == "robot.yaml"
    assert text.splitlines()[finding.span.line - 1][finding.span.column - 1 : finding.span.end_column - 1] == wrong
    assert help_text in (None, finding.help)


ELSEWHERE = "rbx: 1\nkind: {}\nname: delivery\ndo: recharge\n"


def test_a_start_mission_that_lies_in_the_project_is_to_be_named(tmp_path: Path) -> None:
    text = HEAD + "start: delivery\n"
    others = {"missions/delivery.yaml": ELSEWHERE.format("Mission"), "delivery.yaml": ELSEWHERE.format("Test")}
    found = list(check_text(text, tmp_path, others=others).compilation.report)
    assert [finding.help for finding in found if finding.code == "RBX3009"] == [
        "add 'delivery: missions/delivery.yaml' below 'missions:'"
    ]


def test_the_path_to_it_is_that_from_the_robot(tmp_path: Path) -> None:
    folder = tmp_path / "robots" / "cart"
    folder.mkdir(parents=True)
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "delivery.yaml").write_text(ELSEWHERE.format("Mission"), encoding="utf-8")
    found = list(check_text(HEAD + "start: delivery\n", folder).compilation.report)
    assert "add 'delivery: ../../missions/delivery.yaml' below 'missions:'" in [finding.help for finding in found]


def test_a_start_mission_of_the_command_line_is_to_be_named_in_the_robot(tmp_path: Path) -> None:
    others = {"missions/delivery.yaml": ELSEWHERE.format("Mission")}
    found = list(check_text(HEAD, tmp_path, others=others, sets=["start=delivery"]).compilation.report)
    assert "add 'delivery: missions/delivery.yaml' below 'missions:'" in [finding.help for finding in found]


def test_a_start_mission_that_lies_nowhere_is_told_as_before(tmp_path: Path) -> None:
    found = list(check_text(HEAD + "start: delivery\n", tmp_path).compilation.report)
    assert [finding.help for finding in found if finding.code == "RBX3009"] == [""]


def test_a_port_of_a_device_without_devices_is_told_how_to_declare_it(tmp_path: Path) -> None:
    finding = only(HEAD + "buses:\n  servos: {type: dynamixel, port: 'dev:u2d2'}\n", tmp_path)
    assert finding.help == "add 'u2d2' below 'devices', or write a path such as '/dev/ttyUSB0'"


def test_a_neutral_tick_beyond_those_of_the_servo_is_told_its_range(tmp_path: Path) -> None:
    (tmp_path / "body.urdf").write_text(
        '<robot name="x"><link name="a"/><link name="b"/><joint name="pan" type="revolute"><parent link="a"/>'
        '<child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>',
        encoding="utf-8",
    )
    servo = "actuators:\n  pan: {bus: servos, id: 1, model: AX-12A, neutral: 2048}\njoints:\n  pan: {actuator: pan}\n"
    bus = "body: {urdf: body.urdf}\nbuses:\n  servos: {type: dynamixel, port: /dev/ttyUSB0}\n"
    codes = {finding.code: finding.help for finding in check_text(HEAD + bus + servo, tmp_path).compilation.report}
    assert codes["RBX2225"] == (
        "the ticks of servo 1, AX-12, go from 0 to 1023: the middle, 'neutral: 512', is the default"
    )


@pytest.mark.parametrize(
    ("heading", "label", "remedy"),
    [
        ("450 deg", "this is 450 deg", "write the angle within one turn: '90 deg'"),
        ("-400.5 deg", "this is -400.5 deg", "write the angle within one turn: '-40.5 deg'"),
        ("90 rad", "this is 5156.62 deg", "write it in 'deg'"),
    ],
)
def test_a_heading_beyond_a_turn_is_told_as_it_is_written_and_what_to_write(
    heading: str, label: str, remedy: str, tmp_path: Path
) -> None:
    finding = only(HEAD + f"places:\n  window: {{x: 2 m, y: 1 m, heading: {heading}}}\n", tmp_path)
    assert (finding.code, finding.label, finding.help) == ("RBX3507", label, remedy)

"""What is said to somebody who wrote one wrong thing: each finding names the cure, with the person's own words."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.testing.manifests import check_text
from tests.loops import for_all
from tests.misconfig.corpus import HERE

ROBOT = (HERE / "robot.yaml").read_text(encoding="utf-8")
MISSION = "rbx: 1\nkind: Mission\nname: work\ndo:\n  - go_to: kitchen\n"
GO_TO = "    type: go_to\n"

CURES = [
    (GO_TO, f"{GO_TO}    speed: 0.3 mps\n", "did you mean 'm/s'?"),
    (GO_TO, f"{GO_TO}    turn_rate: 120/s\n", "write '120 deg/s' or '120 rad/s'"),
    ("heading: 90 deg", "heading: 45", "write '45 deg' or '45 rad'"),
    (
        GO_TO,
        "    type: lidar_driver\n",
        "if a package brings it, install that; 'rbxcompose new component lidar_driver' begins one of your own",
    ),
    (
        GO_TO,
        "    type: joint_trajectory_controller/JointTrajectoryController\n",
        "write it below 'controllers', with the type 'joint_trajectory'",
    ),
    (GO_TO, f"{GO_TO}    depends_on: [base]\n", "did you mean 'starts_after'?"),
    ("muxes:", "diagnostics: {rate: 20 ms}\nmuxes:", "a period as a rate: write '50 Hz'"),
    ("timeout: 0.5 s", "timeout: 2 Hz", "once every 0.5 s: write '0.5 s'"),
    (
        "muxes:",
        "diagnostics: {analyzers: {power: null}}\nmuxes:",
        "in a profile or an overlay, '!remove' behind the colon removes it",
    ),
    ("name: helper", "metadata:\n  name: helper", "the keys below it belong at the top of the file: move them there"),
    ("muxes:", "substitutions: {speed: 1}\nmuxes:", "arguments are below 'args', each with its type and default"),
    ("muxes:", "diagnostics: !include of.yaml\nmuxes:", "a file of its own is named below 'include'"),
    (
        GO_TO,
        f"{GO_TO}    ros__parameters:\n      speed: 0.3\n",
        "remove 'ros__parameters:' and move what is below it to the left, into its column",
    ),
    (
        GO_TO,
        f"{GO_TO}    params:\n      speed: 0.3\n",
        "remove 'params:' and move what is below it to the left, into its column",
    ),
    (
        "heading: 90 deg",
        "heading: 90 deg, frame: odom",
        "places are always in 'map': give 'x' and 'y' there, and remove 'frame'",
    ),
    (
        "muxes:",
        "include: [rbx:parts/teleop.yaml, rbx:parts/arm.yaml]\nmuxes:",
        "each needs a name instead of its dash: 'teleop: rbx:parts/teleop.yaml' and 'arm: rbx:parts/arm.yaml'",
    ),
    ("muxes:", "include: rbx:parts/arm.yaml\nmuxes:", "it needs a name: write 'arm: rbx:parts/arm.yaml' below it"),
    ("muxes:", "include:\n  - {part: a.yaml, name: b}\nmuxes:", "each needs a name instead of its dash: 'b:'"),
    ("muxes:", "include: [[a]]\nmuxes:", "each needs a name instead of its dash: 'NAME:'"),
    (
        "teleop:\n        priority: 100\n        timeout: 0.5 s\n      navigation:\n",
        "- name: teleop\n        priority: 100\n        timeout: 0.5 s\n      - name: navigation\n",
        "each needs a name instead of its dash: 'teleop:' and 'navigation:'",
    ),
    (
        "missions:",
        "  diagnostics:\n    analyzers:\n      power: {match: [battery]}\nmissions:",
        "move it, with all below it, 2 columns to the left",
    ),
    (
        "components:",
        "  diagnostics:\n    analyzers:\n      power: {match: [battery]}\ncomponents:",
        "move it, with all below it, 2 columns to the left",
    ),
    (
        "components:",
        "bus:\n  domain: 3\n  start: work\ncomponents:",
        "move it, with all below it, 2 columns to the left",
    ),
    (GO_TO, f"{GO_TO}    environment: [A=b]\n", "fills in a variable, and the domain is 'domain' below 'bus'"),
    (GO_TO, f"{GO_TO}    profiles: [home]\n", "a section of the file: 'profiles: {NAME: {components: {...}}}'"),
    ("places:", "bus: {use_sim_time: true}\nplaces:", "write 'clock: external' below 'bus'"),
    ("places:", "ros2_control: {}\nplaces:", "'actuators', 'joints' and 'controllers'"),
    ("missions:", "profiles: [home]\nmissions:", "below: 'home:' instead of '[home]'"),
    (
        "missions:",
        "values: {level: battery/battery_level}\nmissions:",
        "joined by a dot: write 'battery.battery_level'",
    ),
    ("work: mission.yaml", "work: mission", "did you mean 'mission.yaml'?"),
    (GO_TO, f"{GO_TO}    speed: ${{SPEED:-0.3 m/s}}\n", "write '${env.SPEED:-0.3 m/s}'"),
    (GO_TO, f"{GO_TO}    speed: ${{args.speed:-0.3 m/s}}\n", "and its 'default' where it is declared below 'args'"),
    (GO_TO, f"{GO_TO}    speed: ${{SPEED}}\n", "an environment variable is written '${env.SPEED}'"),
    (GO_TO, f"{GO_TO}    speed: ${{args.speed}}\n", "declare 'speed' below 'args' of this file"),
    (GO_TO, f"{GO_TO}    speed: $(arg speed)\n", "write '${args.speed}', and declare 'speed' under 'args'"),
    (GO_TO, f"{GO_TO}    speed: $(env SPEED)\n", "write '${env.SPEED}'"),
    (GO_TO, f"{GO_TO}    speed: $(optenv SPEED 1)\n", "write '${env.SPEED:-DEFAULT}'"),
    (
        "work: mission.yaml",
        "work: $(find missions)/mission.yaml",
        "a path is relative to the file that writes it: write it without this",
    ),
    ("work: mission.yaml", r"work: missions\patrol.yaml", "write 'missions/patrol.yaml'"),
    (
        "work: mission.yaml",
        r'work: "missions\mission.yaml"',
        "a path is written with '/'; elsewhere write the backslash twice, or use single quotes",
    ),
    (GO_TO, f"{GO_TO}    speed: ${{secret.tokn}}\n", "did you mean 'token'?"),
    (
        "name: helper",
        "name: helper\nabout: rtsp://admin:hunter2@camera/live",
        "where a secret is taken, put the whole address into 'secrets/NAME' and write '${secret.NAME}'",
    ),
    ("    type: go_to\n", "    platform: go_to\n", "write 'type: go_to'"),
    (
        "missions:",
        "---\nrbx: 1\nkind: Mission\nmissions:",
        "a file holds one manifest: move what follows, without the '---', to a file of its own",
    ),
    ("rbx: 1\n", "rbx: 1\n---\n", "a file holds one manifest: remove the '---'"),
    (
        "missions:",
        "profiles:\n  bare:\n    components:\n      go_to: null\nmissions:",
        "to remove it, write 'go_to: !remove'",
    ),
    (
        GO_TO,
        f"{GO_TO}  watch: {{type: topic_monitor, topic: odom, message: nav_msgs.msg.Odometry, rate: 1 Hz}}\n",
        "did you mean 'nav_msgs/msg/Odometry'?",
    ),
    (
        GO_TO,
        f"{GO_TO}  watch: {{type: topic_monitor, topic: odom, message: geometry_msgs/Pose, rate: 1 Hz}}\n",
        "write 'message: nav_msgs/Odometry' in 'watch', or another topic",
    ),
    (
        "missions:",
        "diagnostics: {ignore: [{regex: '*camera*'}]}\nmissions:",
        "write '.*camera.*', or 'contains: camera' instead of 'regex'",
    ),
]


@for_all("right, wrong, cure", CURES)
def test_the_first_finding_about_a_mistake_tells_the_cure(right: str, wrong: str, cure: str, tmp_path: Path) -> None:
    assert right in ROBOT
    others = {"mission.yaml": MISSION, "secrets/token": "x"}
    checked = check_text(ROBOT.replace(right, wrong, 1), tmp_path, others=others)
    assert next(iter(checked.compilation.report)).help.endswith(cure)


@pytest.mark.parametrize(
    ("value", "meant"), [("/amr_1/level", "{topic: /amr_1/level}"), ("{port: /a/b/c}", "topic: /a/b/c")]
)
def test_a_topic_in_place_of_a_port_is_not_changed_to_a_component(value: str, meant: str, tmp_path: Path) -> None:
    checked = check_text(ROBOT.replace("places:", f"values: {{x: {value}}}\nplaces:"), tmp_path)
    (finding,) = (finding for finding in checked.compilation.report if finding.code == "RBX1006")
    assert finding.help == f"a name that begins with '/' is a topic: write '{meant}'"
    assert finding.fix is None


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        (
            "<?xml version='1.0'?>\n<!-- a: b -->\n<robot name='a'/>",
            "this is a URDF: a robot names it by 'body: {urdf: FILE}'",
        ),
        ("<robot>\n\t<xacro:a/></robot>", "this is a xacro file: a robot names it by 'body: {xacro: FILE}'"),
        (
            "<launch>\n  <node pkg='a'/>\n</launch>",
            "this is a ROS launch file: write its nodes as 'components'; 'rbxcompose new robot NAME' begins a robot",
        ),
        (
            "<root>\n  <BehaviorTree ID='a'/>\n</root>",
            "this is a behaviour tree: write it as a mission; 'fallback', 'sequence' and 'parallel' are steps",
        ),
        ("<html/>", ""),
    ],
)
def test_xml_is_told_by_its_root(text: str, cure: str, tmp_path: Path) -> None:
    (finding,) = check_text(text, tmp_path).compilation.report
    assert (finding.code, finding.help) == ("RBX1320", cure)


@pytest.mark.parametrize("text", ["about: <no XML>", "about: '<robot/>'", "components: {}"])
def test_other_texts_are_no_xml(text: str, tmp_path: Path) -> None:
    checked = check_text(f"rbx: 1\nkind: Robot\nname: one\n{text}\n", tmp_path)
    assert not checked.compilation.report.has_errors


@pytest.mark.parametrize(
    "about", ["rtsp://camera/live", "rtsp://admin:***@camera", "mailto:a:b@c", "http://a:8080/b@c"]
)
def test_an_address_without_a_password_is_fine(about: str, tmp_path: Path) -> None:
    assert check_text(f"rbx: 1\nkind: Robot\nname: one\nabout: {about}\n", tmp_path).codes == []


def test_a_path_with_backslashes_is_corrected_where_the_file_is(tmp_path: Path) -> None:
    wrong = ROBOT.replace("work: mission.yaml", r"work: missions\patrol.yaml")
    checked = check_text(wrong, tmp_path, others={"missions/patrol.yaml": MISSION})
    (finding,) = checked.compilation.report
    assert finding.fix
    assert (finding.fix.is_safe, finding.fix.edits[0].text) == (True, "missions/patrol.yaml")


@pytest.mark.parametrize(
    ("components", "cure"),
    [
        ("", "without 'from' the input is open to the outside"),
        (
            "components: {base: {type: diff_drive_sim}}\n",
            "components of this robot: base; without 'from' the input is open to the outside",
        ),
        ("components: {planner: {type: go_to}}\n", "did you mean 'planner'?"),
    ],
)
def test_the_source_of_an_input_that_is_missing_may_be_left_out(components: str, cure: str, tmp_path: Path) -> None:
    muxes = "muxes: {cmd_vel: {inputs: {driver: {from: planer, priority: 1, timeout: 1 s}}}}\n"
    checked = check_text(f"rbx: 1\nkind: Robot\nname: one\n{components}{muxes}", tmp_path)
    assert [finding.help for finding in checked.compilation.report if finding.code == "RBX3003"] == [cure]

"""Arms of a manifest: what they become, how parts name them, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.domains.arms.motion.inverse_kinematics import SolverSettings
from rbxcompose.domains.body.link_pairs import digest_of
from rbxcompose.testing.manifests import check_text
from tests.body.described import described
from tests.misconfig.corpus import HERE
from tests.parts.project import Project

ROBOT = """
buses: {servos: {type: dynamixel}}
include:
  right_arm: {part: "rbx:parts/servo_arm.yaml", with: {bus: servos}}
"""


def arm_of(project: Project) -> Any:
    assert project.checked
    [found] = [instance for instance in project.checked.plan.instances if instance.type == "arm"]
    return found


def test_an_arm_of_a_part_has_the_name_of_the_instance_if_that_ends_with_it(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT)
    assert project.findings == []
    assert arm_of(project).name == "right_arm"
    project.check(ROBOT.replace("right_arm:", "manipulator:"))
    assert arm_of(project).name == "manipulator_arm"


def test_an_arm_has_the_joints_of_its_chain_with_their_tighter_limits(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT)
    config = arm_of(project).config
    assert next(iter(config.joints)) == "right_arm_shoulder_pan_joint"
    assert len(config.joints) == 6
    assert config.follow == "right_arm_controller/follow_joint_trajectory"
    pan = config.joints["right_arm_shoulder_pan_joint"]
    assert (pan.lower, pan.upper) == pytest.approx((-2.6005, 2.6005), abs=1e-3)
    assert (pan.velocity, pan.acceleration) == pytest.approx((1.5708, 6.2832), abs=1e-4)
    assert config.poses["straight_forward"]["right_arm_shoulder_lift_joint"] == pytest.approx(-1.5708, abs=1e-4)


TURNING = """
body: {urdf: arm.urdf}
buses: {servos: {type: dynamixel}}
actuators: {turn_servo: {bus: servos, model: XL430-W250, id: 1}}
joints: {turn: {actuator: turn_servo, limits: {LIMITS}}}
controllers: {arm_controller: {type: joint_trajectory, joints: [turn]}}
arms: {arm: {joints: [turn], controller: arm_controller, poses: {back: {turn: 180 deg}}}}
"""
TURNING_BODY = """<robot name="arm"><link name="base"/><link name="upper"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint></robot>"""


def test_limits_of_the_robot_end_a_joint_that_turns_without_end_in_its_body(tmp_path: Path) -> None:
    project, files = Project(tmp_path), {"robots/one/arm.urdf": TURNING_BODY}
    for position, limits in (("", (None, None, True)), (", position: [-1 rad, 4 rad]", (-1.0, 4.0, False))):
        project.check(TURNING.replace("LIMITS", f"velocity: 1 rad/s{position}"), files=files)
        assert project.findings == []
        turn = arm_of(project).config.joints["turn"]
        assert (turn.lower, turn.upper, turn.is_continuous) == limits
    limited = project.check(TURNING.replace("LIMITS", "velocity: 1 rad/s, position: [-4 rad, 1 rad]"), files=files)
    assert limited.codes == ["RBX2304"]
    assert "in the pose 'back', 'turn' is at 180 deg, beyond its limits" in limited.text


def test_a_robot_changes_the_arm_of_its_part(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(
        ROBOT + "arms: {right_arm: {planner: {time: 2 s}, poses: {down: {right_arm_elbow_flex_joint: 0 deg}}}}\n"
    )
    assert project.findings == []
    config = arm_of(project).config
    assert config.planner.time == 2.0
    assert set(config.poses) == {"resting", "straight_forward", "ready", "wave", "down"}


def test_a_pose_that_does_not_exist_is_a_finding_of_the_mission(tmp_path: Path) -> None:
    project = Project(tmp_path)
    mission = "rbx: 1\nkind: Mission\nname: go\ndo: {move_right_arm: restng}\n"
    checked = project.check(ROBOT + "missions: {go: ../../go.yaml}\n", files={"go.yaml": mission})
    assert checked.codes == ["RBX4105"] or checked.codes == ["RBX4104"], checked.text
    assert "resting" in checked.text


@pytest.mark.parametrize(
    ("points", "told"),
    [
        ("[{x: 1 cm, via: true}, {yaw: 90 deg}]", ""),
        ("[{y: 1 cm, xx: 1 cm}]", "item 1 of the argument 'points' of 'trace_right_arm' has no entry 'xx'"),
        ("[{x: 1 cm}, {x: 3 deg}]", "'x' of item 2 of the argument 'points' of 'trace_right_arm'"),
        ("{x: 1 cm}", "must be a list"),
        ("[5 cm]", "item 1 of the argument 'points' of 'trace_right_arm' must be a map"),
    ],
)
def test_points_of_a_way_are_checked_one_by_one(points: str, told: str, tmp_path: Path) -> None:
    project = Project(tmp_path)
    mission = f"rbx: 1\nkind: Mission\nname: go\ndo: {{trace_right_arm: {{points: {points}}}}}\n"
    checked = project.check(ROBOT + "missions: {go: ../../go.yaml}\n", files={"go.yaml": mission})
    assert checked.codes == (["RBX4105"] if told else []), checked.text
    assert told in checked.text


@pytest.mark.parametrize(
    ("arms", "mission", "codes"),
    [
        ("{prefer: resting}", "{pitch: 90 deg, any_position: true, prefer: wave}", []),
        ("{}", "{x: 10 m, any_orientation: true, approximate: true}", []),
        ("{prefer: restng}", "{x: 10 cm, any_orientation: true}", ["RBX2357"]),
        ("{}", "{x: 10 cm, any_orientation: true, prefer: restng}", ["RBX4105"]),
        ("{}", "{x: 10 cm, pitch: 90 deg, any_position: true}", ["RBX2358"]),
        ("{}", "{pitch: 90 deg}", ["RBX2359"]),
    ],
)
def test_solutions_may_be_preferred_near_a_pose_and_a_goal_may_be_partial(
    arms: str, mission: str, codes: list[str], tmp_path: Path
) -> None:
    project = Project(tmp_path)
    text = f"rbx: 1\nkind: Mission\nname: go\ndo: {{reach_right_arm: {mission}}}\n"
    robot = ROBOT + f"arms: {{right_arm: {{kinematics: {arms}}}}}\nmissions: {{go: ../../go.yaml}}\nstart: go\n"
    checked = project.check(robot, files={"go.yaml": text})
    assert checked.codes == codes, checked.text
    if "resting" in arms:
        assert arm_of(project).config.kinematics.settings == SolverSettings(60, 5.0, prefer="resting")


def test_both_a_chain_and_joints_are_too_much(tmp_path: Path) -> None:
    project = Project(tmp_path)
    checked = project.check(ROBOT + "arms: {right_arm: {joints: [right_arm_elbow_flex_joint]}}\n")
    assert "either 'chain' or 'joints'" in checked.text


PAIRS = """\
body: "{digest}"
samples: 10
seed: 1
pairs:
- [right_arm_elbow_flex_link, right_arm_elbow_flex_servo_link, adjacent]
- [right_arm_elbow_flex_link, right_arm_wrist_flex_link, user]
- [right_arm_base_link, right_arm_elbow_flex_link, never]
- [right_arm_base_link, right_arm_forearm_flex_link, default]
"""
WITH_PAIRS = ROBOT + "body: {collisions: pairs.yaml}\n"


def digest(project: Project) -> str:
    project.check(ROBOT)
    body = described(project.manifest)
    return digest_of(body.body, body.meshes)


def test_an_arm_gets_the_pairs_of_its_body_by_what_they_mean_for_it(tmp_path: Path) -> None:
    project = Project(tmp_path)
    pairs = PAIRS.format(digest=digest(project))
    project.check(WITH_PAIRS, files={"robots/one/pairs.yaml": pairs})
    assert project.findings == []
    found = arm_of(project).config.pairs
    assert len(found.adjacent) == len(found.ignored) == len(found.unlikely) == 1


@pytest.mark.parametrize("files", [{}, {"robots/one/pairs.yaml": PAIRS.format(digest="0")}], ids=["none", "old"])
def test_pairs_of_another_body_are_told_and_not_used(tmp_path: Path, files: dict[str, str]) -> None:
    project = Project(tmp_path)
    checked = project.check(WITH_PAIRS, files=files)
    assert checked.codes == ["RBX2307"]
    assert "rbxcompose arm setup" in checked.text
    assert arm_of(project).config.pairs is None


def test_a_pair_that_names_no_link_is_told_at_its_line(tmp_path: Path) -> None:
    project = Project(tmp_path)
    pairs = PAIRS.format(digest=digest(project)).replace("right_arm_wrist_flex_link", "right_arm_wrist_link")
    checked = project.check(WITH_PAIRS, files={"robots/one/pairs.yaml": pairs})
    [finding] = checked.compilation.report
    assert finding.span is not None
    assert (Path(finding.span.file).name, finding.span.line) == ("pairs.yaml", 6)


def test_a_part_has_no_pairs_of_its_own(tmp_path: Path) -> None:
    project = Project(tmp_path)
    checked = project.check("include: {arm: {part: ../../parts/arm.yaml}}\n", {"arm": "body: {collisions: p.yaml}\n"})
    assert "collisions" in checked.text


LED = "controller: wrist_controller"
WRIST = """
controllers:
  wrist_controller: {type: joint_trajectory, joints: [right_arm_wrist_flex_joint], start: inactive}
arms:
  wrist: {joints: [right_arm_wrist_flex_joint], controller: wrist_controller}
"""


def group(text: str) -> str:
    return ROBOT + WRIST + "  whole: {" + text + "}\n"


def config_of(project: Project, name: str) -> Any:
    assert project.checked
    return next(instance for instance in project.checked.plan.instances if instance.name == name).config


def test_an_arm_of_other_arms_has_the_joints_of_all_in_the_order_of_the_body(tmp_path: Path) -> None:
    project = Project(tmp_path)
    text = "groups: [upper, wrist], controller: right_arm_controller}\n  upper: {joints: [right_arm_elbow_flex_joint], "
    project.check(group(text + "controller: right_arm_controller"))
    assert project.findings == []
    config = config_of(project, "whole")
    assert list(config.joints) == ["right_arm_elbow_flex_joint", "right_arm_wrist_flex_joint"]
    assert (config.base, config.tip) == ("right_arm_elbow_flex_servo_link", config_of(project, "wrist").tip)


LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
SIDE = f"""<link name="SIDE_upper"/><link name="SIDE_tip"/><link name="SIDE_finger"/>
<joint name="SIDE_turn" type="revolute"><parent link="base"/><child link="SIDE_upper"/><origin xyz="0 AT 0"/>
{LIMIT}</joint><joint name="SIDE_bend" type="revolute"><parent link="SIDE_upper"/><child link="SIDE_tip"/>
<origin xyz="0.4 0 0"/>{LIMIT}</joint><joint name="SIDE_close" type="revolute"><parent link="SIDE_tip"/>
<child link="SIDE_finger"/>{LIMIT}</joint>"""
SIDES = {"left": "0.3", "right": "-0.3"}
TWO_ARMS = """
body: {urdf: two.urdf}
buses: {servos: {type: dynamixel, rate: 50 Hz}}
actuators:
JOINTS
controllers:
  left_arm: {type: joint_trajectory, joints: [left_turn, left_bend]}
  right_arm: {type: joint_trajectory, joints: [right_turn, right_bend]}
  both_arms: {type: joint_trajectory, joints: [left_turn, left_bend, right_turn, right_bend], start: inactive}
  left_hand: {type: gripper, joint: left_close, HAND}
  right_hand: {type: gripper, joint: right_close, HAND}
arms:
  left: {chain: {from: base, to: left_tip}, controller: left_arm}
  right: {chain: {from: base, to: right_tip}, controller: right_arm}
  both: {groups: [FIRST, LAST], controller: both_arms, gripper: LAST_hand, poses: {ahead: {left_turn: 0 deg}}}
trackers: {chase: {arm: both, frame: base, rest: ahead}}
"""


@pytest.mark.parametrize(("first", "last"), [("left", "right"), ("right", "left")])
def test_an_arm_of_two_branches_begins_at_the_first_joint_that_moves_its_tip(
    tmp_path: Path, first: str, last: str
) -> None:
    names = [f"{side}_{joint}" for side in SIDES for joint in ("turn", "bend", "close")]
    servos = [f"  {name}_servo: {{bus: servos, model: XL430-W250, id: {id_}}}" for id_, name in enumerate(names, 1)]
    joints = [f"  {name}: {{actuator: {name}_servo, limits: {{acceleration: 1 rad/s^2}}}}" for name in names]
    hand = "model: one_sided, pad_width: 1 cm, finger_length: 5 cm, opening: [1 cm, 5 cm]"
    robot = TWO_ARMS.replace("JOINTS", "\n".join((*servos, "joints:", *joints))).replace("HAND", hand)
    branches = "".join(SIDE.replace("SIDE", side).replace("AT", at) for side, at in SIDES.items())
    project = Project(tmp_path)
    project.check(
        robot.replace("FIRST", first).replace("LAST", last),
        files={"robots/one/two.urdf": f'<robot name="two"><link name="base"/>{branches}</robot>'},
    )
    assert project.findings == []
    assert set(config_of(project, "both").joints) == {name for name in names if "close" not in name}
    assert (config_of(project, "both").base, config_of(project, "both").tip) == ("base", f"{last}_tip")
    tracker = config_of(project, "chase")
    assert (tracker.shoulder, tracker.length) == ((0.0, float(SIDES[last]), 0.0), 0.4)


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (f"groups: [wrist, more], {LED}}}\n  more: {{groups: [whole], {LED}", "RBX2301", "itself"),
        (f"groups: [wrst], {LED}", "RBX10", "wrst"),
        (f"groups: [right_arm], {LED}", "RBX2302", "does not lead"),
    ],
)
def test_what_is_wrong_with_an_arm_of_other_arms_is_told(tmp_path: Path, text: str, code: str, words: str) -> None:
    checked = Project(tmp_path).check(group(text))
    assert checked.codes
    assert checked.codes[0].startswith(code), checked.text
    assert words in checked.text


def test_an_arm_of_links_has_the_joints_above_them_and_the_last_as_its_tip(tmp_path: Path) -> None:
    project = Project(tmp_path)
    links = "right_arm_elbow_flex_link, right_arm_wrist_flex_link, right_arm_tip"
    project.check(group(f"links: [{links}], controller: right_arm_controller"))
    assert project.findings == []
    config = config_of(project, "whole")
    assert list(config.joints) == ["right_arm_elbow_flex_joint", "right_arm_wrist_flex_joint"]
    assert (config.base, config.tip) == ("right_arm_elbow_flex_servo_link", "right_arm_tip")


@pytest.mark.parametrize("links", ["right_arm_tip", "right_arm_wrist_flex_link, right_arm_elbow_flex_link"])
def test_the_last_link_of_an_arm_is_one_that_it_moves(links: str, tmp_path: Path) -> None:
    checked = Project(tmp_path).check(group(f"links: [{links}], controller: right_arm_controller"))
    assert checked.codes == ["RBX2301"], checked.text


def test_passive_joints_of_a_chain_are_not_moved(tmp_path: Path) -> None:
    project = Project(tmp_path)
    elbow = "right_arm_elbow_flex_joint"
    project.check(ROBOT + f"arms: {{right_arm: {{passive: [{elbow}], poses: !replace {{}}}}}}\n")
    assert project.findings == []
    assert elbow not in arm_of(project).config.joints
    checked = project.check(ROBOT + "arms: {right_arm: {passive: [right_arm_base_joint]}}\n")
    assert checked.codes, checked.text


def test_settings_of_the_searches_reach_the_arm(tmp_path: Path) -> None:
    project = Project(tmp_path)
    settings = "planner: {simplify: false}, kinematics: {restarts: 3, time: 1 s, tolerance: 1 cm}"
    project.check(ROBOT + f"arms: {{right_arm: {{{settings}}}}}\n")
    assert project.findings == []
    config = arm_of(project).config
    assert not config.planner.simplify
    assert config.kinematics.settings == SolverSettings(3, 1.0, 0.01)


@pytest.mark.parametrize(
    ("arm", "cure"),
    [
        (
            "chain: {from: right_elbow_flex_link, to: gripper}",
            "links that move below 'right_elbow_flex_link': right_tip, ",
        ),
        ("chain: {to: right_tp}", "did you mean 'right_tip'?"),
        ("gripper: hand", "add 'hand: {type: gripper, ...}' below 'controllers'"),
        ("gripper: right_controler", "add 'right_controler: {type: gripper, ...}' below 'controllers'"),
        ("controller: hand", "controllers of type joint_trajectory: right_controller"),
    ],
)
def test_a_name_that_is_missing_brings_those_that_could_stand_there(arm: str, cure: str, tmp_path: Path) -> None:
    checked = Project(tmp_path).check(ROBOT.replace("right_arm:", "right:") + f"arms: {{right_arm: {{{arm}}}}}\n")
    (finding,) = checked.compilation.report
    assert (finding.code, finding.help[: len(cure)]) == ("RBX1004", cure)


def test_only_grippers_are_listed_for_a_gripper(tmp_path: Path) -> None:
    text = (HERE / "wrong/gripper_of_another_arm/left_and_right.yaml").read_text(encoding="utf-8")
    checked = check_text(text.replace("gripper: right_gripper_controller", "gripper: hand"), tmp_path)
    (finding,) = checked.compilation.report
    assert (finding.code, finding.help) == ("RBX1004", "controllers of type gripper: right_gripper_controller")

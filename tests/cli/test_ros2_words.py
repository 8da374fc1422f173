"""The table of verbs of ROS 2 beside ours, in `docs/interop.md`: each of ours does something on a robot that is up."""

from __future__ import annotations

import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live_robot import Robot
from tests.conftest import ROOT

PAGE = (ROOT / "docs/interop.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `(ros2 [^`|]++)` \| `rbxcompose ([^`|]++)` \|$", PAGE, re.MULTILINE)
SAID = {  # what each answers, among other things
    "topic list": "/odom",
    "topic list --all": "/go_to/_action/feedback",
    "topic info /odom": "nav_msgs/msg/Odometry",
    "topic show /odom": "nav_msgs/msg/Odometry",
    "topic echo /odom --once": "child_frame_id: base_footprint",
    "topic echo /tf_static --once": "child_frame_id: odom",
    "topic hz /odom --for 1s": "Hz",
    "topic pub /cmd_vel/teleop geometry_msgs/Twist '{}'": "1",
    "topic pub /cmd_vel/teleop geometry_msgs/Twist '{}' --rate 10Hz -n 5": "5",
    "service list": "rbxcompose_msgs/srv/SetBatteryLevel",
    "service call /set_battery_level '{value: 90}'": "",
    "action list": "nav2_msgs/action/NavigateToPose",
    "action send /go_to '{pose: {header: {frame_id: map}}}'": "error_code: 0",
    "param list base": "max_speed",
    "param get base max_speed": "0.5",
    "param describe base max_speed": "speed",
    "param set go_to speed '0.2 m/s'": "0.2",
    "param dump base": "max_speed",
    "msg show nav_msgs/Odometry": "child_frame_id",
    "ps": "base",
    "record -o run --for 1s": "recorded",
    "replay run.mcap --info": "/odom",
}


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base, (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8").partition("\nmissions:")[0])
    up = made.do("up", "-d", str(made.file), "--set", "bus.port=7897")
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_every_row_of_the_table_is_read() -> None:
    assert len(ROWS) == PAGE.count("| `ros2 ")
    assert [ours for _, ours in ROWS] == [*SAID]
    assert {theirs.split()[1] for theirs, _ in ROWS} >= {"topic", "service", "action", "param"}


def test_each_of_our_verbs_does_something(robot: Robot, tmp_path: Path, subtests: pytest.Subtests) -> None:
    for ours, said in SAID.items():
        with subtests.test(ours):
            words = [str(tmp_path / word) if word in ("run", "run.mcap") else word for word in shlex.split(ours)]
            done = robot.do(*words)
            assert done.returncode == 0, done.stderr
            assert said in done.stdout, done.stdout

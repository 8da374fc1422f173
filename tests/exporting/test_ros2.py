"""What is written for ROS 2, checked as far as that goes without it."""

from __future__ import annotations

import sys
from pathlib import Path
from unittest.mock import MagicMock

import pytest
import yaml
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from rbxcompose.commands.main import main
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.msgs.packages import OWN
from rbxcompose.tools.exporting.ros2 import packages

PATH = "systems/patrol_two_hosts.yaml"


@pytest.fixture
def files(repository: Path) -> dict[str, str]:
    return packages([robot.plan for robot in compile_system(PATH, environment={}).robots.values()], "1.2.3")


def test_another_reader_of_messages_understands_ours(files: dict[str, str]) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = {path: text for path, text in files.items() if path.endswith(".msg")}
    assert messages
    for path, text in messages.items():
        package, kind, name = path.removesuffix(".msg").split("/")
        store.register(get_types_from_msg(text, f"{package}/{kind}/{name}"))
    assert {path.split("/")[0] for path in messages} == {OWN}


def test_catkin_accepts_the_packages(files: dict[str, str]) -> None:
    package = pytest.importorskip("catkin_pkg.package", reason="needs catkin_pkg")
    names = [package.parse_package_string(text).name for path, text in files.items() if path.endswith("package.xml")]
    assert names == [OWN, "turtlebot_view"]


def test_the_launch_file_starts_a_viewer_of_our_topics_at_our_router(
    files: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    modules = {
        name: MagicMock()
        for name in (
            "launch",
            "launch.actions",
            "launch.conditions",
            "launch.substitutions",
            "launch_ros",
            "launch_ros.actions",
            "launch_ros.substitutions",
        )
    }
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    space: dict[str, object] = {}
    exec(compile(files["turtlebot_view/launch/view.launch.py"], "view.launch.py", "exec"), space)
    launch = space["generate_launch_description"]
    assert callable(launch)
    launch()
    declared = {call.args[0]: call.kwargs for call in modules["launch.actions"].DeclareLaunchArgument.mock_calls}
    assert declared["router"]["default_value"] == "tcp/127.0.0.1:7447"
    programs = {call.kwargs["package"]: call.kwargs for call in modules["launch_ros.actions"].Node.mock_calls}
    assert programs.keys() == {"rviz2", "foxglove_bridge"}
    assert {"/tf", "/odom", "/diagnostics"} <= {*programs["foxglove_bridge"]["parameters"][0]["topic_whitelist"]}


def test_rviz_shows_each_topic_that_it_can_in_the_frame_that_has_no_parent(files: dict[str, str]) -> None:
    manager = yaml.safe_load(files["turtlebot_view/rviz/turtlebot.rviz"])["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "map"
    topics = [
        display.get("Topic", display.get("Description Topic", {})).get("Value") for display in manager["Displays"]
    ]
    assert topics == [None, None, "/odom", "/robot_description"]
    description = manager["Displays"][-1]["Description Topic"]
    assert description["Durability Policy"] == "Transient Local", "it is sent once"


def test_a_robot_alone_is_exported_too_and_a_broken_one_is_not(repository: Path, tmp_path: Path) -> None:
    assert main(["export", "ros2", "robots/turtlebot", "--out", str(tmp_path / "src")]) == 0
    assert (tmp_path / "src/turtlebot_view/launch/view.launch.py").is_file()
    (tmp_path / "robot.yaml").write_text("rbx: 1\nkind: Robot\nname: none\ncomponents: {base: {type: nothing}}\n")
    assert main(["export", "ros2", str(tmp_path / "robot.yaml"), "--out", str(tmp_path / "other")]) == 1
    assert not (tmp_path / "other").exists()

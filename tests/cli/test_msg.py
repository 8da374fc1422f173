"""Definitions of types on the command line, and as a package for ROS 2."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.main import main
from rbxcompose.commands.messages import message_type
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import parse
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.packages import all_names, package_files, parts_of, whole_text
from rbxcompose.msgs.rbxcompose_msgs import Recharge, SetBatteryLevel
from rbxcompose.runtime.recording.topics import definition_of
from tests.loops import for_all


def test_a_type_is_shown_with_its_hash_and_its_parts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["msg", "show", "nav_msgs/Odometry"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[:2] == ["# nav_msgs/msg/Odometry", f"# {Odometry.HASH}"]
    assert "geometry_msgs/TwistWithCovariance twist" in shown
    assert "MSG: geometry_msgs/Vector3" in shown


def test_services_and_actions_are_shown_too(capsys: pytest.CaptureFixture[str]) -> None:
    for wanted, type_hash in (
        ("rbxcompose_msgs/srv/SetBatteryLevel", SetBatteryLevel.HASH),
        ("rbxcompose_msgs/Recharge", Recharge.HASH),
    ):
        assert main(["msg", "show", wanted, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["hash"] == type_hash


def test_a_type_that_is_misspelt_is_told_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["msg", "show", "nav_msgs/Odometri"]) == 1
    assert "did you mean 'nav_msgs/Odometry'?" in capsys.readouterr().err


@for_all("name", all_names())
def test_each_part_of_a_type_is_shown_once_in_a_form_that_can_be_read(name: str) -> None:
    _, *rest = whole_text(name).split("=" * 80 + "\n")
    heads = [one.partition("\n")[0] for one in rest]
    assert heads == [f"MSG: {part.replace('/msg/', '/')}" for part in parts_of(name)]
    assert len(set(heads)) == len(heads)
    for part, text in zip(parts_of(name), rest, strict=True):
        parse(part, text.partition("\n")[2])


def test_the_package_has_the_texts_as_they_are_and_names_all_of_them(tmp_path: Path) -> None:
    assert main(["msg", "export", str(tmp_path)]) == 0
    folder = tmp_path / "rbxcompose_msgs"
    written = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    own = {
        "action/FindObjects.action",
        "action/DockAt.action",
        "action/FollowPerson.action",
        "action/FollowTag.action",
        "action/FollowPoint.action",
        "action/Localise.action",
        "action/Grip.action",
        "action/LookAtPoint.action",
        "action/MoveArm.action",
        "action/PickObject.action",
        "action/PlaceObject.action",
        "action/ReachPose.action",
        "action/TraceArm.action",
        "msg/JointRange.msg",
        "msg/PathConstraints.msg",
        "msg/Sight.msg",
        "msg/TipPoint.msg",
        "msg/Switches.msg",
        "msg/World.msg",
        "msg/WorldHole.msg",
        "msg/WorldHull.msg",
        "msg/WorldLight.msg",
        "msg/WorldRobots.msg",
        "msg/WorldShape.msg",
        "msg/WorldTag.msg",
        "msg/SceneObject.msg",
        "msg/SceneObjects.msg",
        "msg/SceneShape.msg",
        "action/MoveJoints.action",
        "action/BackUp.action",
        "action/Recharge.action",
        "action/RunMission.action",
        "action/Say.action",
        "srv/AttachObject.srv",
        "srv/DetachObject.srv",
        "srv/LocateArm.srv",
        "srv/SetBatteryLevel.srv",
        "srv/SetSpeed.srv",
    }
    assert written == {"package.xml", "CMakeLists.txt", *own}
    cmake = (folder / "CMakeLists.txt").read_text()
    assert all(f'"{name}"' in cmake for name in own)
    root = ElementTree.fromstring((folder / "package.xml").read_text())
    assert root.findtext("name") == "rbxcompose_msgs"
    needed = ["action_msgs", "builtin_interfaces", "geometry_msgs", "nav_msgs", "std_msgs"]
    assert [one.text for one in root.iter("depend")] == needed


def test_an_export_overwrites_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["msg", "export", str(tmp_path)])
    assert main(["msg", "export", str(tmp_path)]) == 1
    assert "already exists" in capsys.readouterr().err


def test_a_package_names_the_packages_that_its_types_are_made_of() -> None:
    files = package_files("nav_msgs", "1.0", "Apache-2.0")
    assert "DEPENDENCIES builtin_interfaces geometry_msgs std_msgs\n" in files["CMakeLists.txt"]
    assert "find_package(geometry_msgs REQUIRED)\n" in files["CMakeLists.txt"]
    assert "<depend>geometry_msgs</depend>" in files["package.xml"]


@for_all("name", [name for name in all_names() if "/msg/" in name])
def test_a_recording_has_the_same_text_of_a_message(name: str) -> None:
    assert definition_of(name) == whole_text(name)


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the folder of a robot with a type of its own, which is the current one."""
    monkeypatch.chdir(tmp_path)
    assert main(["msg", "new", "my_msgs/Grasp"]) == 0
    Path("robot.yaml").write_text("rbx: 1\nkind: Robot\nname: one\nmsgs: {own: msgs}\ncomponents: {}\n")
    yield tmp_path
    registry.choose({})


def test_types_are_listed_those_of_the_robot_first(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["msg", "ls", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert listed[0] == {"type": "my_msgs/msg/Grasp", "own": True}
    assert {"type": "geometry_msgs/msg/Twist", "own": False} in listed
    assert main(["msg", "ls", str(robot)]) == 0
    assert "my_msgs/msg/Grasp" in capsys.readouterr().out


def test_a_type_of_the_robot_is_shown(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["my_msgs/Grasp"], ["my_msgs/msg/Grasp", str(robot)]):
        assert main(["msg", "show", *words]) == 0
        assert "\nfloat64 width  # [m]\n" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["my_msgs/Foo", "my_msgs/msg/Foo", "my_msgs/srv/Foo", "my_msgs/action/Foo"])
def test_a_new_type_can_be_used_at_once(robot: Path, name: str) -> None:
    assert main(["msg", "new", name]) == 0
    assert main(["check", "robot.yaml"]) == 0
    kind = name.split("/")[1] if name.count("/") == 2 else "msg"
    assert f"my_msgs/{kind}/Foo" in registry.chosen().texts


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Foo", "no name of a type"),
        ("my_msgs/foo", "a capital letter"),
        ("My/Foo", "small letters"),
        ("my_msgs/what/Foo", "no name of a type"),
        ("poses/Foo", "is ours"),
        ("my_msgs/msg/a/Foo", "no name of a type"),
        ("class/Foo", "a package cannot be named 'class', a word of Python"),
        ("my_msgs/srv/None", "a type cannot be named 'None', a word of Python"),
        ("std_msgs/String", "'std_msgs/String' is a standard type"),
        ("std_srvs/srv/SetBool", "'std_srvs/srv/SetBool' is a standard type"),
    ],
)
def test_a_name_that_no_type_can_have_is_refused(
    robot: Path, name: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(robot.rglob("*"))
    assert main(["msg", "new", name]) == 1
    told = capsys.readouterr().err
    assert ("RBX9102" in told, said in told) == (True, True)
    assert sorted(robot.rglob("*")) == before


def test_an_existing_type_is_not_overwritten(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["msg", "new", "my_msgs/Grasp"]) == 1
    assert "already exists" in capsys.readouterr().err


def test_types_of_the_robot_in_this_folder_are_known_on_a_bus_of_others(
    robot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    registry.choose({})
    assert message_type("my_msgs/Grasp")().width == 0.0  # type: ignore[attr-defined]
    with pytest.raises(NotDoneError, match="unknown type 'my_msgs/msg/Grsp'"):
        message_type("my_msgs/Grsp")
    registry.choose({})
    (robot / "elsewhere").mkdir()
    monkeypatch.chdir(robot / "elsewhere")
    with pytest.raises(NotDoneError, match="unknown type"):
        message_type("my_msgs/Grasp")


def test_stubs_tell_a_type_checker_what_a_type_has(robot: Path) -> None:
    assert main(["msg", "stubs"]) == 0
    text = (robot / "typings/rbxcompose/msgs/my_msgs.pyi").read_text()
    assert "class Grasp(Message):" in text
    assert "    width: float = 0.0  # [m]\n" in text
    compile(text, "my_msgs.pyi", "exec")


def test_stubs_of_a_robot_without_types_of_its_own_are_refused(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("robot.yaml").write_text("rbx: 1\nkind: Robot\nname: one\ncomponents: {}\n")
    assert main(["msg", "stubs"]) == 1
    assert "RBX9049" in capsys.readouterr().err


def test_packages_of_the_robot_are_exported_too(robot: Path) -> None:
    assert main(["msg", "export", "src", "robot.yaml"]) == 0
    assert {path.name for path in (robot / "src").iterdir()} == {"rbxcompose_msgs", "my_msgs"}
    assert (
        '"msg/Grasp.msg"\n  DEPENDENCIES builtin_interfaces std_msgs'
        in (robot / "src/my_msgs/CMakeLists.txt").read_text()
    )
    assert (robot / "src/my_msgs/msg/Grasp.msg").read_text() == (robot / "msgs/my_msgs/msg/Grasp.msg").read_text()


MISTAKES = [("msgs: {own: msgs}", "flaot64 width\nuint8 n\n", "RBX3026"), ("msgs: {own: msg}", "uint8 n\n", "RBX1301")]


@pytest.mark.parametrize(("section", "text", "code"), MISTAKES)
def test_what_is_left_of_types_with_mistakes_is_neither_shown_nor_written(
    robot: Path, section: str, text: str, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (robot / "msgs/my_msgs/msg/Grasp.msg").write_text(text)
    Path("robot.yaml").write_text(f"rbx: 1\nkind: Robot\nname: one\n{section}\ncomponents: {{}}\n")
    for words in (["show", "my_msgs/Grasp"], ["stubs"], ["export", "src", "robot.yaml"]):
        assert main(["msg", *words]) == 1
        assert code in capsys.readouterr().err
    assert {path.name for path in robot.iterdir()} == {"msgs", "robot.yaml"}


def test_other_mistakes_of_the_robot_hide_no_type(robot: Path) -> None:
    Path("robot.yaml").write_text("rbx: 1\nkind: Robot\nname: one\nmsgs: {own: msgs}\ncomponents: {a: {type: b}}\n")
    assert main(["msg", "export", "src", "robot.yaml"]) == 0


def test_a_robot_that_cannot_be_read_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["msg", "ls", str(tmp_path / "robot.yaml")]) == 1
    assert "RBX1301" in capsys.readouterr().err

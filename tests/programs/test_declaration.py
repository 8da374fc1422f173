"""What a manifest declares for a program: read into ports and capabilities, and checked like any other's."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from rbxcompose.domains.programs.components.program import ProgramConfig, ProgramRunner, ReadyModel
from rbxcompose.domains.programs.declaration import DeclaredPorts, port_name
from rbxcompose.sdk.capabilities import Drives, RunsProgram
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Qos, Serves, ServesAction
from rbxcompose.testing.manifests import check_text
from tests.programs.foreign import PATROL, base, patrol, robot

Check = Callable[..., str]


@pytest.fixture
def check(tmp_path: Path) -> Check:
    """Return what is found in a robot with one program, and the text at its place."""

    def found(**config: Any) -> str:
        settings = {"type": "program", "command": ["./x"], **config}
        checked = check_text(robot("one", components={"p": settings}), tmp_path)
        return "\n".join(
            f"{one.message} ({one.help})" if one.help else one.message for one in checked.compilation.report
        )

    return found


def test_ports_are_those_of_the_topics_with_their_types_and_classes() -> None:
    config = ProgramConfig(
        command=("./x",),
        publishes={"a/image": "sensor_msgs/Image", "odom": {"type": "nav_msgs/Odometry", "rate": 20.0}},
        subscribes={"cmd_vel": "geometry_msgs/Twist", "map": {"type": "nav_msgs/OccupancyGrid", "qos": "latched"}},
        serves={"reset": "std_srvs/Trigger"},
        calls={"ask": "std_srvs/Trigger"},
        serves_actions={"wave": {"type": "rbxcompose_msgs/MoveArm", "claims": "arm"}},
        calls_actions={"go": "nav2_msgs/NavigateToPose"},
    )
    ports = ProgramRunner.ports(config)
    assert {name: (type(port), port.topic) for name, port in ports.items()} == {
        "a_image": (Out, "a/image"),
        "odom": (Out, "odom"),
        "cmd_vel": (In, "cmd_vel"),
        "map": (In, "map"),
        "reset": (Serves, "reset"),
        "ask": (Calls, "ask"),
        "wave": (ServesAction, "wave"),
        "go": (CallsAction, "go"),
    }
    assert all(port.is_elsewhere for port in ports.values())
    classes = {name: port.qos for name, port in ports.items() if isinstance(port, Out | In)}
    assert classes == {"a_image": Qos.BULK, "odom": Qos.STATE, "cmd_vel": Qos.COMMAND, "map": Qos.LATCHED}


def test_a_topic_that_is_published_and_subscribed_to_has_two_ports() -> None:
    both = DeclaredPorts(publishes={"/tf": "tf2_msgs/TFMessage"}, subscribes={"/tf": "tf2_msgs/TFMessage"})
    assert {name: type(port) for name, port in both.ports().items()} == {"tf": Out, "tf_in": In}


TOPICS = st.lists(st.from_regex(r"/?[a-c](/[a-c]|_[a-c]){0,2}", fullmatch=True), max_size=4, unique=True)


@given(publishes=TOPICS, subscribes=TOPICS, serves=TOPICS)
def test_either_each_declared_topic_has_a_port_of_its_own_or_it_is_refused(
    publishes: list[str], subscribes: list[str], serves: list[str]
) -> None:
    message = "std_msgs/String"
    try:
        declared = DeclaredPorts(
            publishes=dict.fromkeys(publishes, message),
            subscribes=dict.fromkeys(subscribes, message),
            serves=dict.fromkeys(serves, "std_srvs/Trigger"),
        )
    except ValidationError:
        names = [*map(port_name, publishes), *map(port_name, serves)]
        names += [f"{port_name(topic)}_in" if topic in publishes else port_name(topic) for topic in subscribes]
        assert len(set(names)) < len(names)
    else:
        assert len(declared.ports()) == len(publishes) + len(subscribes) + len(serves)


def test_capabilities_are_those_of_any_other_base() -> None:
    config = ProgramConfig(
        command=("./x",), **{key: base()[key] for key in ("subscribes", "publishes", "capabilities")}
    )
    found = {type(one): one for one in ProgramRunner.capabilities(config)}
    drives, runs = found[Drives], found[RunsProgram]
    assert isinstance(drives, Drives)
    assert isinstance(runs, RunsProgram)
    assert (drives.commands, drives.odometry) == ("cmd_vel", "odom")
    assert drives.stops_after is not None
    assert (drives.stops_after.value, drives.stops_after.field) == (0.5, "capabilities.drives.stops_after")
    assert runs.command.value == ("./x",)


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (
            {"publishes": {"a/b": "std_msgs/String", "a_b": "std_msgs/String"}},
            "'publishes': 'a/b' and 'a_b' would be the same port, 'a_b': rename one",
        ),
        (
            {"publishes": {"odom": "nav_msgs/Odometry"}, "ready": {"topic": "odm"}},
            "'ready': it waits for the topic 'odm', which 'publishes' does not have (did you mean 'odom'?)",
        ),
        (
            {"publishes": {"charge": "std_msgs/Float32"}, "capabilities": {"drains": {"level": "charg"}}},
            "'capabilities': 'drains.level' names the port 'charg', which 'publishes' does not have"
            " (did you mean 'charge'?)",
        ),
        (
            {"capabilities": {"frames": {"base": "odom"}}},
            "'capabilities': it places frames, so 'publishes' needs '/tf: tf2_msgs/msg/TFMessage'",
        ),
        (
            {"command": "./x --name 'a b'"},
            """'command': a command is a list of words (no shell reads it; write its words: [./x, --name, "a b"])""",
        ),
        (
            {"command": "./x | tee log"},
            """'command': a command is a list of words (only a shell reads that: [sh, -c, "./x | tee log"])""",
        ),
        ({"command": [""]}, "'command': a command begins with an executable (such as [./program])"),
        (
            {"environment": {"B=C": "x"}},
            "'B=C' is not a valid name (a variable's name has one character or more, and no '=')",
        ),
        (
            {"environment": {"ROS_DOMAIN_ID": "33"}},
            "'ROS_DOMAIN_ID' is not a valid name"
            " (the robot sets it: remove it; the domain of all is 'bus: {domain: 7}')",
        ),
        (
            {"secrets": {"RBXCOMPOSE_KEY_ODOM": "x"}},
            "'RBXCOMPOSE_KEY_ODOM' is not a valid name"
            " (the robot sets it: remove it; the domain of all is 'bus: {domain: 7}')",
        ),
        (
            {"ready": {"output": "a("}},
            "'output': is not a regular expression: missing ), unterminated subpattern at position 1",
        ),
        ({"ready": {"output": "a", "ended": True}}, "'ready': needs one of 'topic', 'output', 'token' and 'ended'"),
        (
            {"publishes": {"odom": "nav_msgs/Odometri"}},
            "'odom': there is no message type 'nav_msgs/Odometri' (did you mean 'nav_msgs/msg/Odometry'?)",
        ),
        (
            {"serves": {"reset": "std_srvs/Triger"}},
            "'reset': there is no service type 'std_srvs/Triger' (did you mean 'std_srvs/srv/Trigger'?)",
        ),
        (
            {"calls": {"reset": "Trigger"}},
            "'reset': there is no service type 'Trigger' (write it with its package: 'std_srvs/srv/Trigger')",
        ),
        (
            {"calls_actions": {"go": "nav2_msgs/NavigateToPos"}},
            "'go': there is no action type 'nav2_msgs/NavigateToPos' (did you mean 'nav2_msgs/action/NavigateToPose'?)",
        ),
    ],
    ids=lambda value: "" if isinstance(value, str) else "_".join(value),
)
def test_a_mistake_is_one_finding_that_says_what_to_write(check: Check, config: dict[str, Any], words: str) -> None:
    assert check(**config) == words


def test_nothing_follows_from_a_mistake(check: Check) -> None:
    found = check(
        publishes={"odom": "nav_msgs/Odometri"}, ready={"topic": "odm"}, capabilities={"drains": {"level": "charge"}}
    )
    assert found == "'odom': there is no message type 'nav_msgs/Odometri' (did you mean 'nav_msgs/msg/Odometry'?)"


def test_ready_is_one_thing() -> None:
    for settings in ({}, {"topic": "a", "token": "b"}):
        with pytest.raises(ValidationError):
            ReadyModel(**settings)


def test_a_robot_with_a_base_that_is_a_program_is_fine(tmp_path: Path) -> None:
    checked = check_text(patrol("foreign"), tmp_path, others={"patrol.yaml": PATROL})
    assert checked.text == ""


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"subscribes": {"cmd_vel": "geometry_msgs/TwistStamped"}}, "RBX3107"),
        ({"subscribes": {"cmd_vl": "geometry_msgs/Twist"}}, "RBX1004"),
        ({"publishes": {"odom": "nav_msgs/Path", "/tf": "tf2_msgs/TFMessage"}}, "instead of nav_msgs/msg/Odometry"),
        ({"publishes": {"odometry": "nav_msgs/Odometry", "/tf": "tf2_msgs/TFMessage"}}, "did you mean 'odometry'?"),
        ({"subscribes": {"cmd_vl": "geometry_msgs/Twist"}, "capabilities": {}}, "RBX3011"),
    ],
    ids=[
        "another type of velocities",
        "a typo in the velocities of a base",
        "another type of odometry",
        "a typo in the odometry of a base",
        "a typo in a topic",
    ],
)
def test_a_port_that_does_not_fit_the_others_is_found(tmp_path: Path, changes: dict[str, Any], code: str) -> None:
    checked = check_text(patrol("foreign", **changes), tmp_path, others={"patrol.yaml": PATROL})
    assert code in checked.text

"""What others read of a recording of the patrol: rosbags all messages with their types, Rerun as its entities."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from rbxcompose.runtime.recording.files import RecordingWriter
from rbxcompose.runtime.recording.reader import RecordingReader
from tests.forked import run_command
from tests.shipped import ROOT

SHORT = "--set=missions.patrol.with.rounds=1", "--set=components.battery.runtime=30s"  # it recharges all the same
pytestmark = pytest.mark.timeout(100)


@pytest.fixture(scope="module")
def tape(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A stepped run of the patrol as `up --record` keeps it, events of services included."""
    folder = tmp_path_factory.mktemp("tape")
    path = folder / "patrol.mcap"
    # In a process of its own: a robot forks, and this one may have had sessions of Zenoh, whose threads forbid that.
    up = ("up", str(ROOT / "robots/turtlebot"), "--rate", "max", "--record", str(path), *SHORT)
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    run_command(up, environment, 60.0).check_returncode()
    return path


@pytest.fixture(scope="module")
def patrol(tape: Path) -> Path:
    """The topics of the robot alone, as `record` keeps them."""
    path = tape.with_name("topics.mcap")
    with tape.open("rb") as read, path.open("wb") as written:
        writer = RecordingWriter(written)
        for message in RecordingReader(read).messages():
            if not message.topic.name.endswith("/_service_event"):
                writer.add(message)
        writer.finish()
    return path


def counted(path: Path) -> Counter[tuple[str, str]]:
    """The number of messages of each topic and type, as we read them."""
    with path.open("rb") as file:
        return Counter((message.topic.name, message.topic.type) for message in RecordingReader(file).messages())


@pytest.mark.soak
def test_rosbags_reads_every_message_with_its_type(patrol: Path) -> None:
    highlevel = pytest.importorskip("rosbags.highlevel", reason="needs rosbags")
    found: Counter[tuple[str, str]] = Counter()
    with highlevel.AnyReader([patrol]) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            assert message.__msgtype__ == connection.msgtype
            found[connection.topic, connection.msgtype] += 1
    assert found == counted(patrol)
    assert {"/odom", "/tf", "/go_to/_action/feedback", "/diagnostics_agg"} <= {topic for topic, _ in found}


def test_rosbags_reads_events_of_actions_but_has_no_name_for_those_of_services(tape: Path) -> None:
    highlevel = pytest.importorskip("rosbags.highlevel", reason="needs rosbags")
    with highlevel.AnyReader([tape]) as reader:
        unknown = set()
        for connection, _, data in reader.messages():
            try:
                reader.deserialize(data, connection.msgtype)
            except KeyError:
                unknown.add(connection.msgtype)
    # ROS 2 calls them so, too; rosbags reads `package/srv/Name` as `package/srv/msg/Name`.
    assert unknown == {"action_msgs/srv/CancelGoal_Event", "rbxcompose_msgs/srv/SetBatteryLevel_Event"}


@pytest.fixture
def rerun(tmp_path: Path) -> list[str]:
    """The command of Rerun, in a home of its own, in which it tells nobody what it is used for."""
    here = str(Path(sys.executable).parent)  # of the environment that runs the tests, even if that is not active
    if (program := shutil.which("rerun", path=f"{here}{os.pathsep}{os.environ.get('PATH', '')}")) is None:
        pytest.skip("rerun is not installed: pip install rerun-sdk")
    words = ["env", f"HOME={tmp_path}", f"XDG_CONFIG_HOME={tmp_path}/config", program]
    subprocess.run([*words, "analytics", "disable"], capture_output=True, timeout=30, check=True)
    return words


def test_rerun_loads_each_topic_with_the_frames_and_the_body(patrol: Path, rerun: list[str], tmp_path: Path) -> None:
    made = tmp_path / "patrol.rrd"
    words = [*rerun, "mcap", "convert", str(patrol), "-o", str(made)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert "ERROR" not in done.stderr
    stats = subprocess.run([*rerun, "rrd", "stats", str(made)], capture_output=True, text=True, timeout=60, check=True)
    lines = stats.stdout.splitlines()
    entities = {line.partition(":")[0] for line in lines if line.startswith("/")}
    assert {topic for topic, _ in counted(patrol)} <= entities
    components = {line.partition(": ")[0] for line in lines}
    assert {"Transform3D:translation", "nav_msgs.msg.Odometry:message", "std_msgs.msg.Float32:message"} <= components
    assert any(entity.startswith("/turtlebot/visual_geometries/") for entity in entities), "the body is drawn"


@pytest.mark.soak
def test_rerun_loads_a_tape_too(tape: Path, rerun: list[str], tmp_path: Path) -> None:
    words = [*rerun, "mcap", "convert", str(tape), "-o", str(tmp_path / "tape.rrd")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert "/set_battery_level/_service_event" in done.stderr

"""A component of a recorded run, run again: it sends the same, or the first difference is told."""

from __future__ import annotations

import io
import json
import os
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from rosbags.highlevel import AnyReader

from rbxcompose.base.config import Secret
from rbxcompose.base.requests import as_data
from rbxcompose.commands import main as command
from rbxcompose.commands.console import NotDoneError
from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.missions.execution.requests import CancelMission
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.std_msgs import String
from rbxcompose.runtime.recording.files import RecordingWriter, recover
from rbxcompose.runtime.recording.reader import RecordingReader
from rbxcompose.runtime.recording.tape import ORDERS, PLAN
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic
from rbxcompose.runtime.replay import ReplayResult, missing_topics, replayed
from rbxcompose.testing import instance
from rbxcompose.tools.commands.replay import instance_of
from tests.forked import run_command
from tests.soak import rare

ROOT = Path(__file__).parents[2]
ROUND = (
    "--set=missions.patrol.with.rounds=1",  # half as long as it is
    *(f"--set=places.corner_{place}=40 cm" for place in ("1.x", "2.x", "2.y", "3.y")),
)
COMPONENTS = ["base", "go_to", "mission", *rare("battery", "charger", "cmd_vel", "transforms", "diagnostics")]


@dataclass(frozen=True)
class Recording:
    """A stepped run of the patrol robot as `up --record` keeps it."""

    path: Path
    plan: Plan
    records: list[Recorded]
    topics: list[RecordedTopic]

    def instance(self, name: str) -> Instance:
        return next(instance for instance in self.plan.instances if instance.name == name)

    def again(self, name: str, records: list[Recorded] | None = None) -> ReplayResult:
        return replayed(self.plan, self.instance(name), self.records if records is None else records)

    def write(self, path: Path, records: list[Recorded]) -> Path:
        """Write a recording of the same robot with other records."""
        with path.open("wb") as file:
            writer = RecordingWriter(file)
            writer.attach(PLAN, read(self.path).attachments[PLAN])
            for record in records:
                writer.add(record)
            writer.finish()
        return path


def read(path: Path) -> RecordingReader:
    reader = RecordingReader(io.BytesIO(path.read_bytes()))
    list(reader.messages())
    return reader


def said(capsys: pytest.CaptureFixture[str]) -> str:
    """Return what was written to both streams."""
    return "".join(capsys.readouterr())


def recorded(folder: Path, robot: Path, *options: str) -> Recording:
    path = folder / "run.mcap"
    # In a process of its own: a robot forks, and this one may have had sessions of Zenoh, whose threads forbid that.
    up = ("up", str(robot), "--rate", "max", "--record", str(path), *options)
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    run_command(up, environment, 60.0).check_returncode()
    reader = RecordingReader(io.BytesIO(path.read_bytes()))
    records = list(reader.messages())
    assert reader.damage == ""
    return Recording(path, load(reader.attachments[PLAN].decode()), records, list(reader.topics))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return recorded(tmp_path_factory.mktemp("run"), ROOT / "robots/turtlebot", *ROUND)


AWAY = "{rbx: 1, kind: Mission, name: away, do: [{recharge: , optional: true}, {wait: 1 s}]}\n"


def test_a_goal_is_refused_again_for_the_same_reason(tmp_path: Path) -> None:
    for folder in ("robots/turtlebot", "missions"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    (tmp_path / "missions/away.yaml").write_text(AWAY, encoding="utf-8")
    overlay = tmp_path / "overlay.yaml"
    overlay.write_text(
        "{rbx: 1, kind: Overlay, name: away, missions: {away: missions/away.yaml}, start: away}\n", encoding="utf-8"
    )
    run = recorded(tmp_path, tmp_path / "robots/turtlebot", "-f", str(overlay))
    assert any(b"the robot's position is unknown" in record.payload for record in run.records)
    assert [run.again(name).difference for name in ("mission", "charger")] == [None, None]


@pytest.mark.parametrize("name", COMPONENTS)
def test_a_component_sends_again_what_it_sent(recording: Recording, name: str) -> None:
    assert missing_topics(recording.plan, recording.instance(name), recording.topics) == []
    found = recording.again(name)
    assert (found.difference, found.errors) == (None, ())
    assert found.equal == len([record for record in recording.records if record.topic.node == name]) > 0


def test_another_speed_is_told_with_time_field_and_both_values(
    recording: Recording, capsys: pytest.CaptureFixture[str]
) -> None:
    other = ["--robot", str(ROOT / "robots/turtlebot"), "--set", "args.speed=0.2"]
    assert command.main(["replay", str(recording.path), "--into", "go_to", *other]) == 1
    out = said(capsys)
    assert "RBX9209" in out
    assert "differs at 0.050 s on /cmd_vel/navigation, field 'linear.x': recorded 0.3, now 0.2" in out


def test_the_command_tells_that_nothing_differs(recording: Recording, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["replay", str(recording.path), "--into", "battery", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["component"], told["difference"], told["damage"]) == ("battery", None, "")
    assert told["equal"] > 0


def test_only_a_recording_lacks_a_secret() -> None:
    configuration = {"command": ["true"], "secrets": {"TOKEN": Secret("abc")}}
    plan = Plan("one", "one.yaml", (instance("uploader", "program", configuration),))
    assert instance_of(plan, "uploader") == plan.instances[0]
    with pytest.raises(NotDoneError, match="'uploader' has a secret, which a recording does not hold"):
        instance_of(load(dump(plan)), "uploader")


def test_what_it_sends_now_can_be_kept(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "new.mcap"
    other = ["--robot", str(ROOT / "robots/turtlebot"), "--set", "args.speed=0.2", "--write", str(path)]
    assert command.main(["replay", str(recording.path), "--into", "go_to", *other]) == 1
    kept = list(RecordingReader(io.BytesIO(path.read_bytes())).messages())
    assert kept[-1].log_time > 10e9  # it goes on behind the difference
    assert {message.topic.node for message in kept} == {"go_to"}


def test_an_output_that_is_too_few_or_too_many_is_told(recording: Recording) -> None:
    mine = [number for number, record in enumerate(recording.records) if record.topic.node == "cmd_vel"]
    fewer = [record for number, record in enumerate(recording.records) if number != mine[-1]]
    again = recording.again("cmd_vel", fewer).difference
    assert again
    assert "message" in again.now or again.now.startswith("at ")
    twice = sorted([*recording.records, recording.records[mine[-1]]], key=lambda record: record.log_time)
    again = recording.again("cmd_vel", twice).difference
    assert again
    assert again.now == "nothing"


def commanded(recording: Recording, data: object) -> ReplayResult:
    """Run the missions again as if a command had come right after the start."""
    orders = [number for number, record in enumerate(recording.records) if record.topic.name == ORDERS]
    start = next(number for number in orders if b'"start"' in recording.records[number].payload)
    payload = encode(String(data=json.dumps(["command", "mission", data])))
    records = list(recording.records)
    records.insert(start + 1, replace(records[start], payload=payload))
    return recording.again("mission", records)


def test_a_recorded_command_is_given_again(recording: Recording) -> None:
    found = commanded(recording, as_data(CancelMission()))
    assert found.errors == ()
    assert found.difference  # it was not given then


def test_a_command_that_another_version_recorded_is_told(recording: Recording) -> None:
    found = commanded(recording, "cancel")
    told = "a recorded command cannot be given again: the request cannot be read: '' is not known here"
    assert (found.difference, found.errors) == (None, (f"mission: {told}",))


def test_without_an_input_the_first_output_that_needs_it_differs(recording: Recording) -> None:
    without = [record for record in recording.records if record.topic.name != "/cmd_vel/navigation"]
    assert recording.again("cmd_vel", without).difference


def test_a_recording_that_was_cut_is_compared_up_to_there(recording: Recording) -> None:
    half = recording.records[: len(recording.records) // 2]
    found = recording.again("go_to", half)
    assert found.difference is None
    assert 0 < found.equal < recording.again("go_to").equal


@pytest.mark.parametrize(("kept", "code"), [(0.5, 0), (0.001, 1)])
def test_a_recording_that_was_cut_is_told_as_damaged(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str], kept: float, code: int
) -> None:
    whole = recording.path.read_bytes()
    (cut := tmp_path / "cut.mcap").write_bytes(whole[: int(kept * len(whole))])
    assert command.main(["replay", str(cut), "--into", "battery", "--json"]) == code
    shown = capsys.readouterr()
    assert "warning[RBX9202]" in shown.err
    assert ("lacks the robot's plan, since it is damaged" in shown.err) == (code == 1)
    assert code == 1 or json.loads(shown.out)["damage"] == "it ends in the middle"


def test_inputs_that_are_not_in_the_recording_are_named(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    without = [record for record in recording.records if record.topic.name not in ("/tf", "/tf_static")]
    path = recording.write(tmp_path / "less.mcap", without)
    assert command.main(["replay", str(path), "--into", "go_to"]) == 1
    assert "lacks inputs of 'go_to': /tf, /tf_static" in said(capsys)


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--into", "goto"], 1, "did you mean 'go_to'?"),
        (["--write", "x.mcap"], 2, "--write needs --into"),
        (["--into", "go_to", "--set", "args.speed=0.2"], 2, "need --into and --robot PATH"),
    ],
)
def test_what_cannot_be_is_told(
    recording: Recording, capsys: pytest.CaptureFixture[str], words: list[str], code: int, told: str
) -> None:
    assert command.main(["replay", str(recording.path), *words]) == code
    assert told in said(capsys)


def test_a_recording_from_outside_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with (tmp_path / "a.mcap").open("wb") as file:
        RecordingWriter(file).finish()
    assert command.main(["replay", str(tmp_path / "a.mcap"), "--into", "go_to"]) == 1
    assert "was not recorded within a stepped run" in said(capsys)


def test_recovery_keeps_the_plan_and_the_silent_topics(recording: Recording) -> None:
    whole = io.BytesIO()
    recover(io.BytesIO(recording.path.read_bytes()[:-2000]), whole)
    reader = RecordingReader(io.BytesIO(whole.getvalue()))
    records = list(reader.messages())
    assert PLAN in reader.attachments
    assert {topic.name for topic in reader.topics} >= {"/cmd_vel/navigation", "/tf_static"}
    assert recording.again("diagnostics", records).difference is None


def test_an_independent_reader_of_ros_bags_opens_it_with_the_events_of_services(recording: Recording) -> None:
    with AnyReader([recording.path]) as reader:
        [events] = [
            connection
            for connection in reader.connections
            if connection.topic == "/go_to/_action/send_goal/_service_event"
        ][:1]
        first: Any = next(reader.deserialize(raw, one.msgtype) for one, _, raw in reader.messages([events]))
    assert events.msgtype == "nav2_msgs/action/NavigateToPose_SendGoal_Event"
    assert (len(first.request), len(first.response)) in ((1, 0), (0, 1))


def test_a_field_in_a_list_is_named_by_its_place(recording: Recording) -> None:
    number, record = next((n, one) for n, one in enumerate(recording.records) if one.topic.node == "diagnostics")
    changed = replace(record, payload=record.payload.replace(b"OK", b"KO", 1))
    if changed == record:
        changed = replace(record, payload=record.payload.replace(b"motion", b"notion", 1))
    found = recording.again("diagnostics", [*recording.records[:number], changed, *recording.records[number + 1 :]])
    assert found.difference
    assert found.difference.field.startswith("status[")

"""`record` and `replay`: on a bus, on a robot that is up, killed in the middle, and with files that are no good."""

from __future__ import annotations

import io
import json
import os
import re
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from pathlib import Path

import pytest
from mcap.reader import SeekingReader, make_reader

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_router
from rbxcompose.commands import main as command
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.runtime.processes import titled
from rbxcompose.runtime.recording.reader import RecordingReader
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic
from rbxcompose.sdk.ports import Qos
from rbxcompose.tools.commands.record import Tap
from tests.commands import command as at_once
from tests.forked import RBXCOMPOSE, Forked, run_command
from tests.loops import for_all
from tests.recording.samples import recorded, some, unfinished, written
from tests.recording.samples import topic as recorded_topic

ROOT = Path(__file__).parents[2]
PATIENCE = 20.0  # [s]
NAME = "recorded_bot"
MESSAGES = some(10)


class Shell:
    """Starts commands in a folder of their own."""

    def __init__(self, folder: Path, runtime: Path) -> None:
        self.folder = folder
        self._environment = {**os.environ, "XDG_RUNTIME_DIR": str(runtime), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}

    def start(self, *words: str) -> subprocess.Popen[str]:
        return Forked(
            [*RBXCOMPOSE, *words],
            env=self._environment,
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def do(self, *words: str) -> str:
        """Run a command in this process, but for `up`, which is the beginning of others."""
        if words[0] == "up":
            done = run_command(words, self._environment, PATIENCE, self.folder)
        else:
            done = at_once(*words, environment=self._environment, folder=self.folder)
        output = done.stderr + done.stdout
        assert done.returncode == 0, output
        return output

    def messages(self, name: str) -> tuple[list[Recorded], str]:
        reader = RecordingReader(io.BytesIO((self.folder / name).read_bytes()))
        return list(reader.messages()), reader.damage

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "it did not happen in time"
            time.sleep(0.002)


@pytest.fixture
def shell(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Shell:
    return Shell(tmp_path, tmp_path_factory.mktemp("runtime"))


@pytest.fixture
def router() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    session = open_router(tcp_endpoint(port))
    yield f"tcp/127.0.0.1:{port}"
    session.close()  # type: ignore[no-untyped-call]


def test_a_topic_that_was_silent_is_in_the_file(shell: Shell, router: str) -> None:
    with Guest(BusPlace(router, 0), stays=True) as sender:
        sender.bus().publisher("base", "/cmd_vel", Twist, Qos.COMMAND)
        shell.do("record", "--router", router, "-o", "silent.mcap", "--for", "0.3s")
        words = ("-o", "named.mcap", "--for", "0.3s", "--topics", "cmd_vel", "cmd_*", "odom")
        shown = shell.do("record", "--router", router, *words)
        silent = ["cmd_vel", "cmd_*"]
        assert re.findall(r"warning\[RBX9053\]: '(.*)' has a publisher, but no message of it has come", shown) == silent
    with (shell.folder / "silent.mcap").open("rb") as file:
        reader = RecordingReader(file)
        assert list(reader.messages()) == []
        assert [topic.name for topic in reader.topics] == ["/cmd_vel"]


@pytest.fixture
def robot(shell: Shell) -> Iterator[Shell]:
    text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
    (shell.folder / "robots/turtlebot").mkdir(parents=True)
    (shell.folder / "missions").mkdir()
    (shell.folder / "robots/turtlebot/robot.yaml").write_text(text.replace("name: turtlebot", f"name: {NAME}"))
    (shell.folder / "missions/patrol.yaml").write_bytes((ROOT / "missions/patrol.yaml").read_bytes())
    shell.do("up", "-d", "robots/turtlebot")
    try:
        yield shell
    finally:
        shell.do("down")
        assert [process for process in titled(f"rbxcompose {NAME}: ") if process.is_running] == []


def payloads(messages: list[Recorded], topic: RecordedTopic) -> list[bytes]:
    return [message.payload for message in messages if message.topic == topic]


def test_what_is_replayed_on_a_bus_is_what_was_recorded(shell: Shell, router: str) -> None:
    (shell.folder / "a.mcap").write_bytes(written(MESSAGES))
    bus = ["--router", router, "--domain", "7"]
    recorder = shell.start("record", *bus, "-o", "b.mcap")
    assert recorder.stdout
    assert recorder.stdout.readline().startswith("recording to b.mcap")
    assert "replayed 21 messages" in shell.do("replay", "a.mcap", *bus, "--rate", "2x", "--topics", "*")
    recorder.send_signal(signal.SIGINT)
    output, _ = recorder.communicate(timeout=PATIENCE)
    assert recorder.returncode == 0
    assert "recorded 21 messages to b.mcap" in output
    found, damage = shell.messages("b.mcap")
    assert damage == ""
    for topic in {
        message.topic for message in MESSAGES
    }:  # each has a priority of its own, so that one may overtake another
        assert payloads(found, topic) == payloads(MESSAGES, topic)
    lasted = (found[-1].log_time - found[0].log_time) / 1e9
    assert lasted > 0.4  # of 0.91 s, twice as fast
    assert all(item.publish_time <= item.log_time for item in found)


def test_a_loop_goes_on_until_it_is_interrupted_and_commands_are_left_out(shell: Shell, router: str) -> None:
    (shell.folder / "a.mcap").write_bytes(written(MESSAGES))
    recorder = shell.start("record", "--router", router, "-o", "b.mcap")
    player = shell.start("replay", "a.mcap", "--router", router, "--loop", "--rate", "20x")
    part = shell.folder / "b.mcap.part"
    shell.until(lambda: part.exists() and part.stat().st_size > 3_000)
    player.send_signal(signal.SIGINT)
    output, _ = player.communicate(timeout=PATIENCE)
    assert player.returncode == 0
    assert "warning[RBX9206]: topics that make a robot move: /cmd_vel" in output
    recorder.send_signal(signal.SIGTERM)
    recorder.communicate(timeout=PATIENCE)
    found, _ = shell.messages("b.mcap")
    assert len([item for item in found if item.topic.name == "/odom"]) > 10
    assert {item.topic.name for item in found} == {"/odom", "/map"}


def test_what_would_move_a_robot_is_left_out_whoever_sent_it(
    shell: Shell, router: str, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = [
        recorded(recorded_topic("/cmd_vel/teleop", Twist), Twist(), 0.0),
        recorded(recorded_topic("/lift", Float64), Float64(), 0.0),
        recorded(recorded_topic("/height", Float64), Float64(), 0.0),
    ]
    path = shell.folder / "a.mcap"
    path.write_bytes(written(sent))
    with Guest(BusPlace(router, 0), stays=True) as robot:
        robot.bus().subscribe("lift", "/lift", Float64, Qos.COMMAND, lambda message: None)
        robot.bus().subscribe("lift", "/height", Float64, Qos.STATE, lambda message: None)
        assert command.main(["replay", str(path), "--router", router]) == 0
        shown = capsys.readouterr()
        assert re.findall(r"topics that make a robot move: (.*)", shown.err) == ["/cmd_vel/teleop", "/lift"]
        assert "replayed 1 messages" in shown.out
        assert command.main(["replay", str(path), "--router", router, "--topics", "cmd_vel/*", "lift"]) == 0
        assert "replayed 2 messages" in capsys.readouterr().out


def test_without_a_robot_it_is_replayed_on_a_router_of_its_own_below_a_namespace(shell: Shell) -> None:
    (shell.folder / "a.mcap").write_bytes(written(MESSAGES))
    player = shell.start("replay", "a.mcap", "--loop", "--namespace", "old/run")
    assert player.stdout
    endpoint = next(line for line in player.stdout if "--router" in line).partition("--router ")[2].strip("'\n")
    try:
        shell.do("record", "--router", endpoint, "-o", "b.mcap", "--for", "2s")
    finally:
        player.send_signal(signal.SIGINT)
        player.communicate(timeout=PATIENCE)
    assert player.returncode == 0
    found, _ = shell.messages("b.mcap")
    assert {item.topic.name for item in found} == {"/old/run/odom", "/old/run/map"}


@pytest.mark.parametrize(
    "words", [["--alone", "--robot", "x"], ["--alone", "--router", "tcp/127.0.0.1:1"], ["--namespace", "no name"]]
)
def test_a_bus_of_its_own_is_no_other_and_a_namespace_is_a_name(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code = command.main(["replay", "a.mcap", *words])
    except SystemExit as end:
        code = int(str(end.code))
    assert code == 2
    assert "replay" in capsys.readouterr().err


def test_a_full_disk_ends_the_recording_with_a_finding_and_what_was_written_is_recovered(
    shell: Shell, router: str
) -> None:
    (shell.folder / "a.mcap").write_bytes(written(MESSAGES))
    recorder = shell.start("record", "--router", router, "-o", "b.mcap")
    assert recorder.stdout
    assert recorder.stdout.readline().startswith("recording to b.mcap")
    resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (6_000, 6_000))
    player = shell.start("replay", "a.mcap", "--router", router, "--loop", "--rate", "20x")
    output, _ = recorder.communicate(timeout=PATIENCE)
    player.send_signal(signal.SIGINT)
    player.communicate(timeout=PATIENCE)
    assert recorder.returncode == 1
    assert "error[RBX9203]: 'b.mcap' cannot be written: File too large" in output
    told = re.search(
        r"help: once there is space, 'rbxcompose replay b.mcap --info' recovers at least (\d+) mess", output
    )
    assert told, output
    assert "b.mcap' was unfinished" in shell.do("replay", "b.mcap", "--info")
    found, damage = shell.messages("b.mcap")
    assert damage == ""
    assert len(found) >= int(told[1])


def test_a_split_recording_that_cannot_be_written_any_further_names_its_finished_files(
    tmp_path: Path, router: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def taken(tap: Tap) -> list[Recorded]:
        if (tmp_path / "b_1.mcap").exists():
            (tmp_path / "b_3.mcap").touch()  # cannot be created
        return MESSAGES

    monkeypatch.setattr(Tap, "take", taken)
    told = refused(["record", "--router", router, "--split", "0.001s", "-o", f"{tmp_path}/b"], capsys)
    assert f"help: finished: {tmp_path}/b_0.mcap to {tmp_path}/b_2.mcap\n" in told


def test_two_seconds_of_a_robot_and_a_recorder_that_is_killed(robot: Shell) -> None:
    topics = ("odom", "/cmd_vel*", "tf_static", "tf_statc")
    warned, _, answer = robot.do("record", "--for", "2s", "-o", "whole.mcap", "--json", "--topics", *topics).rpartition(
        "\n{"
    )
    assert "no topic matches 'tf_statc'" in warned
    told = json.loads(f"{{{answer}")
    assert told["unmatched"] == ["tf_statc"]
    assert told["files"] == ["whole.mcap"]
    assert told["messages"]["/odom"] > 60  # of 100
    whole, damage = robot.messages("whole.mcap")
    assert damage == ""
    assert {"/odom", "/tf_static"} <= {item.topic.name for item in whole}
    assert len([item for item in whole if item.topic.name == "/odom"]) > 60  # of 100

    player = robot.start("replay", "whole.mcap", "--topics", "odom", "tf_static")
    output, _ = player.communicate(timeout=PATIENCE)
    assert player.returncode == 1
    assert "error[RBX9210]: these topics are being published now: /odom, /tf_static" in output
    assert "replayed" in robot.do("replay", "whole.mcap", "--topics", "odom", "--rate", "20x", "--over")
    assert "replayed" in robot.do("replay", "whole.mcap", "--topics", "odom", "--rate", "20x", "--namespace", "old")
    alone = robot.do("replay", "whole.mcap", "--topics", "odom", "tf_static", "--rate", "20x", "--alone")
    assert "a router of its own" in alone
    assert "RBX9210" not in alone
    (robot.folder / "some.mcap").write_bytes(written(MESSAGES))
    partly = robot.do("replay", "some.mcap", "--rate", "20x")
    assert "warning[RBX9210]: these topics are being published now: /odom\n" in partly
    assert "replaying 1 topics" in partly

    told = robot.do("record", "--format", "lerobot", "-o", "driven", "--for", "1s", "--fps", "10")
    assert "episode 0: " in told
    info = json.loads((robot.folder / "driven/meta/info.json").read_text(encoding="utf-8"))
    assert (info["robot_type"], info["features"]["action"]["names"]) == (NAME, ["x.vel", "y.vel", "theta.vel"])
    assert not list(robot.folder.glob("driven-*"))

    recorder = robot.start("record", "-o", "cut.mcap")
    part = robot.folder / "cut.mcap.part"
    robot.until(lambda: part.exists() and part.stat().st_size > 10_000)
    assert "not a recording" not in robot.do("replay", "whole.mcap", "--info")  # leaves alone what is being written
    assert part.exists()
    recorder.kill()
    recorder.communicate(timeout=PATIENCE)
    left, _ = robot.messages("cut.mcap.part")
    output = robot.do("replay", "cut.mcap.part", "--info", "--json")
    assert f"{len(left):,} messages are recovered" in output
    info = json.loads(output[output.index("{") :])
    assert info["messages"] == len(left) > 10
    assert robot.messages("cut.mcap") == (left, "")
    reader = make_reader(io.BytesIO((robot.folder / "cut.mcap").read_bytes()))
    assert isinstance(reader, SeekingReader)
    assert len(list(reader.iter_messages())) == len(left)
    assert not part.exists()


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert command.main(words) == 1
    return capsys.readouterr().err


def test_info_shows_topics_types_counts_and_duration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(written(MESSAGES))
    assert command.main(["replay", str(path), "--info"]) == 0
    first, _, *rows = capsys.readouterr().out.splitlines()
    assert first.endswith("a.mcap: 21 messages, 0.910 s")
    assert [row.split() for row in rows] == [
        ["/cmd_vel", "geometry_msgs/msg/Twist", "command", "10"],
        ["/map", "std_msgs/msg/String", "latched", "1"],
        ["/odom", "nav_msgs/msg/Odometry", "state", "10"],
    ]


@for_all("cut", range(0, len(written(MESSAGES)), 97 * 3))
def test_a_file_that_was_cut_is_a_warning_and_shows_what_is_left(
    cut: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(written(MESSAGES)[:cut])
    assert command.main(["replay", str(path), "--info", "--json"]) == 0
    shown = capsys.readouterr()
    assert "warning[RBX9202]" in shown.err
    told = json.loads(shown.out)
    assert (told["messages"] <= 21, told["damage"]) == (True, "it ends in the middle")
    assert path.read_bytes() == written(MESSAGES)[:cut]


def test_what_cannot_be_read_is_a_finding(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.txt").write_text("a text")
    assert "error[RBX9201]" in refused(["replay", str(tmp_path / "gone.mcap")], capsys)
    assert "not a recording" in refused(["replay", str(tmp_path / "a.txt")], capsys)
    assert "not a recording" in refused(["replay", str(tmp_path)], capsys)


def test_nothing_to_replay_is_a_finding(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(written(MESSAGES))
    assert "error[RBX9205]" in refused(["replay", str(path), "--topics", "nothing"], capsys)
    assert "error[RBX9205]" in refused(["replay", str(path), "--from", "10s"], capsys)


def test_a_pattern_that_matches_no_topic_is_a_warning(
    tmp_path: Path, router: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path, bus = tmp_path / "a.mcap", ["--router", router]
    path.write_bytes(written(MESSAGES))
    assert command.main(["replay", str(path), *bus, "--rate", "100x", "--topics", "odom", "odmo", "["]) == 0
    shown = capsys.readouterr()
    assert "warning[RBX9022]: no topic matches 'odmo'\n  = help: did you mean 'odom'?" in shown.err
    assert "no topic matches '['" in shown.err
    assert "'odom'\n" not in shown.err
    words = ["-o", f"{tmp_path}/b", "--for", "0.01s", "--topics", "odom", "odom", "*x*", "--json"]
    assert command.main(["record", *bus, *words]) == 0
    shown = capsys.readouterr()
    assert shown.err.count("warning[RBX9022]: no topic matches") == 2
    assert json.loads(shown.out)["unmatched"] == ["odom", "*x*"]


def test_a_file_that_is_there_is_not_overwritten(
    tmp_path: Path, router: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"mine")
    assert "error[RBX9203]" in refused(["record", "--router", router, "-o", str(path)], capsys)
    assert path.read_bytes() == b"mine"
    for gone in ("no/a.mcap", "no/"):
        assert "error[RBX9203]" in refused(["record", "--router", router, "-o", f"{tmp_path}/{gone}"], capsys)


@pytest.mark.parametrize("end", ["", "/"])
def test_a_recording_goes_into_a_folder_that_is_named(tmp_path: Path, router: str, end: str) -> None:
    folder = tmp_path / "runs"
    folder.mkdir()
    assert command.main(["record", "--router", router, "--for", "0.01s", "-o", f"{folder}{end}"]) == 0
    (file,) = tmp_path.rglob("*.mcap")
    assert re.fullmatch(r"runs/recording-\d{8}-\d{6}\.mcap", str(file.relative_to(tmp_path)))


def test_a_recording_does_not_need_a_reader_of_what_it_prints(tmp_path: Path, router: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w", encoding="utf-8") as out, redirect_stdout(out):
        assert command.main(["record", "--router", router, "--for", "0.01s", "-o", f"{tmp_path}/a"]) == 141
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def test_without_a_router_nothing_is_left_behind(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wanted = str(tmp_path / "a.mcap")
    assert "error[RBX9020]" in refused(["record", "--router", "tcp/127.0.0.1:1", "-o", wanted], capsys)
    assert "error[RBX9020]" in refused(["record", "--router", "nonsense", "-o", wanted], capsys)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("form", ["mcap", "lerobot"])
def test_the_next_recorder_in_a_folder_recovers_what_a_killed_one_has_left(
    form: str, tmp_path: Path, router: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cut.mcap.part").write_bytes(unfinished(MESSAGES))
    command.main(["record", "--format", form, "--router", router, "--for", "0.01s", "-o", f"{tmp_path}/next"])
    assert "cut.mcap' was unfinished" in capsys.readouterr().err
    assert (tmp_path / "cut.mcap").exists()


@pytest.mark.parametrize(
    "words",
    [
        ["--split", "5 apples"],
        ["--split", "0kB"],
        ["--class", "fast"],
        ["--for", "-1s"],
        ["--topics"],
        ["--domain", "x"],
    ],
)
def test_wrong_options_are_wrong_usage(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        command.main(["record", *words])
    assert "usage: rbxcompose record" in capsys.readouterr().err


def test_no_other_command_loads_what_recordings_need(tmp_path: Path) -> None:
    (script := tmp_path / "load.py").write_text(
        "import sys; import rbxcompose.commands.main as m\n"
        "[m.load(verb) for verb in m.verbs() if verb not in ('record', 'replay')]\n"
        "print(*sys.modules)\n"
    )
    words = [sys.executable, str(script)]
    with Forked(words, cwd=ROOT, env=os.environ, stdout=subprocess.PIPE, text=True) as process:
        modules = set(process.communicate(timeout=PATIENCE)[0].split())
    assert process.returncode == 0
    assert "rbxcompose.commands.main" in modules
    assert not {"mcap", "zstandard", "lz4"} & modules

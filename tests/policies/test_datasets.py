"""`record --format lerobot`: recordings become episodes that LeRobot reads; what does not fit is refused."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import NANOSECONDS
from rbxcompose.base.files import alone_in
from rbxcompose.domains.policies.episode import (
    Episode,
    NoEpisodeError,
    Sample,
    SampleRole,
    camera_of,
    features_of,
    role_of,
    sample_of,
)
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.sensor_msgs import CompressedImage, Image
from rbxcompose.runtime.recording.topics import RecordedTopic, definition_of
from rbxcompose.tools import datasets
from rbxcompose.tools.commands import record
from tests.commands import command
from tests.conftest import ROOT
from tests.policies.recordings import BEGIN, SIZE, Timed, arm_with_cameras, joints, jpeg, picture, write_recording
from tests.soak import rare

av = pytest.importorskip("av", reason="av is not installed")
parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
RATE = 10


def samples(messages: Sequence[Timed]) -> list[Sample]:
    """Messages as samples, in the order of time."""
    found = []
    for time, topic, message in sorted(messages, key=lambda each: each[0]):
        role = role_of(topic, message.TYPE)
        assert role
        if (made := sample_of(BEGIN + round(time * NANOSECONDS), topic, role, message)) is not None:
            found.append(made)
    return found


times = st.lists(st.floats(0.0, 3.0).map(lambda time: round(time, 3)), min_size=1, max_size=30, unique=True)


@given(times, times, st.integers(1, 30))
def test_a_frame_has_the_newest_state_and_the_last_command_before_the_next_frame(
    states: list[float], commands: list[float], rate: int
) -> None:
    messages: list[Timed] = [(time, "/joint_states", joints(a=time)) for time in states]
    messages += [(time, "/joint_commands", joints(a=time)) for time in commands]
    made = samples(messages)
    features = features_of(made)
    frames = list(Episode(features, rate).frames(made))
    start, end = max(min(states), min(commands)), max(*states, *commands)
    assert features.start == BEGIN + round(start * NANOSECONDS)
    for number, frame in enumerate(frames):
        now, then = start + number / rate, start + (number + 1) / rate
        assert then < end + 1e-6
        assert frame.state == (max(time for time in states if time <= now + 1e-7),)
        assert frame.action == (max(time for time in commands if time <= then + 1e-7),)
    assert start + (len(frames) + 1) / rate >= end - 1e-6, "there is no frame more"


def test_joints_of_all_buses_and_the_base_are_in_it_and_a_base_that_nobody_commands_rests() -> None:
    messages: list[Timed] = [
        (0.0, "/joint_states", joints(b=1.0)),
        (0.1, "/r/joint_states", joints(a=2.0, lost=float("nan"))),
        (0.1, "/odom", Odometry()),
        (0.2, "/joint_commands", joints(b=3.0)),
        (0.65, "/cmd_vel", Twist(linear=Vector3(x=0.5), angular=Vector3(z=-1.0))),
        (1.0, "/joint_states", joints(b=9.0)),
    ]
    made = samples(messages)
    features = features_of(made)
    assert features.state == ("a.pos", "b.pos", "x.vel", "y.vel", "theta.vel")
    assert features.action == ("b.pos", "x.vel", "y.vel", "theta.vel")
    frames = list(Episode(features, 4).frames(made))
    assert [frame.state for frame in frames] == [(2.0, 1.0, 0.0, 0.0, 0.0)] * 3
    assert [frame.action for frame in frames] == [(3.0, 0.0, 0.0, 0.0), (3.0, 0.5, 0.0, -1.0), (3.0, 0.5, 0.0, -1.0)]


def test_commands_of_a_base_may_have_a_stamp_and_are_not_made_up_where_none_were_recorded() -> None:
    odometry: Timed = 0.0, "/odom", Odometry()
    stamped = TwistStamped(twist=Twist(linear=Vector3(x=0.5), angular=Vector3(z=-1.0)))
    made = samples([odometry, (0.1, "/cmd_vel", stamped), (1.0, "/odom", Odometry())])
    features = features_of(made)
    assert features.action == ("x.vel", "y.vel", "theta.vel")
    assert [frame.action for frame in Episode(features, 2).frames(made)] == [(0.5, 0.0, -1.0)]
    arm: list[Timed] = [odometry, (0.0, "/joint_states", joints(a=1.0)), (0.0, "/joint_commands", joints(a=1.0))]
    assert features_of(samples(arm)).action == ("a.pos",)


def test_a_topic_of_commands_without_messages_is_a_base_that_rests(tmp_path: Path) -> None:
    command_topic = RecordedTopic("/cmd_vel", Twist.TYPE, "RIHS01_00", definition=definition_of(Twist.TYPE))
    messages = [*arm_with_cameras(), *((10 + turn / 10, "/odom", Odometry()) for turn in range(20))]
    write_recording(tmp_path / "r.mcap", messages, silent=[command_topic])
    made(tmp_path, "-o", "rests", "--topics", "joint_*", "odom", "cmd_vel", "--from", "r.mcap")
    info = json.loads((tmp_path / "rests/meta/info.json").read_text())
    assert info["features"]["action"]["names"] == ["lift.pos", "pan.pos", "x.vel", "y.vel", "theta.vel"]
    made(tmp_path, "-o", "arm", "--topics", "joint_*", "odom", "--from", "r.mcap")
    info = json.loads((tmp_path / "arm/meta/info.json").read_text())
    assert info["features"]["action"]["names"] == ["lift.pos", "pan.pos"]


@pytest.mark.parametrize(
    ("messages", "said"),
    [
        ([], "nothing on 'joint_states' or 'odom'"),
        ([(0.0, "/joint_commands", joints(a=1.0))], "nothing on 'joint_states' or 'odom'"),
        ([(0.0, "/joint_states", joints(a=1.0))], "nothing on 'joint_commands' or 'cmd_vel'"),
        ([(0.0, "/odom", Odometry())], "nothing on 'joint_commands' or 'cmd_vel'"),
        ([(0.0, "/joint_states", joints(a=float("nan")))], "nothing on 'joint_states'"),
    ],
)
def test_without_state_or_command_there_is_no_episode(messages: list[Timed], said: str) -> None:
    with pytest.raises(NoEpisodeError, match=said):
        features_of(samples(messages))


def test_roles_go_by_type_and_last_word_and_cameras_by_the_words_before() -> None:
    assert role_of("/left/joint_states", "sensor_msgs/msg/JointState") is SampleRole.JOINTS
    assert role_of("/physics/set_points", "sensor_msgs/msg/JointState") is None
    assert role_of("/cmd_vel/teleop", Twist.TYPE) is None
    assert role_of("/head/image", Image.TYPE) is SampleRole.PICTURE
    assert role_of("/head/image/compressed", CompressedImage.TYPE) is SampleRole.JPEG
    assert [camera_of(topic) for topic in ("/head/image_raw/compressed", "/image", "/a/b/image")] == [
        "head",
        "image",
        "a_b",
    ]
    depth = Image(height=1, width=1, encoding="16UC1", step=2, data=b"12")
    assert sample_of(0, "/head/depth", SampleRole.PICTURE, depth) is None, "depths are no colours"


def made(tmp_path: Path, *words: str, code: int = 0) -> str:
    """What `record` prints."""
    done = command("record", "--format", "lerobot", *words, environment={"NO_COLOR": "1"}, folder=tmp_path)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of two recordings with another one added."""
    folder = tmp_path_factory.mktemp("lerobot")
    for number in range(3):
        write_recording(folder / f"r{number}.mcap", arm_with_cameras(1.0 + number / 2, 1.0 + number))
    words = ("--fps", str(RATE), "-o", "picks", "--task")
    told = made(folder, *words, "pick it", "--from", "r0.mcap", "r1.mcap")
    assert "episode 1: 14 frames in 1.4 s\n  hand: 7 of them have the picture before" in told
    made(folder, *words, "push it", "--append", "--from", "r2.mcap")
    return folder / "picks"


def test_its_tables_have_what_was_recorded(data_set: Path) -> None:
    info = json.loads((data_set / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["total_episodes"]) == ("v3.0", RATE, 3)
    assert info["features"]["action"] == {"dtype": "float32", "shape": [2], "names": ["lift.pos", "pan.pos"]}
    assert info["features"]["observation.images.hand"]["shape"] == [SIZE[1], SIZE[0], 3]
    rows: list[dict[str, Any]] = []
    for path in sorted(data_set.glob("data/*/*.parquet")):
        rows += parquet.read_table(path).to_pylist()
    assert [row["index"] for row in rows] == list(range(info["total_frames"]))
    for row in rows:
        at = (1.0 + row["episode_index"]) * row["frame_index"] / RATE
        ahead = (1.0 + row["episode_index"]) * (row["frame_index"] + 1) / RATE + 0.1
        assert row["observation.state"] == pytest.approx([at, -at], abs=1e-5)
        assert row["action"] == pytest.approx([ahead, -ahead], abs=1e-5)
        assert row["timestamp"] == pytest.approx(row["frame_index"] / RATE)
        assert row["task_index"] == (row["episode_index"] == 2)
    stats = json.loads((data_set / "meta/stats.json").read_text())
    state = np.array([row["observation.state"] for row in rows])
    assert stats["observation.state"]["count"] == [len(rows)]
    for name, found in (("min", state.min(0)), ("max", state.max(0)), ("mean", state.mean(0)), ("std", state.std(0))):
        assert stats["observation.state"][name] == pytest.approx(found, abs=1e-5)


def test_its_videos_have_the_pictures_of_the_frames(data_set: Path) -> None:
    with av.open(str(data_set / "videos/observation.images.front/chunk-000/file-000.mp4")) as container:
        frames = list(container.decode(video=0))
    assert [round(float(frame.time) * RATE) for frame in frames] == list(range(len(frames)))
    newest = [100 + 2 * int(turn / RATE * 15 + 1e-6) for turn in range(len(frames))]
    reds = [float(frame.to_ndarray(format="rgb24")[:, :, 0].mean()) for frame in frames]
    assert reds == pytest.approx(newest, abs=4)


def test_lerobot_reads_it(data_set: Path, tmp_path: Path) -> None:
    python = ROOT / ".lerobot/bin/python"
    if not python.exists():
        pytest.skip("needs LeRobot, several GB: make lerobot")
    program = f"""
import json
from lerobot.datasets.lerobot_dataset import LeRobotDataset
found = LeRobotDataset("local/picks", root={str(data_set)!r}, video_backend="pyav")
item = found[len(found) - 1]
print(json.dumps([found.num_episodes, len(found), item["task"], item["action"].tolist(),
    list(item["observation.images.front"].shape), item["observation.images.hand"].mean().item(),
    found.meta.stats["observation.images.hand"]["mean"].tolist()]))
"""
    environment = {"HF_HUB_OFFLINE": "1", "HOME": str(tmp_path), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        [str(python), "-c", program], capture_output=True, text=True, env=environment, timeout=150, check=False
    )
    assert done.returncode == 0, done.stderr
    episodes, length, task, action, shape, brightness, mean = json.loads(done.stdout.splitlines()[-1])
    assert (episodes, length, task, shape) == (3, 9 + 14 + 19, "push it", [3, SIZE[1], SIZE[0]])
    assert action == pytest.approx([3 * 1.9 + 0.1, -3 * 1.9 - 0.1], abs=1e-4)
    assert brightness == pytest.approx(140 / 255, abs=0.02)
    assert np.shape(mean) == (3, 1, 1)


def test_what_does_not_fit_is_refused_and_nothing_is_lost(data_set: Path, tmp_path: Path) -> None:
    copy = tmp_path / "picks"
    shutil.copytree(data_set, copy)
    before = {path: path.read_bytes() for path in sorted(copy.rglob("*")) if path.is_file()}
    other = write_recording(tmp_path / "other.mcap", [(0.0, "/joint_states", joints(a=1.0))])
    pictures = [each for each in arm_with_cameras() if isinstance(each[2], Image)]
    wide = [each for each in arm_with_cameras() if each not in pictures]
    wide += [(time, topic, picture(9, 80)) for time, topic, _ in pictures]
    write_recording(tmp_path / "wide.mcap", wide)
    numbers = [each for each in arm_with_cameras() if not isinstance(each[2], Image | CompressedImage)]
    write_recording(tmp_path / "blind.mcap", numbers)
    write_recording(tmp_path / "grows.mcap", [*arm_with_cameras(), (11.0, "/front/image", picture(9, 80))])
    (tmp_path / "text.mcap").write_text("no recording")
    (tmp_path / "file").write_text("")
    for words, said in [
        (("--from", "other.mcap", "-o", "picks"), "error[RBX3802]: 'picks' is there already"),
        (("--from", "other.mcap", "-o", "nowhere/picks"), "there is no folder 'nowhere'"),
        (
            ("--from", "blind.mcap", "other.mcap", "-o", "new"),
            "'other.mcap' is no episode: nothing on 'joint_commands'",
        ),
        (
            ("--from", "blind.mcap", "wide.mcap", "-o", "new"),
            "'observation.images.front' is a video of 80 x 48 here, and missing in the episodes before",
        ),
        (("--from", "missing.mcap", "-o", "new"), "error[RBX9201]: 'missing.mcap' cannot be read"),
        (("--from", "text.mcap", "-o", "new"), "error[RBX9201]: 'text.mcap' is not a recording"),
        (("--append", "--from", "other.mcap", "-o", "new"), "'new' is no data set of LeRobot"),
        (("--append", "--from", "other.mcap", "-o", "file"), "'file' is no data set of LeRobot"),
        (("--append", "--from", "wide.mcap", "-o", "picks"), "'picks' has 10 frames per second, not 15"),
        (
            ("--append", "--fps", "10", "--from", "wide.mcap", "-o", "picks"),
            "'observation.images.front' is a video of 80 x 48 here, and a video of 64 x 48 in the episodes before",
        ),
        (
            ("--append", "--fps", "10", "--from", "grows.mcap", "-o", "picks"),
            "'grows.mcap' is no episode: a picture has 80 x 48 pixels, others 64 x 48",
        ),
        (
            ("--append", "--fps", "10", "--from", "blind.mcap", "-o", "picks"),
            "'observation.images.front' is missing here, and a video of 64 x 48",
        ),
    ]:
        told = made(tmp_path, *words, code=1)
        assert said in told
        assert "episode 0" not in told
    assert {path: path.read_bytes() for path in sorted(copy.rglob("*")) if path.is_file()} == before
    assert other.exists()
    assert not [path for path in tmp_path.iterdir() if "new" in path.name]
    for words, said in [
        (("--split", "1GB"), "an episode cannot be split"),
        (("--json",), "--json is for recordings"),
        (("--fps", "0"), "'0' is not a whole number from 1 to 120"),
    ]:
        assert said in made(tmp_path, *words, code=2)
    done = command("record", "--append", environment={}, folder=tmp_path)
    assert (done.returncode, "need --format lerobot" in done.stderr) == (2, True)


@pytest.mark.parametrize("number", [signal.SIGTERM, *rare(signal.SIGINT)])
def test_an_interrupt_leaves_neither_files_nor_a_doubt_about_what_stays(
    data_set: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    taken = count()

    def interrupted(*given: Any) -> Sample | None:
        if next(taken) % 300 == 250:  # while it films
            signal.raise_signal(number)
            signal.raise_signal(number)
        return sample_of(*given)

    def recorded(arguments: object, place: object, path: Path, topics: object) -> int:
        write_recording(path, arm_with_cameras())
        return 0

    shutil.copytree(data_set, tmp_path / "picks")
    write_recording(tmp_path / "r.mcap", arm_with_cameras())
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr(datasets, "sample_of", interrupted)
    monkeypatch.setattr(record, "_record", recorded)
    handler = signal.signal(number, lambda *_: pytest.fail("it ends in the middle"))
    try:
        told = made(tmp_path, "--from", "r.mcap", "-o", "new", code=130)
        assert "error[RBX3802]: interrupted: 'new' is not made\n" in told
        told = made(tmp_path, "--append", "--fps", "10", "--from", "r.mcap", "-o", "picks", code=130)
        assert "error[RBX3802]: interrupted: 'picks' gets no further episode\n" in told
        assert sorted(tmp_path.rglob("*")) == before
        told = made(tmp_path, "--router", "tcp/127.0.0.1:1", "-o", "live", code=130)
    finally:
        signal.signal(number, handler)
    (left,) = {*tmp_path.rglob("*")} - {*before}
    assert f"the recording stays: {left.name}\n" in told


def test_messages_that_came_together_may_stand_in_any_order(tmp_path: Path) -> None:
    messages: list[Timed] = []
    for turn in range(20):
        messages += [(turn / 10 + 0.002, "/cmd_vel", Twist()), (turn / 10 + 0.001, "/odom", Odometry())]
    write_recording(tmp_path / "r.mcap", messages, is_sorted=False)
    assert "episode 0: 18 frames" in made(tmp_path, "--fps", "10", "--from", "r.mcap", "-o", "base")


def test_a_data_set_with_damaged_files_is_refused_and_nothing_is_added(data_set: Path, tmp_path: Path) -> None:
    write_recording(tmp_path / "r.mcap", arm_with_cameras())
    for name in ("meta/stats.json", "meta/tasks.parquet"):
        copy = tmp_path / Path(name).stem
        shutil.copytree(data_set, copy)
        (copy / name).write_bytes(b"{}")
        before = sorted(copy.rglob("*.mp4*"))
        told = made(tmp_path, "--append", "--fps", "10", "--from", "r.mcap", "-o", copy.name, code=1)
        assert f"'r.mcap' is not added: '{copy.name}/{name}' cannot be read" in told
        assert sorted(copy.rglob("*.mp4*")) == before


def test_a_broken_picture_is_the_one_before_and_a_first_one_is_an_error(tmp_path: Path) -> None:
    numbers = [each for each in arm_with_cameras() if not isinstance(each[2], Image | CompressedImage)]
    broken = (11.0, "/hand/image/compressed", CompressedImage(format="jpeg", data=jpeg(90).data[:200]))
    write_recording(tmp_path / "late.mcap", [*numbers, (10.0, "/hand/image/compressed", jpeg(90)), broken])
    made(tmp_path, "--fps", "10", "--from", "late.mcap", "-o", "late")
    with av.open(str(tmp_path / "late/videos/observation.images.hand/chunk-000/file-000.mp4")) as container:
        means = [float(frame.to_ndarray(format="rgb24").mean()) for frame in container.decode(video=0)]
    assert means == pytest.approx([90] * 19, abs=3)
    write_recording(tmp_path / "first.mcap", [*numbers, broken])
    assert "a compressed picture cannot be read" in made(tmp_path, "--from", "first.mcap", "-o", "first", code=1)


def test_what_is_there_of_a_damaged_recording_becomes_an_episode(tmp_path: Path) -> None:
    whole = write_recording(tmp_path / "whole.mcap", arm_with_cameras())
    (tmp_path / "cut.mcap").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    told = made(tmp_path, "--from", "cut.mcap", "-o", "cut")
    assert told.count("warning[RBX9202]: 'cut.mcap' is damaged: it ends in the middle") == 1
    assert "episode 0: " in told


def test_without_the_extra_it_says_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(datasets, "_NEEDED", ("nothing_of_this_name",))
    assert "pip install 'rbxcompose[lerobot]'" in made(tmp_path, "--from", "r.mcap", code=1)


@pytest.mark.soak
def test_of_two_who_add_to_a_data_set_one_waits(data_set: Path, tmp_path: Path) -> None:
    shutil.copytree(data_set, tmp_path / "picks")
    write_recording(tmp_path / "r.mcap", arm_with_cameras())
    words = ("record", "--format", "lerobot", "--append", "--fps", "10", "--from", "r.mcap", "-o", "picks")
    command_line = [sys.executable, "-m", "rbxcompose", *words]
    with alone_in(tmp_path / "picks"):
        two = [subprocess.Popen(command_line, cwd=tmp_path, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    told = sorted(each.communicate(timeout=60)[0].partition(":")[0] for each in two)
    assert told == ["episode 3", "episode 4"]

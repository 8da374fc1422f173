"""What is written opens everywhere; what is broken gives what is whole in it, and never more than a finding."""

from __future__ import annotations

import io
import os
import resource
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import SeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.runtime.recording.files import ENDING, Recorder, Split, complete, create, part_of, recover, recover_all
from rbxcompose.runtime.recording.reader import NotARecordingError, RecordingReader
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic
from tests.recording.samples import MAP, ODOM, TWIST, odometry, recorded, some, topic, twist, unfinished, written
from tests.soak import Soak

MESSAGES = some()
WHOLE = written(MESSAGES)


def read(data: bytes) -> tuple[list[Recorded], str]:
    reader = RecordingReader(io.BytesIO(data))
    return list(reader.messages()), reader.damage


def indexed(data: bytes) -> list[tuple[str, int, bytes]]:
    """What the usual reader finds by the index."""
    reader = make_reader(io.BytesIO(data))
    assert isinstance(reader, SeekingReader)
    summary = reader.get_summary()
    assert summary is not None
    assert summary.chunk_indexes
    return [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]


def plain(messages: list[Recorded]) -> list[tuple[str, int, bytes]]:
    in_time = sorted(messages, key=lambda message: message.log_time)
    return [(message.topic.name, message.log_time, message.payload) for message in in_time]


def test_what_is_written_is_read_again() -> None:
    assert read(WHOLE) == (MESSAGES, "")


def test_a_finished_recording_has_an_index() -> None:
    assert sorted(indexed(WHOLE)) == sorted(plain(MESSAGES))


def test_channels_tell_ros_the_encoding_the_hash_and_the_quality_of_service() -> None:
    summary = make_reader(io.BytesIO(WHOLE)).get_summary()
    assert summary is not None
    channels = {channel.topic: channel for channel in summary.channels.values()}
    assert {channel.message_encoding for channel in channels.values()} == {"cdr"}
    assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
    assert channels["/odom"].metadata["topic_type_hash"] == ODOM.hash
    assert "durability: 1\n" in channels["/map"].metadata["offered_qos_profiles"]
    assert "durability: 2\n" in channels["/odom"].metadata["offered_qos_profiles"]


def test_an_independent_decoder_reads_the_values_by_the_definitions_in_the_file() -> None:
    reader = make_reader(io.BytesIO(WHOLE), decoder_factories=[DecoderFactory()])
    found = [message.decoded_message for message in reader.iter_decoded_messages(topics=["/odom", "/cmd_vel"])]
    assert len(found) == 120
    for number in range(60):
        odom, command = found[2 * number], found[2 * number + 1]
        meant = odometry(number)
        assert (odom.header.frame_id, odom.child_frame_id) == ("odom", "base_link")
        assert odom.pose.pose.position.x == meant.pose.pose.position.x
        assert (odom.pose.pose.orientation.z, odom.pose.pose.orientation.w) == (0.6, 0.8)
        assert np.array_equal(odom.pose.covariance, meant.pose.covariance)
        assert odom.twist.twist.linear.x == command.linear.x == twist(number).linear.x
        assert command.angular.z == twist(number).angular.z


def test_an_independent_reader_of_ros_bags_opens_it_with_types_and_quality_of_service(tmp_path: Path) -> None:
    feedback = NavigateToPose.FeedbackMessage(feedback=NavigateToPose.Feedback(distance_remaining=2.5))
    path = tmp_path / "a.mcap"
    path.write_bytes(written([*MESSAGES, recorded(topic("/go/_action/feedback", type(feedback)), feedback, 7.0)]))
    with AnyReader([path]) as reader:
        qos: dict[str, Any] = {connection.topic: connection.ext for connection in reader.connections}
        values: dict[str, Any] = {one.topic: reader.deserialize(raw, one.msgtype) for one, _, raw in reader.messages()}
    assert qos["/map"].offered_qos_profiles[0].durability.name == "TRANSIENT_LOCAL"
    assert qos["/odom"].offered_qos_profiles[0].durability.name == "VOLATILE"
    assert values["/go/_action/feedback"].feedback.distance_remaining == 2.5
    assert values["/odom"].pose.pose.position.x == odometry(59).pose.pose.position.x


def test_a_recording_that_was_cut_gives_an_exact_prefix_and_loses_no_more_than_one_chunk(soak: Soak) -> None:
    counts = []
    for cut in range(0, len(WHOLE), soak.examples(quick=997, many=97)):
        messages, damage = read(WHOLE[:cut])
        assert messages == MESSAGES[: len(messages)]
        assert damage == "it ends in the middle"
        counts.append(len(messages))
    assert read(WHOLE) == (MESSAGES, "")
    if soak.is_on:  # at smaller steps than a chunk has bytes
        assert {later - earlier for earlier, later in pairwise([*counts, len(MESSAGES)])} <= {0, 10, 1}


def test_a_recovered_recording_has_an_index(soak: Soak) -> None:
    for cut in range(0, len(WHOLE), soak.examples(quick=2_477, many=97 * 5)):
        whole = io.BytesIO()
        count = recover(io.BytesIO(WHOLE[:cut]), whole)
        assert read(whole.getvalue()) == (MESSAGES[:count], "")
        if count:
            assert sorted(indexed(whole.getvalue())) == sorted(plain(MESSAGES[:count]))


@given(st.integers(8, len(WHOLE) - 1), st.binary(min_size=1, max_size=12))
def test_changed_bytes_never_raise_and_never_invent_payloads(place: int, noise: bytes) -> None:
    messages, _ = read(WHOLE[:place] + noise + WHOLE[place + len(noise) :])
    known = {message.payload for message in MESSAGES}
    assert {message.payload for message in messages} <= known


@given(st.binary(max_size=400))
def test_noise_behind_the_first_bytes_never_raises(noise: bytes) -> None:
    assert read(WHOLE[:8] + noise)[0] == []


@pytest.mark.parametrize("foreign", [b"#ROSBAG V2.0\n", b"\x89PNG\r\n\x1a\n", b"SQLite format 3\x00", b"\n"])
def test_another_kind_of_file_is_told_apart(foreign: bytes) -> None:
    with pytest.raises(NotARecordingError):
        RecordingReader(io.BytesIO(foreign))


def test_a_file_has_its_name_only_once_it_is_finished(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recorder = Recorder(path, 0.0)
    for message in MESSAGES:
        recorder.add(message)
    recorder.keep(0.6)
    assert recorder.kept == len(MESSAGES)
    assert not path.exists()
    assert read(part_of(path).read_bytes())[0] == MESSAGES
    assert list(recover_all(tmp_path)) == []  # its writer is at it
    recorder.finish()
    assert os.listdir(tmp_path) == ["a.mcap"]
    assert read(path.read_bytes()) == (MESSAGES, "")


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"mine")
    with pytest.raises(FileExistsError):
        create(path)
    part_of(path).write_bytes(unfinished(MESSAGES))
    (found,) = recover_all(tmp_path)
    assert "already exists" in found.problem
    assert path.read_bytes() == b"mine"


def test_what_a_killed_recorder_left_is_recovered(tmp_path: Path) -> None:
    part = tmp_path / "a.mcap.part"
    part.write_bytes(unfinished(MESSAGES)[:-5])
    (tmp_path / "a.mcap.part.new").write_bytes(b"an earlier recovery was killed, too")
    (tmp_path / "other.mcap.part").write_bytes(b"a text")
    good, bad = recover_all(tmp_path)
    messages, damage = read((tmp_path / "a.mcap").read_bytes())
    assert damage == ""
    assert messages == MESSAGES[: good.messages]
    assert good.messages >= len(MESSAGES) - 20
    assert bad.problem
    assert sorted(os.listdir(tmp_path)) == ["a.mcap", "other.mcap.part"]


def test_a_recovery_without_room_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "a.mcap.part").write_bytes(unfinished(MESSAGES)[:-5])
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        (found,) = recover_all(tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert found.problem == "File too large"
    assert os.listdir(tmp_path) == ["a.mcap.part"]


def test_an_empty_part_becomes_a_recording_of_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.mcap.part").write_bytes(b"")
    assert [one.messages for one in recover_all(tmp_path)] == [0]
    assert read((tmp_path / "a.mcap").read_bytes()) == ([], "")


@pytest.mark.parametrize(("split", "files"), [(Split(time=2.0), 3), (Split(size=4000), 2), (Split(size=10**9), 1)])
def test_a_recording_is_split_by_size_or_time_and_nothing_is_lost(tmp_path: Path, split: Split, files: int) -> None:
    recorder = Recorder(tmp_path / "a.mcap", 0.0, split)
    for number, message in enumerate(MESSAGES):
        recorder.add(message)
        recorder.keep(number * 0.05)
    recorder.finish()
    assert [path.name for path in recorder.paths] == [f"a_{number}{ENDING}" for number in range(len(recorder.paths))]
    assert len(recorder.paths) >= files
    parts = [read(path.read_bytes()) for path in recorder.paths]
    assert [message for messages, _ in parts for message in messages] == MESSAGES
    assert {damage for _, damage in parts} == {""}


def test_a_type_without_a_definition_is_kept_as_it_is() -> None:
    foreign = RecordedTopic("/odd", "odd_msgs/msg/Odd", "RIHS01_00")
    message = Recorded(foreign, 5, 4, 3, b"\x00\x01\x00\x00abc")
    assert read(written([message])) == ([message], "")


def test_a_completed_file_survives_its_writer(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    file = create(path)
    file.write(WHOLE)
    file.flush()
    complete(path, file)
    assert read(path.read_bytes()) == (MESSAGES, "")
    assert {message.topic for message in MESSAGES} == {MAP, ODOM, TWIST}

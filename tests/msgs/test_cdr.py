import struct
import tracemalloc
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.msgs.action_msgs import CancelGoal, GoalInfo
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.cdr import HEADER, CdrError, CdrLimitError, decode, encode
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.geometry_msgs import PoseWithCovariance, Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.rbxcompose_msgs import Switches
from rbxcompose.msgs.std_msgs import Bool, Empty, Float32, Int32, String
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from rbxcompose.msgs.types import Message, declared
from rbxcompose.msgs.unique_identifier_msgs import UUID
from tests.loops import for_all
from tests.msgs.samples import EVERYTHING, MESSAGES, ORACLE, any_message, instances, oracle_encode
from tests.soak import Soak

GOLDEN = [
    (Empty(), "00"),
    (Bool(data=True), "01"),
    (String(data="hello"), "06000000 68656c6c6f00"),
    (String(), "01000000 00"),
    (Time(sec=1, nanosec=2), "01000000 02000000"),
    (Float32(data=1.0), "0000803f"),
    (
        Twist(linear=Vector3(x=0.5), angular=Vector3(z=-1.0)),
        "000000000000e03f" + "00" * 16 + "00" * 16 + "000000000000f0bf",
    ),
    (CancelGoal.Request(GoalInfo(UUID(bytes(range(16))), Time(sec=1))), bytes(range(16)).hex() + "0100000000000000"),
]


@for_all("message, body", GOLDEN)
def test_known_messages_have_known_bytes(message: Message, body: str) -> None:
    assert encode(message) == HEADER + bytes.fromhex(body)


def test_a_message_of_defaults_is_written_as_rosbags_writes_it_and_read_back(soak: Soak) -> None:
    for message in MESSAGES[:: soak.examples(10, 1)]:
        payload = encode(message())
        assert payload == oracle_encode(message()), message
        assert decode(message, payload) == message()


@given(any_message())
def test_any_message_is_written_as_rosbags_writes_it_and_read_back(message: Message) -> None:
    payload = encode(message)
    assert payload == oracle_encode(message)
    assert decode(type(message), payload) == message


@given(instances(EVERYTHING))
def test_every_kind_of_field_is_written_as_rosbags_writes_it_and_read_back(message: Message) -> None:
    payload = encode(message)
    assert payload == oracle_encode(message)
    assert decode(EVERYTHING, memoryview(payload)) == message


@given(st.sampled_from(MESSAGES), st.binary(max_size=80))
def test_random_bytes_are_a_message_or_a_cdr_error(message: type[Message], noise: bytes) -> None:
    try:
        decoded = decode(message, HEADER + noise)
    except CdrError:
        return
    assert type(decoded) is message


@given(instances(EVERYTHING), st.data())
def test_a_payload_that_was_cut_or_changed_is_a_message_or_a_cdr_error(message: Message, data: st.DataObject) -> None:
    payload = bytearray(encode(message))
    for at in data.draw(st.lists(st.integers(4, len(payload) - 1), max_size=3)):
        payload[at] = data.draw(st.integers(0, 255))
    try:
        decode(EVERYTHING, payload[: data.draw(st.integers(0, len(payload)))])
    except CdrError:
        return


@given(any_message(), st.data())
def test_a_message_that_lacks_its_last_byte_is_refused(message: Message, data: st.DataObject) -> None:
    payload = encode(message)
    with pytest.raises(CdrError, match=f"^no {message.TYPE}: "):
        decode(type(message), payload[: data.draw(st.integers(0, len(payload) - 1))])


def test_a_lying_count_is_refused_before_room_is_made() -> None:
    payload = HEADER + bytes(8) + b"\x01\0\0\0\0\0\0\0" + struct.pack("<I", 2**32 - 1) + bytes(1000)
    tracemalloc.start()
    try:
        with pytest.raises(CdrError, match="4294967295 elements"):
            decode(DiagnosticArray, payload)
        assert tracemalloc.get_traced_memory()[1] < 100_000
    finally:
        tracemalloc.stop()


def test_a_sequence_of_messages_holds_at_most_a_million() -> None:
    payload = encode(EVERYTHING())
    assert payload.endswith(struct.pack("<I", 0))  # the count of `nothings`
    with pytest.raises(CdrError, match="at most 1000000 are allowed"):
        decode(EVERYTHING, payload[:-4] + struct.pack("<I", 1_000_001) + bytes(1_000_001))


def test_padding_of_other_writers_is_accepted_and_no_more() -> None:
    payload = encode(String(data="hi"))
    assert decode(String, payload + bytes(16)) == String(data="hi")
    with pytest.raises(CdrError, match="no std_msgs/msg/String: 17 bytes too many"):
        decode(String, payload + bytes(17))


def test_lists_may_be_followed_by_as_many_bytes_as_rclpy_leaves_for_empty_ones() -> None:
    trajectory = JointTrajectory(points=(JointTrajectoryPoint(),) * 50)
    payload = encode(trajectory)
    assert decode(JointTrajectory, payload + bytes(50 * 4 * 4)) == trajectory
    with pytest.raises(CdrError, match="bytes too many"):
        decode(JointTrajectory, payload + bytes(len(payload)))
    with pytest.raises(CdrError, match="17 bytes too many"):
        decode(Twist, encode(Twist()) + bytes(17))


@pytest.mark.parametrize("count", [1, 3])
def test_entries_of_nested_lists_are_counted_together_before_they_are_read(count: int) -> None:
    statuses = tuple(DiagnosticStatus(values=(KeyValue(),) * count) for _ in range(5))
    payload, entries = encode(DiagnosticArray(status=statuses)), 5 + 5 * count
    assert decode(DiagnosticArray, payload, entries) == DiagnosticArray(status=statuses)
    with pytest.raises(CdrLimitError, match=f"DiagnosticArray with more than {entries - 1} entries"):
        decode(DiagnosticArray, payload, entries - 1)


@given(any_message(), st.integers(0, 16))
def test_a_message_is_the_same_with_and_without_filling(message: Message, filling: int) -> None:
    assert encode(decode(type(message), encode(message) + bytes(filling))) == encode(message)


def test_a_text_of_length_zero_is_read_as_empty() -> None:
    assert decode(String, HEADER + bytes(4)) == String()


@pytest.mark.parametrize("payload", [b"", b"\0\1", b"\0\0\0\0\0\0\0\1", b"\0\7\0\0\0\0\0\1"], ids=repr)
def test_anything_but_little_endian_cdr_is_refused(payload: bytes) -> None:
    with pytest.raises(CdrError, match="no little-endian CDR header"):
        decode(Int32, payload)


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (b"\x03\0\0\0abc", "a text has no end"),
        (b"\x09\0\0\0abc\0", "a text has no end"),
        (b"\x03\0\0\0\xff\xff\0", "can't decode"),
    ],
    ids=repr,
)
def test_a_text_must_be_whole_utf_8(body: bytes, why: str) -> None:
    with pytest.raises(CdrError, match=why):
        decode(String, HEADER + body)


@for_all(
    "message",
    [
        Int32(data=2**31),
        Float32(data=1e300),
        Float32(data="x"),  # type: ignore[arg-type]
        String(data=7),  # type: ignore[arg-type]
        String(data="\ud800"),
        UUID(uuid=b"short"),
        Twist(linear=None),  # type: ignore[arg-type]
        EVERYTHING(short="too long"),
        EVERYTHING(codes=("a", "b", "c")),
        EVERYTHING(few=[1, 2, 3, 4, 5]),
        EVERYTHING(pair=("one",)),
        Bool(data="x"),  # type: ignore[arg-type]
        Bool(data=None),  # type: ignore[arg-type]
        SetBool.Response(success="no"),  # type: ignore[arg-type]
        Switches(is_on=("on", "off")),  # type: ignore[arg-type]
        JointTrajectory(joint_names="abc"),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_written_is_a_cdr_error_that_names_the_type(message: Message) -> None:
    with pytest.raises(CdrError, match=f"^{message.TYPE} cannot be written: "):
        encode(message)


def test_flags_of_numpy_are_flags() -> None:
    assert encode(Bool(data=np.True_)) == encode(Bool(data=True))  # type: ignore[arg-type]
    flags: Any = np.array([True, False])
    assert encode(Switches(is_on=flags)) == encode(Switches(is_on=(True, False)))


def test_decoded_arrays_are_read_only() -> None:
    decoded = decode(Odometry, encode(Odometry()))
    with pytest.raises(ValueError, match="read-only"):
        decoded.pose.covariance[0] = 1.0


def test_a_payload_that_changes_later_does_not_change_the_message() -> None:
    payload = bytearray(encode(PoseWithCovariance(covariance=np.arange(36.0))))
    decoded = decode(PoseWithCovariance, payload)
    payload[:] = bytes(len(payload))
    assert decoded.covariance[35] == 35.0


def test_nested_messages_are_of_our_classes() -> None:
    sample: Any = declared["rbx_samples/action/Fibonacci"]
    request = decode(sample.SendGoal.Request, encode(sample.SendGoal.Request(goal=sample.Goal(order=5))))
    assert type(request.goal) is sample.Goal
    assert type(request.goal_id) is UUID


def test_a_byte_is_unsigned() -> None:
    payload = encode(DiagnosticStatus(level=255))
    assert payload[4] == 255
    assert decode(DiagnosticStatus, payload).level == 255


def test_rosbags_reads_what_we_write() -> None:
    foreign: Any = ORACLE.deserialize_cdr(encode(Twist(linear=Vector3(x=0.3))), Twist.TYPE)
    assert foreign.linear.x == 0.3

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus import wire
from rbxcompose.bus.names import (
    ActionNames,
    Attachment,
    AttachmentError,
    data_key,
    dds_type,
    decode_attachment,
    resolve,
)
from rbxcompose.bus.tokens import EndpointToken, EntityKind, NodeToken, endpoint_pattern, gid, parse_token, session_of
from rbxcompose.bus.wire import SERVICE_QOS, WIRE_PROFILES, RosQos, queue_depth, ros_qos, sending
from rbxcompose.msgs.example_interfaces import AddTwoInts
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk.ports import Qos, name_problem
from tests.loops import for_all

JAZZY = WIRE_PROFILES["jazzy"]

# The examples of rmw_zenoh's own design document.
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD_HASH = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
NODE = "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"
SUBSCRIPTION = (
    "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MS/%/%/listener/%chatter/"
    f"std_msgs::msg::dds_::String_/{STRING_HASH}/::,10:,:,:,,"
)
PUBLISHER = (
    "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/"
    f"std_msgs::msg::dds_::String_/{STRING_HASH}/::,7:,:,:,,"
)
SERVER = (
    "@ros2_lv/2/f9980ee0495eaafb3e38f0d19e2eae12/0/10/SS/%/%/add_two_ints_server/%add_two_ints/"
    f"example_interfaces::srv::dds_::AddTwoInts_/{ADD_HASH}/::,10:,:,:,,"
)

words = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
names = st.lists(words, min_size=1, max_size=4).map("/".join)


def test_tokens_are_those_of_the_design_document() -> None:
    listener = NodeToken(2, "aac3178e146ba6f1fc6e6a4085e77f21", 0, "listener")
    talker = NodeToken(2, "8b20917502ee955ac4476e0266340d5c", 0, "talker")
    server = NodeToken(2, "f9980ee0495eaafb3e38f0d19e2eae12", 0, "add_two_ints_server")
    string, add = dds_type(String.TYPE), dds_type(AddTwoInts.TYPE)
    ten, seven = JAZZY.qos_text(RosQos(depth=10)), JAZZY.qos_text(RosQos(depth=7))
    assert listener.key == NODE
    assert listener.endpoint_key(EntityKind.SUBSCRIPTION, 10, "/chatter", string, STRING_HASH, ten) == SUBSCRIPTION
    assert talker.endpoint_key(EntityKind.PUBLISHER, 10, "/chatter", string, STRING_HASH, seven) == PUBLISHER
    assert (
        server.endpoint_key(EntityKind.SERVER, 10, "/add_two_ints", add, ADD_HASH, JAZZY.qos_text(SERVICE_QOS))
        == SERVER
    )


@pytest.mark.parametrize("key", [NODE, SUBSCRIPTION, PUBLISHER, SERVER])
def test_a_token_that_was_read_is_written_the_same(key: str) -> None:
    token = parse_token(key)
    assert token is not None
    assert token.key == key
    assert session_of(key) == (token if isinstance(token, NodeToken) else token.node).session


@given(domain=st.integers(0, 232), number=st.integers(0, 999), name=names, namespace=names, owner=words)
def test_any_token_survives_the_wire(domain: int, number: int, name: str, namespace: str, owner: str) -> None:
    node = NodeToken(domain, "abc", number, owner, f"/{namespace}")
    token = EndpointToken(
        node, number + 1, EntityKind.CLIENT, f"/{name}", "a::srv::dds_::B_", "RIHS01_0", "::,10:,:,:,,"
    )
    assert parse_token(node.key) == node
    assert parse_token(token.key) == token


def test_what_newer_versions_append_to_a_token_is_left_out() -> None:
    assert parse_token(f"{PUBLISHER}/backends:cpu") == parse_token(PUBLISHER)


@given(st.text(max_size=60))
def test_other_keys_are_no_tokens(text: str) -> None:
    assert parse_token(f"0/{text}") is None


def test_the_pattern_of_peers_leaves_session_node_and_quality_open() -> None:
    assert endpoint_pattern(2, EntityKind.SERVER, "/add_two_ints", dds_type(AddTwoInts.TYPE), ADD_HASH) == (
        f"@ros2_lv/2/*/*/*/SS/*/*/*/%add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD_HASH}/**"
    )


def test_a_gid_is_the_hash_of_the_token_in_little_endian() -> None:
    # The hash of nothing is a published value of XXH3-128: 99aa06d3014798d86001c324468d497f.
    assert gid("").hex() == "7f498d4624c30160d8984701d306aa99"
    assert gid(PUBLISHER).hex() == "ac170f31eadcd9ff0cd86d7a17907d1c"


def test_an_attachment_has_33_bytes() -> None:
    attachment = Attachment(1, 0x0102030405060708, bytes(range(16)))
    expected = "0100000000000000" + "0807060504030201" + "10" + "000102030405060708090a0b0c0d0e0f"
    assert attachment.encode().hex() == expected
    assert decode_attachment(attachment.encode()) == attachment


@given(st.binary(max_size=60))
def test_other_bytes_are_no_attachment(data: bytes) -> None:
    if len(data) == 33 and data[16] == 16:
        return
    with pytest.raises(ValueError, match="attachment of 33 bytes"):
        decode_attachment(data)


def test_keys_hold_the_domain_the_full_name_the_dds_type_and_the_hash() -> None:
    assert data_key(2, "/chatter", String.TYPE, JAZZY.hash_of(String)) == (
        f"2/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"
    )
    assert data_key(0, "/robot1/add_two_ints", AddTwoInts.TYPE, JAZZY.hash_of(AddTwoInts)) == (
        f"0/robot1/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD_HASH}"
    )


def test_the_parts_of_an_action_have_names_and_types_of_their_own() -> None:
    parts = ActionNames.of("/go_to")
    assert parts == ActionNames(
        "/go_to/_action/send_goal",
        "/go_to/_action/get_result",
        "/go_to/_action/cancel_goal",
        "/go_to/_action/feedback",
        "/go_to/_action/status",
    )
    assert dds_type(NavigateToPose.SendGoal.TYPE) == "nav2_msgs::action::dds_::NavigateToPose_SendGoal_"
    assert dds_type(NavigateToPose.FeedbackMessage.TYPE) == "nav2_msgs::action::dds_::NavigateToPose_FeedbackMessage_"


def test_humble_has_no_type_hashes() -> None:
    assert WIRE_PROFILES["humble"].hash_of(String) == "TypeHashNotSupported"
    assert {WIRE_PROFILES[name].hash_of(String) for name in ("jazzy", "kilted", "lyrical")} == {STRING_HASH}


@pytest.mark.parametrize(
    ("name", "namespace", "full"),
    [
        ("odom", "", "/odom"),
        ("odom", "robot1", "/robot1/odom"),
        ("cmd_vel/navigation", "/fleet/robot1", "/fleet/robot1/cmd_vel/navigation"),
        ("/tf", "robot1", "/tf"),
    ],
)
def test_names_are_relative_to_the_namespace_unless_absolute(name: str, namespace: str, full: str) -> None:
    assert resolve(name, namespace) == full


@given(names)
def test_words_joined_by_slashes_are_names(name: str) -> None:
    assert name_problem(name) == ""
    assert resolve(resolve(name)) == resolve(name)


@for_all("name", ["", "/", "a//b", "a/", "2a", "a/2b", "a b", "a-b", "~a", "ä", "a\n", "a" * 248])
def test_what_ros_does_not_allow_is_no_name(name: str) -> None:
    assert name_problem(name)
    with pytest.raises(ValueError):
        resolve(name)


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (Qos.COMMAND, "::,1:,:,:,,"),
        (Qos.STATE, "::,10:,:,:,,"),
        (Qos.LATCHED, ":1:,1:,:,:,,"),
        (Qos.EVENT, "::2,:,:,:,,"),
        (Qos.BULK, "2::,2:,:,:,,"),
    ],
)
def test_each_class_has_its_text_in_tokens(qos: Qos, text: str) -> None:
    assert JAZZY.qos_text(ros_qos(qos)) == text


def test_only_events_wait_on_a_congested_link_and_nothing_else_shares_their_priority() -> None:
    assert [qos for qos in Qos if sending(qos).blocks] == [Qos.EVENT]
    assert len({sending(qos).priority for qos in Qos}) == len(Qos)
    assert sending(Qos.COMMAND).priority == "REAL_TIME"


def test_a_latched_queue_has_room_for_several_publishers() -> None:
    assert [queue_depth(qos) for qos in (Qos.COMMAND, Qos.STATE)] == [1, 10]
    assert queue_depth(Qos.LATCHED) > 1


def test_only_the_profile_knows_in_what_distributions_differ() -> None:
    files = [file for file in Path(wire.__file__).parent.glob("*.py") if file.name != "wire.py"]
    known = re.compile(r"humble|kilted|lyrical|TypeHashNotSupported|\.HASH\b|DEFAULT_DEPTH")
    assert [file.name for file in files if known.search(file.read_text(encoding="utf-8"))] == []


@given(st.binary(max_size=40) | st.binary(min_size=33, max_size=33))
def test_random_bytes_are_an_attachment_that_is_written_alike_or_an_error(data: bytes) -> None:
    try:
        attachment = decode_attachment(data)
    except AttachmentError:
        return
    assert attachment.encode() == data


@given(st.text(max_size=100) | st.lists(st.text(max_size=6) | st.sampled_from(SUBSCRIPTION.split("/"))).map("/".join))
def test_any_text_is_a_token_or_none(key: str) -> None:
    parse_token(key)

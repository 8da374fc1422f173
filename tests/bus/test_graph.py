"""The graph: tokens in, who is there and what they offer out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus.graph import Graph, find
from rbxcompose.bus.names import dds_type, ros_type
from rbxcompose.bus.tokens import EntityKind, NodeToken, gid
from rbxcompose.bus.wire import WIRE_PROFILES, RosQos
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_msgs import Float32, String
from rbxcompose.msgs.types import Interface

JAZZY = WIRE_PROFILES["jazzy"]
BASE, BRAIN = NodeToken(0, "aa", 0, "base"), NodeToken(0, "bb", 1, "brain", "/robot1")


def token(node: NodeToken, kind: EntityKind, name: str, interface: type[Interface], type_hash: str = "") -> str:
    hash_ = type_hash or interface.HASH
    return node.endpoint_key(kind, 7, name, dds_type(interface.TYPE), hash_, JAZZY.qos_text(RosQos(depth=3)))


def test_topics_have_publishers_and_subscriptions_with_their_nodes() -> None:
    key = token(BASE, EntityKind.PUBLISHER, "/level", Float32)
    graph = Graph.of([BASE.key, BRAIN.key, key, token(BRAIN, EntityKind.SUBSCRIPTION, "/level", Float32)])
    assert graph.nodes == ["/base", "/robot1/brain"]
    (topic,) = graph.topics
    assert (topic.name, topic.types, topic.clash) == ("/level", ["std_msgs/msg/Float32"], "")
    assert [(end.node, end.gid, end.qos) for end in topic.givers] == [("/base", gid(key), RosQos(depth=3))]
    assert [end.node for end in topic.takers] == ["/robot1/brain"]
    assert (graph.services, graph.actions) == ([], [])


def test_an_action_is_told_by_the_service_that_takes_its_goals() -> None:
    graph = Graph.of([token(BASE, EntityKind.SERVER, "/go_to/_action/send_goal", NavigateToPose.SendGoal)])
    (action,) = graph.actions
    assert (action.name, action.types) == ("/go_to", ["nav2_msgs/action/NavigateToPose"])
    assert [service.is_hidden for service in graph.services] == [True]


def test_different_types_on_one_topic_are_told() -> None:
    keys = [token(BASE, EntityKind.PUBLISHER, "/a", Float32), token(BRAIN, EntityKind.SUBSCRIPTION, "/a", String)]
    (topic,) = Graph.of(keys).topics
    assert topic.clash == "different types: std_msgs/msg/Float32, std_msgs/msg/String"


def test_different_definitions_of_one_type_are_told() -> None:
    keys = [
        token(BASE, EntityKind.PUBLISHER, "/a", Float32),
        token(BRAIN, EntityKind.SUBSCRIPTION, "/a", Float32, "RIHS01_00"),
    ]
    (topic,) = Graph.of(keys).topics
    assert topic.clash.startswith("different definitions of std_msgs/msg/Float32: RIHS01_7170")


@pytest.mark.parametrize("wanted", ["/level", "level"])
def test_a_name_is_found_with_or_without_its_slash(wanted: str) -> None:
    topics = Graph.of([token(BASE, EntityKind.PUBLISHER, "/level", Float32)]).topics
    found = find(topics, wanted)
    assert found is not None
    assert found.name == "/level"
    assert find(topics, "/lev") is None


def test_a_quality_of_service_that_we_cannot_read_is_none() -> None:
    key = BASE.endpoint_key(EntityKind.PUBLISHER, 7, "/a", dds_type(Float32.TYPE), Float32.HASH, "nonsense")
    assert Graph.of([key]).topics[0].givers[0].qos is None


@given(st.lists(st.text(max_size=30) | st.lists(st.sampled_from("@ros2_lv/0/MP/%:,a"), max_size=40).map("".join)))
def test_no_token_is_too_strange(keys: list[str]) -> None:
    Graph.of(keys)


@pytest.mark.parametrize("qos", [RosQos(), RosQos(False, True, True, 7), RosQos(depth=0), RosQos(keeps_all=True)])
def test_quality_of_service_is_read_as_it_was_written(qos: RosQos) -> None:
    assert JAZZY.read_qos(JAZZY.qos_text(qos)) == qos


def test_a_type_is_read_as_it_was_written() -> None:
    assert ros_type(dds_type("std_srvs/srv/SetBool_Request")) == "std_srvs/srv/SetBool_Request"
    assert ros_type("something::else") == "something::else"

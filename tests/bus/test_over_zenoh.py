from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
import zenoh

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.local import BURST, RefusalReason
from rbxcompose.bus.names import Attachment, decode_attachment
from rbxcompose.bus.tokens import EndpointToken, NodeToken, parse_token
from rbxcompose.bus.zenoh_session import open_peer, open_router
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.example_interfaces import AddTwoInts
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_msgs import Float32, String
from rbxcompose.msgs.unique_identifier_msgs import UUID
from rbxcompose.sdk.bound import Ended, Outcome, Reply
from rbxcompose.sdk.ports import MessageLimits, Qos
from tests.bus.conftest import Connected, Network

Goal, Result, Feedback = NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback


def test_messages_reach_each_subscriber_once_here_and_there(network: Network, one: Connected, other: Connected) -> None:
    here: list[str] = []
    there: list[str] = []
    one.bus.subscribe("here", "chatter", String, Qos.EVENT, lambda message: here.append(message.data))
    heard = other.bus.subscribe("there", "chatter", String, Qos.EVENT, lambda message: there.append(message.data))
    publish = one.bus.publisher("talker", "chatter", String, Qos.EVENT)
    network.until(lambda: publish._remote.has_match)
    texts = [str(number) for number in range(20)]
    for text in texts:
        publish(String(data=text))
    network.until(lambda: len(there) >= len(texts))
    assert here == there == texts
    assert heard.source is not None
    assert (heard.source.sequence, heard.source.gid) == (20, publish.gid)
    assert heard.age < 1.0


def test_nothing_is_encoded_while_nobody_elsewhere_listens(network: Network, one: Connected, other: Connected) -> None:
    one.bus.subscribe("here", "chatter", String, Qos.STATE, lambda message: None)
    publish = one.bus.publisher("talker", "chatter", String, Qos.STATE)
    assert not publish._remote.has_match
    other.bus.subscribe("there", "chatter", String, Qos.STATE, lambda message: None)
    network.until(lambda: publish._remote.has_match)
    other.bus.close_owner("there")
    network.until(lambda: not publish._remote.has_match)


def publish_and_wait(network: Network, one: Connected, other: Connected, topic: str) -> None:
    """Publish on a topic of its own and wait for it: what `one` sent before has left, or arrived, by then."""
    heard: list[String] = []
    other.bus.subscribe("waiting", topic, String, Qos.LATCHED, heard.append)
    one.bus.publisher("waiting", topic, String, Qos.LATCHED)(String())
    network.until(lambda: heard)


def test_a_latched_message_reaches_late_subscribers_once_and_its_publisher_may_start_again(
    network: Network, one: Connected, other: Connected
) -> None:
    here: list[str] = []
    there: list[str] = []
    publish = one.bus.publisher("map", "map", String, Qos.LATCHED)
    publish(String(data="old"))
    publish(String(data="first"))
    publish_and_wait(network, one, other, "before")
    one.bus.subscribe("here", "map", String, Qos.LATCHED, lambda message: here.append(message.data))
    other.bus.subscribe("there", "map", String, Qos.LATCHED, lambda message: there.append(message.data))
    network.until(lambda: there)
    one.bus.close_owner("map")
    one.bus.publisher("map", "map", String, Qos.LATCHED)(String(data="second"))
    network.until(lambda: len(there) >= 2)
    publish_and_wait(network, one, other, "after")
    assert here == there == ["first", "second"]


def test_a_slow_handler_does_not_stall_another_topic(network: Network, one: Connected, other: Connected) -> None:
    slow: list[float] = []
    fast: list[float] = []

    def dawdle(message: Float32) -> None:
        end = time.monotonic() + 0.02
        while time.monotonic() < end:
            pass
        slow.append(message.data)

    flooded = other.bus.subscribe("slow", "slow", Float32, Qos.BULK, dawdle)
    other.bus.subscribe("fast", "fast", Float32, Qos.COMMAND, lambda message: fast.append(message.data))
    flood = one.bus.publisher("source", "slow", Float32, Qos.BULK)
    single = one.bus.publisher("source", "fast", Float32, Qos.COMMAND)
    network.until(lambda: flood._remote.has_match and single._remote.has_match)
    for number in range(2000):
        flood(Float32(data=float(number)))
    single(Float32(data=1.0))
    network.until(lambda: fast and slow)  # to handle the flood one by one would take 40 s
    assert flooded.dropped > 0


def test_bad_input_is_refused_counted_by_reason_and_logged_once(
    network: Network, one: Connected, other: Connected
) -> None:
    got: list[Twist] = []
    heard = other.bus.subscribe("base", "cmd_vel", Twist, Qos.COMMAND, got.append)
    publish = one.bus.publisher("teleop", "cmd_vel", Twist, Qos.COMMAND)
    network.until(lambda: publish._remote.has_match)
    source, good = Attachment(1, 0, bytes(16)).encode(), encode(Twist())
    bad = [
        (good[:-1], source),
        (good + bytes(17), source),
        (good, b""),
        (good, source + b"x"),
        (b"\x07" + good, source),
        (encode(Twist(linear=Vector3(x=math.nan))), source),
        (encode(Twist(angular=Vector3(z=math.inf))), source),
    ]
    for number, (payload, attachment) in enumerate(bad, 1):  # one by one, since a command keeps only the newest
        publish._remote.put(payload, attachment)
        network.until(lambda number=number: heard.refusals.total == number)  # type: ignore[misc]
    publish(Twist(linear=Vector3(x=0.1)))
    network.until(lambda: got)
    assert got == [Twist(linear=Vector3(x=0.1))]
    assert heard.refusals.news() == {
        RefusalReason.LENGTH: 2,
        RefusalReason.ATTACHMENT: 2,
        RefusalReason.CONTENT: 1,
        RefusalReason.NOT_FINITE: 2,
    }
    assert [text.partition(":")[0] for _, text in other.log] == ["dropped a message on /cmd_vel"]


def test_a_flood_of_commands_is_capped_before_anything_is_decoded_and_other_topics_go_on(
    network: Network, one: Connected, other: Connected
) -> None:
    got: list[Twist] = []
    levels: list[Float32] = []
    heard = other.bus.subscribe("base", "cmd_vel", Twist, Qos.COMMAND, got.append, max_rate=50.0)
    other.bus.subscribe("charger", "level", Float32, Qos.STATE, levels.append)
    flood = one.bus.publisher("teleop", "cmd_vel", Twist, Qos.COMMAND)
    level = one.bus.publisher("battery", "level", Float32, Qos.STATE)
    network.until(lambda: flood._remote.has_match and level._remote.has_match)
    payload, source = encode(Twist()), Attachment(1, 0, bytes(16)).encode()
    started = other.clock.now()

    def has_flooded() -> bool:
        for _ in range(1000):
            flood._remote.put(payload, source)
        return heard.refusals.total > 1000  # a congested link drops most of it by itself

    network.until(has_flooded)
    level(Float32(data=0.5))
    network.until(lambda: levels and got)
    lasted = other.clock.now() - started
    assert heard._inbox._arrived <= 50.0 * (lasted + BURST)
    assert set(heard.refusals.news()) == {RefusalReason.TOO_MANY}


def test_a_message_that_is_too_large_is_refused_unread(network: Network, one: Connected, other: Connected) -> None:
    got = list[Twist]()
    size_of_a_twist = MessageLimits(size=52)
    heard = other.bus.subscribe("base", "moved", Twist, Qos.STATE, got.append, limits=size_of_a_twist)
    moved = one.bus.publisher("base", "moved", Twist, Qos.STATE)
    network.until(lambda: moved._remote.has_match)
    moved._remote.put(bytes(53), Attachment(1, 0, bytes(16)).encode())
    moved(Twist())
    network.until(lambda: got and heard.refusals.news() == {RefusalReason.TOO_LARGE: 1})


def test_another_type_on_the_same_topic_is_never_delivered(network: Network, one: Connected, other: Connected) -> None:
    got: list[object] = []
    other.bus.subscribe("there", "t", String, Qos.EVENT, got.append)
    other.bus.subscribe("there", "t", Float32, Qos.EVENT, got.append)
    publish = one.bus.publisher("source", "t", Float32, Qos.EVENT)
    network.until(lambda: publish._remote.has_match)
    publish(Float32(data=1.0))
    network.until(lambda: got)
    assert got == [Float32(data=1.0)]


def test_a_service_answers_fails_and_goes_away(network: Network, one: Connected, other: Connected) -> None:
    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a < 0:
            raise ValueError("too small")
        return AddTwoInts.Response(sum=request.a + request.b)

    call = one.bus.client("client", "add", AddTwoInts)
    changes: list[bool] = []
    call.watch(changes.append)
    other.bus.serve("server", "add", AddTwoInts, add)
    network.until(lambda: call.is_available)
    replies: list[Reply[AddTwoInts.Response]] = []
    call(AddTwoInts.Request(a=2, b=3), replies.append)
    network.until(lambda: len(replies) == 1)
    call(AddTwoInts.Request(a=-1), replies.append)
    network.until(lambda: len(replies) == 2)
    assert replies == [Reply(AddTwoInts.Response(sum=5)), Reply(None, "ValueError: too small")]
    assert [owner for owner, _ in other.errors] == ["server"]
    other.bus.close_owner("server")
    network.until(lambda: not call.is_available)
    assert changes == [True, False]


def test_a_call_that_nobody_answers_ends_after_its_timeout(network: Network, one: Connected, other: Connected) -> None:
    call = one.bus.client("client", "go_to/_action/get_result", NavigateToPose.GetResult)
    server = other.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: "")
    send = one.bus.action_client("client", "go_to", NavigateToPose)
    network.until(lambda: call.is_available and send.is_available)
    goal = send(Goal(), lambda end: None)
    network.until(lambda: server.current)
    replies: list[object] = []
    call(NavigateToPose.GetResult.Request(goal_id=UUID(goal.id)), replies.append, timeout=0.05)
    network.until(lambda: replies)
    assert replies == [Reply(None, "no reply within 0.05 s")]


def test_an_action_is_carried_out_cancelled_and_left(network: Network, one: Connected, other: Connected) -> None:
    server = other.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: goal.behavior_tree)
    send = one.bus.action_client("mission", "go_to", NavigateToPose)
    network.until(lambda: send.is_available)
    ends: list[Ended[NavigateToPose.Result]] = []
    heard: list[NavigateToPose.Feedback] = []

    send(Goal(behavior_tree="too far: " + "\u00fc" * 200), ends.append)  # more than an encoding of Zenoh can hold
    network.until(lambda: len(ends) == 1)
    assert ends == [Ended(Outcome.REJECTED, message="too far: " + "\u00fc" * 116)]

    send(Goal(), ends.append, heard.append)
    network.until(lambda: server.current)
    running = server.current
    assert running is not None

    def report() -> bool:  # again and again: the server may learn of the goal before it learns who listens
        running.feedback(Feedback(distance_remaining=2.0))
        return bool(heard)

    network.until(report)
    running.succeeded()
    network.until(lambda: len(ends) == 2)

    send(Goal(), ends.append).cancel()
    network.until(lambda: server.current and server.current.cancel_requested)
    assert server.current is not None
    server.current.canceled()
    network.until(lambda: len(ends) == 3)

    assert set(heard) == {Feedback(distance_remaining=2.0)}
    assert [end.outcome for end in ends] == [Outcome.REJECTED, Outcome.SUCCEEDED, Outcome.CANCELED]

    send(Goal(), ends.append)
    network.until(lambda: server.current)
    one.bus.close_owner("mission")
    network.until(lambda: server.current and server.current.cancel_requested)


def test_a_server_that_starts_again_in_place_loses_its_goal_once(
    network: Network, one: Connected, other: Connected
) -> None:
    send = one.bus.action_client("mission", "go_to", NavigateToPose)
    ends: list[Ended[NavigateToPose.Result]] = []
    server = other.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: "")
    network.until(lambda: send.is_available)
    send(Goal(), ends.append)
    network.until(lambda: server.current)
    other.bus.close_owner("base")
    server = other.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: "")
    network.until(lambda: ends)
    assert [end.outcome for end in ends] == [Outcome.LOST]
    network.until(lambda: send.is_available)
    send(Goal(), ends.append)
    network.until(lambda: server.current)
    assert len(ends) == 1


def test_a_killed_server_is_lost_within_a_second(network: Network, one: Connected) -> None:
    send = one.bus.action_client("mission", "go_to", NavigateToPose)
    ends: list[Ended[NavigateToPose.Result]] = []
    heard: list[NavigateToPose.Feedback] = []
    child = subprocess.Popen([sys.executable, "-m", "tests.bus.lone_server", str(network.port)])
    try:
        network.until(lambda: send.is_available, within=10.0)
        send(Goal(), ends.append, heard.append)
        network.until(lambda: heard)
        os.kill(child.pid, signal.SIGKILL)
        assert network.until(lambda: ends) < 1.0
    finally:
        child.kill()
        child.wait()
    assert [end.outcome for end in ends] == [Outcome.LOST]
    network.until(lambda: not send.is_available)


def test_a_component_is_seen_with_all_its_ends_and_not_after_it_was_closed(
    network: Network, one: Connected, other: Connected
) -> None:
    seen: set[str] = set()
    other.transport.watch("@ros2_lv/0/**", lambda key, is_there: seen.add(key) if is_there else seen.discard(key))
    one.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: "")
    one.bus.subscribe("base", "cmd_vel", Float32, Qos.COMMAND, lambda message: None)
    network.until(lambda: len(seen) == 7)
    tokens = [parse_token(key) for key in seen]
    assert [token.name for token in tokens if isinstance(token, NodeToken)] == ["base"]
    ends = sorted((str(token.kind), token.name) for token in tokens if isinstance(token, EndpointToken))
    assert ends == [
        ("MP", "/go_to/_action/feedback"),
        ("MP", "/go_to/_action/status"),
        ("MS", "/cmd_vel"),
        ("SS", "/go_to/_action/cancel_goal"),
        ("SS", "/go_to/_action/get_result"),
        ("SS", "/go_to/_action/send_goal"),
    ]
    one.bus.close_owner("base")
    network.until(lambda: not seen)


@pytest.fixture
def stranger(network: Network) -> Iterator[zenoh.Session]:
    """A session that knows Zenoh and the wire of ROS 2, and nothing of us."""
    session = open_peer(f"tcp/127.0.0.1:{network.port}")
    yield session
    session.close()  # type: ignore[no-untyped-call]


def test_a_stranger_sees_the_bytes_of_ros_on_a_topic(network: Network, one: Connected, stranger: zenoh.Session) -> None:
    subscriber = stranger.declare_subscriber(f"0/chatter/std_msgs::msg::dds_::String_/{String.HASH}")
    publish = one.bus.publisher("talker", "chatter", String, Qos.STATE)
    network.until(lambda: publish._remote.has_match)
    before = time.time_ns()
    publish(String(data="hi"))
    samples: list[zenoh.Sample | None] = [None]
    network.until(lambda: samples.append(subscriber.try_recv()) or samples[-1])  # type: ignore[func-returns-value]
    sample = samples[-1]
    assert sample is not None
    assert sample.payload.to_bytes().hex() == "00010000" + "03000000" + "686900"
    assert sample.attachment is not None
    source = decode_attachment(sample.attachment.to_bytes())
    assert source == (1, source.stamp, publish.gid)
    assert before <= source.stamp <= time.time_ns()


def test_a_stranger_that_asks_gets_its_sequence_and_gid_back(
    network: Network, one: Connected, stranger: zenoh.Session
) -> None:
    one.bus.serve("server", "add", AddTwoInts, lambda request: AddTwoInts.Response(sum=request.a + request.b))
    key = f"0/add/example_interfaces::srv::dds_::AddTwoInts_/{AddTwoInts.HASH}"
    querier = stranger.declare_querier(key, target=zenoh.QueryTarget.ALL_COMPLETE)
    status: Any = querier
    network.until(lambda: status.matching_status.matching)
    payload = bytes.fromhex("00010000" + "0200000000000000" + "0300000000000000")
    replies = querier.get(payload=payload, attachment=Attachment(41, 7, bytes(range(16))).encode())
    samples: list[zenoh.Reply | None] = [None]
    network.until(lambda: samples.append(replies.try_recv()) or samples[-1])  # type: ignore[func-returns-value]
    reply = samples[-1]
    assert reply is not None
    assert reply.ok is not None
    assert reply.ok.payload.to_bytes().hex() == "00010000" + "0500000000000000"
    assert reply.ok.attachment is not None
    source = decode_attachment(reply.ok.attachment.to_bytes())
    assert (source.sequence, source.gid) == (41, bytes(range(16)))
    assert source.stamp > 7


def test_processes_find_each_other_whenever_the_router_comes(network: Network) -> None:
    network.stop_router()
    one, other = network.process(), network.process()
    got: list[String] = []
    other.bus.subscribe("there", "chatter", String, Qos.STATE, got.append)
    publish = one.bus.publisher("talker", "chatter", String, Qos.STATE)
    network.start_router()
    network.until(lambda: publish._remote.has_match)
    network.stop_router()
    publish(String(data="without a router"))
    network.until(lambda: got)


def test_a_port_that_is_taken_is_an_os_error() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(OSError, match="is taken"):
            open_router(tcp_endpoint(taken.getsockname()[1]))

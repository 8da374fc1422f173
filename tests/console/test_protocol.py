"""rosbridge v2, without a socket: what each operation does, and what a bad frame gets."""

from __future__ import annotations

import json
import math
import time
from typing import Any
from unittest import mock

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rbxcompose.base.garbage_collection import paused_collection
from rbxcompose.domains.console import json_messages
from rbxcompose.domains.console.access import Role
from rbxcompose.domains.console.json_messages import WrongMessageError, from_json, numbers_of, to_json
from rbxcompose.domains.console.lease import DriveLimits
from rbxcompose.domains.console.protocol import (
    LARGEST,
    MOST_FRAMES,
    MOST_PER_SECOND,
    MOST_SUBSCRIPTIONS,
    MOST_VALUES,
    RELEASE,
    Advertise,
    AskRobot,
    BusRequest,
    EditMission,
    Publish,
    ReadTested,
    SaveSettings,
    SendGoal,
    Serve,
    ServeAction,
    ServiceCall,
    Subscribe,
    TailLog,
    Unwatch,
    Watch,
    Withdraw,
)
from rbxcompose.msgs.action_msgs import GoalStatusArray
from rbxcompose.msgs.geometry_msgs import PoseStamped, Twist, Vector3
from rbxcompose.msgs.rcl_interfaces import GetParameters, ParameterValue
from rbxcompose.msgs.sensor_msgs import Image, LaserScan
from rbxcompose.msgs.std_msgs import ColorRGBA, Float32, Header, String
from rbxcompose.msgs.std_srvs import SetBool
from tests.console.clients import STAMP, TELEOP, Room
from tests.loops import for_all


def level(percent: float) -> Float32:
    return Float32(data=percent)


def test_a_topic_is_on_the_bus_only_while_a_client_wants_it() -> None:
    room = Room()
    one, two = room.client(), room.client()
    assert one.does("subscribe", topic="/level") == []
    assert two.does("subscribe", topic="level", type="std_msgs/Float32") == []
    assert room.asked() == [Subscribe("/level", Float32)]
    room.arrives("/level", level(50))
    assert one.gets() == [{"op": "publish", "topic": "/level", "msg": {"data": 50.0}}]
    assert two.gets() == [{"op": "publish", "topic": "level", "msg": {"data": 50.0}}]  # as it calls it
    one.does("unsubscribe", topic="/level")
    assert room.asked() == []
    two.leaves()
    assert room.asked() == [Withdraw(Subscribe, "/level")]


def test_a_message_is_encoded_once_for_all_and_only_for_who_takes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    room, encoded = Room(), list[object]()
    monkeypatch.setattr(
        "rbxcompose.domains.console.protocol.encoded",
        lambda message: encoded.append(message) or json_messages.encoded(message),  # type: ignore[func-returns-value]
    )
    clients = [room.client() for _ in range(20)]
    for client in clients:
        client.does("subscribe", topic="/level")
    for count in range(30):
        room.arrives("/level", level(count))
    assert encoded == []
    received = [client.gets() for client in clients]
    assert [frame["msg"]["data"] for frame in received[0]] == list(range(20, 30))  # the newest
    assert all(frames == received[0] for frames in received)
    assert len(encoded) == 10


def test_a_throttle_keeps_the_rate_on_average() -> None:
    room = Room()
    client = room.client()
    client.does("subscribe", topic="/level", throttle_rate=250)
    got = []
    for count in range(150):  # 50 Hz for 3 s
        room.now = count * 0.02
        room.arrives("/level", level(count))
        got += client.gets()
    assert len(got) == 12


def test_the_lowest_throttle_and_the_longest_queue_of_several_subscriptions_count() -> None:
    room = Room()
    client = room.client()
    client.does("subscribe", topic="/level", id="slow", throttle_rate=1000, queue_length=2)
    client.does("subscribe", topic="/level", id="fast", throttle_rate=100)
    for count in range(4):
        room.arrives("/level", level(count))
    assert [frame["msg"]["data"] for frame in client.gets()] == [2.0]
    assert room.bridge.pause(client.number, room.now) == pytest.approx(0.1)
    room.now = 0.1
    assert [frame["msg"]["data"] for frame in client.gets()] == [3.0]
    assert room.bridge.pause(client.number, room.now) == math.inf
    client.does("unsubscribe", topic="/level", id="fast")
    room.now = 0.2
    for count in range(5, 10):
        room.arrives("/level", level(count))
    assert [frame["msg"]["data"] for frame in client.gets()] == [8.0]
    room.now = 0.9
    assert client.gets() == []
    room.now = 1.0
    assert [frame["msg"]["data"] for frame in client.gets()] == [9.0]
    room.asked()
    client.does("unsubscribe", topic="/level", id="slow")
    assert room.asked() == [Withdraw(Subscribe, "/level")]


def test_clients_that_came_at_different_times_get_the_same_messages() -> None:
    room = Room()
    clients = []
    for turn in range(4):
        room.now = turn * 0.03
        clients.append(client := room.client())
        client.does("subscribe", topic="/level", type="std_msgs/Float32", throttle_rate=100)
    got: list[list[float]] = [[] for _ in clients]
    for step in range(100):
        room.now = 0.2 + step * 0.02
        if room.bridge.wants("/level", room.now):
            room.arrives("/level", level(step))
        for client, numbers in zip(clients, got, strict=True):
            numbers += (frame["msg"]["data"] for frame in client.gets())
    assert got[0] == got[1] == got[2] == got[3]
    assert len(got[0]) == pytest.approx(20, abs=1)


def test_topics_take_turns() -> None:
    room = Room()
    client = room.client()
    for topic in ("/level", "/other"):
        client.does("subscribe", topic=topic, type="std_msgs/msg/Float32")
    for count in range(3):
        room.arrives("/level", level(count))
        room.arrives("/other", level(count))
    assert [frame["topic"] for frame in client.gets()] == ["/level", "/other"] * 3


def test_a_late_client_gets_the_last_message_of_a_latched_topic() -> None:
    room = Room()
    room.graph.latched.add("/level")
    early, late = room.client(), room.client()
    early.does("subscribe", topic="/level")
    room.arrives("/level", level(7))
    assert late.does("subscribe", topic="/level")[0]["msg"] == {"data": 7.0}


def test_messages_are_published_with_defaults_and_a_stamp() -> None:
    room = Room()
    client = room.client()
    assert client.does("advertise", topic="/goal", type="geometry_msgs/PoseStamped") == []
    assert client.does("publish", topic="/goal", msg={"pose": {"position": {"x": 1}}}) == []
    advertised, published = room.asked()
    assert advertised == Advertise("/goal", PoseStamped)
    assert isinstance(published, Publish)
    made: Any = published.message
    assert (made.pose.position.x, made.pose.orientation.w) == (1.0, 1.0)
    assert (made.header.stamp.sec, made.header.stamp.nanosec) == divmod(STAMP, 10**9)
    client.does("unadvertise", topic="goal")
    assert room.asked() == [Withdraw(Advertise, "/goal")]


def test_a_topic_is_advertised_until_the_last_that_did_so_in_a_client_does_no_longer() -> None:
    room = Room()
    client = room.client()
    for name in ("first", "second", "second"):
        client.does("advertise", topic="/goal", type="geometry_msgs/PoseStamped", id=name)
    assert room.asked() == [Advertise("/goal", PoseStamped)]
    assert client.does("unadvertise", topic="/goal", id="second") == []
    assert room.asked() == []
    assert client.does("unadvertise", topic="/goal", id="first") == []
    assert room.asked() == [Withdraw(Advertise, "/goal")]
    client.does("advertise", topic="/goal", type="geometry_msgs/PoseStamped", id="first")
    assert client.does("unadvertise", topic="/goal") == []  # all of them
    assert room.asked() == [Advertise("/goal", PoseStamped), Withdraw(Advertise, "/goal")]


def test_the_status_of_an_action_needs_no_type() -> None:
    room = Room()
    assert room.client().does("subscribe", topic="/go_to/_action/status") == []
    assert room.asked() == [Subscribe("/go_to/_action/status", GoalStatusArray)]


def test_a_topic_that_exists_needs_no_type_and_no_advertisement() -> None:
    room = Room()
    client = room.client()
    assert client.does("publish", topic="level", msg={"data": 3}) == []
    assert room.asked() == [Advertise("/level", Float32), Publish("/level", level(3.0))]
    client.leaves()
    assert room.asked() == [Withdraw(Advertise, "/level")]


def test_services_are_called_with_maps_and_lists() -> None:
    room = Room()
    client = room.client()
    for args in ({"data": True}, [True]):
        assert client.does("call_service", service="lamp", args=args, id="call:1", timeout=3) == []
        (call,) = room.asked()
        assert isinstance(call, ServiceCall)
        assert (call.service, call.request, call.timeout) == ("/lamp", SetBool.Request(data=True), 3.0)
        room.bridge.answered(call.number, SetBool.Response(success=True, message="on"))
        values = {"success": True, "message": "on"}
        answer = {"op": "service_response", "id": "call:1", "service": "lamp", "values": values, "result": True}
        assert client.gets() == [answer]


@for_all("given, wanted", [(60, 60.0), (100, 60.0), (math.inf, 60.0), (0.5, 0.5), (0, 10.0), (-1, 10.0), (None, 10.0)])
def test_a_call_waits_as_long_as_its_client_says_but_not_for_ever(given: float | None, wanted: float) -> None:
    room = Room()
    assert room.client().does("call_service", service="lamp", timeout=given) == []
    (call,) = room.asked()
    assert isinstance(call, ServiceCall)
    assert call.timeout == wanted


def test_each_failed_call_is_answered_with_values() -> None:
    room = Room()
    client = room.client()
    for service, args, why in (
        ("/none", {}, "there is no service"),
        ("/strange", {}, "is not known here"),
        ("/lamp", {"datum": 1}, "has no field 'datum'"),
        ("/lamp", [True, True], "has 1 fields"),
        ("/lamp", {"data": 10**400}, "expected"),
        ("/console/ask", {"type": "mission.RunMission", "mission": "\ud800"}, "surrogates"),
        ("/rosapi/set_param", {}, "'name' is a text"),
        ("/rosapi/get_param", {}, "'name' is a text"),
        ("/rosapi/set_param", {"name": "/nobody:speed", "value": "1"}, "no node with a parameter"),
        ("/rosapi/message_details", {"type": "toy_msgs/Toy"}, "is not known here"),
        ("/rosapi/nonsense", {}, "there is no service"),
        ("/rosapi/topic_type", {}, "'topic' is a text"),
        ("/console/drive", {"take": "yes"}, "true or false"),
        ("/console/drive", 7, "a map or a list"),
    ):
        (answer,) = client.does("call_service", service=service, args=args)
        assert (answer["result"], why in answer["values"]) == (False, True), answer
    client.does("call_service", service="/lamp")
    call = room.asked()[-1]
    assert isinstance(call, ServiceCall)
    room.bridge.answered(call.number, None, "the server is gone")
    assert client.gets()[0]["values"] == "the server is gone"
    (answer,) = client.does("call_service", service="/lamp", timeout="5")
    assert answer["values"] == "'timeout' is a number of seconds"


def test_an_answer_for_a_client_that_is_gone_is_dropped() -> None:
    room = Room()
    client = room.client()
    client.does("call_service", service="/lamp")
    (call,) = room.asked()
    assert isinstance(call, ServiceCall)
    client.leaves()
    room.bridge.answered(call.number, SetBool.Response())


def test_rosapi_answers_with_and_without_a_slash() -> None:
    client = Room().client()
    for prefix in ("/", ""):
        assert client.calls(f"{prefix}rosapi/topics")["topics"] == ["/odom", "/level", TELEOP]
        assert client.calls(f"{prefix}rosapi/topic_type", {"topic": "level"}) == {"type": "std_msgs/msg/Float32"}
        assert client.calls(f"{prefix}rosapi/topic_type", ["/none"]) == {"type": ""}
        assert client.calls(f"{prefix}rosapi/service_type", {"service": "lamp"}) == {"type": "std_srvs/srv/SetBool"}
        assert client.calls(f"{prefix}rosapi/topics_for_type", {"type": "std_msgs/Float32"}) == {"topics": ["/level"]}
        assert client.calls(f"{prefix}rosapi/services_for_type", ["std_srvs/SetBool"]) == {"services": ["/lamp"]}
        assert client.calls(f"{prefix}rosapi/publishers", {"topic": "odom"}) == {"publishers": ["/base"]}
        assert client.calls(f"{prefix}rosapi/subscribers", {"topic": "odom"}) == {"subscribers": []}
        assert client.calls(f"{prefix}rosapi/nodes") == {"nodes": ["/base"]}
        assert client.calls(f"{prefix}rosapi/get_time")["time"] == {"sec": 5, "nanosec": 7, "secs": 5, "nsecs": 7}


def test_each_listed_service_has_a_type_by_which_it_is_found() -> None:
    client = Room().client()
    services = client.calls("/rosapi/services")["services"]
    types = {name: client.calls("/rosapi/service_type", [name])["type"] for name in services}
    for name, type_ in types.items():
        for spelling in (type_, type_.replace("/srv/", "/")):
            assert name in client.calls("/rosapi/services_for_type", [spelling])["services"]
    assert types["/rosapi/topics_for_type"] == "rosapi_msgs/srv/TopicsForType"
    assert types["/rosapi/get_param"] == "rosapi_msgs/srv/GetParam"
    assert types["/rosapi/get_ros_version"] == "rosapi_msgs/srv/GetROSVersion"
    assert types["/rosapi/action_servers"] == "rosapi_msgs/srv/GetActionServers"


def test_rosapi_lists_the_interfaces_of_each_kind() -> None:
    found = Room().client().calls("/rosapi/interfaces")["interfaces"]
    assert {"geometry_msgs/msg/Twist", "std_srvs/srv/SetBool", "nav2_msgs/action/NavigateToPose"} < {*found}
    assert found == sorted(found)


def test_anyone_may_stop_and_release_the_robot() -> None:
    room = Room()
    client = room.client()
    for what, says in (("stop", {"by": "the console"}), ("release", {})):
        assert client.does("call_service", service=f"/console/{what}", id="x") == []
        (asked,) = room.asked()
        assert isinstance(asked, AskRobot)
        assert asked.request == {"type": f"robot.{what.title()}Robot", **says}
        room.bridge.robot_answered(asked.number, "done")
        assert client.gets()[0]["values"] == {"success": True, "message": "done", "answer": "done"}


def test_a_request_goes_to_the_robot_and_its_answer_comes_back() -> None:
    room = Room()
    client = room.client()
    assert (
        client.calls("/console/ask", {"mission": "patrol"})
        == "'type' is the name of a request, such as 'mission.ListMissions'"
    )
    request = {"type": "mission.PauseMission", "mission": "patrol"}
    answers: list[tuple[object, object, str]] = [([1, math.nan], [1, None], ""), (None, None, "it is not running")]
    for answer, shown, refusal in answers:
        assert client.does("call_service", service="/console/ask", args=request) == []
        (asked,) = room.asked()
        assert isinstance(asked, AskRobot)
        assert asked.request == request
        room.bridge.robot_answered(asked.number, answer, refusal)
        assert client.gets()[0]["values"] == {"success": not refusal, "message": refusal, "answer": shown}


def test_a_window_is_looked_through_as_often_as_the_most_curious_client_wants_and_shows_changes() -> None:
    room = Room()
    window = "/console/windows/mux/LookAtMux/component/cmd_vel"
    query = {"type": "mux.LookAtMux", "component": "cmd_vel"}
    one, other = room.client(), room.client()
    one.does("subscribe", topic=window, throttle_rate=1000)
    assert room.asked() == [Watch(window, query, 1.0)]
    other.does("subscribe", topic=window)
    assert room.asked() == [Watch(window, query, 0.2)]
    for _ in range(2):
        room.bridge.seen(window, {"holder": "teleop"}, room.now)
    assert [client.gets()[0]["msg"] for client in (one, other)] == [{"answer": {"holder": "teleop"}}] * 2
    assert other.gets() == []
    late = room.client()
    assert late.does("subscribe", topic=window)[0]["msg"] == {"answer": {"holder": "teleop"}}
    room.bridge.seen(window, None, room.now, "it has failed")
    assert late.gets()[0]["msg"] == {"refused": "it has failed"}
    for client in (other, late):
        client.leaves()
    assert room.asked() == [Watch(window, query, 1.0)]
    one.does("unsubscribe", topic=window)
    assert room.asked() == [Unwatch(window)]


def test_a_window_shows_when_the_page_has_another_configuration() -> None:
    room = Room()
    room.bridge.show_config({"places": {}})
    client = room.client()
    (shown,) = client.does("subscribe", topic="/console/windows/config")
    assert shown["msg"] == {"answer": {"places": {}}}
    room.bridge.show_config({"places": {}})
    assert client.gets() == []
    room.bridge.show_config({"places": {"dock": {"x": 1.0}}})
    assert client.gets()[0]["msg"] == {"answer": {"places": {"dock": {"x": 1.0}}}}
    client.does("unsubscribe", topic="/console/windows/config")


def test_what_reaches_nobody_is_not_wanted() -> None:
    room = Room()
    first, second = room.client(), room.client()
    for client, throttle in ((first, 100), (second, 500)):
        client.does("subscribe", topic="/battery_level", type="std_msgs/Float32", throttle_rate=throttle)
    assert room.bridge.wants("/battery_level", room.now)
    room.bridge.arrived("/battery_level", Float32(), room.now)
    assert [room.bridge.wants("/battery_level", room.now + later) for later in (0.05, 0.1)] == [False, True]
    first.leaves()
    assert [room.bridge.wants("/battery_level", room.now + later) for later in (0.4, 0.5)] == [False, True]
    assert not room.bridge.wants("/odom", room.now)


@pytest.mark.parametrize("path", ["mission", "mission/ListMissions/name", "x/y/z/w/v"])
def test_what_is_no_window_is_refused(path: str) -> None:
    (status,) = Room().client().does("subscribe", topic=f"/console/windows/{path}")
    assert "a subject, a query, and its fields" in status["msg"]


@for_all(
    "frame, why",
    [
        ("", "not JSON"),
        ("{", "not JSON"),
        (b"\xff\xfe", "not JSON"),
        ("7", "a map"),
        ("[]", "a map"),
        ("null", "a map"),
        ("{}", "'op'"),
        ('{"op": 3}', "'op'"),
        ('{"op": "dance"}', "no operation 'dance'"),
        ('{"op": "subscribe"}', "'topic'"),
        ('{"op": "subscribe", "topic": "a b"}', "'topic'"),
        ('{"op": "subscribe", "topic": "/new"}', "its type must be given"),
        ('{"op": "subscribe", "topic": "/new", "type": "a/msg/B"}', "not known here"),
        ('{"op": "subscribe", "topic": "/new", "type": "../../etc"}', "not the name of a type"),
        ('{"op": "subscribe", "topic": "/level", "type": "std_msgs/String"}', "is of the type"),
        ('{"op": "subscribe", "topic": "/level", "id": []}', "'id'"),
        ('{"op": "subscribe", "topic": "/level", "throttle_rate": -1}', "'throttle_rate'"),
        ('{"op": "subscribe", "topic": "/level", "throttle_rate": NaN}', "'throttle_rate'"),
        ('{"op": "subscribe", "topic": "/level", "queue_length": "5"}', "'queue_length'"),
        ('{"op": "subscribe", "topic": "/level", "compression": "zip"}', "not 'zip'"),
        ('{"op": "unsubscribe", "topic": "/level"}', "no subscription"),
        ('{"op": "unadvertise", "topic": "/level"}', "not advertised"),
        ('{"op": "publish", "topic": "/level", "msg": 3}', "is a map of its fields"),
        ('{"op": "publish", "topic": "/level", "msg": {"data": "x"}}', "expected a number"),
        ('{"op": "publish", "topic": "/text", "type": "std_msgs/String", "msg": {"data": "\\ud800"}}', "surrogates"),
        ('{"op": "call_service"}', "'service'"),
        (f'{{"op": "service_response", "service": "/x", "id": "{"1" * 5000}"}}', "no open request"),
        ('{"op": "set_level", "level": "loud"}', "a level"),
        (f'{{"op": "set_level", "level": {"[" * 101}{"]" * 101}}}', "nested"),
        ('{"op":' * 10_000 + "1" + "}" * 10_000, "nested"),
        ('{"op": "publish", "msg": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested"),
        (" " * (LARGEST + 1), "at most 8 MiB"),
    ],
)
def test_a_bad_frame_gets_a_status(frame: str | bytes, why: str) -> None:
    room = Room()
    client = room.client()
    client.sends(frame)
    (status,) = client.gets()
    assert (status["op"], status["level"]) == ("status", "error")
    assert why in status["msg"]
    assert client.calls("/rosapi/nodes") == {"nodes": ["/base"]}  # it goes on


def test_a_client_chooses_what_it_is_told() -> None:
    client = Room().client()
    assert client.does("set_level", level="none") == []
    assert client.does("dance") == []
    client.does("set_level", level="error")
    assert len(client.does("dance")) == 1
    assert client.does("status", level="info", msg="hello") == []


def test_a_flood_of_frames_is_dropped_with_one_word_a_second() -> None:
    room = Room()
    client, other = room.client(), room.client()
    for _ in range(MOST_PER_SECOND):
        client.sends('{"op": "status"}')
    got = [frame for _ in range(300) for frame in client.does("dance")]
    assert [frame["msg"] for frame in got] == [f"more than {MOST_PER_SECOND} frames a second: the rest is dropped"]
    assert len(other.does("dance")) == 1
    room.now = 1.0
    assert client.calls("rosapi/nodes") == {"nodes": ["/base"]}


def test_subscriptions_and_advertisements_have_a_limit() -> None:
    room = Room()
    client = room.client()
    for count in range(MOST_SUBSCRIPTIONS):
        room.now += 0.1
        assert client.does("subscribe", topic=f"/t{count}", type="std_msgs/Float32") == []
        assert client.does("advertise", topic=f"/t{count}", type="std_msgs/Float32") == []
    assert "at most" in client.does("subscribe", topic="/more", type="std_msgs/Float32")[0]["msg"]
    assert "at most" in client.does("advertise", topic="/more", type="std_msgs/Float32")[0]["msg"]


def test_a_client_that_asks_and_does_not_read_is_given_up() -> None:
    room = Room()
    client = room.client()
    for count in range(MOST_FRAMES + 1):
        room.now = count * 0.01
        assert not room.bridge.is_overrun(client.number)
        client.sends('{"op": "dance"}')
    assert room.bridge.is_overrun(client.number)


def test_messages_become_json_that_javascript_reads() -> None:
    scan = LaserScan(header=Header(frame_id="laser"), ranges=np.array([math.inf, 0.1, math.nan], np.float32))
    assert to_json(scan)["ranges"] == [None, 0.1, None]
    assert to_json(Image(width=1, data=bytes([0, 255])))["data"] == "AP8="
    assert json.loads(json_messages.encoded(scan))["header"]["frame_id"] == "laser"


def test_what_javascript_and_ros_1_write_is_understood() -> None:
    image = from_json(Image, {"data": "AP8=", "width": 2.0, "header": {"seq": 4, "stamp": {"secs": 3, "nsecs": 4}}}, 1)
    assert (bytes(image.data), image.width, image.header.stamp.sec) == (b"\0\xff", 2, 3)
    assert bytes(from_json(Image, {"data": [0, 255]}, 1).data) == b"\0\xff"
    assert math.isnan(from_json(Float32, {"data": None}, 1).data)
    assert from_json(ColorRGBA, None, 1) == ColorRGBA()
    for wrong in ({"data": "no base64!"}, {"width": 2.5}, {"width": True}, {"header": 3}):
        with pytest.raises(WrongMessageError):
            from_json(Image, wrong, 1)


@given(st.floats(width=32), st.floats(), st.text(st.characters(exclude_categories=["Cs"])))
def test_there_and_back_is_the_same(narrow: float, wide: float, text: str) -> None:
    for message in (Float32(data=narrow), String(data=text), Twist(linear=Vector3(x=wide))):
        back = from_json(type(message), json.loads(json_messages.encoded(message)), 1)
        assert to_json(back) == to_json(message)


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
WORDS = st.sampled_from(
    [
        "/level",
        "level",
        TELEOP,
        "/odom",
        "/lamp",
        "/console/drive",
        "/rosapi/topic_type",
        "a",
        "png",
        "none",
        "std_msgs/Float32",
        "nav_msgs/msg/Odometry",
        "std_msgs/String",
    ]
)
OPS = ("subscribe", "unsubscribe", "advertise", "unadvertise", "publish", "call_service")
KEYS = ("topic", "type", "service", "id", "throttle_rate", "queue_length", "compression", "sent", "latch")
FRAMES = st.fixed_dictionaries(
    {"op": st.sampled_from(OPS)},
    optional=dict.fromkeys(
        ("topic", "type", "service", "id", "throttle_rate", "queue_length", "compression", "sent", "latch"),
        WORDS | ANYTHING,
    )
    | {
        "msg": ANYTHING | st.fixed_dictionaries({}, optional={"data": ANYTHING, "linear": ANYTHING, "pose": ANYTHING}),
        "args": ANYTHING | st.fixed_dictionaries({"take": st.booleans() | ANYTHING}, optional={"name": ANYTHING}),
        "timeout": ANYTHING,
        "level": ANYTHING,
    },
)


@given(st.lists(st.tuples(st.integers(0, 1), FRAMES | ANYTHING | st.binary(max_size=50), st.floats(0, 0.6))))
def test_no_frame_raises_and_whatever_is_sent_is_json(frames: list[tuple[int, Any, float]]) -> None:
    room = Room()
    clients = [room.client(), room.client()]
    for who, frame, pause in frames:
        room.now += pause
        room.requests += room.bridge.expire(room.now, STAMP)
        clients[who].sends(frame if isinstance(frame, bytes) else json.dumps(frame))
        room.arrives("/level", level(1))
        for client in clients:
            client.gets()
    for client in clients:
        client.leaves()
    subscribed, advertised = set[str](), set[str]()
    for request in room.requests:
        match request:
            case Subscribe(topic):
                assert topic not in subscribed
                subscribed.add(topic)
            case Advertise(topic):
                assert topic not in advertised
                advertised.add(topic)
            case Withdraw(kind, topic):
                (subscribed if kind is Subscribe else advertised).remove(topic)
            case Publish(topic):
                assert topic in advertised
    assert (subscribed, advertised) == (set(), set())  # nothing is left on the bus


@pytest.mark.parametrize(
    ("type_", "field", "item"),
    [
        ("sensor_msgs/LaserScan", "ranges", "1.5"),
        ("sensor_msgs/LaserScan", "ranges", "null"),
        ("sensor_msgs/LaserScan", "ranges", "[]"),
        ("sensor_msgs/JointState", "name", '"a"'),
        ("sensor_msgs/Image", "data", "7"),
        ("geometry_msgs/PoseArray", "poses", "{}"),
    ],
)
def test_a_long_message_holds_up_nobody(type_: str, field: str, item: str) -> None:
    room = Room()
    client = room.client()
    frame = f'{{"op":"publish","topic":"/x","type":"{type_}","msg":{{"{field}":[{",".join([item] * 200_000)}]}}}}'
    with paused_collection():  # which would look through all that other tests have left, in one of them or the other
        began = time.process_time()
        client.sends(frame)
        taken = time.process_time() - began
        began = time.process_time()
        json.loads(frame)
        assert taken < 6 * (time.process_time() - began) + 0.1


def test_many_wrong_fields_hold_up_nobody() -> None:
    client = Room().client()
    fields = ",".join(f'"field{count}":0' for count in range(200_000))
    began = time.process_time()
    client.sends(f'{{"op":"publish","topic":"/level","msg":{{{fields}}}}}')
    assert time.process_time() - began < 2
    assert "has no field 'field0'" in client.gets()[0]["msg"]


@for_all("many", ["[]", "{}", "0", '""', '"\\\\"', '","'])
def test_what_would_take_long_to_read_is_refused_before_it_is(many: str) -> None:
    client = Room().client()
    with mock.patch("json.loads") as read:
        client.sends(f'{{"op":"x","y":[{",".join([many] * (MOST_VALUES + 1))}]}}')
    assert not read.called
    assert "at most 250000 values" in client.gets()[0]["msg"]


@for_all("text", ["," * MOST_VALUES * 2, '"' * MOST_VALUES, "[{\\,\n" * MOST_VALUES])
def test_a_text_is_one_value_whatever_it_says(text: str) -> None:
    room = Room()
    room.graph.known["/text"] = String.TYPE
    client = room.client()
    assert client.does("publish", topic="/text", msg={"data": text}) == []
    assert room.asked()[-1] == Publish("/text", String(data=text))


@for_all(
    "type_, data",
    [
        ("uint8", [0, 256]),
        ("byte", [-1]),
        ("int32", [2**31]),
        ("int32", [0.5]),
        ("int64", [2**70]),
        ("int32", [None]),
        ("float32", [1e39]),
        ("float32", ["1"]),
        ("float64", [True, False]),
        ("float64", [[1.0]]),
        ("float64", [[1.0], [1.0, 2.0]]),
        ("float64", [{}]),
        ("float64", ["x" * 10_000] + [1] * 10_000),  # as an array of texts, 400 MB
    ],
)
def test_lists_of_numbers_are_of_their_type(type_: str, data: list[Any]) -> None:
    with pytest.raises(ValueError, match="expected a list of numbers"):
        numbers_of(type_, data)


@pytest.mark.parametrize("data", [[1.0, 2], [0, 255], []])
@pytest.mark.parametrize("type_", ["uint8", "int16", "uint64", "float32", "float64"])
def test_lists_of_numbers_are_taken_as_javascript_writes_them(type_: str, data: list[Any]) -> None:
    made = numbers_of(type_, data)
    assert (made.dtype, made.tolist()) == (np.dtype(type_), data)


@for_all("type_, data", [("uint64", [2**64 - 1, 1.0]), ("uint64", [2**63, 1]), ("int64", [-(2**63), 2**53 + 1, 1.0])])
def test_no_number_of_64_bits_is_rounded(type_: str, data: list[Any]) -> None:
    assert numbers_of(type_, data).tolist() == data


def test_what_a_role_may_not_is_refused_and_answered() -> None:
    room = Room()
    client = room.client(Role.VIEW)
    assert client.does("subscribe", topic="/level") == []
    (status,) = client.does("publish", topic="/level", msg={"data": 1})
    assert status["msg"] == "this needs the role 'operate'; yours is 'view'"
    assert client.calls("/rosapi/topics")["topics"]
    (answer,) = client.does("call_service", service="/lamp", id="a")
    assert (answer["result"], answer["id"]) == (False, "a")
    assert client.does("call_service", service="/console/stop") == []
    (asked,) = (request for request in room.asked() if isinstance(request, AskRobot))
    assert asked.request == {"type": "robot.StopRobot", "by": "the console"}


def test_names_may_be_guarded_by_patterns() -> None:
    room = Room(guarded={"/l*": Role.CONFIGURE})
    client = room.client(Role.OPERATE)
    (status,) = client.does("publish", topic="level", msg={"data": 1})
    assert "the role 'configure'" in status["msg"]
    assert client.does("subscribe", topic="/level") == []


@pytest.mark.parametrize(
    ("topic", "pattern"), [("/cmd_vel", TELEOP), ("/go_to/goal", "/go_to"), ("move_base/goal", "/go_to")]
)
def test_no_other_name_leads_round_a_guard(topic: str, pattern: str) -> None:
    drive = DriveLimits(TELEOP, "geometry_msgs/msg/Twist", 0.5, 1.0, frozenset({"/cmd_vel"}))
    room = Room(drive, guarded={pattern: Role.CONFIGURE})
    (status,) = room.client(Role.OPERATE).does("publish", topic=topic, msg={})
    assert "the role 'configure'" in status["msg"]


def needed_by(request: BusRequest, guards: dict[str, Role]) -> Role:
    """Return the least role that may have the bus asked for something: by what is asked, not by how."""
    least, names = Role.OPERATE, list[str]()
    match request:
        case Publish(topic) | Advertise(topic):
            names = [topic]
        case SendGoal(action=action):
            names = [action]
        case ServiceCall(service=service, type=type_):
            word, names = type_.TYPE.rpartition("/")[2], [service, service.removesuffix("/pause")]
            if word.endswith(("Parameters", "ParametersAtomically")):
                least = Role.CONFIGURE if word.startswith(("Set", "Change")) else Role.VIEW
        case SaveSettings() | Serve() | ServeAction():
            least = Role.CONFIGURE
        case EditMission(request=asked):
            writes = asked["do"].endswith(("new", "save", "apply", "revert"))
            least = Role.CONFIGURE if writes else Role.OPERATE if asked["do"] in ("test", "try") else Role.VIEW
        case AskRobot(request=asked):
            least = Role.OPERATE if asked is RELEASE else Role.VIEW
        case Withdraw(kind) if kind is Subscribe:
            return Role.VIEW
        case Subscribe() | Watch() | TailLog() | ReadTested():
            return Role.VIEW
    names += [name.partition("/_action/")[0] for name in names]
    return max([least, *(guards[name] for name in names if name in guards)])


NODE = {"get_parameters": "GetParameters", "set_parameters": "SetParameters", "list_parameters": "ListParameters"}
SERVICES = {f"/level/{name}": f"rcl_interfaces/srv/{type_}" for name, type_ in NODE.items()} | {
    "/level/change_parameters": "rbxcompose_parameters/srv/ChangeParameters",
    "/go_to/pause": "std_srvs/srv/SetBool",
    "/rosapi/strange": "std_srvs/srv/SetBool",
    "/get_parameters": "std_srvs/srv/SetBool",
}
GATEWAYS = ("stop", "release", "drive", "ask", "save", "log", "mission/new", "mission/save", "mission/look")
TARGETS = st.sampled_from(
    ["/level", "/cmd_vel", TELEOP, "/lamp", "//lamp", "/./lamp", "/LAMP", "/go_to", "/move_base", *SERVICES]
    + [f"{action}/{part}" for action in ("/go_to", "/move_base") for part in ("goal", "cancel", "_action/feedback")]
    + ["/go_to/_action/cancel_goal", "/go_to/_action/send_goal"]
    + [f"/console/{name}" for name in (*GATEWAYS, "robot/apply", "robot/save", "windows/drive")]
    + [f"/rosapi/{name}" for name in ("nodes", "set_param", "get_param", "get_param_names")]
).flatmap(lambda name: st.sampled_from([name, name.removeprefix("/")]))
KEY_OF = {
    **dict.fromkeys(("publish", "advertise", "unadvertise", "subscribe", "unsubscribe"), "topic"),
    **dict.fromkeys(("call_service", "advertise_service", "unadvertise_service", "service_response"), "service"),
    **dict.fromkeys(("send_action_goal", "cancel_action_goal", "advertise_action", "action_result"), "action"),
}
ARGUMENTS = [
    {"name": "/level:runtime", "value": "1"},
    {"mission": "m", "text": "t", "hash": "", "template": "t", "dry_run": True},
    {"subject": "places", "changes": [], "hashes": {}, "generation": 1},
    {"take": True, "type": "robot.StopRobot"},
    {},
]
ASKED = st.sampled_from([*KEY_OF, *("call_service",) * 10]).flatmap(
    lambda op: st.fixed_dictionaries(
        {"op": st.just(op), KEY_OF[op]: TARGETS, "args": st.sampled_from(ARGUMENTS)},
        optional={"type": st.sampled_from(["std_msgs/Float32", "std_srvs/SetBool"]), "id": st.just("g")},
    )
)
GUARDS = st.dictionaries(
    st.sampled_from(["/go_to", "/lamp", TELEOP, "/cmd_vel", "/level", *SERVICES]), st.sampled_from(Role), max_size=3
)


def came_of(
    frames: list[dict[str, Any]], role: Role, guards: dict[str, Role]
) -> tuple[list[Any], list[BusRequest], Any]:
    """Return what frames lead to: what the client gets, what the bus is asked for, and the notes."""
    drive = DriveLimits(TELEOP, "geometry_msgs/msg/Twist", 0.5, 1.0, frozenset({"/cmd_vel"}))
    room = Room(drive, guarded=guards)
    room.graph.served |= SERVICES
    client, told, asked = room.client(role), list[Any](), list[BusRequest]()
    for frame in frames:
        client.sends(json.dumps(frame))
        while room.requests:
            request = room.requests.pop(0)
            asked.append(request)
            if isinstance(request, ServiceCall) and request.type is GetParameters:
                value = ParameterValue(type=3, double_value=60.0)
                room.bridge.answered(request.number, GetParameters.Response(values=(value,)))
                room.requests += room.bridge.take_requests()
        told += client.gets()
    return told, asked, list(room.bridge.notes)


CALLED = {"op": "call_service", "service": "/rosapi/set_param", "args": ARGUMENTS[0]}
ANY_FRAMES = st.lists(ASKED, min_size=30, max_size=60)
MORE = st.dictionaries(st.sampled_from(["topic", "service", "action"]), TARGETS)


@given(ANY_FRAMES, MORE, st.sampled_from(Role), GUARDS)
@example([CALLED], {"topic": "/rosapi/nodes"}, Role.VIEW, {})
@example([{"op": "call_service", "service": "/level/change_parameters"}], {}, Role.OPERATE, {})
@example([{"op": "call_service", "service": "/rosapi/strange"}], {}, Role.VIEW, {})
@example([{"op": "send_action_goal", "action": "go_to"}], {"topic": "/x"}, Role.OPERATE, {"/go_to": Role.CONFIGURE})
@example([{"op": "call_service", "service": "/go_to/pause"}], {}, Role.OPERATE, {"/go_to": Role.CONFIGURE})
def test_nobody_gets_done_what_needs_a_higher_role(
    frames: list[dict[str, Any]], more: dict[str, str], role: Role, guards: dict[str, Role]
) -> None:
    for request in came_of([{**more, **frame} for frame in frames], role, guards)[1]:
        assert needed_by(request, guards) <= role, request


@given(ANY_FRAMES, MORE, st.sampled_from(Role), GUARDS)
@example([CALLED], {"topic": "/rosapi/nodes"}, Role.CONFIGURE, {})
def test_no_other_key_of_a_frame_changes_what_it_leads_to(
    frames: list[dict[str, Any]], more: dict[str, str], role: Role, guards: dict[str, Role]
) -> None:
    assert came_of([{**more, **frame} for frame in frames], role, guards) == came_of(frames, role, guards)


def test_a_token_of_the_operation_auth_gives_a_role_and_never_takes_one() -> None:
    room = Room(admit=lambda token: {"o": Role.OPERATE, "v": Role.VIEW}.get(token, Role.NOBODY))
    client = room.client(Role.NOBODY)
    (status,) = client.does("subscribe", topic="/level")
    assert "the role 'view'; yours is 'nobody'" in status["msg"]
    assert client.does("auth", mac="o") == []
    assert client.does("publish", topic="/level", msg={"data": 1}) == []
    assert client.does("auth", mac="v") == []
    assert room.bridge.role(client.number) is Role.OPERATE
    (status,) = (other := Room()).client(Role.NOBODY).does("auth", mac="x")
    assert status["msg"] == "'mac' is no token of this robot"
    assert len(other.bridge.refused) == 1  # for the log


def test_the_log_says_once_who_does_what() -> None:
    room = Room()
    client = room.client(Role.OPERATE, "192.168.1.7")
    for value in range(3):
        client.does("publish", topic="/level", msg={"data": value})
    client.does("subscribe", topic="/odom")
    client.does("call_service", service="/lamp", args=[True])
    for topic, msg in (("/a b", {}), ("/odom", {"data": 1}), ("/cmd_vel", {})):
        client.does("publish", topic=topic, msg=msg)
    client.does("call_service", service="/lamp", args=[1, 2])
    assert list(room.bridge.notes) == [
        "192.168.1.7 (operate): publish /level",
        "192.168.1.7 (operate): call_service /lamp",
    ]

"""Actions, services of clients, parameters and types by rosbridge, without a socket."""

from __future__ import annotations

import json
from base64 import b64encode
from typing import Any

import pytest

from rbxcompose.domains.console.access import Role
from rbxcompose.domains.console.protocol import (
    MOST_SUBSCRIPTIONS,
    CancelGoal,
    GoalEnd,
    GoalFeedback,
    SendGoal,
    Serve,
    ServeAction,
    ServiceAnswer,
    ServiceCall,
    Withdraw,
)
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.rcl_interfaces import (
    GetParameters,
    ListParameters,
    ListParametersResult,
    ParameterValue,
    SetParameters,
    SetParametersResult,
)
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.bound import Ended, Outcome
from tests.console.clients import TELEOP, Client, Room
from tests.loops import for_all

NAVIGATE = "nav2_msgs/action/NavigateToPose"


def sent(room: Room) -> SendGoal:
    """Return the goal that was sent last."""
    return [request for request in room.asked() if isinstance(request, SendGoal)][-1]


def goes(client: Client, **more: Any) -> list[dict[str, Any]]:
    pose = {"pose": {"header": {"frame_id": "map"}, "pose": {"position": {"x": 1}}}}
    return client.does("send_action_goal", action="go_to", action_type=NAVIGATE, args=pose, id="g", **more)


def test_a_goal_is_sent_with_feedback_if_wanted_and_its_end_comes_back() -> None:
    room = Room()
    client = room.client()
    assert goes(client, feedback=True) == []
    goal = sent(room)
    assert (goal.action, goal.goal.pose.pose.position.x, goal.wants_feedback) == ("/go_to", 1.0, True)  # type: ignore[attr-defined]
    room.bridge.fed_back(goal.number, NavigateToPose.Feedback(distance_remaining=0.5))
    (fed_back,) = client.gets()
    assert (fed_back["op"], fed_back["id"], fed_back["action"]) == ("action_feedback", "g", "go_to")
    assert fed_back["values"]["distance_remaining"] == 0.5
    room.bridge.ended(goal.number, Ended(Outcome.SUCCEEDED, NavigateToPose.Result()))
    (ended,) = client.gets()
    assert (ended["op"], ended["status"], ended["result"]) == ("action_result", 4, True)
    room.bridge.fed_back(goal.number, NavigateToPose.Feedback())
    assert client.gets() == []


@pytest.mark.parametrize(
    ("outcome", "status"), [(Outcome.CANCELED, 5), (Outcome.ABORTED, 6), (Outcome.REJECTED, 0), (Outcome.LOST, 0)]
)
def test_each_way_to_end_is_told(outcome: Outcome, status: int) -> None:
    room = Room()
    client = room.client()
    goes(client)
    room.bridge.ended(sent(room).number, Ended(outcome, None, "why"))
    (ended,) = client.gets()
    assert (ended["status"], ended["result"], ended["values"]) == (status, False, "why")


def test_a_goal_is_cancelled_by_its_id_by_its_client_only() -> None:
    room = Room()
    client, other = room.client(), room.client()
    goes(client)
    goal = sent(room)
    (status,) = other.does("cancel_action_goal", action="go_to", id="g")
    assert "no goal of this id" in status["msg"]
    (status,) = client.does("cancel_action_goal", action="/another", id="g")
    assert "no goal of this id" in status["msg"]
    assert client.does("cancel_action_goal", action="go_to", id="g") == []
    assert room.asked() == [CancelGoal(goal.number)]


def test_a_goal_goes_on_when_its_client_leaves() -> None:
    room = Room()
    client = room.client()
    goes(client)
    goal = sent(room)
    client.leaves()
    assert room.asked() == []
    room.bridge.ended(goal.number, Ended(Outcome.SUCCEEDED, NavigateToPose.Result()))


@pytest.mark.parametrize(
    ("frame", "why"),
    [
        ({"action": "/none"}, "there is no action '/none'"),
        ({"action": "go_to", "args": {"posse": {}}}, "has no field 'posse'"),
        ({"action": "go_to", "args": 7}, "is a map of its fields"),
        ({"action": "go_to", "action_type": "foo/Bar"}, f"is of the type '{NAVIGATE}', not 'foo/Bar'"),
        ({"action": "go_to", "action_type": "nav2_msgs/srv/NavigateToPose"}, "is of the type"),
        ({"action": "go_to", "action_type": ["nav2_msgs/NavigateToPose"]}, "is of the type"),
    ],
)
def test_a_goal_that_cannot_be_sent_is_answered(frame: dict[str, Any], why: str) -> None:
    (answer,) = Room().client().does("send_action_goal", id="g", **frame)
    assert (answer["op"], answer["id"], answer["result"]) == ("action_result", "g", False)
    assert why in answer["values"]


@pytest.mark.parametrize("type_", ["nav2_msgs/NavigateToPose", NAVIGATE, "", None])
def test_the_type_of_an_action_is_taken_in_each_spelling(type_: str | None) -> None:
    room = Room()
    assert room.client().does("send_action_goal", action="go_to", action_type=type_) == []
    assert sent(room).type.TYPE == NAVIGATE


def test_a_service_is_of_the_type_that_a_client_takes_it_for() -> None:
    room = Room()
    client = room.client()
    (answer,) = client.does("call_service", service="/lamp", type="std_srvs/Trigger")
    assert answer["values"] == "'/lamp' is of the type 'std_srvs/srv/SetBool', not 'std_srvs/Trigger'"
    assert client.does("call_service", service="/lamp", type="std_srvs/SetBool") == []


# As ROS 1 has them


def test_a_page_for_ros_1_drives_by_move_base() -> None:
    room = Room()
    client, viewer = room.client(), room.client()
    for part, type_ in (("status", "actionlib_msgs/GoalStatusArray"), ("feedback", ""), ("result", "")):
        assert client.does("subscribe", topic=f"/move_base/{part}", type=type_) == [] or part == "status"
    client.gets()
    assert client.does("advertise", topic="/move_base/goal", type="move_base_msgs/MoveBaseActionGoal") == []
    pose = {"header": {"frame_id": "/map"}, "pose": {"position": {"x": 2.0}, "orientation": {"w": 1}}}
    goal = {"goal_id": {"stamp": {"secs": 0, "nsecs": 0}, "id": "one"}, "goal": {"target_pose": pose}}
    (listed,) = client.does("publish", topic="/move_base/goal", msg=goal)
    assert listed["msg"]["status_list"][0]["status"] == 1
    request = sent(room)
    assert (request.action, request.goal.pose.pose.position.x) == ("/go_to", 2.0)  # type: ignore[attr-defined]
    room.bridge.fed_back(request.number, NavigateToPose.Feedback())
    (fed_back,) = client.gets()
    assert "base_position" in fed_back["msg"]["feedback"]
    assert viewer.does("publish", topic="/move_base/cancel", msg={"id": "one"}) == []
    assert room.asked() == [CancelGoal(request.number)]
    room.bridge.ended(request.number, Ended(Outcome.CANCELED, NavigateToPose.Result()))
    frames = {frame["topic"]: frame["msg"] for frame in client.gets()}
    assert frames["/move_base/result"]["status"] == {
        "goal_id": {"stamp": {"secs": 5, "nsecs": 7}, "id": "one"},
        "status": 2,
        "text": "",
    }
    assert frames["/move_base/status"]["status_list"][0]["status"] == 2


def test_a_goal_of_another_client_is_canceled_by_the_service_of_its_action() -> None:
    room = Room(guarded={"/go_to": Role.CONFIGURE})
    info = {"goal_info": {"goal_id": {"uuid": b64encode(bytes(range(16))).decode()}}}
    cancel = {"service": "/go_to/_action/cancel_goal", "args": info}
    (refused,) = room.client(Role.OPERATE).does("call_service", **cancel)
    assert "needs the role 'configure'" in refused["values"]
    assert room.asked() == []
    assert room.client(Role.CONFIGURE).does("call_service", **cancel) == []
    (call,) = room.asked()
    assert isinstance(call, ServiceCall)
    assert call.service == "/go_to/_action/cancel_goal"
    assert bytes(call.request.goal_info.goal_id.uuid) == bytes(range(16))  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("newer", "said", "state", "text"),
    [
        ("/go_to", "", 2, "replaced by a newer goal"),
        ("/move_base", "replaced", 2, "replaced"),
        ("", "no way there", 4, "no way there"),
        ("/elsewhere", "", 4, ""),
    ],
)
def test_a_goal_that_a_newer_one_replaces_is_preempted(newer: str, said: str, state: int, text: str) -> None:
    room = Room()
    client = room.client()
    client.does("subscribe", topic="/go_to/result")
    client.does("publish", topic="/go_to/goal", msg={"goal": {}})
    number = sent(room).number
    room.graph.acted["/elsewhere"] = "nav2_msgs/action/Wait"
    if newer:
        client.does("publish", topic=f"{newer}/goal", msg={"goal": {}})
    room.bridge.ended(number, Ended(Outcome.ABORTED, NavigateToPose.Result(error_msg=said)))
    (result,) = client.gets()
    assert (result["msg"]["status"]["status"], result["msg"]["status"]["text"]) == (state, text)


def test_an_empty_cancel_ends_all_goals_of_the_action() -> None:
    room = Room()
    client = room.client()
    numbers = []
    for _ in range(2):
        client.does("publish", topic="/go_to/goal", msg={"goal": {}})
        numbers.append(sent(room).number)
    client.does("publish", topic="/go_to/cancel", msg={})
    assert room.asked() == [CancelGoal(number) for number in numbers]


def test_topics_of_that_name_that_exist_are_left_alone() -> None:
    room = Room()
    room.graph.known["/go_to/status"] = "std_msgs/msg/String"
    client = room.client()
    client.does("subscribe", topic="/go_to/status")
    assert [type(request).__name__ for request in room.asked()] == ["Subscribe"]


# Services of clients


def test_a_client_serves_and_fails_what_it_leaves_open() -> None:
    room = Room()
    client = room.client()
    assert client.does("advertise_service", service="/bell", type="std_srvs/SetBool") == []
    assert room.asked() == [Serve("/bell", SetBool)]
    for number in (1, 2, 3):
        room.bridge.requested("/bell", number, SetBool.Request(data=True))
    first, second, third = client.gets()
    assert (first["op"], first["args"]) == ("call_service", {"data": True})
    client.does("service_response", service="bell", id=first["id"], values={"message": "ding"}, result=True)
    client.does("service_response", service="bell", id=second["id"], values="broken", result=False)
    assert room.asked() == [ServiceAnswer(1, SetBool.Response(message="ding")), ServiceAnswer(2, None, "broken")]
    (status,) = client.does("service_response", service="bell", id=first["id"], values={})
    assert "no open request" in status["msg"]
    client.leaves()
    assert room.asked() == [ServiceAnswer(3, None, "the client that served it has left"), Withdraw(Serve, "/bell")]
    assert third["id"] == "request:3"


@for_all(
    "values, reason",
    [
        ("broken", "broken"),
        ({"message": "why"}, "why"),
        (None, "it was refused"),
        ({}, "it was refused"),
        ([], "it was refused"),
    ],
)
def test_a_service_that_fails_says_why_if_it_can(values: object, reason: str) -> None:
    room = Room()
    client = room.client()
    client.does("advertise_service", service="/bell", type="std_srvs/SetBool")
    room.bridge.requested("/bell", 1, SetBool.Request())
    client.does("service_response", service="bell", id="request:1", values=values, result=False)
    assert room.asked()[-1] == ServiceAnswer(1, None, reason)


def test_a_service_may_answer_with_a_list() -> None:
    room = Room()
    client = room.client()
    client.does("advertise_service", service="/bell", type="std_srvs/SetBool")
    room.bridge.requested("/bell", 1, SetBool.Request())
    client.does("service_response", service="bell", id="request:1", values=[True, "ding"], result=True)
    assert room.asked()[-1] == ServiceAnswer(1, SetBool.Response(success=True, message="ding"))


def test_a_response_that_cannot_be_used_fails_the_request_with_the_reason() -> None:
    room = Room()
    client = room.client()
    client.does("advertise_service", service="/bell", type="std_srvs/SetBool")
    room.bridge.requested("/bell", 1, SetBool.Request())
    client.gets()
    (status,) = client.does("service_response", service="bell", id="request:1", values={"sound": 1}, result=True)
    answer = room.asked()[-1]
    assert isinstance(answer, ServiceAnswer)
    assert (answer.number, answer.response) == (1, None)
    assert "its response cannot be used: " in answer.error
    assert "has no field 'sound'" in answer.error
    assert "has no field 'sound'" in status["msg"]
    (status,) = client.does("service_response", service="bell", id="request:1", values={})
    assert "no open request" in status["msg"]


def test_a_service_that_exists_is_not_served_again() -> None:
    (status,) = Room().client().does("advertise_service", service="/lamp", type="std_srvs/SetBool")
    assert status["msg"] == "'/lamp' is served already"


def test_a_client_that_never_answers_fails_the_oldest_request() -> None:
    room = Room()
    client = room.client()
    client.does("advertise_service", service="/bell", type="std_srvs/SetBool")
    room.asked()
    for number in range(1, MOST_SUBSCRIPTIONS + 2):
        room.bridge.requested("/bell", number, SetBool.Request())
    assert room.bridge.take_requests() == [ServiceAnswer(1, None, "the client that serves it does not answer")]


# Actions of clients


def served_goals(count: int) -> tuple[Room, Client]:
    """Return a client that serves an action, to which goals came."""
    room = Room()
    client = room.client()
    assert client.does("advertise_action", action="greet", type=NAVIGATE) == []
    assert room.asked() == [ServeAction("/greet", NavigateToPose)]
    for number in range(1, count + 1):
        room.bridge.goal_came("/greet", number, NavigateToPose.Goal(behavior_tree="hello"))
    return room, client


def test_a_client_carries_out_a_goal_under_the_name_that_it_gave() -> None:
    room, client = served_goals(1)
    (goal,) = client.gets()
    assert (goal["op"], goal["action"], goal["action_type"]) == ("send_action_goal", "greet", NAVIGATE)
    assert goal["args"]["behavior_tree"] == "hello"
    named = {"action": "greet", "id": goal["id"]}
    client.does("action_feedback", **named, values={"distance_remaining": 2.0})
    client.does("action_result", **named, values={"error_code": 3}, status=4, result=True)
    told = [GoalFeedback(1, NavigateToPose.Feedback(distance_remaining=2.0))]
    assert room.asked() == [
        *told,
        GoalEnd(1, Outcome.SUCCEEDED, NavigateToPose.Result(error_code=3), "client 1 gave up"),
    ]
    (status,) = client.does("action_result", **named)
    assert "no open goal" in status["msg"]


@pytest.mark.parametrize(
    ("said", "outcome"),
    [
        ({}, Outcome.SUCCEEDED),
        ({"result": False}, Outcome.ABORTED),
        ({"status": 5, "result": True}, Outcome.CANCELED),
        ({"status": 6, "result": False}, Outcome.ABORTED),
    ],
)
def test_a_client_ends_a_goal_in_each_way(said: dict[str, Any], outcome: Outcome) -> None:
    room, client = served_goals(1)
    (goal,) = client.gets()
    assert client.does("action_result", action="/greet", id=goal["id"], **said) == []
    (end,) = room.asked()
    assert isinstance(end, GoalEnd)
    assert end.outcome is outcome


def test_a_goal_is_unwanted_when_canceled_or_replaced() -> None:
    room, client = served_goals(2)
    first, unwanted, second = client.gets()
    assert (unwanted["op"], unwanted["id"]) == ("cancel_action_goal", first["id"])
    room.bridge.goal_unwanted("/greet")
    (canceled,) = client.gets()
    assert (canceled["op"], canceled["id"]) == ("cancel_action_goal", second["id"])
    (status,) = client.does("action_result", action="greet", id=first["id"])
    assert "no open goal" in status["msg"]
    client.leaves()
    assert room.asked() == [Withdraw(ServeAction, "/greet")]


def test_only_its_server_answers_for_an_action_and_an_end_has_a_status_of_ros() -> None:
    room, client = served_goals(1)
    (goal,) = client.gets()
    for status in (7, "4", None):
        (said,) = client.does("action_result", action="greet", id=goal["id"], status=status)
        assert "4 (succeeded)" in said["msg"]
    other = room.client()
    for op in ("action_feedback", "action_result", "unadvertise_action"):
        assert len(other.does(op, action="greet", id=goal["id"])) == 1
    for action, type_ in (("greet", NAVIGATE), ("go_to", NAVIGATE), ("x", "no/Such"), ("x", 3)):
        assert len(other.does("advertise_action", action=action, type=type_)) == 1
    assert client.does("unadvertise_action", action="greet") == []
    assert room.asked() == [Withdraw(ServeAction, "/greet")]


# Parameters and types


def with_parameters(**access: Any) -> Room:
    room = Room(**access)
    services = {
        "get_parameters": "GetParameters",
        "set_parameters": "SetParameters",
        "list_parameters": "ListParameters",
    }
    room.graph.served |= {f"/battery/{name}": f"rcl_interfaces/srv/{type_}" for name, type_ in services.items()}
    return room


def call(room: Room, service: str) -> ServiceCall:
    (request,) = (request for request in room.asked() if isinstance(request, ServiceCall))
    assert request.service == service
    return request


@pytest.mark.parametrize("name", ["/battery:runtime", "battery/runtime"])
def test_a_parameter_is_read_by_each_spelling(name: str) -> None:
    room = with_parameters()
    client = room.client()
    client.does("call_service", service="/rosapi/get_param", args={"name": name, "default_value": "7"})
    asked = call(room, "/battery/get_parameters")
    value = ParameterValue(type=3, double_value=60.0)
    room.bridge.answered(asked.number, GetParameters.Response(values=(value,)))
    (answer,) = client.gets()
    assert json.loads(answer["values"]["value"]) == 60.0


@pytest.mark.parametrize(
    ("default", "value"),
    [("5", 5), ('"front"', "front"), ("front", "front"), ("[1, 2]", [1, 2]), ("", None), (None, None), (0, 0)],
)
@pytest.mark.parametrize("name", ["/battery:nothing", "/robot_gui/videoTopic", "/nobody:speed", "speed", ""])
def test_a_parameter_that_is_not_there_is_its_default(name: str, default: object, value: object) -> None:
    room = with_parameters()
    client = room.client()
    for service, args, expected in (
        ("get_param", {"name": name, "default_value": default}, {"value": json.dumps(value), "successful": True}),
        ("has_param", {"name": name}, {"exists": False}),
    ):
        answers = client.does("call_service", service=f"/rosapi/{service}", args=args)
        if name.startswith("/battery"):
            room.bridge.answered(call(room, "/battery/get_parameters").number, GetParameters.Response())
            answers = client.gets()
        (answer,) = answers
        assert answer["result"]
        assert answer["values"].items() >= expected.items()


def test_a_number_is_set_in_the_type_that_the_parameter_has() -> None:
    room = with_parameters()
    client = room.client()
    client.does("call_service", service="/rosapi/set_param", args={"name": "/battery:runtime", "value": "45"})
    before = GetParameters.Response(values=(ParameterValue(type=3, double_value=60.0),))
    room.bridge.answered(call(room, "/battery/get_parameters").number, before)
    room.requests += room.bridge.take_requests()
    asked = call(room, "/battery/set_parameters")
    (change,) = asked.request.parameters  # type: ignore[attr-defined]
    assert (change.name, change.value.type, change.value.double_value) == ("runtime", 3, 45.0)
    refused = SetParameters.Response(results=(SetParametersResult(successful=False, reason="too long"),))
    room.bridge.answered(asked.number, refused)
    (answer,) = client.gets()
    assert (answer["result"], answer["values"]) == (False, "too long")


@for_all(
    "value, why",
    [
        ("1" + "0" * 400, "no parameter can have this value"),
        (10**400, "no parameter can have this value"),
        ("1" + "0" * 5000, ""),  # a text
        ("[" * 100_000, "nested"),
        ("[" * 102 + "]" * 102, "nested"),
        ([[[1]]], "no parameter can have this value"),
        ({"a": 1}, "no parameter can have this value"),
        ("\ud800", "surrogates"),
    ],
)
def test_each_value_is_set_or_answered(value: object, why: str) -> None:
    room = with_parameters()
    client = room.client()
    answers = client.does("call_service", service="/rosapi/set_param", args=["/battery:runtime", value], id="a")
    if not answers:
        now = GetParameters.Response(values=(ParameterValue(type=3, double_value=60.0),))
        room.bridge.answered(call(room, "/battery/get_parameters").number, now)
        room.requests += room.bridge.take_requests()
        answers = client.gets()
    if why:
        assert [(answer["id"], answer["result"]) for answer in answers] == [("a", False)]
        assert why in answers[0]["values"]
    else:
        call(room, "/battery/set_parameters")


def test_a_node_that_is_guarded_is_guarded_by_rosapi_too() -> None:
    room = with_parameters(guarded={"/battery/*": Role.CONFIGURE})
    client = room.client(Role.OPERATE)
    assert "needs the role 'configure'" in client.calls("/rosapi/get_param", ["/battery:runtime"])
    assert client.calls("/rosapi/get_param_names") == {"names": []}


def test_the_parameters_of_all_nodes_are_listed() -> None:
    room = with_parameters()
    room.graph.served["/base/list_parameters"] = "rcl_interfaces/srv/ListParameters"
    client = room.client()
    client.does("call_service", service="/rosapi/get_param_names")
    for node in ("battery", "base"):
        found = ListParameters.Response(result=ListParametersResult(names=("speed",)))
        room.bridge.answered(call(room, f"/{node}/list_parameters").number, found)
        room.requests += room.bridge.take_requests()
    (answer,) = client.gets()
    assert answer["values"] == {"names": ["/battery:speed", "/base:speed"]}


def test_types_are_described_with_their_constants() -> None:
    client = Room().client()
    status, _ = client.calls("/rosapi/message_details", {"type": "diagnostic_msgs/DiagnosticStatus"})["typedefs"]
    assert status["constnames"] == ["OK", "WARN", "ERROR", "STALE"]
    assert status["constvalues"] == ["0", "1", "2", "3"]
    answer = client.calls("/rosapi/service_response_details", {"type": "action_msgs/CancelGoal"})["typedefs"][0]
    assert (answer["constnames"][0], answer["constvalues"][:2]) == ("ERROR_NONE", ["0", "1"])


def test_raw_types_are_the_texts_of_all_that_is_in_them() -> None:
    room = Room()
    room.graph.known |= {"/diagnostics": "diagnostic_msgs/msg/DiagnosticArray", "/toy": "toy_msgs/msg/Toy", "/odd": "a"}
    found = room.client().calls("/rosapi/topics_and_raw_types")
    texts = dict(zip(found["topics"], found["typedefs_full_text"], strict=True))
    assert "float64 x" in texts[TELEOP].partition("MSG: geometry_msgs/Vector3\n")[2]
    assert "byte STALE=3" in texts["/diagnostics"].partition("MSG: diagnostic_msgs/DiagnosticStatus\n")[2]
    assert (texts["/toy"], texts["/odd"]) == ("", "")


def test_types_are_described_with_all_that_is_in_them() -> None:
    client = Room().client()
    types = client.calls("/rosapi/message_details", {"type": "geometry_msgs/Twist"})["typedefs"]
    assert [type_["type"] for type_ in types] == ["geometry_msgs/Twist", "geometry_msgs/Vector3"]
    assert (types[0]["fieldnames"], types[0]["fieldarraylen"]) == (["linear", "angular"], [-1, -1])
    (request,) = client.calls("/rosapi/service_request_details", {"type": "std_srvs/SetBool"})["typedefs"]
    assert request["fieldtypes"] == ["bool"]
    goal = client.calls("/rosapi/action_goal_details", {"type": NAVIGATE})["typedefs"]
    assert goal[0]["fieldnames"] == ["pose", "behavior_tree"]
    assert client.calls("/rosapi/action_servers") == {"action_servers": ["/go_to"]}
    assert client.calls("/rosapi/node_details", {"node": "base"})["publishing"] == ["/odom"]

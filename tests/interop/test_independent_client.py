"""An exchange in both directions with a client that others wrote, over a real router on the loopback interface."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.example_interfaces import AddTwoInts
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Connected, Network

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("zenoh_ros2_sdk") is None, reason="needs the package zenoh-ros2-sdk"
)

ROOT = Path(__file__).parents[2]
PATIENCE = 15.0  # [s] of each question, which the other side may take long for
LATCHED = ":1:,1:,:,:,,"


class Sdk:
    """The other side. Requests are answered in a thread, so that our process may turn meanwhile."""

    def __init__(self, network: Network, home: Path) -> None:
        self._network = network
        environment = {**os.environ, "HOME": str(home), "GIT_PYTHON_REFRESH": "quiet", "ROS_DOMAIN_ID": "0"}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.interop.sdk_peer", str(network.port)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )

    def ask(self, verb: str, *arguments: object) -> Any:
        """Have the other side do something and return its answer."""
        answers: list[str] = []
        thread = threading.Thread(target=lambda: answers.append(self._answer(verb, arguments)))
        thread.start()
        self._network.until(lambda: answers, PATIENCE)
        thread.join()
        return json.loads(answers[0])

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()

    def _answer(self, verb: str, arguments: tuple[object, ...]) -> str:
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(json.dumps([verb, arguments]) + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline() or '"the client has ended"'


@pytest.fixture(scope="module")
def network() -> Iterator[Network]:
    made = Network()
    yield made
    made.close()


@pytest.fixture(scope="module")
def ours(network: Network) -> Connected:
    return network.process()


@pytest.fixture(scope="module")
def theirs(network: Network, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sdk]:
    made = Sdk(network, tmp_path_factory.mktemp("home"))
    yield made
    made.close()


def test_messages_pass_both_ways(network: Network, ours: Connected, theirs: Sdk) -> None:
    got: list[Twist] = []
    ours.bus.subscribe("base", "cmd_vel", Twist, Qos.COMMAND, got.append)
    theirs.ask("publisher", "/cmd_vel", "geometry_msgs/msg/Twist")
    fields = {"linear": {"x": 0.25, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": -1.5}}

    def pushed() -> bool:
        theirs.ask("publish", "/cmd_vel", fields)  # again until the two have found each other
        return bool(got)

    network.until(pushed, PATIENCE)
    assert got[0] == Twist(linear=Vector3(x=0.25), angular=Vector3(z=-1.5))

    theirs.ask("subscribe", "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    publish = ours.bus.publisher("host", "/diagnostics", DiagnosticArray, Qos.STATE)
    network.until(lambda: publish.has_match)
    pair = KeyValue(key="voltage", value="11.1")
    publish(DiagnosticArray(status=(DiagnosticStatus(level=1, name="battery", message="low", values=(pair,)),)))
    network.until(lambda: theirs.ask("heard", "/diagnostics"), PATIENCE)
    (heard,) = theirs.ask("heard", "/diagnostics")
    assert heard["status"] == [
        {
            "level": 1,
            "name": "battery",
            "message": "low",
            "hardware_id": "",
            "values": [{"key": "voltage", "value": "11.1"}],
        }
    ]


def test_a_latched_message_reaches_their_late_subscriber(network: Network, ours: Connected, theirs: Sdk) -> None:
    publish = ours.bus.publisher("body", "/robot_description", String, Qos.LATCHED)
    publish(String(data="old"))
    publish(String(data="<robot/>"))
    network.until(lambda: "/robot_description" in theirs.ask("topics"), PATIENCE)

    def heard() -> bool:
        # Each late subscriber of theirs asks once for what was kept, perhaps before it is connected.
        theirs.ask("subscribe", "/robot_description", "std_msgs/msg/String", LATCHED)
        return bool(theirs.ask("heard", "/robot_description"))

    network.until(heard, PATIENCE)
    assert theirs.ask("heard", "/robot_description") == [{"data": "<robot/>"}]


def test_services_answer_both_ways(network: Network, ours: Connected, theirs: Sdk) -> None:
    ours.bus.serve("server", "add", AddTwoInts, lambda request: AddTwoInts.Response(sum=request.a + request.b))
    theirs.ask("client", "/add", "example_interfaces/srv/AddTwoInts")
    assert theirs.ask("call", "/add", {"a": 2, "b": 40}) == {"sum": 42}

    theirs.ask("serve", "/other", "example_interfaces/srv/AddTwoInts", {"sum": 7})
    call = ours.bus.client("client", "other", AddTwoInts)
    network.until(lambda: call.is_available)

    def answered() -> Reply[AddTwoInts.Response]:
        replies: list[Reply[AddTwoInts.Response]] = []
        call(AddTwoInts.Request(a=3, b=4), replies.append)
        network.until(lambda: replies)
        return replies[0]

    # Their server shows its token before it takes requests; one that comes in between reaches nobody.
    network.until(lambda: answered() == Reply(AddTwoInts.Response(sum=7)))
    assert theirs.ask("heard", "/other") == [{"a": 3, "b": 4}]


def test_their_client_has_our_action_done(network: Network, ours: Connected, theirs: Sdk) -> None:
    # It knows no actions, but the services that make them up; the hash of those it takes from us.
    server = ours.bus.serve_action("charger", "recharge", Recharge, lambda goal: "")
    for part, interface in (("send_goal", Recharge.SendGoal), ("get_result", Recharge.GetResult)):
        theirs.ask("client", f"/recharge/_action/{part}", interface.TYPE, interface.HASH)
    theirs.ask("subscribe", "/recharge/_action/status", "action_msgs/msg/GoalStatusArray", LATCHED)
    goal_id = {"uuid": list(range(16))}
    goal = {"goal_id": goal_id, "structure_needs_at_least_one_member": 0}
    assert theirs.ask("call", "/recharge/_action/send_goal", goal)["accepted"] is True
    assert server.current is not None
    server.current.succeeded()
    result = theirs.ask("call", "/recharge/_action/get_result", {"goal_id": goal_id})
    assert result["status"] == 4
    statuses = [entry["status_list"][-1]["status"] for entry in theirs.ask("heard", "/recharge/_action/status")]
    assert statuses[-1] == 4


def test_their_graph_shows_our_topics(network: Network, ours: Connected, theirs: Sdk) -> None:
    ours.bus.publisher("talker", "chatter", String, Qos.STATE)
    network.until(lambda: theirs.ask("topics").get("/chatter") == ["std_msgs/msg/String"], PATIENCE)

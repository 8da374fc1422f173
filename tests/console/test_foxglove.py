"""The server for Foxglove, at a robot that is not there."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Future
from contextlib import AsyncExitStack
from queue import Queue
from typing import Any

import pytest

from rbxcompose.bus.names import resolve
from rbxcompose.domains.console.foxglove_server import FoxgloveServer, RobotAccess
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.rcl_interfaces import GetParameters, Parameter, ParameterEvent, ParameterValue
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.types import Message, Service
from rbxcompose.sdk.parameters import to_message
from tests.console.foxglove_client import Foxglove

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")

EVENTS = "/parameter_events"
STRING = "std_msgs/msg/String"
SERVICES = {"/battery/get_parameters": GetParameters.TYPE}


class FakeRobot:
    """A robot with a model, which is latched, and a topic of messages that are lost on who comes too late."""

    def __init__(self) -> None:
        self.latched = {"/robot_description": [b"model"], "/tf_static": [b"base", b"arm"]}
        self.parameters: dict[str, object] = {"runtime": 90.0, "names": ("a", "b")}
        self.published: list[Message] = []
        self.withdrawn: Queue[str] = Queue()
        self.called: list[str] = []
        self.listeners: list[tuple[str, Callable[[bytes], None]]] = []
        access = RobotAccess(
            self.listen, self.latched.__contains__, self.publisher, self.call, resolve, lambda topic: ""
        )
        self.server = FoxgloveServer(access, "fake", 0)
        topics = {**dict.fromkeys((*self.latched, "/talk"), STRING), EVENTS: ParameterEvent.TYPE}
        self.server.offer(topics, SERVICES)

    def listen(self, topic: str, take: Callable[[bytes], None]) -> Callable[[], None]:
        listener = topic, take
        self.listeners.append(listener)
        for message in self.latched.get(topic, ()):
            take(message)
        return lambda: self.listeners.remove(listener)

    def changes(self, name: str, value: object) -> None:
        changed = (Parameter(name=name, value=to_message(value) or ParameterValue()),)
        event = encode(ParameterEvent(node="/battery", changed_parameters=changed))
        for topic, take in self.listeners:
            if topic == EVENTS:
                take(event)

    def publisher(self, topic: str) -> tuple[Callable[[Message], object], Callable[[], object]]:
        return self.published.append, lambda: self.withdrawn.put(topic)

    def call(self, name: str, type_: type[Service[Any, Any]], request: Message) -> Future[Any]:
        """Answer for parameters of the battery; nobody else ever answers."""
        future: Future[Any] = Future()
        self.called.append(name)
        if isinstance(request, GetParameters.Request) and name in SERVICES:
            values = [to_message(self.parameters.get(name)) or ParameterValue() for name in request.names]
            future.set_result(GetParameters.Response(values=tuple(values)))
        return future


@pytest.fixture
def robot() -> Iterator[FakeRobot]:
    robot = FakeRobot()
    yield robot
    robot.server.close()


def talk(robot: FakeRobot, what: Callable[[Foxglove, Foxglove], Awaitable[None]]) -> None:
    """Let two clients talk to the server."""

    async def run() -> None:
        async with AsyncExitStack() as stack:
            sockets = [await stack.enter_async_context(Foxglove.at(robot.server.port)) for _ in range(2)]
            await what(*map(Foxglove, sockets))

    asyncio.run(run())


def test_every_client_gets_what_is_latched_also_beside_others(robot: FakeRobot) -> None:
    async def both(first: Foxglove, second: Foxglove) -> None:
        for client in (first, second):
            await client.gets("advertise")
            for number, topic in enumerate(robot.latched):
                channel = client.offered[topic]["id"]
                await client.says("subscribe", subscriptions=[{"id": number, "channelId": channel}])
                got = [await client.gets(1) for _ in robot.latched[topic]]
                assert [(frame[1:5], frame[13:]) for frame in got] == [
                    (struct.pack("<I", number), message) for message in robot.latched[topic]
                ]
        assert sorted(topic for topic, _ in robot.listeners) == sorted([*robot.latched, EVENTS])

    talk(robot, both)


def test_parameters_that_nobody_has_are_left_out_and_hold_nobody_up(robot: FakeRobot) -> None:
    names = ["/nix.x", "~nay.y", "/battery.nix", "/battery.runtime", "/battery.names"]

    async def ask(client: Foxglove, other: Foxglove) -> None:
        await client.says("getParameters", parameterNames=names, id="a")
        got = (await client.gets("parameterValues"))["parameters"]
        values = {each["name"]: each["value"] for each in got}
        assert values == {"/battery.runtime": 90.0, "/battery.names": '["a", "b"]'}
        assert robot.called == ["/battery/get_parameters"]

    talk(robot, ask)


def test_who_wants_a_parameter_gets_its_changes_whoever_makes_them(robot: FakeRobot) -> None:
    async def subscribe(client: Foxglove, other: Foxglove) -> None:
        await client.says("subscribeParameterUpdates", parameterNames=["/battery.runtime"])
        await client.says("getParameters", parameterNames=["/battery.names"], id="a")  # answered after that
        assert (await client.gets("parameterValues"))["id"] == "a"
        robot.changes("names", ("c",))
        robot.changes("runtime", 80.0)
        (runtime,) = (await client.gets("parameterValues"))["parameters"]
        assert (runtime["name"], runtime["value"]) == ("/battery.runtime", 80.0)

    talk(robot, subscribe)


def test_what_a_client_publishes_is_withdrawn_when_it_says_so_or_leaves(robot: FakeRobot) -> None:
    async def publish(client: Foxglove, other: Foxglove) -> None:
        ghosts = [{"id": n, "topic": f"/ghost{n}", "encoding": "cdr", "schemaName": STRING} for n in range(2)]
        await client.says("advertise", channels=ghosts)
        await client.socket.send(struct.pack("<BI", 1, 1) + encode(String(data="boo")))
        await client.says("unadvertise", channelIds=[0])
        assert await asyncio.to_thread(robot.withdrawn.get, timeout=10) == "/ghost0"
        assert robot.published == [String(data="boo")]
        await client.socket.close()
        assert await asyncio.to_thread(robot.withdrawn.get, timeout=10) == "/ghost1"

    talk(robot, publish)

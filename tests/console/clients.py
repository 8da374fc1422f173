"""A bridge without sockets: what clients send and get, in virtual time."""

from __future__ import annotations

import json
from typing import Any

from rbxcompose.domains.console.access import Role
from rbxcompose.domains.console.lease import DriveLimits
from rbxcompose.domains.console.protocol import Bridge, BusRequest
from rbxcompose.domains.console.rosapi import BusView
from rbxcompose.msgs.types import Message

TELEOP = "/cmd_vel/teleop"
TWIST = "geometry_msgs/msg/Twist"
LIMITS = DriveLimits(TELEOP, TWIST, 0.5, 1.0)
STAMP = 5_000_000_007  # [ns]


class Graph:
    """A bus with a few names."""

    def __init__(self) -> None:
        self.known = {"/odom": "nav_msgs/msg/Odometry", "/level": "std_msgs/msg/Float32", TELEOP: TWIST}
        self.served = {"/lamp": "std_srvs/srv/SetBool", "/strange": "toy_msgs/srv/Strange"}
        self.acted = {"/go_to": "nav2_msgs/action/NavigateToPose"}
        self.latched: set[str] = set()

    def view(self) -> BusView:
        servers = {service: ["/base"] for service in self.served}
        publishers = {"/odom": ["/base"]}
        return BusView(self.known, self.served, self.acted, ["/base"], publishers, {}, servers, self.latched)


class Room:
    """The bridge, with the requests to the bus since the last look, at a time that only `now` changes."""

    def __init__(self, drive: DriveLimits | None = LIMITS, **access: Any) -> None:
        self.graph, self.now = Graph(), 0.0
        self.bridge = Bridge(self.graph.view, drive, **access)
        self.requests: list[BusRequest] = []

    def client(self, role: Role = Role.CONFIGURE, who: str = "") -> Client:
        return Client(self, self.bridge.open(role, who))

    def arrives(self, topic: str, message: Message) -> None:
        self.bridge.arrived(topic, message, self.now)

    def wait(self, seconds: float) -> None:
        """Let time pass, in steps in which a lease that is over is noticed."""
        for _ in range(round(seconds / 0.01)):
            self.now = round(self.now + 0.01, 6)
            self.requests += self.bridge.expire(self.now, STAMP)

    def asked(self) -> list[BusRequest]:
        requests, self.requests = self.requests, []
        return requests


class Client:
    """One connection."""

    def __init__(self, room: Room, number: int) -> None:
        self.room, self.number = room, number

    def sends(self, frame: str | bytes) -> None:
        self.room.requests += self.room.bridge.receive(self.number, frame, self.room.now, STAMP)

    def does(self, op: str, **fields: Any) -> list[dict[str, Any]]:
        """Send an operation, and return all that came since the last look."""
        self.sends(json.dumps({"op": op, **fields}))
        return self.gets()

    def calls(self, service: str, args: Any = None) -> Any:
        """Return the values of a service that answers at once."""
        (answer,) = self.does("call_service", service=service, **({} if args is None else {"args": args}))
        assert answer["op"] == "service_response"
        return answer["values"]

    def gets(self) -> list[dict[str, Any]]:
        found = []
        while (frame := self.room.bridge.next_frame(self.number, self.room.now)) is not None:
            found.append(json.loads(frame))
        return found

    def leaves(self) -> None:
        self.room.requests += self.room.bridge.close(self.number, self.room.now, STAMP)

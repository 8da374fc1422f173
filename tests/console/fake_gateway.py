"""A robot's gateway as small as a page needs it: the built console, its configuration, and rosbridge for one robot."""

from __future__ import annotations

import json
import mimetypes
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from pathlib import Path
from typing import Any

from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection, serve

from rbxcompose.base.requests import Refused

CONFIG: dict[str, Any] = {
    "robot": "turtlebot",
    "about": "A TurtleBot 2 that patrols four rooms",
    "first_page": "drive",
    "drive": {"topic": "/cmd_vel_console", "type": "geometry_msgs/Twist", "max_speed": 0.5, "max_turn_rate": 1.5},
    "values": {
        "base_battery": {"topic": "/battery_level", "type": "std_msgs/Float32", "field": "data", "unit": "%"},
        "laptop_battery": {"topic": "/laptop_charge", "type": "std_msgs/Float32", "field": "data", "unit": "%"},
        "main_supply": {"topic": "/supply", "type": "std_msgs/Float32", "field": "data", "unit": "V"},
    },
}
WINDOWS = "/console/windows/"
RUNNING = "robot/RobotStatus"
POLICY = "default-src 'self'; frame-ancestors 'none'"
DATA = {"/battery_level": 78.4, "/laptop_charge": 23.0, "/supply": 12.37}


PATIENCE = 20.0  # [s]


class FakeGateway:
    """Serves pages below `static` at `url` and keeps what their connections sent, with the time [s] of each frame."""

    def __init__(self, static: Path, config: dict[str, Any] = CONFIG) -> None:
        self.static, self.config = static, config
        self.frames: list[tuple[float, dict[str, Any]]] = []
        self._arrived = threading.Condition()  # another frame
        self.holder = ""
        self.windows: dict[str, Any] = {"drive": {"holder": ""}, RUNNING: {"stop": None}}
        """What queries answer, by name and fields: `mission/ListMissions`; change them by `show`."""
        listed = {"success": True, "message": "", "answer": []}
        self.answers: dict[str, Callable[[dict[str, Any]], Any]] = {"/console/mission/list": lambda _: listed}
        """What requests answer, by name: `mission.PauseMission`; and services and actions, by name: `/arm/home`."""
        self.latched: dict[str, dict[str, Any]] = {}
        """What a new subscriber of a topic gets at once."""
        self.repeated: dict[str, dict[str, Any]] = {}
        """What is published ten times a second, by topic; to be replaced as a whole."""
        self.files: dict[str, bytes] = {}
        """Further addresses, with what is there."""
        self._others: str | None = None
        self.is_away = False  # takes no connections
        self.is_locked = False  # knows nobody but who has the token
        self.token = "the-token"
        self.subscribed: dict[ServerConnection, set[str]] = {}
        self.velocity = (0.0, 0.0)
        self._server = serve(self._serve, "127.0.0.1", 0, process_request=self._respond)
        self.port = self._server.socket.getsockname()[1]
        self._threads = [threading.Thread(target=self._server.serve_forever), threading.Thread(target=self._publish)]
        self._ended = threading.Event()
        for thread in self._threads:
            thread.start()

    @property
    def others(self) -> str | None:
        """Who drives from elsewhere."""
        return self._others

    @others.setter
    def others(self, name: str | None) -> None:
        self._others = name
        self.show("drive", {"holder": name or ""})

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def close(self) -> None:
        self._ended.set()
        self.drop()
        self._server.shutdown()
        for thread in self._threads:
            thread.join()

    def drop(self) -> None:
        """Close all connections."""
        for connection in list(self.subscribed):
            connection.close()

    def commands(self, since: float = 0.0) -> list[tuple[float, float, float]]:
        """Return time [s], forward and turn of each command."""
        return [
            (at, frame["msg"]["linear"]["x"], frame["msg"]["angular"]["z"])
            for at, frame in list(self.frames)
            if frame["op"] == "publish" and at >= since
        ]

    def show(self, window: str, answer: Any) -> None:
        """Let a query answer this from now on."""
        self.windows[window] = answer
        self.say(f"{WINDOWS}{window}", {"answer": answer})

    def refuse(self, window: str, reason: str) -> None:
        """Let a query be refused until it is shown."""
        self.windows.pop(window, None)
        self.latched[f"{WINDOWS}{window}"] = refused = {"answer": None, "refused": reason}
        self.say(f"{WINDOWS}{window}", refused)

    def say(self, topic: str, message: dict[str, Any]) -> None:
        """Send a message to who subscribed to its topic."""
        for connection, topics in list(self.subscribed.items()):
            if topic in topics:
                with suppress(ConnectionClosed):
                    connection.send(json.dumps({"op": "publish", "topic": topic, "msg": message}))

    def goals(self, least: int = 0) -> list[dict[str, Any]]:
        """Return the frames of the goals that were sent, as soon as there are so many."""
        return self._with("send_action_goal", lambda _: True, least)

    def act(self, op: str, goal: dict[str, Any], values: Any, **more: Any) -> None:
        """Send feedback or the result of a goal to all clients."""
        frame = {"op": op, "id": goal["id"], "action": goal["action"], "values": values, **more}
        for connection in list(self.subscribed):
            with suppress(ConnectionClosed):
                connection.send(json.dumps(frame))

    def asked(self, request: str, least: int = 0) -> list[dict[str, Any]]:
        """Return the requests of a type that were sent to the robot, as soon as there are so many."""
        return self.calls("/console/ask", least, lambda given: bool(given["type"] == request))

    def calls(
        self, service: str, least: int = 0, is_meant: Callable[[dict[str, Any]], bool] = lambda _: True
    ) -> list[dict[str, Any]]:
        """Return the arguments of each call of a service, as soon as there are so many."""
        found = self._with("call_service", lambda one: one["service"] == service and is_meant(one["args"]), least)
        return [frame["args"] for frame in found]

    def _with(self, op: str, is_meant: Callable[[dict[str, Any]], bool], least: int) -> list[dict[str, Any]]:
        """Return the frames that are meant: what a page shows may be seen before its frame has come."""

        def found() -> list[dict[str, Any]]:
            return [frame for _, frame in self.frames if frame["op"] == op and is_meant(frame)]

        with self._arrived:
            assert self._arrived.wait_for(lambda: len(found()) >= least, PATIENCE)
            return found()

    def _respond(self, connection: ServerConnection, request: Request) -> Response | None:
        path = request.path.partition("?")[0]
        if path == "/rosbridge":
            return self._response(HTTPStatus.SERVICE_UNAVAILABLE, "text/plain", b"away") if self.is_away else None
        if path == "/console/config" and self.is_locked:
            return self._response(HTTPStatus.UNAUTHORIZED, "application/json", b"{}")
        if path == "/console/config":
            return self._response(HTTPStatus.OK, "application/json", json.dumps(self.config).encode())
        if path in self.files:
            return self._response(HTTPStatus.OK, "application/xml", self.files[path])
        file = (self.static / (path.lstrip("/") or "index.html")).resolve()
        if not file.is_file() or not file.is_relative_to(self.static):
            return self._response(HTTPStatus.NOT_FOUND, "text/plain", b"not found")
        return self._response(HTTPStatus.OK, mimetypes.guess_type(file)[0] or "text/plain", file.read_bytes())

    def _policy(self) -> str:
        fleet = self.config.get("fleet", {}) if self.config else {}
        return f"{POLICY}; connect-src 'self' {' '.join(f'ws://127.0.0.1{address}' for address in fleet.values())}"

    def _response(self, status: HTTPStatus, kind: str, body: bytes) -> Response:
        headers = {"Content-Type": kind, "Content-Length": str(len(body)), "Content-Security-Policy": self._policy()}
        return Response(status.value, status.phrase, Headers({**headers, "Connection": "close"}), body)

    def _serve(self, connection: ServerConnection) -> None:
        self.subscribed[connection] = set()
        try:
            for text in connection:
                frame = json.loads(text)
                with self._arrived:
                    self.frames.append((time.monotonic(), frame))
                    self._arrived.notify_all()
                self._handle(connection, frame)
        except ConnectionClosed:
            pass
        finally:
            del self.subscribed[connection]
            self.velocity, self.holder = (0.0, 0.0), ""

    def _handle(self, connection: ServerConnection, frame: dict[str, Any]) -> None:
        match frame["op"]:
            case "auth" if frame["mac"] == self.token:
                self.is_locked = False
            case _ if self.is_locked:
                words = "this needs the role 'view'; yours is 'nobody'"
                connection.send(json.dumps({"op": "status", "level": "error", "id": frame["id"], "msg": words}))
            case "subscribe":
                topic = frame["topic"]
                self.subscribed[connection].add(topic)
                window = topic.removeprefix(WINDOWS)
                shown = {"answer": self.windows[window]} if window in self.windows else self.latched.get(topic)
                if shown is not None:
                    connection.send(json.dumps({"op": "publish", "topic": topic, "msg": shown}))
            case "unsubscribe":
                self.subscribed[connection].discard(frame["topic"])
            case "send_action_goal" if frame["action"] in self.answers:
                try:
                    self.act("action_feedback", frame, self.answers[frame["action"]](frame["args"]))
                except Refused as refusal:
                    self.act("action_result", frame, str(refusal), status=0, result=False)
            case "cancel_action_goal":
                self.act("action_result", frame, {}, status=5, result=True)
            case "publish" if "linear" in frame["msg"]:
                if self.others:
                    error = {"op": "status", "level": "error", "id": frame["id"], "msg": "not yours"}
                    connection.send(json.dumps(error))
                else:
                    self.velocity = (frame["msg"]["linear"]["x"], frame["msg"]["angular"]["z"])
            case "call_service":
                answer = {"op": "service_response", "id": frame["id"], "service": frame["service"]}
                try:
                    answer |= {"result": True, "values": self._call(frame["service"], frame["args"])}
                except Refused as refusal:
                    answer |= {"result": False, "values": str(refusal)}
                connection.send(json.dumps(answer))

    def _call(self, service: str, args: dict[str, Any]) -> dict[str, Any]:
        if service == "/console/drive":
            if self.others:
                return {"success": False, "holder": self.others, "message": f"'{self.others}' drives"}
            self.holder = args["name"] if args["take"] else ""
            self.show("drive", {"holder": self.holder})
            return {"success": True, "holder": self.holder, "message": ""}
        if service == "/console/ask":
            if (answer := self.answers.get(args["type"])) is None:
                return {"success": False, "message": f"there is no request '{args['type']}'", "answer": None}
            try:
                return {"success": True, "message": "", "answer": answer(args)}
            except Refused as refusal:
                return {"success": False, "message": str(refusal), "answer": None}
        if service in self.answers:
            values: dict[str, Any] = self.answers[service](args)
            if (
                values.get("success")
                and service.endswith(("/save", "/new", "/apply", "/revert"))
                and not args.get("dry_run")
            ):
                self.show("changes", self.windows.get("changes", 0) + 1)
            return values
        if service in ("/console/stop", "/console/release"):
            self.show(RUNNING, {"stop": {"by": "the console", "time": 1.0} if service.endswith("stop") else None})
        return {"success": True, "message": ""}

    def _publish(self) -> None:
        while not self._ended.wait(0.1):
            forward, turn = self.velocity
            data: dict[str, dict[str, Any]] = {topic: {"data": value} for topic, value in DATA.items()}
            data["odom"] = {"twist": {"twist": {"linear": {"x": 0.96 * forward}, "angular": {"z": 0.97 * turn}}}}
            for topic, message in (data | self.repeated).items():
                self.say(topic, message)


class FakeLog:
    """A log that grows."""

    def __init__(self, gateway: FakeGateway) -> None:
        self.records: list[dict[str, Any]] = []
        self.findings: list[dict[str, Any]] = []
        gateway.answers["/console/log"] = self.answer
        self.add("info", "mission", "go_to corner_1")
        self.add("warning", "battery", "Low battery", detail="at 12 V")

    def add(self, level: str, source: str, text: str, **more: str) -> None:
        self.records.append({"time": 1.0 + len(self.records), "level": level, "source": source, "text": text, **more})

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        answer: dict[str, Any] = {"records": self.records[request["after"] :], "after": len(self.records)}
        if request["after"] == 0:
            answer["findings"] = self.findings
        return {"success": True, "message": "", "answer": answer}

"""A party on the bus that is not ours: the client `zenoh-ros2-sdk` in a process of its own, led by lines of JSON.

Each line from standard input is a request, answered by one line. Definitions are read from our interface texts; the
keys, tokens, hashes, attachments and bytes are all the client's own work.
"""

from __future__ import annotations

import dataclasses
import json
import os
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy
import zenoh_ros2_sdk as sdk
from rosbags.interfaces import Nodetype

import rbxcompose.msgs

EMPTY = "uint8 structure_needs_at_least_one_member\n"  # what takes the place of no fields at all
ZEROS = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}
INTERFACES = Path(rbxcompose.msgs.__file__).parent / "interfaces"


class Peer:
    """Everything that was declared so far; each public method is a request."""

    def __init__(self, port: int) -> None:
        self._session = sdk.ZenohSession.get_instance(router_port=port)
        self._registry = sdk.get_registry(str(INTERFACES))
        self._publishers: dict[str, Any] = {}
        self._clients: dict[str, Any] = {}
        self._kept: list[Any] = []
        self._heard: dict[str, list[Any]] = {}

    def publisher(self, topic: str, type_name: str) -> None:
        """Declare a publisher."""
        self._load(type_name)
        self._publishers[topic] = sdk.ROS2Publisher(topic, type_name)

    def publish(self, topic: str, fields: dict[str, Any]) -> None:
        """Publish a message."""
        publisher = self._publishers[topic]
        publisher.publish(**self._filled(publisher.msg_type, fields))

    def subscribe(self, topic: str, type_name: str, qos: str | None = None) -> None:
        """Collect what comes on a topic."""
        self._load(type_name)
        heard = self._heard.setdefault(topic, [])
        self._kept.append(sdk.ROS2Subscriber(topic, type_name, lambda message: heard.append(plain(message)), qos=qos))

    def heard(self, topic: str) -> list[Any]:
        """Return what came so far."""
        return self._heard[topic]

    def serve(self, name: str, type_name: str, response: dict[str, Any]) -> None:
        """Answer each request with `response`; requests are collected under the service's name."""
        heard = self._heard.setdefault(name, [])

        def answer(request: Any) -> Any:
            heard.append(plain(request))
            return server.response_msg_class(**self._filled(server.response_store_type, response))

        server = sdk.ROS2ServiceServer(name, type_name, answer, **self._parts(type_name))
        self._kept.append(server)

    def client(self, name: str, type_name: str, type_hash: str | None = None) -> None:
        """Declare a client."""
        parts = self._parts(type_name)
        self._clients[name] = sdk.ROS2ServiceClient(name, type_name, timeout=5.0, type_hash=type_hash, **parts)

    def call(self, name: str, fields: dict[str, Any]) -> Any:
        """Send a request and return the response, or nothing."""
        client = self._clients[name]
        return plain(client.call(**self._filled(client.request_store_type, fields)))

    def topics(self) -> dict[str, list[str]]:
        """Return what the graph shows."""
        return {name: list(types) for name, types in sdk.get_topic_names_and_types()}

    def _load(self, type_name: str) -> None:
        if not self._registry.load_message_type(type_name):
            raise LookupError(type_name)

    def _parts(self, type_name: str) -> dict[str, str]:
        """Return the definitions of a service, or of one of the two that make up an action."""
        package, kind, name = type_name.split("/")
        if kind == "srv":
            text = (INTERFACES / package / kind / f"{name}.srv").read_text(encoding="utf-8")
        else:
            action, _, part = name.rpartition("_")
            text = (INTERFACES / package / kind / f"{action}.action").read_text(encoding="utf-8")
            goal, result, _ = (part if fields_of(part) else EMPTY for part in text.split("---\n"))
            uuid, stamp = "unique_identifier_msgs/UUID goal_id\n", "builtin_interfaces/Time stamp\n"
            text = {
                "SendGoal": f"{uuid}{goal}---\nbool accepted\n{stamp}",
                "GetResult": f"{uuid}---\nint8 status\n{result}",
            }[part]
        request, response = (qualified(part, package) for part in text.split("---\n"))
        for held in (*fields_of(request), *fields_of(response)):
            if "/" in held:
                self._load(held.replace("/", "/msg/"))
        return {"request_definition": request, "response_definition": response}

    def _filled(self, store_type: str, fields: dict[str, Any]) -> dict[str, Any]:
        """Return all fields of a message: maps become nested ones, lists of numbers arrays; the others are zero."""
        known = self._session.store.fielddefs[store_type][1]
        return {name: self._value(kind, about, fields.get(name)) for name, (kind, about) in known}

    def _value(self, kind: Nodetype, about: Any, given: Any) -> Any:
        if kind is Nodetype.NAME:
            return self._session.store.types[about](**self._filled(about, given or {}))
        if kind is Nodetype.BASE:
            return ZEROS.get(about[0], 0) if given is None else given
        (inner, of), count = about
        values = [None] * (count if kind is Nodetype.ARRAY else 0) if given is None else given
        found = [self._value(inner, of, value) for value in values]
        return found if inner is Nodetype.NAME or of[0] == "string" else numpy.array(found, of[0])


def qualified(definition: str, package: str) -> str:
    """Return a definition whose messages of the same package are named with it, as those of others are."""
    lines = definition.splitlines()
    bare = (line[:1].isupper() and "/" not in line.split(" ")[0] for line in lines)
    lines = [f"{package}/{line}" if is_bare else line for line, is_bare in zip(lines, bare, strict=True)]
    return "".join(f"{line}\n" for line in lines)


def fields_of(definition: str) -> list[str]:
    """Return the type of each field, without its brackets."""
    lines = (line.partition("#")[0].split() for line in definition.splitlines())
    return [words[0].partition("[")[0] for words in lines if words]


def plain(value: Any) -> Any:
    """Return a message as data for JSON; its constants, which are written in capitals, are left out."""
    if dataclasses.is_dataclass(value):
        names = (field.name for field in dataclasses.fields(value))
        return {name: plain(getattr(value, name)) for name in names if name.islower() and name[0] != "_"}
    if isinstance(value, list):
        return [plain(item) for item in value]
    return value.tolist() if hasattr(value, "tolist") else value


def main() -> None:
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what the client logs is no answer
    try:
        peer = Peer(int(sys.argv[1]))
        for line in sys.stdin:
            verb, arguments = json.loads(line)
            method: Callable[..., Any] = getattr(peer, verb)
            answers.write(json.dumps(method(*arguments)) + "\n")
            answers.flush()
    except Exception:
        traceback.print_exc()
    finally:
        os._exit(0)  # the client's threads would keep the process


if __name__ == "__main__":
    main()

"""The side of the bridge that runs in ROS's own Python: it needs nothing there but rclpy.

Messages pass as bytes. One thread waits for ROS, in a wait set of its own: rclpy's executors make a new one for each
message, which takes four times as long. Another one takes what comes through the socket.
"""

from __future__ import annotations

import importlib
import json
import os
import signal
import socket
import sys
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any

_IS_READ = "rbxcompose" in sys.modules  # by a tool, in our Python, which has no rclpy
if TYPE_CHECKING or not _IS_READ:
    import rclpy
    from rclpy.impl.implementation_singleton import rclpy_implementation as implementation
    from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
    from rclpy.serialization import deserialize_message, serialize_message
if TYPE_CHECKING or _IS_READ:
    from rbxcompose.domains.programs.bridge import link
else:
    import link  # beside this file: the package is not there in ROS's Python

_LOOK = 0.5  # [s] between two looks at the graph
_SHALLOWEST = 10  # messages that wait in ROS: the newest counts only where it is used
_BUSY, _PACE = 500.0, 0.002  # [1/s] messages from ROS, above which they are taken that often [s]
_SETTLED = 2.0  # [s] without anything new
_SERVED_WITHIN = 10.0  # [s] for a node that starts to have its servers; until then, requests wait for them
_GOODBYE = 1.0  # [s] to leave ROS
_ECHOES = 64  # messages that may be on their way back to us


class EndError(Exception):
    """An end that cannot be made."""


def interface(name: str) -> Any:
    """Return the class of a type: `geometry_msgs/msg/Twist`, or a part of an action: `p/action/X_SendGoal`."""
    package, kind, bare = name.split("/")
    try:
        module = importlib.import_module(f"{package}.{kind}")
        if kind == "action":
            whole, _, part = bare.partition("_")
            inner = getattr(module, whole).Impl
            return inner.FeedbackMessage if part == "FeedbackMessage" else getattr(inner, f"{part}Service")
        return getattr(module, bare)
    except (ImportError, AttributeError) as error:
        raise EndError(f"this ROS 2 does not have {name}: {error}") from error


def quality(end: dict[str, Any], *, reliable: bool) -> QoSProfile:
    """Return the quality of service of a topic."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=max(end["depth"], _SHALLOWEST),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if end["latched"] else DurabilityPolicy.VOLATILE,
    )


class RosSide:
    """All ends of the bridge in ROS, by channel."""

    def __init__(self, wire: link.Link, name: str) -> None:
        self._link = wire
        self.node = rclpy.create_node(name, start_parameter_services=False, enable_rosout=False)
        self._guard = self.node.create_guard_condition(lambda: None)
        self._ends: dict[int, dict[str, Any]] = {}
        self._entities: dict[int, Any] = {}
        self._orders: deque[dict[str, Any]] = deque()
        self._echoes: dict[str, deque[bytes]] = {}  # of topics that pass both ways
        self._lock = threading.Lock()
        self._early: dict[int, tuple[float, deque[link.Frame]]] = {}  # by client: until when its requests wait [s]
        self._waiting: dict[tuple[int, int], int] = {}  # numbers of our requests by client and sequence
        self._asked: dict[int, tuple[int, Any]] = {}  # ROS's requests by our number: the channel and the header
        self._next = 0
        self._passed = 0  # messages from ROS
        self._is_busy = False

    # From the socket

    def receive(self) -> None:
        """Take what the other side sends until it is gone."""
        for frame in self._link.frames():
            try:
                self._take(frame)
            except Exception as error:  # whatever one message causes, the others pass
                self._problem(frame.channel, f"{type(error).__name__}: {error}")
        leave(self.node)

    def _take(self, frame: link.Frame) -> None:
        entity = self._entities.get(frame.channel)
        if frame.kind == link.EVENT:
            self._orders.append(json.loads(frame.payload))
            self._guard.trigger()
        elif entity is None:
            if frame.kind == link.REQUEST:
                self._link.send(frame.channel, link.ERROR, b"the bridge has no such service", frame.number)
        elif frame.kind == link.DATA:
            if (echoes := self._echoes.get(self._ends[frame.channel]["name"])) is not None:
                echoes.append(frame.payload)
            entity.publish(frame.payload)
        elif frame.kind == link.REQUEST:
            with self._lock:
                if frame.channel in self._early:
                    self._early[frame.channel][1].append(frame)
                    return
            self._ask(frame, entity)
        else:
            self._answer(frame, entity)

    def _ask(self, frame: link.Frame, client: Any) -> None:
        if not client.service_is_ready():
            self._link.send(frame.channel, link.ERROR, b"no server in ROS 2", frame.number)
            return
        request = deserialize_message(frame.payload, client.srv_type.Request)
        with self._lock, client.handle:
            self._waiting[(frame.channel, client.handle.send_request(request))] = frame.number

    def _ask_early(self) -> None:
        """Send the requests that came before their servers, in their order, once these are there or late."""
        for channel, (until, frames) in [*self._early.items()]:
            client = self._entities[channel]
            if not client.service_is_ready() and time.monotonic() < until:
                continue
            while channel in self._early:
                with self._lock:
                    if not frames:
                        del self._early[channel]
                        break
                    frame = frames.popleft()
                try:
                    self._ask(frame, client)
                except Exception as error:  # as in `receive`
                    self._problem(channel, f"{type(error).__name__}: {error}")

    def _answer(self, frame: link.Frame, service: Any) -> None:
        with self._lock:
            channel, header = self._asked.pop(frame.number, (0, None))
        if header is None:
            return
        if frame.kind == link.RESPONSE:
            response = deserialize_message(frame.payload, service.srv_type.Response)
        else:  # ROS has no word for "there will be no answer"; a response that can say why does
            response, why = service.srv_type.Response(), frame.payload.decode()
            self._problem(channel, f"a request has failed: {why}")
            if hasattr(response, "success") and hasattr(response, "message"):
                response.message = why
        with service.handle:
            service.handle.service_send_response(response, header)

    # In ROS

    def run(self) -> None:
        """Wait for ROS, and pass on what comes."""
        context = self.node.context
        while context.ok():
            with self._lock:
                while self._orders:
                    self._carry_out(self._orders.popleft())
            subscriptions = self._of_way("topic", "from_ros")
            clients, services = self._of_way("service", "to_ros"), self._of_way("service", "from_ros")
            size = len(subscriptions), 1, 0, len(clients), len(services), 0
            waits = implementation.WaitSet(*size, context.handle)
            looked, passed = time.monotonic(), self._passed
            while context.ok() and not self._orders:
                self._wait(waits, subscriptions, clients, services)
                self._ask_early()
                if (now := time.monotonic()) - looked > _LOOK:
                    self._is_busy = (self._passed - passed) / (now - looked) > _BUSY
                    looked, passed = now, self._passed
                    if self._adapt():
                        break
                if self._is_busy:
                    time.sleep(_PACE)  # several messages at once cost little more than one

    def _of_way(self, kind: str, way: str) -> list[tuple[int, Any]]:
        wanted = [channel for channel, end in self._ends.items() if (end["kind"], end["way"]) == (kind, way)]
        return [(channel, self._entities[channel]) for channel in wanted if channel in self._entities]

    def _wait(self, waits: Any, subscriptions: Any, clients: Any, services: Any) -> None:
        waits.clear_entities()
        guard = waits.add_guard_condition(self._guard.handle)
        places = [(waits.add_subscription(entity.handle), channel, entity) for channel, entity in subscriptions]
        asking = [(waits.add_client(entity.handle), channel, entity) for channel, entity in clients]
        served = [(waits.add_service(entity.handle), channel, entity) for channel, entity in services]
        waits.wait(int(_LOOK * 1e9))
        del guard
        for index, channel, entity in places:
            if waits.is_ready("subscription", index):
                self._messages(channel, entity)
        for index, channel, entity in asking:
            if waits.is_ready("client", index):
                self._responses(channel, entity)
        for index, channel, entity in served:
            if waits.is_ready("service", index):
                self._requests(channel, entity)

    def _messages(self, channel: int, subscription: Any) -> None:
        end = self._ends[channel]
        echoes, depth = self._echoes.get(end["name"]), end["depth"]
        while (taken := subscription.handle.take_message(subscription.msg_type, True)) is not None:
            data = taken[0]
            if echoes and data in echoes:
                echoes.remove(data)  # our own message, on its way back
                continue
            self._passed += 1
            self._link.send(channel, link.DATA, data, depth=depth)

    def _responses(self, channel: int, client: Any) -> None:
        while True:
            header, response = client.handle.take_response(client.srv_type.Response)
            if header is None or response is None:
                return
            with self._lock:
                number = self._waiting.pop((channel, header.request_id.sequence_number), None)
            if number is not None:
                self._link.send(channel, link.RESPONSE, serialize_message(response), number)

    def _requests(self, channel: int, service: Any) -> None:
        while True:
            request, header = service.handle.service_take_request(service.srv_type.Request)
            if header is None:
                return
            with self._lock:
                self._next += 1
                number = self._next
                self._asked[number] = channel, header.request_id
            self._link.send(channel, link.REQUEST, serialize_message(request), number)

    # Ends

    def _carry_out(self, order: dict[str, Any]) -> None:
        for end in order.get("add", ()):
            self._ends[end["channel"]] = end
            self._make(end)
        for channel in order.get("remove", ()):
            self._drop(channel)
            self._ends.pop(channel, None)
        names = [(end["name"], end["way"]) for end in self._ends.values() if end["kind"] == "topic"]
        both = {name for name, _ in names if {(name, "to_ros"), (name, "from_ros")} <= {*names}}
        self._echoes = {name: self._echoes.get(name, deque(maxlen=_ECHOES)) for name in both}
        self._link.event(done=[end["channel"] for end in order.get("add", ())])

    def _make(self, end: dict[str, Any]) -> None:
        node, name, channel = self.node, end["name"], end["channel"]
        try:
            kind = interface(end["type"])
            if end["kind"] == "service":
                if end["way"] == "to_ros":
                    made = node.create_client(kind, name)
                    if "/_action/" not in name:  # no goal begins after a stop that came while it waited
                        self._early[channel] = time.monotonic() + _SERVED_WITHIN, deque()
                else:
                    made = node.create_service(kind, name, lambda request, response: response)
            elif end["way"] == "to_ros":
                made = node.create_publisher(kind, name, quality(end, reliable=True))
            else:
                end["reliable"] = self._is_reliable(name)
                made = node.create_subscription(
                    kind, name, lambda data: None, quality(end, reliable=end["reliable"]), raw=True
                )
            if end["kind"] == "topic" and (other := self._other_hash(end)):
                made.destroy()
                raise EndError(f"this ROS 2 has another definition of {end['type']}: {other}, ours is {end['hash']}")
            self._entities[channel] = made
        except Exception as error:  # an end that cannot be made must not end the others
            self._problem(channel, str(error))

    def _other_hash(self, end: dict[str, Any]) -> str:
        """Return the hash of the type of our own end in ROS, if it is not ours; Humble has none."""
        node, name = self.node, end["name"]
        look = node.get_publishers_info_by_topic if end["way"] == "to_ros" else node.get_subscriptions_info_by_topic
        own = [info for info in look(name) if info.node_name == node.get_name()]
        found = {str(getattr(info, "topic_type_hash", end["hash"])) for info in own}
        return "" if end["hash"] in found else next(iter(found), "")

    def _drop(self, channel: int) -> None:
        self._early.pop(channel, None)
        if (entity := self._entities.pop(channel, None)) is not None:
            entity.destroy()

    def _is_reliable(self, name: str) -> bool:
        """Return whether all publishers of a topic are reliable: one that is not reaches no reliable subscription."""
        infos = self.node.get_publishers_info_by_topic(name)
        return all(info.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT for info in infos)

    def _adapt(self) -> bool:
        """Make subscriptions anew whose publishers have another reliability; return whether there is any."""
        changed = False
        for channel, end in self._ends.items():
            is_heard = (end["kind"], end["way"]) == ("topic", "from_ros") and channel in self._entities
            if is_heard and end["reliable"] != self._is_reliable(end["name"]):
                self._drop(channel)
                self._make(end)
                changed = True
        return changed

    def _problem(self, channel: int, text: str) -> None:
        self._link.event(problem=text, channel=channel)


def graph(node: Any) -> dict[str, Any]:
    """Return what is in ROS: by node, its topics and services with their types, and which topics are latched."""
    found: dict[str, Any] = {}
    for name, namespace in node.get_node_names_and_namespaces():
        full = f"{namespace.rstrip('/')}/{name}"
        if name.startswith("_"):  # hidden, as bridges are
            continue
        try:
            publishes = dict(node.get_publisher_names_and_types_by_node(name, namespace))
            found[full] = {
                "publishes": publishes,
                "subscribes": dict(node.get_subscriber_names_and_types_by_node(name, namespace)),
                "serves": dict(node.get_service_names_and_types_by_node(name, namespace)),
                "calls": dict(node.get_client_names_and_types_by_node(name, namespace)),
                "latched": [topic for topic in publishes if _is_latched(node, topic, name)],
            }
        except Exception as error:  # a node that has just gone
            sys.stderr.write(f"{full}: {error}\n")
    return found


def discovered(node: Any, most: float) -> dict[str, Any]:
    """Return the graph once something has appeared and then nothing new, after `most` [s] in any case."""
    began = changed = time.monotonic()
    found: dict[str, Any] = {}
    while time.monotonic() - began < most and (not found or time.monotonic() - changed < _SETTLED):
        time.sleep(_LOOK / 2)
        if (now := graph(node)) != found:
            found, changed = now, time.monotonic()
    return found


def _is_latched(node: Any, topic: str, name: str) -> bool:
    infos = node.get_publishers_info_by_topic(topic)
    return any(
        info.node_name == name and info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for info in infos
    )


def leave(node: Any) -> None:
    """End the process, after the others in ROS were told: they remember one that only dies for many seconds."""
    sys.stdout.flush()
    threading.Timer(_GOODBYE, os._exit, (0,)).start()  # threads of the middleware may never return
    node.destroy_node()  # with the last one, the participant of DDS goes
    rclpy.shutdown()
    os._exit(0)


def main() -> None:
    """Serve the bridge at the socket whose descriptor is the first argument, as the node of the second.

    With `graph` and a time [s], only look around for so long at most, and print what there is.
    """
    if sys.argv[1] == "graph":
        rclpy.init(args=[])
        node = rclpy.create_node("_rbxcompose", start_parameter_services=False, enable_rosout=False)
        sys.stdout.write(json.dumps(discovered(node, float(sys.argv[2]))))
        leave(node)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    wire = link.Link(socket.socket(fileno=int(sys.argv[1])))
    rclpy.init(args=[])
    side = RosSide(wire, sys.argv[2])
    wire.event(ready=rclpy.get_rmw_implementation_identifier())
    threading.Thread(target=side.receive, name="bridge reader", daemon=True).start()
    side.run()


if __name__ == "__main__":
    main()

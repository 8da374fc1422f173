"""A server for Foxglove and Lichtblick: the robot's topics as they are, its services and its parameters.

It knows no bus: what it needs of the robot it is given as functions, which it calls in its own thread or in those of
the library, so that these wait for a loop that is busy.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoAnswerInTimeError
from threading import Lock
from typing import TYPE_CHECKING, Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.console.rosapi import definition
from rbxcompose.msgs import packages, registry
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.cdr import CdrError, decode, encode
from rbxcompose.msgs.types import Message, Service
from rbxcompose.sdk import parameters

if TYPE_CHECKING:
    import foxglove
    from foxglove.websocket import ChannelView, Client, ClientChannel, PlaybackControlRequest, PlaybackState

CDR, ROS = "cdr", "ros2msg"
PATIENCE = 5.0  # [s] for an answer of the robot
_EVENTS = "/parameter_events"  # the topic on which nodes say which of their parameters have changed
_SEPARATOR = "."  # between the name of a node and that of its parameter


@dataclass(frozen=True, slots=True)
class RobotAccess:
    """What the server asks of the robot; each may be called in any thread."""

    listen: Callable[[str, Callable[[bytes], None]], Callable[[], None]]
    """Pass the messages of a topic on as CDR, first those that are latched, and return what ends that."""
    is_latched: Callable[[str], bool]
    """Return whether the last message of a topic is kept for late subscribers."""
    publisher: Callable[[str], tuple[Callable[[Message], object], Callable[[], object]]]
    """Return what publishes on a topic, and what withdraws that."""
    call: Callable[[str, type[Service[Any, Any]], Message], Future[Any]]
    """Call a service; the future has the response, or fails with the reason."""
    full_name: Callable[[str], str]
    """Return the full name of a topic as the bus resolves it; a `ValueError` says what is wrong with it."""
    refused: Callable[[str], str]
    """Return why clients may not publish on a topic, by its full name; nothing if they may."""


@dataclass(frozen=True, slots=True)
class _ClientPublisher:
    """What publishes the messages of one channel of a client."""

    topic: str
    type: type[Message]
    publish: Callable[[Message], object]
    withdraw: Callable[[], object]


class FoxgloveServer:
    """Serves one robot at a port of this machine."""

    def __init__(self, robot: RobotAccess, name: str, port: int) -> None:
        """Take the port; nothing is offered yet.

        Raises:
            RuntimeError: if the port is taken.
        """
        import foxglove
        from foxglove.websocket import Capability

        foxglove.set_log_level("ERROR")  # who comes and goes is no event of the robot
        self._robot, self._name = robot, name
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._types: dict[str, str] = {}
        self._services: dict[str, str] = {}
        self._listening: dict[str, tuple[int, Callable[[], None]]] = {}  # clients of a topic, and what ends it
        self._lock = Lock()  # of these: each client is served in a thread of its own
        self._end_events: Callable[[], None] | None = None  # once it listens to them
        self._publishers: dict[tuple[int, int], _ClientPublisher] = {}  # by client and channel
        self._server = foxglove.start_server(
            name=name,
            host="127.0.0.1",
            port=port,
            capabilities=[Capability.ClientPublish, Capability.Parameters, Capability.Services],
            server_listener=self,
            supported_encodings=[CDR],
            context=self._context,
        )

    @property
    def port(self) -> int:
        """Return where it listens."""
        return self._server.port

    def close(self) -> None:
        """Let all clients go; what they publish is withdrawn with the bus."""
        self._publishers.clear()
        self._server.stop()
        for _, end in self._listening.values():
            end()
        self._listening.clear()
        if self._end_events is not None:
            self._end_events()

    def offer(self, topics: Mapping[str, str], services: Mapping[str, str]) -> None:
        """Offer just these topics and services, each with its type; types that are not known here are left out."""
        import foxglove

        for topic in [topic for topic, type_ in self._types.items() if topics.get(topic) != type_]:
            del self._types[topic]
            self._channels.pop(topic).close()
        for topic, type_ in topics.items():
            if topic not in self._types and (text := definition(type_)) is not None:
                self._types[topic] = type_
                schema = foxglove.Schema(name=type_, encoding=ROS, data=text.encode())
                self._channels[topic] = foxglove.Channel(
                    topic, schema=schema, message_encoding=CDR, context=self._context
                )
        gone = [name for name, type_ in self._services.items() if services.get(name) != type_]
        if gone:
            self._server.remove_services(gone)
        self._services = {name: type_ for name, type_ in self._services.items() if name not in gone}
        new = {name: made for name in services.keys() - self._services if (made := self._service(name, services[name]))}
        if new:
            self._server.add_services([*new.values()])
            self._services |= {name: services[name] for name in new}
        if self._end_events is None and topics.get(_EVENTS) == rcl.ParameterEvent.TYPE:
            self._end_events = self._robot.listen(_EVENTS, self._push_changes)

    # What the library calls

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Listen to a topic as long as somebody wants it.

        If it is latched, listen anew for each client: the library sends to all of them or none, so all get it again.
        """
        log = self._channels[channel.topic].log
        with self._lock:
            count, end = self._listening.pop(channel.topic, (0, None))
            if end is not None and self._robot.is_latched(channel.topic):
                end()
                end = None
            self._listening[channel.topic] = count + 1, end or self._robot.listen(channel.topic, log)

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """Listen no more if nobody does."""
        with self._lock:
            count, end = self._listening.pop(channel.topic, (1, lambda: None))
            if count > 1:
                self._listening[channel.topic] = count - 1, end
            else:
                end()

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """Take what a client is going to publish, unless it may not."""
        try:
            topic = self._robot.full_name(channel.topic)
            why = self._why_not(topic, channel.encoding, channel.schema_name)
        except ValueError as error:
            why = str(error)
        if why:
            self._complain(f"'{channel.topic}' cannot be published: {why}")
            return
        type_ = registry.message(channel.schema_name)
        self._publishers[client.id, channel.id] = _ClientPublisher(topic, type_, *self._robot.publisher(topic))

    def _why_not(self, topic: str, encoding: str, type_name: str) -> str:
        if encoding != CDR:
            return f"messages are encoded as {CDR}, not '{encoding}'"
        try:
            wanted = registry.message(type_name).TYPE
        except KeyError:
            return f"the type '{type_name}' is not known here"
        known = self._types.get(topic, wanted)
        return self._robot.refused(topic) or ("" if known == wanted else f"it is of the type '{known}'")

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """Withdraw it, also when its client leaves."""
        if (known := self._publishers.pop((client.id, client_channel_id), None)) is not None:
            known.withdraw()

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """Publish a message of a client."""
        known = self._publishers.get((client.id, client_channel_id))
        if known is None:
            return  # its client got a warning when it advertised
        try:
            known.publish(decode(known.type, data))
        except CdrError as error:
            self._complain(f"a message on '{known.topic}' was dropped: {error}")

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[foxglove.Parameter]:
        """Return parameters by their names, `/base.max_speed`; all of them without names."""
        if param_names:
            return self._values(param_names)
        names = []
        for service in [name for name in self._services if name.endswith("/list_parameters")]:
            listed = self._answer(service, rcl.ListParameters, rcl.ListParameters.Request())
            node = service.removesuffix("/list_parameters")
            names += [f"{node}{_SEPARATOR}{name}" for name in listed.result.names] if listed is not None else []
        return self._values(names)

    def on_set_parameters(
        self, client: Client, parameters: list[foxglove.Parameter], request_id: str | None = None
    ) -> list[foxglove.Parameter]:
        """Set parameters, and return what they are then."""
        for wanted in parameters:
            self._set(wanted)
        return self._values([wanted.name for wanted in parameters])

    def on_parameters_subscribe(self, param_names: list[str]) -> None:
        """Do nothing: the library knows who wants which of all that is pushed."""

    def on_parameters_unsubscribe(self, param_names: list[str]) -> None:
        """Do nothing."""

    def on_connection_graph_subscribe(self) -> None:
        """Do nothing: it is not offered."""

    def on_connection_graph_unsubscribe(self) -> None:
        """Do nothing."""

    def on_playback_control_request(self, playback_control_request: PlaybackControlRequest) -> PlaybackState | None:
        """Do nothing: a robot is not played back."""
        return None

    # Services and parameters

    def _service(self, name: str, type_name: str) -> foxglove.Service | None:
        import foxglove

        try:
            type_ = registry.service(type_name)
            request, _, response = registry.text_of(type_name).partition("\n---")
        except (KeyError, OSError):
            return None
        nested = packages.whole_text(type_name).removeprefix(registry.text_of(type_name))

        def schema(kind: str, text: str) -> foxglove.MessageSchema:
            made = foxglove.Schema(name=f"{type_name}_{kind}", encoding=ROS, data=f"{text.strip()}\n{nested}".encode())
            return foxglove.MessageSchema(encoding=CDR, schema=made)

        def handle(asked: foxglove.ServiceRequest) -> bytes:
            if asked.encoding != CDR:
                raise ValueError(f"requests are encoded as {CDR}, not '{asked.encoding}'")
            answer = self._robot.call(name, type_, decode(type_.Request, asked.payload)).result(PATIENCE)
            return encode(answer)

        whole = foxglove.ServiceSchema(
            type_name, request=schema("Request", request), response=schema("Response", response)
        )
        return foxglove.Service(name, schema=whole, handler=handle)

    def _answer(self, name: str, type_: type[Service[Any, Any]], request: Message) -> Any:
        """Return the response, None without one: at once if nobody serves it, since all clients wait meanwhile."""
        try:
            if self._robot.full_name(name) not in self._services:
                return None
            return self._robot.call(name, type_, request).result(PATIENCE)
        except (NoAnswerInTimeError, RuntimeError, ValueError):
            return None

    def _got(self, node: str, names: list[str]) -> Any:
        request = rcl.GetParameters.Request(names=tuple(names))
        return self._answer(f"{node}/get_parameters", rcl.GetParameters, request)

    def _values(self, names: list[str]) -> list[foxglove.Parameter]:
        found: list[foxglove.Parameter] = []
        for node, wanted in _by_node(names).items():
            got = self._got(node, wanted)
            found += _shown(node, zip(wanted, got.values if got is not None else (), strict=False))
        return found

    def _push_changes(self, data: bytes) -> None:
        """Push the parameters that have changed, whoever changed them, to the clients that want them."""
        event = decode(rcl.ParameterEvent, data)
        changed = ((each.name, each.value) for each in (*event.new_parameters, *event.changed_parameters))
        self._server.publish_parameter_values(_shown(event.node, changed))

    def _set(self, wanted: foxglove.Parameter) -> None:
        value = wanted.get_value()
        ((node, (name,)),) = _by_node([wanted.name]).items()
        now = self._got(node, [name])
        is_float = now is not None and isinstance(parameters.from_message(now.values[0]), float)
        message = parameters.to_message(float(value) if is_float and isinstance(value, int) else value)
        if now is None or message is None:
            self._complain(f"there is no parameter '{wanted.name}' that could be set to this")
            return
        change = rcl.SetParameters.Request(parameters=(rcl.Parameter(name=name, value=message),))
        done = self._answer(f"{node}/set_parameters", rcl.SetParameters, change)
        if done is None or not done.results[0].successful:
            why = done.results[0].reason if done is not None else "it does not answer"
            self._complain(f"'{wanted.name}' was not set: {why}")

    def _complain(self, text: str) -> None:
        from foxglove import StatusLevel

        self._server.publish_status(text, StatusLevel.Warning)


def _shown(node: str, values: Iterable[tuple[str, rcl.ParameterValue]]) -> list[foxglove.Parameter]:
    """Return the parameters of a node for a client, without those that are not set or do not exist."""
    import foxglove

    found = []
    for name, message in values:
        if (value := parameters.from_message(message)) is not None:
            plain = value if isinstance(value, bool | int | float | str) else json.dumps(value, default=list)
            found.append(foxglove.Parameter(f"{node}{_SEPARATOR}{name}", value=plain))
    return found


def _by_node(names: list[str]) -> dict[str, list[str]]:
    """Return the names of parameters by those of their nodes."""
    found: dict[str, list[str]] = {}
    for name in names:
        node, _, parameter = name.partition(_SEPARATOR)
        found.setdefault(node, []).append(parameter)
    return found

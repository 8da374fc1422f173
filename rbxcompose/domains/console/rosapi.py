"""The services of rosapi about what is on the bus, and about types; ROS 1 and ROS 2 have other names for some."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.console.json_messages import WrongMessageError
from rbxcompose.msgs import packages, registry
from rbxcompose.msgs.definitions import KINDS, FieldShape, FieldType, parse_type
from rbxcompose.msgs.types import Message

_EXAMPLES = {"string": "", "wstring": "", "bool": False}
_HOST = "localhost"
_VERSION = {"version": 2, "distro": "jazzy"}  # the release whose types and wire format the bus has


@dataclass(frozen=True, slots=True)
class BusView:
    """What is on the bus at a moment; all names are absolute, and topics, services and actions have their types."""

    topics: Mapping[str, str]
    services: Mapping[str, str]
    """Of those that somebody serves, as for actions."""
    actions: Mapping[str, str]
    nodes: Sequence[str]
    publishers: Mapping[str, Sequence[str]]
    """The names of the nodes that publish, by topic."""
    subscribers: Mapping[str, Sequence[str]]
    """The names of the nodes that subscribe, by topic."""
    servers: Mapping[str, Sequence[str]]
    """The names of the nodes that serve, by service."""
    latched: Collection[str]
    """Topics whose last message is kept for late subscribers."""


def answer(name: str, given: Mapping[str, Any], graph: BusView, stamp: int) -> dict[str, Any]:
    """Return the answer of `/rosapi/NAME`.

    Args:
        name: one of `ARGUMENTS`, but none of a parameter.
        given: its arguments.
        graph: what is on the bus.
        stamp: the time [ns].

    Raises:
        WrongMessageError: if an argument is wrong, or a type is not known.
    """
    values = [_text(given, argument) for argument in ARGUMENTS[name]]
    if name == "get_time":
        seconds, rest = divmod(stamp, 1_000_000_000)
        return {"time": {"sec": seconds, "nanosec": rest, "secs": seconds, "nsecs": rest}}  # of ROS 2, and of ROS 1
    return _SERVICES[name][1](graph, *values)


def _topics_and_raw_types(graph: BusView) -> dict[str, Any]:
    types = list(graph.topics.values())
    return {
        "topics": list(graph.topics),
        "types": types,
        "typedefs_full_text": [definition(type_) or "" for type_ in types],
    }


def _services(graph: BusView) -> dict[str, str]:
    """Return the types of the services that clients find: those of the bus, and of rosapi."""
    return {**graph.services, **TYPES}


def _node_details(graph: BusView, node: str) -> dict[str, Any]:
    wanted = absolute(node)
    return {
        "publishing": [topic for topic in graph.topics if wanted in graph.publishers.get(topic, ())],
        "subscribing": [topic for topic in graph.topics if wanted in graph.subscribers.get(topic, ())],
        "services": [service for service in graph.services if wanted in graph.servers.get(service, ())],
    }


_SERVICES: Mapping[str, tuple[tuple[str, ...], Callable[..., dict[str, Any]]]] = {
    "topics": ((), lambda graph: {"topics": list(graph.topics), "types": list(graph.topics.values())}),
    "topics_and_raw_types": ((), _topics_and_raw_types),
    "interfaces": ((), lambda graph: {"interfaces": sorted(name for kind in KINDS for name in registry.names(kind))}),
    "services": ((), lambda graph: {"services": sorted(_services(graph))}),
    "action_servers": ((), lambda graph: {"action_servers": sorted(graph.actions)}),
    "action_type": (("action",), lambda graph, action: {"type": graph.actions.get(absolute(action), "")}),
    "nodes": ((), lambda graph: {"nodes": list(graph.nodes)}),
    "node_details": (("node",), _node_details),
    "topic_type": (("topic",), lambda graph, topic: {"type": graph.topics.get(absolute(topic), "")}),
    "service_type": (("service",), lambda graph, service: {"type": _services(graph).get(absolute(service), "")}),
    "service_node": (
        ("service",),
        lambda graph, service: {"node": next(iter(graph.servers.get(absolute(service), ())), "")},
    ),
    "service_host": (
        ("service",),
        lambda graph, service: {"host": _HOST if absolute(service) in _services(graph) else ""},
    ),
    "service_providers": (("service",), lambda graph, type_: {"providers": _of_type(_services(graph), type_, "srv")}),
    "topics_for_type": (("type",), lambda graph, type_: {"topics": _of_type(graph.topics, type_, "msg")}),
    "services_for_type": (("type",), lambda graph, type_: {"services": _of_type(_services(graph), type_, "srv")}),
    "publishers": (("topic",), lambda graph, topic: {"publishers": list(graph.publishers.get(absolute(topic), ()))}),
    "subscribers": (("topic",), lambda graph, topic: {"subscribers": list(graph.subscribers.get(absolute(topic), ()))}),
    "get_ros_version": ((), lambda graph: dict(_VERSION)),
    "message_details": (("type",), lambda graph, type_: _details(_known(registry.message, type_))),
    "service_request_details": (("type",), lambda graph, type_: _details(_known(registry.service, type_).Request)),
    "service_response_details": (("type",), lambda graph, type_: _details(_known(registry.service, type_).Response)),
    "action_goal_details": (("type",), lambda graph, type_: _details(_known(registry.action, type_).Goal)),
    "action_result_details": (("type",), lambda graph, type_: _details(_known(registry.action, type_).Result)),
    "action_feedback_details": (("type",), lambda graph, type_: _details(_known(registry.action, type_).Feedback)),
}
"""The services of rosapi that need only what is on the bus: their arguments, and what answers."""
ARGUMENTS: Mapping[str, tuple[str, ...]] = {
    **{name: arguments for name, (arguments, _) in _SERVICES.items()},
    "get_time": (),
    "get_param": ("name", "default_value"),
    "get_param_names": (),
    "has_param": ("name",),
    "set_param": ("name", "value"),
}
"""All services of rosapi, each with its arguments."""
_TYPE_NAMES = {"action_servers": "GetActionServers", "get_ros_version": "GetROSVersion"}
TYPES: Mapping[str, str] = {
    f"/rosapi/{name}": f"rosapi_msgs/srv/{_TYPE_NAMES.get(name) or name.title().replace('_', '')}" for name in ARGUMENTS
}
"""Their types, by their names on the bus."""


def _details(message: type[Message]) -> dict[str, Any]:
    return {"typedefs": list(_typedefs(message))}


def _typedefs(message: type[Message]) -> Iterator[dict[str, Any]]:
    """Yield what a message and those within it are made of, each once."""
    waiting, seen, structures = [message], {message.TYPE}, registry.chosen().structures
    while waiting:
        current = waiting.pop(0)
        types = {name: parse_type(text) for name, text in current.FIELDS.items()}
        constants = structures[current.TYPE].constants if current.TYPE in structures else ()
        yield {
            "type": _bare(current.TYPE),
            "fieldnames": list(types),
            "fieldtypes": [_bare(type_.base) for type_ in types.values()],
            "fieldarraylen": [_length(type_) for type_ in types.values()],
            "examples": [_example(type_.base, type_.shape) for type_ in types.values()],
            "constnames": [constant.name for constant in constants],
            "constvalues": [str(constant.value) for constant in constants],
        }
        for type_ in types.values():
            if type_.is_message and type_.base not in seen:
                seen.add(type_.base)
                waiting.append(registry.message(type_.base))


def _length(type_: FieldType) -> int:
    if type_.shape is FieldShape.SINGLE:
        return -1
    return type_.length if type_.shape is FieldShape.ARRAY else 0


def definition(type_: str) -> str | None:
    """Return the text of a message and those within it; None if it is not known here."""
    try:
        return packages.whole_text(registry.message(type_).TYPE)
    except (KeyError, OSError):
        return None


def _example(base: str, shape: FieldShape) -> str:
    if shape is not FieldShape.SINGLE:
        return "[]"
    return "{}" if "/" in base else str(_EXAMPLES.get(base, 0))


def _known(find: Callable[[str], Any], name: str) -> Any:
    try:
        return find(name)
    except KeyError as error:
        raise WrongMessageError(f"the type '{name[:60]}' is not known here") from error


def _bare(type_: str) -> str:
    """Return `geometry_msgs/Twist` for `geometry_msgs/msg/Twist`, as clients expect it."""
    return type_.replace("/msg/", "/").replace("/srv/", "/").replace("/action/", "/")


def _of_type(names: Mapping[str, str], type_: str, kind: str) -> list[str]:
    wanted = registry.full_name(type_, kind)
    return [name for name, known in names.items() if known == wanted]


def absolute(name: str) -> str:
    """Return a name with its first slash, which clients may leave out."""
    return f"/{name.lstrip('/')}"


def _text(given: Mapping[str, Any], key: str) -> str:
    if not isinstance(value := given.get(key), str):
        raise WrongMessageError(f"'{key}' is a text")
    return value

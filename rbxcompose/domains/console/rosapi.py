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


ARGUMENTS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("action_servers", "get_ros_version", "get_time", "interfaces", "nodes", "services"), ()),
    **dict.fromkeys(("topics", "topics_and_raw_types"), ()),
    **dict.fromkeys(("publishers", "subscribers", "topic_type"), ("topic",)),
    **dict.fromkeys(("services_for_type", "topics_for_type"), ("type",)),
    **dict.fromkeys(("service_type", "service_node", "service_host"), ("service",)),
    **dict.fromkeys(("message_details", "service_request_details", "service_response_details"), ("type",)),
    **dict.fromkeys(("action_goal_details", "action_result_details", "action_feedback_details"), ("type",)),
    "action_type": ("action",),
    "service_providers": ("service",),
    "node_details": ("node",),
    "get_param": ("name", "default_value"),
    "get_param_names": (),
    "has_param": ("name",),
    "set_param": ("name", "value"),
}
"""The services of rosapi, each with its arguments."""
_TYPE_NAMES = {"action_servers": "GetActionServers", "get_ros_version": "GetROSVersion"}
TYPES: Mapping[str, str] = {
    f"/rosapi/{name}": f"rosapi_msgs/srv/{_TYPE_NAMES.get(name) or name.title().replace('_', '')}" for name in ARGUMENTS
}
"""Their types, by their names on the bus."""
_PARTS = {
    "service_request_details": ("srv", "Request"),
    "service_response_details": ("srv", "Response"),
    "action_goal_details": ("action", "Goal"),
    "action_result_details": ("action", "Result"),
    "action_feedback_details": ("action", "Feedback"),
}


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
    if name == "message_details":
        return {"typedefs": list(_typedefs(_known(registry.message, values[0])))}
    if name in _PARTS:
        kind, part = _PARTS[name]
        interface = _known(registry.service if kind == "srv" else registry.action, values[0])
        return {"typedefs": list(_typedefs(getattr(interface, part)))}
    return _ANSWERS[name](graph, *values)


def _topics_and_raw_types(graph: BusView) -> dict[str, Any]:
    types = list(graph.topics.values())
    return {"topics": list(graph.topics), "types": types, "typedefs_full_text": [_definition(type_) for type_ in types]}


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


_ANSWERS: Mapping[str, Callable[..., dict[str, Any]]] = {
    "topics": lambda graph: {"topics": list(graph.topics), "types": list(graph.topics.values())},
    "topics_and_raw_types": _topics_and_raw_types,
    "interfaces": lambda graph: {"interfaces": sorted(name for kind in KINDS for name in registry.names(kind))},
    "services": lambda graph: {"services": sorted(_services(graph))},
    "action_servers": lambda graph: {"action_servers": sorted(graph.actions)},
    "action_type": lambda graph, action: {"type": graph.actions.get(absolute(action), "")},
    "nodes": lambda graph: {"nodes": list(graph.nodes)},
    "node_details": _node_details,
    "topic_type": lambda graph, topic: {"type": graph.topics.get(absolute(topic), "")},
    "service_type": lambda graph, service: {"type": _services(graph).get(absolute(service), "")},
    "service_node": lambda graph, service: {"node": next(iter(graph.servers.get(absolute(service), ())), "")},
    "service_host": lambda graph, service: {"host": _HOST if absolute(service) in _services(graph) else ""},
    "service_providers": lambda graph, type_: {"providers": _of_type(_services(graph), type_, "srv")},
    "topics_for_type": lambda graph, type_: {"topics": _of_type(graph.topics, type_, "msg")},
    "services_for_type": lambda graph, type_: {"services": _of_type(_services(graph), type_, "srv")},
    "publishers": lambda graph, topic: {"publishers": list(graph.publishers.get(absolute(topic), ()))},
    "subscribers": lambda graph, topic: {"subscribers": list(graph.subscribers.get(absolute(topic), ()))},
    "get_ros_version": lambda graph: dict(_VERSION),
}


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


def _definition(type_: str) -> str:
    """Return the text of a message and those within it; empty if there is none here."""
    try:
        return packages.whole_text(registry.message(type_).TYPE)
    except KeyError:
        return ""


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

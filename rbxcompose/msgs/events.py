"""Events of services: the message in which ROS 2 reports a request or a reply, on `SERVICE/_service_event`."""

from dataclasses import field, make_dataclass
from functools import cache
from typing import Any

from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldDefinition, Structure, parse_type, type_hash
from rbxcompose.msgs.service_msgs import ServiceEventInfo
from rbxcompose.msgs.types import Fields, Message, Service

TOPIC = "_service_event"  # suffix of the topic of a service's events


def event_of(service: type[Service[Any, Any]]) -> type[Any]:
    """Return the type with the fields `info`, `request` and `response`; one of the last two holds one message."""
    named: Any = service  # for mypy, classes of a generic are not hashable
    return _event_of(named)


@cache
def _event_of(service: Any) -> type[Any]:
    name = f"{service.TYPE}_Event"
    fields = {
        "info": ServiceEventInfo.TYPE,
        "request": f"{service.Request.TYPE}[<=1]",
        "response": f"{service.Response.TYPE}[<=1]",
    }
    structures: dict[str, Structure] = {}
    _describe(name, fields, structures)
    return make_dataclass(
        name.split("/")[-1],
        [
            ("info", ServiceEventInfo, field(default_factory=ServiceEventInfo)),
            ("request", tuple[Any, ...], ()),
            ("response", tuple[Any, ...], ()),
        ],
        bases=(Message,),
        namespace={"TYPE": name, "HASH": type_hash(name, structures), "FIELDS": fields},
        frozen=True,
        slots=True,
    )


def _describe(name: str, fields: Fields, found: dict[str, Structure]) -> None:
    """Add a message and all messages inside it to `found`."""
    found[name] = Structure(name, tuple(FieldDefinition(each, parse_type(text)) for each, text in fields.items()))
    for each in found[name].fields:
        if each.type.is_message and each.type.base not in found:
            _describe(each.type.base, registry.message(each.type.base).FIELDS, found)

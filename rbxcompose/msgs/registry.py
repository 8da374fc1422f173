"""Find messages, services and actions by their ROS names; a package is imported at its first lookup.

Classes of other packages are found, too, once they have been imported.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any, TypeVar

from rbxcompose.msgs.definitions import KINDS, interface_names
from rbxcompose.msgs.types import Action, Message, Service, declared

T = TypeVar("T")
_WHAT = dict(zip(KINDS, ("message", "service", "action"), strict=True))


def message(name: str) -> type[Message]:
    """Return the message `geometry_msgs/msg/Twist`, also written `geometry_msgs/Twist`; parts of services are messages.

    Raises:
        KeyError: lists the existing names.
    """
    return _find(name, "msg", Message)


def service(name: str) -> type[Service[Any, Any]]:
    """Return the service `std_srvs/srv/SetBool`, also written `std_srvs/SetBool`.

    Raises:
        KeyError: lists the existing names.
    """
    return _find(name, "srv", Service)


def action(name: str) -> type[Action[Any, Any, Any]]:
    """Return the action `nav2_msgs/action/NavigateToPose`, also written `nav2_msgs/NavigateToPose`.

    Raises:
        KeyError: lists the existing names.
    """
    return _find(name, "action", Action)


def names(kind: str) -> list[str]:
    """Return the sorted full names of all interfaces of one kind: `msg`, `srv` or `action`."""
    imported = (name for name in declared if name.split("/")[1] == kind and "_" not in name.split("/")[2])
    return sorted({*_shipped(kind), *imported})


def full_name(name: str, kind: str) -> str:
    """Return `geometry_msgs/msg/Twist` for `geometry_msgs/Twist`; other names unchanged."""
    match name.split("/"):
        case [package, bare]:
            return f"{package}/{kind}/{bare}"
    return name


def _find(name: str, kind: str, base: type[T]) -> type[T]:
    full = full_name(name, kind)
    package = full.split("/")[0]
    if full not in declared and package in _shipped_packages():
        import_module(f"rbxcompose.msgs.{package}")
    found = declared.get(full)
    if found is None or not issubclass(found, base):
        raise KeyError(f"no {_WHAT[kind]} {name!r}; there are {', '.join(names(kind))}")
    return found


@cache
def _shipped(kind: str) -> tuple[str, ...]:
    return tuple(interface_names(kind))


@cache
def _shipped_packages() -> frozenset[str]:
    return frozenset(name.split("/")[0] for kind in KINDS for name in _shipped(kind))

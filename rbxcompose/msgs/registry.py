"""The packages of interfaces in `interfaces/` as Python modules, and their classes by ROS name.

`rbxcompose.msgs.geometry_msgs` has no file: it makes the class `Twist` from its text when it is first used. Classes of
other packages are found by name, too, once they have been imported.
"""

from collections.abc import Mapping
from functools import cache
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, TypeVar

from rbxcompose.msgs.classes import class_path, make_class
from rbxcompose.msgs.definitions import INTERFACES, KINDS, Structures, interface_names
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
    found = _shipped_class(full) or _imported_class(full)
    if found is None or not issubclass(found, base):
        raise KeyError(f"no {_WHAT[kind]} {name!r}; there are {', '.join(names(kind))}")
    return found


def _shipped_class(full: str) -> type[Any] | None:
    """Return a class of ours, also that of a part: `std_srvs/srv/SetBool_Request`."""
    package = PACKAGES.get(full.split("/")[0])
    if package is None or full.count("/") != 2:
        return None
    found: Any = package
    for part in class_path(full, package.interfaces().values()).split("."):
        found = getattr(found, part, None)
    return found if getattr(found, "TYPE", None) == full else None


def _imported_class(full: str) -> type[Any] | None:
    """Return a class of another package, also that of a part, which may not be made yet."""
    whole, is_part, part = full.rpartition("_")
    if full in declared or not is_part:
        return declared.get(full)
    found = getattr(_imported_class(whole), part, None)
    return found if getattr(found, "TYPE", None) == full else None


@cache
def _shipped(kind: str) -> tuple[str, ...]:
    return tuple(interface_names(kind))


class _Package(ModuleType):
    """A ROS package as a Python module: its attributes are classes."""

    def __init__(self, package: str) -> None:
        super().__init__(f"{__package__}.{package}", f"ROS 2 interfaces of `{package}`.")
        self.__package__ = __package__
        self.__spec__ = ModuleSpec(self.__name__, None, origin=str(INTERFACES / package))

    def __getattr__(self, name: str) -> type[Any]:
        interface = self.interfaces().get(name)
        if interface is None:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        made = make_class(interface, SHIPPED)
        setattr(self, name, made)
        return made

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.interfaces()})

    def interfaces(self) -> Mapping[str, str]:
        """Return the names of all interfaces by those of their classes."""
        return _interfaces(self.__name__.rpartition(".")[2])


@cache
def _interfaces(package: str) -> Mapping[str, str]:
    names = {f"{package}/{path.parent.name}/{path.stem}" for path in (INTERFACES / package).glob("*/*")}
    return {class_path(name, names): name for name in names}


SHIPPED = Structures()
PACKAGES = {path.name: _Package(path.name) for path in INTERFACES.iterdir()}

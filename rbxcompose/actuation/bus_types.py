"""Types of buses of servos: how one is opened, and which models are on it. Each is one file in `bus_types/`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.servo_models import ServoModel, find_model
from rbxcompose.dataclass import dataclass
from rbxcompose.plugins import Plugins

PLUGINS = Plugins("bus_type", "rbxcompose.bus_types")
DYNAMIXEL = "dynamixel"


class OpensBus(Protocol):
    """Opens a bus at the path of a port, for servos by id."""

    def __call__(
        self, path: str, servos: Mapping[int, ServoModel], *, baud: int, clock: Callable[[], float], is_fast: bool
    ) -> ServoBus:
        """Return the bus; `is_fast` if it may use what old firmware lacks. PortError if there is no such port."""
        ...


@dataclass(frozen=True, slots=True)
class BusType:
    """A type of bus: `package` is what it needs beside rbxcompose, which the extra `extra` installs."""

    name: str
    open: OpensBus
    models: Callable[[], Mapping[str, ServoModel]]
    package: str = ""
    extra: str = ""

    def model(self, name: str) -> ServoModel | None:
        """Return a model by its name; capitals, signs and revisions do not matter."""
        return find_model(name, self.models())


_TYPES: dict[str, BusType] = {}


def bus_type_declared(
    name: str, models: Callable[[], Mapping[str, ServoModel]], *, package: str = "", extra: str = ""
) -> Callable[[OpensBus], OpensBus]:
    """Declare a type of bus by the function that opens one."""

    def register(opens: OpensBus) -> OpensBus:
        _TYPES[name] = BusType(name, opens, models, package, extra)
        return opens

    return register


def bus_type_names() -> list[str]:
    """Return the names of all types, sorted, without importing any."""
    return sorted({*PLUGINS.names(), *_TYPES})


def bus_type(name: str) -> BusType:
    """Return a type, importing its file if necessary.

    Raises:
        KeyError: if no type has this name.
        BrokenPluginError: if it belongs to another package and cannot be used.
    """
    if name not in _TYPES and PLUGINS.load(name) and name not in _TYPES:
        raise PLUGINS.broken(name, f"its module declares no type by @bus_type_declared({name!r}, ...)")
    return _TYPES[name]

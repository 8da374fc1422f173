"""ROS 2 messages, services and actions: definitions, classes, type hashes and the CDR codec.

Each package of `interfaces/` is a module here, such as `rbxcompose.msgs.geometry_msgs`, without a file of its own.
"""

from importlib import import_module
from types import ModuleType

from rbxcompose.msgs.registry import PACKAGES


def __getattr__(name: str) -> ModuleType:
    if name in PACKAGES:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *PACKAGES})

"""The components that sections request."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Protocol

from rbxcompose.config import Config
from rbxcompose.dataclass import dataclass
from rbxcompose.manifest.options import ComponentOptions
from rbxcompose.manifest.tree import KeyPath


@dataclass(frozen=True, slots=True)
class WantedComponent:
    """A component that a section requests; `path` is the place in the manifest that does so."""

    name: str
    type_name: str
    config: Config | Mapping[str, object]
    """Its configuration, or the data from which its type makes one."""
    path: KeyPath
    options: ComponentOptions = field(default_factory=ComponentOptions)
    places: Mapping[str, KeyPath] = field(default_factory=dict)
    """Where the manifest has fields and ports that it got from elsewhere: `{"controllers.base": ("controllers",
    "base")}`."""
    is_sound: bool = True
    """Whether its configuration is what the user meant; otherwise only its ports count."""


class Wiring(Protocol):
    """The wires of the components known so far."""

    def message_of(self, topic: str) -> str:
        """Return the type of a subscriber of a topic, else of a publisher below it; empty if there is none."""
        ...

    def drives(self, topic: str) -> bool:
        """Return whether a base follows the commands on a topic."""
        ...

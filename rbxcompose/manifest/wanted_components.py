"""What sections become: the components that they ask for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from rbxcompose.config import Config
from rbxcompose.manifest.options import ComponentOptions
from rbxcompose.manifest.tree import KeyPath


@dataclass(frozen=True, slots=True)
class WantedComponent:
    """A component that a section asks for; `path` is where the manifest does so."""

    name: str
    type_name: str
    config: Config | Mapping[str, object]
    """Its configuration, or what its type is to make one of."""
    path: KeyPath
    options: ComponentOptions = field(default_factory=ComponentOptions)


class Wiring(Protocol):
    """The wires of the components that there are so far."""

    def message_of(self, topic: str) -> str:
        """Return the type of who listens to a topic, else of who publishes below it; empty if nobody does."""
        ...

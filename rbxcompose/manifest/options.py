"""The options that every component takes."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from rbxcompose.config import Config, Name
from rbxcompose.manifest.fields import ComponentName, TopicName
from rbxcompose.references import Refers
from rbxcompose.restarts import DEFAULT, Restart, When

OWN_PORT = "own port"
"""A port of the component whose options these are."""


def _spelt_out(value: Any) -> Any:
    return {"when": value} if isinstance(value, str) else value


RestartModel = Annotated[Restart, BeforeValidator(_spelt_out, json_schema_input_type=Restart | When)]


class ComponentOptions(Config):
    """What every component takes besides its own configuration."""

    process: Name | None = None
    """Its process group; components of one group share a process."""
    starts_after: tuple[ComponentName, ...] = ()
    """Components that must be active before this one starts."""
    restart: RestartModel = DEFAULT
    """Whether and when it restarts after a failure: a word, or a map with `when`, `max`, `within` and `backoff`."""
    log: Literal["info", "warn", "error"] = "info"
    """The lowest level that it logs."""
    connect: dict[Annotated[Name, Refers(OWN_PORT, is_told=True)], TopicName] = {}
    """Topics by port, where they differ from the port's name."""


OPTIONS = tuple(ComponentOptions.model_fields)

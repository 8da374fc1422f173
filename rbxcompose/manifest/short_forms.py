"""Short forms of entries: one word in place of a map with one key."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any

from pydantic import BeforeValidator

from rbxcompose.dataclass import dataclass
from rbxcompose.manifest.shapes import below, kinds_of
from rbxcompose.references import Refers


@dataclass(frozen=True, slots=True)
class Short:
    """One word in place of an entry with one key: `patrol: FILE` is `{file: FILE}`."""

    key: str
    is_merged: bool = True
    """Whether layers may change single keys of such an entry; otherwise they replace it as a whole."""
    only_over: str = ""
    """Meaning of the word, if only an overlay may use the short form."""


@cache
def short_type_of(model: Any, key: str) -> Any:
    """Return the type of the word in place of an entry."""
    return Annotated[(str, *(Refers(kind, is_told=True) for kind in kinds_of(next(below(model, key)))))]


@cache  # each type is compiled once
def entry_type_of(model: Any, short: Short) -> Any:
    """Return the type of an entry, whole or short."""
    word = short_type_of(model, short.key)
    read = BeforeValidator(
        lambda value: {short.key: value} if isinstance(value, str) else value, json_schema_input_type=model | word
    )
    return Annotated[model, read]

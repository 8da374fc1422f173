"""The keys at the start of every manifest."""

from __future__ import annotations

from typing import Literal

from rbxcompose.config import Config, Name

KINDS = ("Robot", "Part", "Overlay", "Mission", "Test", "System")
"""What a manifest may describe."""


class ManifestHeader(Config):
    """The keys at the start of every manifest."""

    rbx: Literal[1]
    """Version of the language."""
    kind: str
    """What this file describes: `Robot`, `Part`, `Overlay`, `Mission`, `Test` or `System`."""
    name: Name
    """Its name: lower-case letters, digits and underscores."""
    about: str = ""
    """What it is for, in a sentence."""

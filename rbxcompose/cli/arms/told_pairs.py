"""Pairs of links for people."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.body.link_pairs import LinkPair


def told_pairs(pairs: Sequence[LinkPair], most: int = 10) -> str:
    """Return pairs of links in words."""
    words = ", ".join(f"{one} - {other}" for one, other in pairs[:most])
    return words + (f" and {len(pairs) - most} more" if len(pairs) > most else "")

"""A place that the robot does not have."""

from __future__ import annotations

from rbxcompose.findings import Finding, Related, Span, kind

UNKNOWN_PLACE = kind("RBX4103", is_fixable=True)


def removed_place(span: Span, name: str, remover: Span) -> Finding:
    """Return the finding for a place that the robot had until a layer removed it."""
    return UNKNOWN_PLACE.at(span, f"there is no place '{name}' any more", related=[Related(remover, "removed here")])

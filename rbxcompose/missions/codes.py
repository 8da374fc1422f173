"""Kinds of findings that come up while a mission is read.

Findings that need the whole mission come from rules, in `missions/checks`.
"""

from rbxcompose.base.findings import Finding, Related, Span, kind

UNKNOWN_KEY = kind("RBX4101", is_fixable=True)
UNKNOWN_PLACE = kind("RBX4103", is_fixable=True)
UNKNOWN_NAME = kind("RBX4104", is_fixable=True)
WRONG_TYPE = kind("RBX4106", is_fixable=True)
TWO_STEPS = kind("RBX4108", is_fixable=True)
MISSING = kind("RBX4109")
WRONG_SHAPE = kind("RBX4110", is_fixable=True)
NO_EXPRESSION = kind("RBX4111")
NAME_CLASH = kind("RBX4112")
WRONG_INPUT = kind("RBX4113", is_fixable=True)
NOT_A_CHOICE = kind("RBX4114", is_fixable=True)
TOO_DEEP = kind("RBX4115")


def removed_place(span: Span, name: str, remover: Span) -> Finding:
    """Return the finding for a place that the robot had until a layer removed it."""
    related = [Related(remover, "removed here")]
    return UNKNOWN_PLACE.at(span, f"there is no place '{name}' any more", related=related, about=[name])

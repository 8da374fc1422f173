"""Kinds of findings that come up while a mission is read, one file each with its docs page.

Findings that need the whole mission come from rules, in `missions/checks`.
"""

from __future__ import annotations

from rbxcompose.missions.codes.missing_key import MISSING
from rbxcompose.missions.codes.name_clash import NAME_CLASH
from rbxcompose.missions.codes.no_expression import NO_EXPRESSION
from rbxcompose.missions.codes.not_a_choice import NOT_A_CHOICE
from rbxcompose.missions.codes.too_deep import TOO_DEEP
from rbxcompose.missions.codes.two_steps import TWO_STEPS
from rbxcompose.missions.codes.unknown_key import UNKNOWN_KEY
from rbxcompose.missions.codes.unknown_name import UNKNOWN_NAME
from rbxcompose.missions.codes.unknown_place import UNKNOWN_PLACE, removed_place
from rbxcompose.missions.codes.wrong_input import WRONG_INPUT
from rbxcompose.missions.codes.wrong_shape import WRONG_SHAPE
from rbxcompose.missions.codes.wrong_type import WRONG_TYPE

__all__ = [
    "MISSING",
    "NAME_CLASH",
    "NOT_A_CHOICE",
    "NO_EXPRESSION",
    "TOO_DEEP",
    "TWO_STEPS",
    "UNKNOWN_KEY",
    "UNKNOWN_NAME",
    "UNKNOWN_PLACE",
    "WRONG_INPUT",
    "WRONG_SHAPE",
    "WRONG_TYPE",
    "removed_place",
]

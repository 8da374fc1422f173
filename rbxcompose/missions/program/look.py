"""How a kind of node is drawn."""

from __future__ import annotations

from enum import StrEnum

from rbxcompose.dataclass import dataclass


class Form(StrEnum):
    """How the children of a node are arranged: one after the other, side by side, or as states with transitions.

    `STATE` is for a state itself.
    """

    AFTER = "after"
    BESIDE = "beside"
    MACHINE = "machine"
    STATE = "state"


@dataclass(frozen=True, slots=True)
class NodeLook:
    """The sign before the title, the form, and whether the keys of the children are worth showing."""

    sign: str = ""
    form: Form = Form.AFTER
    has_roles: bool = False


PLAIN = NodeLook()

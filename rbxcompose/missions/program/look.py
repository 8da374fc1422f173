"""How a kind of node is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Form(StrEnum):
    """How what is inside a node stands: one after the other, beside each other, as states with transitions.

    A state is drawn as one.
    """

    AFTER = "after"
    BESIDE = "beside"
    MACHINE = "machine"
    STATE = "state"


@dataclass(frozen=True, slots=True)
class NodeLook:
    """The sign before the title, the form, and whether the keys of the nodes inside say something."""

    sign: str = ""
    form: Form = Form.AFTER
    has_roles: bool = False


PLAIN = NodeLook()

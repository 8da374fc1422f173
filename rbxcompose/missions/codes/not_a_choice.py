"""A word that an option does not take."""

from __future__ import annotations

from rbxcompose.findings import kind

NOT_A_CHOICE = kind("RBX4114", is_fixable=True)

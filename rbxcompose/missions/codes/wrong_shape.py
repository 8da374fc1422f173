"""A form that the language does not have."""

from __future__ import annotations

from rbxcompose.findings import kind

WRONG_SHAPE = kind("RBX4110", is_fixable=True)

"""A value of the wrong type."""

from __future__ import annotations

from rbxcompose.findings import kind

WRONG_TYPE = kind("RBX4106", is_fixable=True)

"""A key that belongs to nothing."""

from __future__ import annotations

from rbxcompose.findings import kind

UNKNOWN_KEY = kind("RBX4101", is_fixable=True)

"""A `$name` that means nothing."""

from __future__ import annotations

from rbxcompose.findings import kind

UNKNOWN_NAME = kind("RBX4104", is_fixable=True)

"""Something required that is missing."""

from __future__ import annotations

from rbxcompose.findings import kind

MISSING = kind("RBX4109")

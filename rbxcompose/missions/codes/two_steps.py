"""Two steps where only one is allowed."""

from __future__ import annotations

from rbxcompose.findings import kind

TWO_STEPS = kind("RBX4108", is_fixable=True)

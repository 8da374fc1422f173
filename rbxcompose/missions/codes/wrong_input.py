"""A value for an input that does not fit."""

from __future__ import annotations

from rbxcompose.findings import kind

WRONG_INPUT = kind("RBX4113", is_fixable=True)

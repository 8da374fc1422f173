"""One name for two things."""

from __future__ import annotations

from rbxcompose.findings import kind

NAME_CLASH = kind("RBX4112")

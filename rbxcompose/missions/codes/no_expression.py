"""A condition or a value that cannot be read."""

from __future__ import annotations

from rbxcompose.findings import kind

NO_EXPRESSION = kind("RBX4111")

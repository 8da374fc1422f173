"""Nodes that are nested too deeply."""

from __future__ import annotations

from rbxcompose.findings import kind

TOO_DEEP = kind("RBX4115")

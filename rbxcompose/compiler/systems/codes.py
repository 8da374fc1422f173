"""Kinds of findings about systems that are reported while they are read."""

from __future__ import annotations

from rbxcompose.base.findings import kind

UNKNOWN_HOST = kind("RBX6100", is_fixable=True)
NOTHING_TO_PLACE = kind("RBX6101", is_fixable=True)
SAME_NAME = kind("RBX6131")
BROKEN_ROBOT = kind("RBX6102")

"""Possible errors in the file of a test."""

from rbxcompose.base.findings import Severity, kind

UNKNOWN = kind("RBX4201", is_fixable=True)
WRONG_VALUE = kind("RBX4202")
NEVER = kind("RBX4203")
NO_STEP = kind("RBX4204")
UNUSED_MOCK = kind("RBX4205", Severity.WARNING)

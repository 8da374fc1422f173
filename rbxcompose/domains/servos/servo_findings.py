"""What can be wrong with servos on a bus, for people."""

from __future__ import annotations

from rbxcompose.base.findings import Severity, kind

NOT_INSTALLED = kind("RBX2207")
SILENT = kind("RBX2208")
ID_TAKEN = kind("RBX2209")
NO_ITEM = kind("RBX2210")
REFUSED = kind("RBX2211")
UNKNOWN_MODEL = kind("RBX2212")
OTHER_RATE = kind("RBX2250", Severity.WARNING)

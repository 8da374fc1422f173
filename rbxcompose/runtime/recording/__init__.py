"""MCAP files: writes, reads and recovers them; and the kinds of findings about them."""

from rbxcompose.base.findings import Severity, kind

UNREADABLE = kind("RBX9201")
DAMAGED = kind("RBX9202", Severity.WARNING)
UNWRITABLE = kind("RBX9203")
RECOVERED = kind("RBX9204", Severity.WARNING)
NOTHING = kind("RBX9205")
NOT_REPLAYED = kind("RBX9206", Severity.WARNING)
SENT_ALREADY = kind("RBX9210")
NOT_ENOUGH = kind("RBX9208")
DIFFERENT = kind("RBX9209")
LOST = kind("RBX9207", Severity.WARNING)

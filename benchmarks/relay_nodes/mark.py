"""What all relays do besides passing a message on, whatever carries it: they tell when their first one came."""

from __future__ import annotations

import os
import time
from pathlib import Path


def mark(folder: str, number: int) -> None:
    """Write down that relay `number` has had its first message, and when [s] on the machine's monotonic clock."""
    path = Path(folder) / str(number)
    new = path.with_suffix(".new")
    new.write_text(f"{os.getpid()} {time.monotonic()}", encoding="ascii")
    new.rename(path)  # whole, or not there

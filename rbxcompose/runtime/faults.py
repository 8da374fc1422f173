"""What follows a fault: how it is told, and when the component that made it may try again."""

from __future__ import annotations

import traceback
from collections import deque
from pathlib import Path

WITHIN = 60.0  # [s] in which failures are counted
MOST = 5  # failures within that time after which there is no further try
FIRST_BACKOFF = 0.1  # [s], doubled by each failure in a row


class RestartPolicy:
    """Counts failures: `after_failure` tells how long to wait for the next try."""

    def __init__(self) -> None:
        self.restarts = 0
        self._failures: deque[float] = deque(maxlen=MOST)

    def after_failure(self, now: float) -> float | None:
        """Return the pause before the next try [s], or None if there were `MOST` failures within `WITHIN`."""
        self._failures.append(now)
        recent = sum(1 for time in self._failures if now - time <= WITHIN)
        if recent >= MOST:
            return None
        self.restarts += 1
        return float(FIRST_BACKOFF * 2 ** (recent - 1))


def explain(error: BaseException, file: str | None = None) -> tuple[str, str]:
    """Return one line that names the error and where it was raised, and the whole traceback.

    The line is the innermost one in `file`, where the component is written, if the error came through it.
    """
    frames = traceback.extract_tb(error.__traceback__)
    words = f"{type(error).__name__}: {error}".removesuffix(": ")
    detail = "".join(traceback.format_exception(error))
    if not frames:
        return words, detail
    own = [frame for frame in frames if frame.filename == file]
    last = (own or frames)[-1]
    return f"{last.name} raised {words} ({Path(last.filename).name}:{last.lineno})", detail

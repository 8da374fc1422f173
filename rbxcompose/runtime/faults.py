"""The consequences of a fault: how it is reported, and when the component that raised it may retry."""

import traceback
from collections import deque
from pathlib import Path

from rbxcompose.base.config import DEFAULT, Restart
from rbxcompose.base.requests import OutsideError


class RestartPolicy:
    """Counts failures and backs off: `after_failure` returns the pause before the next try.

    The time from the `begin` of a try until it is `ready`, or has failed, does not count: failures of what hangs would
    otherwise never be close enough together.
    """

    def __init__(self, restart: Restart = DEFAULT) -> None:
        self.restarts = 0
        self._restart = restart
        self._failures: deque[float] = deque(maxlen=restart.max)  # [s], without the time of all tries before
        self._began: float | None = None  # [s], of a try that is not ready
        self._tried = 0.0  # [s] in all tries

    @property
    def is_allowed(self) -> bool:
        """Return whether the component may ever be restarted, however few failures there were."""
        return self._restart.when != "never"

    def begin(self, now: float) -> None:
        """Note that a try begins."""
        self._began = now

    def ready(self, now: float) -> None:
        """Note that the try, if one was under way, is over."""
        if self._began is not None:
            self._tried += now - self._began
            self._began = None

    def after_failure(self, now: float, *, stands: bool = False) -> float | None:
        """Return the pause before the next try [s], or None if there is none.

        The pause stays short enough for `max` failures to fit into `within`: otherwise none would be the last.
        While time `stands` still, no pause would end: the next try comes at once, and even `always` has a last one.
        """
        limits = self._restart
        self.ready(now)
        now -= self._tried
        self._failures.append(now)
        recent = sum(1 for time in self._failures if now - time <= limits.within)
        if not self.is_allowed or ((stands or limits.when == "on_failure") and recent >= limits.max):
            return None
        self.restarts += 1
        if stands:
            return 0.0
        return float(min(limits.backoff * 2.0 ** (recent - 1), limits.within / limits.max))


def explain(error: BaseException, file: str | None = None) -> tuple[str, str]:
    """Return one line that names the error and where it was raised, and the whole traceback.

    The place is the innermost one in `file`, the component's source, if the error passed through it. A reason outside
    of all code has neither place nor traceback.
    """
    if isinstance(error, OutsideError):
        return str(error), ""
    frames = traceback.extract_tb(error.__traceback__)
    words = f"{type(error).__name__}: {error}".removesuffix(": ")
    detail = "".join(traceback.format_exception(error))
    if not frames:
        return words, detail
    own = [frame for frame in frames if frame.filename == file]
    last = (own or frames)[-1]
    return f"{last.name} raised {words} ({Path(last.filename).name}:{last.lineno})", detail

"""Why there is no pose of one frame in another, in words that name the frames and times that there are."""

from __future__ import annotations

from collections.abc import Collection

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import nearest
from rbxcompose.units import TIME, format_quantity

MOST_NAMES = 6  # frames that a message lists
NANOSECONDS = 1_000_000_000


class TransformError(LookupError):
    """Raised when a frame has no pose in another one, or none at that time; the text tells why."""


class UnknownFrameError(TransformError):
    """No transform has named this frame; the text lists those that exist, the most similar first."""

    def __init__(self, frame: str, frames: Collection[str]) -> None:
        super().__init__(f"there is no frame '{frame}'; {_listed(frame, frames)}")
        self.frame = frame


class NotConnectedError(TransformError):
    """The frames have different roots."""

    def __init__(self, target: str, source: str, roots: tuple[str, str]) -> None:
        mine, other = roots
        super().__init__(
            f"'{target}' and '{source}' are not connected: the root of '{target}' is '{mine}', "
            f"that of '{source}' is '{other}'"
        )
        self.roots = roots


@dataclass(frozen=True, slots=True)
class KnownTimes:
    """From when to when [ns] a frame has poses in its parent."""

    frame: str
    parent: str
    oldest: int
    newest: int


class ExtrapolationError(TransformError):
    """The time lies outside of what is known; `limit` is the frame that ends first there."""

    def __init__(self, pair: tuple[str, str], time: int, links: Collection[KnownTimes]) -> None:
        target, source = pair
        oldest, newest = max(one.oldest for one in links), min(one.newest for one in links)
        is_future = time > newest
        if is_future:
            limit = next(one for one in links if one.newest == newest)
            known, apart = f"until {_moment(newest)}", f"{_duration(time - newest)} earlier"
        else:
            limit = next(one for one in links if one.oldest == oldest)
            known, apart = f"from {_moment(oldest)} on", f"{_duration(oldest - time)} later"
        whole = f"from {_moment(oldest)} to {_moment(newest)}" if oldest <= newest else "at no time"
        super().__init__(
            f"no pose of '{source}' in '{target}' at {_moment(time)}: '{limit.frame}' in '{limit.parent}' is known "
            f"only {known}, {apart}; everything between them is known {whole}"
        )
        self.time, self.oldest, self.newest = time, oldest, newest
        self.limit, self.is_future = limit.frame, is_future


def _listed(frame: str, frames: Collection[str]) -> str:
    if not frames:
        return "there are none yet"
    near = nearest(frame, frames, most=MOST_NAMES, cutoff=0.0)
    first = (near + sorted(set(frames) - set(near)))[:MOST_NAMES]
    rest = f" and {len(frames) - MOST_NAMES} more" if len(frames) > MOST_NAMES else ""
    return f"frames: {', '.join(first)}{rest}"


def _moment(time: int) -> str:
    seconds, rest = divmod(time, NANOSECONDS)
    return f"{seconds + rest / NANOSECONDS:.3f} s"


def _duration(time: int) -> str:
    return format_quantity(time / NANOSECONDS, TIME)

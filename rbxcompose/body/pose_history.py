"""The recent poses of one frame in its parent, by the time at which they were measured."""

from __future__ import annotations

from array import array
from bisect import bisect_left

from rbxcompose.geometry import Transform3, lerp, slerp

SPAN = 10_000_000_000  # [ns] before the newest pose: what is older is forgotten
LATE = 1_000_000_000  # [ns]; a stamp that is older by more comes from a clock that was set back
MOST_POSES = 2000
_BLOCK = 256  # outdated poses whose memory is freed at once
_WIDTH = 7  # numbers of a pose


class PoseHistory:
    """Poses ordered by their stamps [ns]; plain numbers in arrays take a sixth of the memory of objects."""

    __slots__ = ("_first", "_numbers", "_stamps")

    def __init__(self) -> None:
        self._stamps, self._numbers = array("q"), array("d")
        self._first = 0  # those before it are outdated

    def __len__(self) -> int:
        return len(self._stamps)

    @property
    def oldest(self) -> int:
        """Return the stamp of the oldest pose [ns]."""
        return self._stamps[self._first]

    @property
    def newest(self) -> int:
        """Return the stamp of the newest pose [ns]."""
        return self._stamps[-1]

    def add(self, stamp: int, pose: Transform3) -> None:
        """Insert a pose at its place; it replaces one with the same stamp, and all if the clock was set back."""
        stamps = self._stamps
        if not stamps or stamp > stamps[-1]:
            stamps.append(stamp)
            self._numbers.extend(pose.translation + pose.rotation)
            self._forget()
        elif self.is_set_back(stamp):
            self._cut(len(stamps))
            self.add(stamp, pose)
        else:
            self._insert(stamp, pose)

    def is_set_back(self, stamp: int) -> bool:
        """Return whether a stamp is too old to be that of a late message: the publisher's clock was set back."""
        return bool(self._stamps) and self._stamps[-1] - stamp > LATE

    def at(self, stamp: int) -> Transform3 | None:
        """Return the pose at a time [ns], interpolated between its neighbours; None outside of what is known."""
        stamps = self._stamps
        after = bisect_left(stamps, stamp, self._first)
        if after == len(stamps):
            return None
        if stamps[after] == stamp:
            return self._pose(after)
        if after == self._first:
            return None
        start, end = stamps[after - 1], stamps[after]
        return self._between(after, (stamp - start) / (end - start))

    def halve(self) -> None:
        """Forget the older half, but not the newest pose."""
        self._cut(len(self._stamps) // 2)

    def _insert(self, stamp: int, pose: Transform3) -> None:
        place = bisect_left(self._stamps, stamp)
        start = end = place * _WIDTH
        if self._stamps[place] == stamp:
            end += _WIDTH
        else:
            self._stamps.insert(place, stamp)
        self._numbers[start:end] = array("d", pose.translation + pose.rotation)
        self._forget()

    def _forget(self) -> None:
        outdated = bisect_left(self._stamps, self._stamps[-1] - SPAN)
        self._first = max(outdated, len(self._stamps) - MOST_POSES)
        if self._first >= _BLOCK:
            self._cut(self._first)

    def _cut(self, count: int) -> None:
        del self._stamps[:count], self._numbers[: count * _WIDTH]
        self._first = max(0, self._first - count)

    def _pose(self, index: int) -> Transform3:
        x, y, z, qx, qy, qz, qw = self._numbers[index * _WIDTH : (index + 1) * _WIDTH]
        return Transform3((x, y, z), (qx, qy, qz, qw))

    def _between(self, after: int, fraction: float) -> Transform3:
        numbers = self._numbers[(after - 1) * _WIDTH : (after + 1) * _WIDTH]
        x, y, z, qx, qy, qz, qw, next_x, next_y, next_z, next_qx, next_qy, next_qz, next_qw = numbers
        return Transform3(
            lerp((x, y, z), (next_x, next_y, next_z), fraction),
            slerp((qx, qy, qz, qw), (next_qx, next_qy, next_qz, next_qw), fraction),
        )

"""The tree of frames: where each frame is in its parent, now and lately, and so where any frame is in another."""

import math
from array import array
from bisect import bisect_left
from collections.abc import Collection

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import nearest
from rbxcompose.base.geometry import Transform3, composed, lerp, slerp
from rbxcompose.base.units import TIME, format_quantity

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
        oldest, newest = max(link.oldest for link in links), min(link.newest for link in links)
        is_future = time > newest
        if is_future:
            limit = next(link for link in links if link.newest == newest)
            known, apart = f"until {_moment(newest)}", f"{_duration(time - newest)} earlier"
        else:
            limit = next(link for link in links if link.oldest == oldest)
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
            place = bisect_left(self._stamps, stamp)
            start = end = place * _WIDTH
            if self._stamps[place] == stamp:
                end += _WIDTH
            else:
                self._stamps.insert(place, stamp)
            self._numbers[start:end] = array("d", pose.translation + pose.rotation)
            self._forget()

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
            x, y, z, qx, qy, qz, qw = self._numbers[after * _WIDTH : (after + 1) * _WIDTH]
            return Transform3((x, y, z), (qx, qy, qz, qw))
        if after == self._first:
            return None
        start, end = stamps[after - 1], stamps[after]
        return self._between(after, (stamp - start) / (end - start))

    def halve(self) -> None:
        """Forget the older half, but not the newest pose."""
        self._cut(len(self._stamps) // 2)

    def _forget(self) -> None:
        outdated = bisect_left(self._stamps, self._stamps[-1] - SPAN)
        self._first = max(outdated, len(self._stamps) - MOST_POSES)
        if self._first >= _BLOCK:
            self._cut(self._first)

    def _cut(self, count: int) -> None:
        del self._stamps[:count], self._numbers[: count * _WIDTH]
        self._first = max(0, self._first - count)

    def _between(self, after: int, fraction: float) -> Transform3:
        numbers = self._numbers[(after - 1) * _WIDTH : (after + 1) * _WIDTH]
        x, y, z, qx, qy, qz, qw, next_x, next_y, next_z, next_qx, next_qy, next_qz, next_qw = numbers
        return Transform3(
            lerp((x, y, z), (next_x, next_y, next_z), fraction),
            slerp((qx, qy, qz, qw), (next_qx, next_qy, next_qz, next_qw), fraction),
        )


MOST_FRAMES = 10_000  # names come from outside; a tree must not grow without bound
TRANSFORMS_MOST_POSES = 200_000  # of all frames together, 64 B each; frames that move then remember less
UNIT_TOLERANCE = 1e-2  # how far the length of a rotation may differ from 1, as in other transform trees


@dataclass(frozen=True, slots=True)
class TransformAnswer:
    """Answer to `set`: whether the transform was accepted, and a message if it was not, or was not like others."""

    accepted: bool
    message: str = ""


_ACCEPTED = TransformAnswer(True)


@dataclass(frozen=True, slots=True)
class _Link:
    parent: str
    transform: Transform3
    stamp: float
    history: PoseHistory | None = None  # None if static

    def at(self, time: int) -> Transform3 | None:
        """Return the pose at a time [ns], None outside of what is known."""
        return self.transform if self.history is None else self.history.at(time)


class TransformTree:
    """Newest and recent poses of every frame in its parent; frames without a common root are not connected."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}  # by child
        self._kept = 0  # poses in all histories

    @property
    def frames(self) -> frozenset[str]:
        """Names of all frames, roots included."""
        return frozenset(self._links) | {link.parent for link in self._links.values()}

    def parent_of(self, frame: str) -> str | None:
        """Return the parent of `frame`; None for roots and unknown frames."""
        link = self._links.get(frame)
        return link.parent if link else None

    def set(
        self, parent: str, child: str, transform: Transform3, *, stamp: float, static: bool, measured: int | None = None
    ) -> TransformAnswer:
        """Place `child` in `parent`, or refuse what would not be a tree; a later parent replaces an earlier one.

        `stamp` is the robot time [s] at which the transform was received, `measured` the stamp that it had [ns], by
        default the same. A static transform never grows old, and holds for all times.

        The newest pose is the one received last: a clock that is set back must not freeze a robot's view of itself. In
        the history, a pose that comes up to 1 s late is put in its place; one with a known stamp replaces that pose. If
        stamps go back further, the history begins again.
        """
        refusal = self._refusal(parent, child, transform)
        if refusal:
            return TransformAnswer(False, refusal)
        before, transform = self._links.get(child), _normalised(transform)
        moved = before is not None and before.parent != parent
        note = f"'{child}' has moved from '{before.parent}' to '{parent}'" if before and moved else ""
        if static:
            self._replace(child, _Link(parent, transform, math.inf))
            return TransformAnswer(True, note)
        known = before.history if before and not moved else None
        history = PoseHistory() if known is None else known
        late = self._remember(history, transform, round(stamp * NANOSECONDS) if measured is None else measured)
        self._replace(child, _Link(parent, transform, stamp, history))
        note = note or (f"the stamps of '{child}' went back{late}" if late else "")
        return TransformAnswer(True, note) if note else _ACCEPTED

    def lookup(self, target: str, source: str) -> Transform3 | None:
        """Return the newest pose of frame `source` in frame `target`, or None when they are not connected.

        Each frame counts as it was last seen, so that a joint that is seldom reported does not hold up the others;
        `lookup_common` is the look-up in which all of them have the same time.
        """
        paths = self._paths(target, source)
        if paths is None:
            return None
        up, down = paths
        return self._chain(up).inverse().compose(self._chain(down)) if up else self._chain(down)

    def lookup_at(self, target: str, source: str, time: int) -> Transform3:
        """Return the pose of `source` in `target` at a time [ns], interpolated between the poses that are known.

        Raises:
            TransformError: if a frame is unknown, the two are not connected, or the time is not known.
        """
        up, down = (self._chain_at(path, time) for path in self._connected(target, source))
        if up is None or down is None:
            raise ExtrapolationError((target, source), time, self._known(target, source))
        return up.inverse().compose(down)

    def lookup_across(self, target: str, target_time: int, source: str, source_time: int, fixed: str) -> Transform3:
        """Return where `source` was at its time, as seen from where `target` was at its own [ns].

        `fixed` is the frame that has not moved between the two times, such as `odom`.

        Raises:
            TransformError: as `lookup_at`.
        """
        return self.lookup_at(target, fixed, target_time).compose(self.lookup_at(fixed, source, source_time))

    def lookup_common(self, target: str, source: str) -> Transform3:
        """Return the pose at the newest time for which all frames between the two are known.

        Raises:
            TransformError: as `lookup_at`.
        """
        time = self.newest_common(target, source)
        return self.lookup_at(target, source, 0 if time is None else time)

    def newest_common(self, target: str, source: str) -> int | None:
        """Return the newest time [ns] for which all frames between two are known, None if they hold for all times.

        Raises:
            TransformError: if a frame is unknown, or the two are not connected.
        """
        return min((one.newest for one in self._known(target, source)), default=None)

    def problem(self, target: str, source: str) -> TransformError | None:
        """Return why two frames have no pose in each other, None if they have one."""
        frames = self.frames
        for frame in (target, source):
            if frame not in frames:
                return UnknownFrameError(frame, frames)
        roots = self._ancestry(target)[-1], self._ancestry(source)[-1]
        return None if roots[0] == roots[1] else NotConnectedError(target, source, roots)

    def stamp_of(self, target: str, source: str) -> float | None:
        """Return the stamp [s] of the oldest dynamic link between two frames.

        It is infinite when all links are static, and None when the frames are not connected.
        """
        paths = self._paths(target, source)
        if paths is None:
            return None
        return min((self._links[frame].stamp for path in paths for frame in path), default=math.inf)

    def age(self, target: str, source: str, now: float) -> float | None:
        """Return how long ago [s] the oldest dynamic link was received: 0 if all are static, None if not connected."""
        stamp = self.stamp_of(target, source)
        return None if stamp is None else max(0.0, now - stamp)

    def _remember(self, history: PoseHistory, pose: Transform3, measured: int) -> str:
        """Add a pose to a history; if its stamp is not the newest, return what becomes of the history."""
        late, held = "", len(history)
        if held and measured < history.newest:
            is_forgotten = history.is_set_back(measured)
            late = ": its earlier poses are forgotten" if is_forgotten else ", by less than a second"
        history.add(measured, pose)
        self._kept += len(history) - held
        if self._kept > TRANSFORMS_MOST_POSES:
            before = len(history)
            history.halve()
            self._kept += len(history) - before
        return late

    def _replace(self, child: str, link: _Link) -> None:
        before = self._links.get(child)
        if before is not None and before.history is not None and before.history is not link.history:
            self._kept -= len(before.history)
        self._links[child] = link

    def _refusal(self, parent: str, child: str, transform: Transform3) -> str:
        if not parent or not child:
            return "a frame needs a name"
        numbers = (*transform.translation, *transform.rotation)
        if not math.isfinite(sum(numbers)) and not all(map(math.isfinite, numbers)):
            return f"the transform of '{child}' contains a number that is not finite"
        if abs(math.hypot(*transform.rotation) - 1.0) > UNIT_TOLERANCE:
            return f"the rotation of '{child}' is not a unit quaternion"
        if child in self._ancestry(parent):
            return f"'{child}' cannot be placed in '{parent}': that is '{child}' itself or is below it"
        if child not in self._links and len(self._links) >= MOST_FRAMES:
            return f"'{child}' is one frame more than the {MOST_FRAMES} that a tree may have"
        return ""

    def _ancestry(self, frame: str) -> list[str]:
        """Return `frame` and all above it, up to its root."""
        found = [frame]
        while link := self._links.get(found[-1]):
            found.append(link.parent)
        return found

    def _paths(self, target: str, source: str) -> tuple[list[str], list[str]] | None:
        """Return the frames below the nearest common ancestor: on the way to `target`, and to `source`."""
        if target == source:
            return ([], []) if target in self.frames else None
        above_target, above_source = self._ancestry(target), self._ancestry(source)
        if above_target[-1] != above_source[-1]:
            return None
        while above_target and above_source and above_target[-1] == above_source[-1]:
            above_target.pop()
            above_source.pop()
        return above_target, above_source

    def _chain(self, path: list[str]) -> Transform3:
        links = self._links
        return composed([links[frame].transform for frame in path])  # from the leaf upwards

    def _chain_at(self, path: list[str], time: int) -> Transform3 | None:
        poses = [self._links[frame].at(time) for frame in path]
        known = [pose for pose in poses if pose is not None]
        return composed(known) if len(known) == len(poses) else None

    def _connected(self, target: str, source: str) -> tuple[list[str], list[str]]:
        paths = self._paths(target, source)
        if paths is None:
            raise self.problem(target, source) or TransformError(f"'{source}' has no pose in '{target}'")
        return paths

    def _known(self, target: str, source: str) -> list[KnownTimes]:
        """Return from when to when each moving frame between two is known."""
        frames = (frame for path in self._connected(target, source) for frame in path)
        links = ((frame, self._links[frame]) for frame in frames)
        return [
            KnownTimes(frame, link.parent, link.history.oldest, link.history.newest)
            for frame, link in links
            if link.history is not None
        ]


def _normalised(transform: Transform3) -> Transform3:
    x, y, z, w = transform.rotation
    length = math.hypot(x, y, z, w)
    if length == 1.0:
        return transform
    return Transform3(transform.translation, (x / length, y / length, z / length, w / length))

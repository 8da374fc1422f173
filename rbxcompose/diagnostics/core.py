"""The aggregator: from the statuses of all parts to one tree with a level for each group.

Statuses are named `component` or `component: detail`; a pattern that matches the component matches its details too.
All times are robot time [s] at which a status reached the aggregator.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase

from rbxcompose.dataclass import dataclass
from rbxcompose.diagnostics.status import Status
from rbxcompose.levels import Level, combined

DEFAULT_TIMEOUT = 5.0  # [s]
OTHER = "Other"  # the group of statuses that no analyzer matches
_GLOB = frozenset("*?[")
MOST_ITEMS = 10_000  # names come from outside; the tree must not grow without bound


@dataclass(frozen=True, slots=True)
class Analyzer:
    """A group of the tree: names or globs in `match`, names that must report in `expected`.

    An item that is silent for more than `timeout` [s] is STALE.
    """

    match: tuple[str, ...] = ()
    expected: tuple[str, ...] = ()
    timeout: float = DEFAULT_TIMEOUT

    def matches(self, name: str) -> bool:
        """Return whether the status called `name` belongs to this group."""
        parts = (name, _component(name))
        return any(_matches(parts, pattern) for pattern in (*self.match, *self.expected))


@dataclass(frozen=True, slots=True)
class _Item:
    """The latest status under a name; `status` is None until one has been received."""

    status: Status | None
    heard: float
    cause: str = ""  # why the part is lost; empty if it is not

    def seen(self, name: str, timeout: float, now: float) -> Status:
        """Return the status of the item in the tree at `now`."""
        status = self.status or Status(name, Level.OK, "has not reported yet")
        if self.cause:
            return replace(status, level=Level.STALE, message=self.cause)
        if now - self.heard <= timeout:
            return status
        last = f", last: {status.message}" if status.message else ""
        silent = f"silent since {self.heard:.1f} s{last}" if self.status else "never reported"
        return replace(status, level=Level.STALE, message=silent)


class Aggregator:
    """Keeps the latest status of every name and sorts them into the groups of `analyzers`.

    `started` is the robot time [s] from which on a part that was expected counts as late.
    """

    def __init__(self, analyzers: Mapping[str, Analyzer], *, started: float = 0.0) -> None:
        self._analyzers = dict(analyzers)
        self._started = started
        self._items = {
            name: _Item(None, started) for analyzer in self._analyzers.values() for name in analyzer.expected
        }
        self._groups_of: dict[str, tuple[str, ...]] = {}
        self._reported: dict[str, Level] | None = None
        self.dropped = 0  # statuses of new names for which there was no room

    def feed(self, now: float, statuses: Iterable[Status]) -> None:
        """Receive statuses that arrived at `now`; a name that was lost is back."""
        for status in statuses:
            if status.name not in self._items and len(self._items) >= MOST_ITEMS:
                self.dropped += 1
                continue
            component = _component(status.name)
            if component in self._items and self._items[component].status is None:
                del self._items[component]  # a placeholder for a part that had not reported
            self._items[status.name] = _Item(status, now)

    def lost(self, now: float, names: Iterable[str], cause: str) -> None:
        """Mark the components `names` as STALE immediately, with the `cause`, until they report again."""
        for name in names:
            known = [item for item in self._items if name in (item, _component(item))]
            for item in known or [name]:
                before = self._items.get(item, _Item(None, now))
                self._items[item] = replace(before, cause=cause)

    def report(self, now: float) -> tuple[Status, ...]:
        """Return the tree: for each group its header `/group`, followed by its items `/group/name` by name."""
        tree: list[Status] = []
        self._reported = {}
        for group, items in self._groups(now).items():
            header = self._header(group, items, now)
            self._reported[group] = header.level
            tree.append(header)
            tree.extend(replace(item, name=f"/{group}/{_flat(item.name)}") for item in items)
        return tuple(tree)

    def changed(self, now: float) -> bool:
        """Return whether the level of any group differs from the last report; before the first one it does."""
        return self._levels(now) != self._reported

    def top_level(self, now: float) -> Level:
        """Return the level of the whole robot."""
        return combined(self._levels(now).values())

    def _levels(self, now: float) -> dict[str, Level]:
        return {group: self._level(group, items, now) for group, items in self._groups(now).items()}

    def _groups(self, now: float) -> dict[str, list[Status]]:
        """Return the items of every group with their status at `now`, sorted by name; Other only if it has any."""
        groups: dict[str, list[Status]] = {group: [] for group in (*self._analyzers, OTHER)}
        for name in sorted(self._items):
            for group in self._groups_with(name):
                timeout = self._analyzers[group].timeout if group in self._analyzers else DEFAULT_TIMEOUT
                groups[group].append(self._items[name].seen(name, timeout, now))
        if not groups[OTHER] and OTHER not in self._analyzers:
            del groups[OTHER]
        return groups

    def _groups_with(self, name: str) -> tuple[str, ...]:
        if name not in self._groups_of:
            matching = tuple(group for group, analyzer in self._analyzers.items() if analyzer.matches(name))
            self._groups_of[name] = matching or (OTHER,)
        return self._groups_of[name]

    def _level(self, group: str, items: list[Status], now: float) -> Level:
        if items:
            return combined(item.level for item in items)
        is_late = now - self._started > self._analyzers[group].timeout
        return Level.STALE if is_late else Level.OK

    def _header(self, group: str, items: list[Status], now: float) -> Status:
        level = self._level(group, items, now)
        if not items:
            return Status(f"/{group}", level, "nothing reported" if level is Level.STALE else "nothing reported yet")
        worst = max(items, key=lambda item: item.level)  # the first one if several are equal
        return Status(
            f"/{group}",
            level,
            "OK" if worst.level is Level.OK else f"{worst.name}: {worst.message}",
            values=tuple((item.name, item.message) for item in items),
        )


def _component(name: str) -> str:
    return name.partition(": ")[0]


def is_glob(pattern: str) -> bool:
    """Return whether a pattern can match other names than itself."""
    return not _GLOB.isdisjoint(pattern)


def _matches(parts: tuple[str, str], pattern: str) -> bool:
    # Equality first: a name may contain brackets, which have a meaning in globs.
    if pattern in parts:
        return True
    return is_glob(pattern) and any(fnmatchcase(part, pattern) for part in parts)


def _flat(name: str) -> str:
    """Return `name` as one step of a path: a slash would add a level."""
    return name.strip("/").replace("/", " ")

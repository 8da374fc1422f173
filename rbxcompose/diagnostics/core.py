"""The aggregator: from the statuses of all parts to one tree with a level for each group.

All times are robot time [s] at which a status reached the aggregator. A status costs the same however many there are:
levels are counted in each group, and only groups in which a count has changed are looked at.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from heapq import heappop, heappush

from rbxcompose.diagnostics.admission import Admission
from rbxcompose.diagnostics.conditions import component_of, fits, matches
from rbxcompose.diagnostics.group import Group, GroupItem, Item
from rbxcompose.diagnostics.layout import GroupLayout
from rbxcompose.diagnostics.settings import DiagnosticsModel
from rbxcompose.diagnostics.tree import LevelHistory, TreeRow
from rbxcompose.levels import Level
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus


class Aggregator:
    """Keeps the latest status of every name and sorts them into groups.

    `expected` are the robot's own components, which must all report; `started` is the robot time [s] from which on
    they count as late.
    """

    def __init__(self, settings: DiagnosticsModel, expected: Sequence[str] = (), *, started: float = 0.0) -> None:
        self._settings, self._own = settings, frozenset(expected)
        self._layout = GroupLayout(settings, started)
        self._items: dict[str, Item] = {}
        self._dirty: list[int] = []
        self._is_dirty: set[int] = set()
        self._check_at = math.inf  # [s], the first time at which a group may change by itself
        self.history, self.admission = LevelHistory(), Admission()
        names = {*expected, *(name for one in self._layout.groups for name in one.analyzer.expected)}
        for name in sorted(names):
            self._place(Item(name, started, is_own=self._is_own(name)))
        for group in self._layout.groups:
            self._touch(group)
        self._settle(started)
        self.has_news = False  # the level of a group has changed; whoever reports it resets this

    def feed(self, now: float, statuses: Iterable[DiagnosticStatus]) -> None:
        """Receive statuses that arrived at `now`; a name that was lost is back."""
        items = self._items
        for status in statuses:
            item = items.get(status.name)
            if item is None and (item := self._new(status, now)) is None:
                continue
            item.status, item.heard = self.admission.fitted(status), now
            if status.level != item.level or not item.is_plain:
                item.level, item.cause = status.level, ""
                self._follow(item, now)
        self._settle(now)

    def lost(self, now: float, names: Iterable[str], cause: str) -> None:
        """Mark the components `names` as STALE immediately, with the `cause`, until they report again."""
        for name in names:
            known = [one for one in self._items.values() if name in (one.name, component_of(one.name))]
            for item in known or [self._place(Item(name, now, is_own=self._is_own(name)))]:
                item.cause = cause
                for member in item.members:
                    member.group.is_urgent = True
                self._follow(item, now)
        self._settle(now)

    def advance(self, now: float) -> None:
        """Let time pass: what is silent for too long becomes STALE, and levels that had to last count."""
        if now > self._check_at:
            for group in self._layout.groups:
                if now > group.check_at:
                    self._sweep(group, now)
            self._settle(now)
            self._check_at = min(group.check_at for group in self._layout.groups)

    def acknowledge(self, now: float, path: str = "") -> list[str]:
        """Let the latched levels of a group and those below it follow the present; return the paths of these groups."""
        done: list[str] = []
        for group in self._layout.groups:
            if (not path or f"{group.path}/".startswith(f"{path}/")) and group.acknowledge():
                group.is_urgent = True
                self._touch(group)
                done.append(group.path)
        self._settle(now)
        return done

    def level(self) -> tuple[Level, str]:
        """Return the level of the whole robot, and the group that gives it with its cause."""
        return self._layout.level()

    def paths(self) -> list[str]:
        """Return the paths of all groups."""
        return [one.path for one in self._layout.groups if one.has_header]

    def report(self, now: float) -> tuple[TreeRow, ...]:
        """Return the tree: the header of each group, followed by its items by name and the groups below it."""
        for group in self._layout.groups:
            group.tell(now)
        return tuple(row for top in self._layout.tops() for row in _rows(top, 0))

    def take_over(self, old: Aggregator, now: float) -> None:
        """Go on with what another aggregator knew: its items, and the levels of groups that are the same."""
        self.admission = old.admission
        for name, before in old._items.items():
            if before.status is None and not before.cause:
                continue
            item = self._items.get(name) or self._entered(name, before.heard)
            item.status, item.heard, item.level, item.cause = before.status, before.heard, before.level, before.cause
            self._follow(item, now)
        self.history = old.history  # in which what is known already is no change
        there = {group.key: group for group in old._layout.groups}
        for group in self._layout.groups:
            if group.key in there:
                group.take_over(there[group.key])
            self._touch(group)
        self._settle(now)

    # Items

    def _is_own(self, name: str) -> bool:
        return component_of(name) in self._own

    def _new(self, status: DiagnosticStatus, now: float) -> Item | None:
        return self._entered(status.name, now) if self.admission.takes(status, len(self._items)) else None

    def _entered(self, name: str, now: float) -> Item:
        """Return the item of a new name; it replaces a placeholder for its component."""
        component = component_of(name)
        if component != name and component in self._items and self._items[component].status is None:
            self._forget(self._items[component], now)
        return self._place(Item(name, now, is_own=self._is_own(name)))

    def _place(self, item: Item) -> Item:
        """Put an item into all groups that match it, else into `Other`; one that is ignored into none."""
        self._items[item.name], name = item, item.name
        wanted: list[Group] = []
        if not any(fits(one, name) for one in self._settings.ignore):
            wanted = [group for group in self._layout.matching if matches(group.analyzer, name)]
            silent = any(matches(one, name) for one in self._layout.silent)
            wanted = wanted or ([] if silent else [self._layout.other])
        for group in wanted:
            group.add(item)
            self._touch(group)
        return item

    def _follow(self, item: Item, now: float) -> None:
        """Give an item the level that it has now, in all of its groups."""
        item.is_plain = item.status is not None and not item.cause
        for member in item.members:
            level = member.level_at(now)
            if level is not member.level:
                self._move(member, level, now)
            item.is_plain = item.is_plain and level == item.level
            if (timeout := member.group.analyzer.timeout) and not item.cause:
                member.group.check_at = min(member.group.check_at, item.heard + timeout)
                self._check_at = min(self._check_at, member.group.check_at)
            if member.group.is_urgent:
                self._touch(member.group)

    def _move(self, member: GroupItem, level: Level, now: float) -> None:
        old = member.level
        member.group.move(member, level)
        self.history.add(now, member.path, old, level, member.message())
        self._touch(member.group)

    def _forget(self, item: Item, now: float) -> None:
        for member in list(item.members):
            self._leave(member, now)

    def _leave(self, member: GroupItem, now: float) -> None:
        member.group.drop(member, now)
        self._touch(member.group)
        if not member.item.members:
            del self._items[member.item.name]

    # Groups

    def _touch(self, group: Group) -> None:
        if group.index not in self._is_dirty:
            self._is_dirty.add(group.index)
            heappush(self._dirty, group.index)

    def _sweep(self, group: Group, now: float) -> None:
        """Find what has become STALE by silence; let it disappear if it shall."""
        timeout, group.check_at = group.analyzer.timeout or math.inf, math.inf
        shall_go = group.analyzer.discard_stale or group is self._layout.other
        for member in list(group.members.values()):
            level, item = member.level_at(now), member.item
            if level is not member.level:
                self._move(member, level, now)
                item.is_plain = False
            if now - item.heard <= timeout:
                group.check_at = min(group.check_at, item.heard + timeout)
            elif shall_go and not (item.is_own or item.name in group.analyzer.expected):
                self._leave(member, now)
        self._touch(group)

    def _settle(self, now: float) -> None:
        """Bring the levels of all groups in which something has changed up to date, in the order of dependence."""
        while self._dirty:
            index = heappop(self._dirty)
            self._is_dirty.discard(index)
            group = self._layout.groups[index]
            before, is_urgent, had_failed = group.level, group.is_urgent, group.is_failed
            if group.update(now):
                self.has_news = True
                if group.has_header:
                    self.history.add(now, group.path, before, group.level, group.message)
            for one in group.dependents if group.is_failed is not had_failed else ():
                self._touch(one)
            self._check_at = min(self._check_at, group.check_at)
            self._tell_parent(group, is_urgent)

    def _tell_parent(self, group: Group, is_urgent: bool) -> None:
        parent, counted = group.parent, group.level if group.is_visible else None
        if parent is None or counted is group.counted:
            return
        if group.counted is not None:
            parent.counts[group.counted] -= 1
        if counted is not None:
            parent.counts[counted] += 1
        group.counted, self.has_news = counted, True
        parent.is_urgent = parent.is_urgent or is_urgent
        self._touch(parent)


def _rows(group: Group, depth: int) -> Iterator[TreeRow]:
    """Yield the header of a group and what is below it."""
    if not group.is_visible:
        return
    if group.has_header:
        yield TreeRow(group.name, depth, is_group=True, status=group.shown())
    below = depth + group.has_header
    for member in group.sorted_members:
        yield TreeRow(member.name, below, is_group=False, status=member.shown())
    for child in group.children:
        yield from _rows(child, below)

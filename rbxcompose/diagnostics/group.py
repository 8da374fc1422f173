"""A group of the tree while the robot runs: its items, its level, and what delays, keeps or silences that level."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.diagnostics.conditions import flat, stripped
from rbxcompose.diagnostics.settings import AnalyzerModel
from rbxcompose.levels import Level
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus, KeyValue

OK, WARN, ERROR, STALE = Level
FAILED = (ERROR, STALE)


class Item:
    """The latest status under a name; `status` is None until one has been received."""

    __slots__ = ("cause", "heard", "is_own", "is_plain", "level", "members", "name", "status")

    def __init__(self, name: str, heard: float, *, is_own: bool) -> None:
        self.name, self.heard, self.is_own = name, heard, is_own
        self.status: DiagnosticStatus | None = None
        self.level = 0  # that of the status, as it came
        self.cause = ""  # why the part is lost; empty if it is not
        self.members: list[GroupItem] = []
        self.is_plain = False  # each group shows it with the level of its status


class GroupItem:
    """An item in a group."""

    __slots__ = ("group", "item", "level", "name", "path")

    def __init__(self, item: Item, group: Group) -> None:
        self.item, self.group = item, group
        self.name = stripped(flat(item.name), group.analyzer.strip_prefix)
        self.path = f"{group.path}/{self.name}"
        self.level = OK

    def level_at(self, now: float) -> Level:
        """Return the level of the item in the tree at `now` [s]."""
        item, timeout = self.item, self.group.analyzer.timeout
        if item.cause or (timeout and now - item.heard > timeout):
            return STALE
        return Level(item.level) if OK <= item.level <= STALE else ERROR

    def message(self) -> str:
        """Return what the item tells, or why it is STALE."""
        item, status = self.item, self.item.status
        if item.cause:
            return item.cause
        if self.level is not STALE or item.level == STALE:
            if status is None:
                return "has not reported yet"
            return status.message if OK <= item.level <= STALE else f"level {item.level} is unknown: {status.message}"
        last = f", last: {status.message}" if status and status.message else ""
        return f"silent since {item.heard:.1f} s{last}" if status else "never reported"

    def shown(self) -> DiagnosticStatus:
        """Return the item as it is in the tree."""
        status = self.item.status
        if status is None:
            return DiagnosticStatus(int(self.level), self.path, self.message())
        is_told = self.level == status.level and not self.item.cause
        message = status.message if is_told else self.message()
        return DiagnosticStatus(int(self.level), self.path, message, status.hardware_id, status.values)


class Group:
    """An analyzer with a header in the tree. `key` are the keys of the analyzers down to it; times are robot time [s].

    `counts` has the number of items and visible groups by level, `index` orders groups so that those that a group
    depends on come before it.
    """

    def __init__(self, key: tuple[str, ...], analyzer: AnalyzerModel, parent: Group | None, path: str, born: float):
        self.key, self.analyzer, self.parent, self.path = key, analyzer, parent, path
        self.name = analyzer.path or (key[-1] if key else "")
        self.has_header = bool(path) and (parent is None or path != parent.path)
        self.children: list[Group] = []
        self.suppressor: Group | None = None
        self.dependents: list[Group] = []
        self.members: dict[str, GroupItem] = {}
        self.counts = [0, 0, 0, 0]
        self.index = 0
        self.level = OK
        self.message = "OK"  # of the header, as of the last `tell`
        self.is_visible = True
        self.counted: Level | None = None  # as what its parent counts it
        self.is_classic = False
        self.floor = OK  # the least level with items that are not the robot's own
        self._now = OK  # the level of the last update without delay or latch
        self.latched_at = math.inf
        self._latched = ""  # what there was to tell when the level was latched
        self.check_at = math.inf  # [s], after which time alone may change it
        self.is_urgent = False  # a level counts at once, whatever `debounce` says
        self.had_items = False
        self._born = self._empty_since = born
        self._leaving = math.inf  # since when another level is due
        self._order: list[GroupItem] | None = None

    @property
    def is_failed(self) -> bool:
        """Return whether what depends on it is silenced: not by a level that is only latched."""
        return self.is_visible and self.level in FAILED and self._now in FAILED

    def add(self, item: Item) -> GroupItem:
        """Add an item; its level counts from the next `move`."""
        member = GroupItem(item, self)
        self.members[item.name] = member
        item.members.append(member)
        self.counts[OK] += 1
        self.had_items = True
        self._order = None
        self.check_at = min(self.check_at, item.heard + (self.analyzer.timeout or math.inf))
        return member

    def drop(self, member: GroupItem, now: float) -> None:
        """Remove an item."""
        del self.members[member.item.name]
        member.item.members.remove(member)
        self.counts[member.level] -= 1
        self._order = None
        if not self.members:
            self._empty_since = now

    def move(self, member: GroupItem, level: Level) -> None:
        """Give an item another level."""
        self.counts[member.level] -= 1
        self.counts[level] += 1
        member.level = level

    @property
    def sorted_members(self) -> list[GroupItem]:
        """Return the items by name."""
        if self._order is None:
            self._order = [self.members[name] for name in sorted(self.members)]
        return self._order

    # The level

    def rank(self, level: Level) -> int:
        """Return how bad a level is: STALE is less than ERROR, except in a classic tree."""
        return level if self.is_classic else (OK, WARN, STALE, ERROR).index(level)

    def combined(self) -> Level:
        """Return the level that follows from the items and groups alone."""
        counts = self.counts
        if counts[STALE] and self.is_classic:
            return ERROR if any(counts[:STALE]) else STALE
        level = ERROR if counts[ERROR] else STALE if counts[STALE] else WARN if counts[WARN] else OK
        if self.floor > level and any(not one.item.is_own for one in self.members.values()):
            return self.floor
        return level

    def _wrong_count(self, now: float) -> str:
        """Return how many items there are and should be; empty if that is right."""
        counted = self.analyzer.counted
        if counted is None:
            return ""
        found, (least, most) = sum(one.item.status is not None for one in self.members.values()), counted
        if (found < least and self._is_late(now)) or (most is not None and found > most):
            wanted = f"{least}" if least == most else f"at least {least}" if most is None else f"{least} to {most}"
            return f"{found or 'no'} {'item' if found == 1 else 'items'}, expected {wanted}"
        return ""

    def _is_late(self, now: float) -> bool:
        return bool(self.analyzer.timeout) and now - self._born > self.analyzer.timeout

    def _is_empty(self) -> bool:
        return not self.members and not any(self.counts)

    def present(self, now: float) -> Level:
        """Return the level at `now` without delay or latch."""
        if self.suppressor is not None and self.suppressor.is_failed:
            return OK
        may_be_empty = self.analyzer.counted is not None and self.analyzer.counted[0] == 0
        if self._is_empty() and not may_be_empty:
            if self.analyzer.kind != "generic":
                return OK
            return STALE if self._is_late(now) or (self.had_items and self.analyzer.discard_stale) else OK
        level = self.combined()
        return max(level, ERROR, key=self.rank) if self._wrong_count(now) else level

    def cause(self, now: float) -> str:
        """Return why the group is as it is at present, `OK` if nothing is wrong."""
        if self.suppressor is not None and self.suppressor.is_failed:
            return f"follows from {self.suppressor.path}, which is {self.suppressor.level.name}"
        if self._is_empty() and self.analyzer.kind == "generic":
            waits = self.analyzer.counted is None or self.analyzer.counted[0] > 0
            late = "nothing reported" if self._is_late(now) or self.had_items else "nothing reported yet"
            return self._wrong_count(now) or (late if waits else "OK")
        found = list(self._told())
        told = (one for one in found if one[0] is not OK)
        worst = max(told, key=lambda one: self.rank(one[0]), default=None)  # the first one if several are equal
        if (wrong := self._wrong_count(now)) and (worst is None or self.rank(worst[0]) < self.rank(ERROR)):
            return wrong
        if worst is None and self.floor > OK and self.combined() is self.floor:
            name = next(one.name for one in self.sorted_members if not one.item.is_own)
            return f"{name} belongs to no group"
        return "OK" if worst is None else f"{worst[1]}: {worst[2]}"

    def _told(self) -> Iterator[tuple[Level, str, str]]:
        yield from ((one.level, one.item.name, one.message()) for one in self.sorted_members)
        for child in self.children:
            if child.is_visible:
                yield child.level, child.name, child.message

    def update(self, now: float) -> bool:
        """Follow the present as far as `debounce` and `latch` let it; return whether the level has changed."""
        level, before = self.present(now), self.level
        self._now = level
        self.check_at = min(self.check_at, self._late_at(now))
        self.is_visible = self._shall_show(now)
        if self.rank(level) < self.rank(before) and self.analyzer.latch and self.latched_at <= now:
            level = before
        self._leaving = math.inf if level is before else min(self._leaving, now)
        hold = self.analyzer.holds[self.rank(level) < self.rank(before)]
        if level is not before and (self.is_urgent or now - self._leaving >= hold):
            self.level, self._leaving = level, math.inf
            if self.analyzer.latch and self.rank(level) > self.rank(before):
                self.latched_at, self._latched = min(self.latched_at, now), self.cause(now)
        elif level is not before:
            self.check_at = min(self.check_at, self._leaving + hold)
        self.is_urgent = False
        if self.level is not before:
            self.tell(now)
        return self.level is not before

    def tell(self, now: float) -> None:
        """Put what there is to tell at `now` into `message`."""
        present, cause = self.present(now), self.cause(now)
        is_better = self.rank(present) < self.rank(self.level)
        if present is self.level:
            self.message = cause
        elif is_better and self.latched_at <= now:
            self.message = f"{self._latched} (latched since {self.latched_at:.1f} s, {present.name} now)"
        else:
            self.message = f"{present.name} for less than {self.analyzer.holds[is_better]:g} s: {cause}"

    def _late_at(self, now: float) -> float:
        """Return the next time at which the group is late or disappears."""
        timeout = self.analyzer.timeout
        times = (self._born + timeout, self._empty_since + timeout) if timeout else ()
        return min((time for time in times if time >= now), default=math.inf)

    def _shall_show(self, now: float) -> bool:
        analyzer = self.analyzer
        if analyzer.kind == "other":
            return bool(self.members)
        is_over = bool(analyzer.timeout) and now - self._empty_since > analyzer.timeout
        return not (analyzer.discard_stale and not self.children and not self.members and is_over)

    def acknowledge(self) -> bool:
        """Forget that a level is latched; return whether one was."""
        was_latched, self.latched_at = self.latched_at < math.inf, math.inf
        return was_latched

    def take_over(self, old: Group) -> None:
        """Go on with the level of the group that was in this place."""
        self.level, self.latched_at, self._latched = old.level, old.latched_at, old._latched
        self._leaving = old._leaving
        self._born, self._empty_since, self.had_items = old._born, old._empty_since, old.had_items
        self.message = old.message
        if not self.analyzer.latch:
            self.latched_at = math.inf

    def shown(self) -> DiagnosticStatus:
        """Return the header, with what each item and group below it tells."""
        items = tuple(KeyValue(one.item.name, one.message()) for one in self.sorted_members)
        groups = tuple(
            KeyValue(one.analyzer.path or one.key[-1], one.message) for one in self.children if one.is_visible
        )
        return DiagnosticStatus(int(self.level), self.path, self.message, values=items + groups)

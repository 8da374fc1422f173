"""The aggregator: from the statuses of all parts to one tree with a level for each group."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from heapq import heappop, heappush

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.requests import NOT_YET, LatchedLevel, LevelChange
from rbxcompose.domains.diagnostics.settings import (
    OTHER,
    SHOWN,
    AnalyzerModel,
    DiagnosticsModel,
    component_of,
    fits,
    flat,
    matches,
    stripped,
)
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus, KeyValue

MOST_ITEMS = 10_000
LONGEST_NAME = 256  # characters
MOST_TEXT = 8_192  # characters of a status; ten thousand of these are 80 MB
OK, WARN, ERROR, STALE = Level
FAILED = (ERROR, STALE)
MOST_CHANGES = 1000
_LONGEST = 200  # characters of a cause
_FLOORS = {"warn": Level.WARN, "error": Level.ERROR}


class Admission:
    """Refuses what no tree can hold, and counts it; `news` says it once for each reason."""

    def __init__(self) -> None:
        self.refused = 0
        self._logged: set[str] = set()
        self._news: list[str] = []

    def takes(self, status: DiagnosticStatus, known: int) -> bool:
        """Return whether a status of a new name is taken beside `known` others."""
        reason = _reason(status.name, known)
        if reason:
            self.refused += 1
            if reason not in self._logged:
                self._logged.add(reason)
                self._news.append(reason)
        return not reason

    def fitted(self, status: DiagnosticStatus) -> DiagnosticStatus:
        """Return a status of bounded length: one that is too long loses its values and the end of its message."""
        values = status.values
        size = len(status.message) + len(status.hardware_id)
        for pair in values:
            size += len(pair.key) + len(pair.value)
        if size <= MOST_TEXT:
            return status
        note = KeyValue("left out", f"a status may have {MOST_TEXT:,} characters; this one had {size:,}")
        return replace(status, message=status.message[:1000], hardware_id=status.hardware_id[:1000], values=(note,))

    def news(self) -> list[str]:
        """Return the reasons for which something was refused for the first time since the last call."""
        news, self._news = self._news, []
        return news


def _reason(name: str, known: int) -> str:
    if not name.strip("/ "):
        return "statuses without a name are left out"
    if len(name) > LONGEST_NAME:
        return f"statuses whose name has more than {LONGEST_NAME} characters are left out"
    return f"there are {MOST_ITEMS:,} statuses: further names are left out" if known >= MOST_ITEMS else ""


class Item:
    """The latest status under a name; `status` is None until one has been received."""

    __slots__ = ("cause", "is_own", "is_plain", "level", "members", "name", "received_at", "status")

    def __init__(self, name: str, received_at: float, *, is_own: bool) -> None:
        self.name, self.received_at, self.is_own = name, received_at, is_own
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
        self.name = stripped(flat(item.name), group.analyzer.prefixes)
        self.path = f"{group.path}/{self.name}"
        self.level = OK

    def level_at(self, now: float) -> Level:
        """Return the level of the item in the tree at `now` [s]."""
        item, timeout = self.item, self.group.analyzer.timeout
        if item.cause or (timeout and now - item.received_at > timeout):
            return STALE
        return Level(item.level) if OK <= item.level <= STALE else ERROR

    def message(self) -> str:
        """Return what the item reports, or why it is STALE."""
        item, status = self.item, self.item.status
        if item.cause:
            return item.cause
        if self.level is not STALE or item.level == STALE:
            if status is None:
                return NOT_YET
            return status.message if OK <= item.level <= STALE else f"level {item.level} is unknown: {status.message}"
        last = f", last: {status.message}" if status and status.message else ""
        return f"silent since {item.received_at:.1f} s{last}" if status else "never reported"

    def shown(self) -> DiagnosticStatus:
        """Return the item as it is in the tree."""
        status = self.item.status
        if status is None:
            return DiagnosticStatus(int(self.level), self.path, self.message())
        is_reported = self.level == status.level and not self.item.cause
        message = status.message if is_reported else self.message()
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
        self.message = "OK"  # of the header, as of the last `update_message`
        self.is_visible = True
        self.counted: Level | None = None  # as what its parent counts it
        self.is_classic = False
        self.floor = OK  # the least level with items that are not the robot's own
        self._now = OK  # the level of the last update without delay or latch
        self._since = math.inf  # when the level rose first since it was OK, or since it was acknowledged
        self._reached = ""  # the message when the level was reached
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

    @property
    def is_latched(self) -> bool:
        """Return whether the level can only rise until it is acknowledged."""
        return self.analyzer.latch and self._since < math.inf

    def add(self, item: Item) -> GroupItem:
        """Add an item; its level counts from the next `move`."""
        member = GroupItem(item, self)
        self.members[item.name] = member
        item.members.append(member)
        self.counts[OK] += 1
        self.had_items = True
        self._order = None
        self.check_at = min(self.check_at, item.received_at + (self.analyzer.timeout or math.inf))
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
        if self.floor > level and any(not member.item.is_own for member in self.members.values()):
            return self.floor
        return level

    def _wrong_count(self, now: float) -> str:
        """Return how many items there are and should be; empty if that is right."""
        counted = self.analyzer.counted
        if counted is None:
            return ""
        found, (least, most) = sum(member.item.status is not None for member in self.members.values()), counted
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
        found = list(self._reports())
        bad = (row for row in found if row[0] is not OK)
        worst = max(bad, key=lambda row: self.rank(row[0]), default=None)  # the first one if several are equal
        if (wrong := self._wrong_count(now)) and (worst is None or self.rank(worst[0]) < self.rank(ERROR)):
            return wrong
        if worst is None and self.floor > OK and self.combined() is self.floor:
            name = next(member.name for member in self.sorted_members if not member.item.is_own)
            return f"{name} belongs to no group"
        return "OK" if worst is None else f"{worst[1]}: {worst[2]}"

    def _reports(self) -> Iterator[tuple[Level, str, str]]:
        yield from ((member.level, member.item.name, member.message()) for member in self.sorted_members)
        for child in self.children:
            if child.is_visible:
                yield child.level, child.name, child.message

    def update(self, now: float) -> bool:
        """Follow the present as far as `debounce` and `latch` let it; return whether the level has changed."""
        level, before = self.present(now), self.level
        self._now = level
        self.check_at = min(self.check_at, self._late_at(now))
        self.is_visible = self._shall_show(now)
        if self.rank(level) < self.rank(before) and self.is_latched:
            level = before
        self._leaving = math.inf if level is before else min(self._leaving, now)
        hold = self.analyzer.holds[self.rank(level) < self.rank(before)]
        if level is not before and (self.is_urgent or now - self._leaving >= hold):
            self.level, self._leaving = level, math.inf
            if self.rank(level) > self.rank(before):
                self._since = min(self._since, now)
            elif level is OK:
                self._since = math.inf
        elif level is not before:
            self.check_at = min(self.check_at, self._leaving + hold)
        self.is_urgent = False
        if self.level is not before:
            self.update_message(now)
            self._reached = self.message
        return self.level is not before

    def update_message(self, now: float) -> None:
        """Put what there is to report at `now` into `message`."""
        present, cause = self.present(now), self.cause(now)
        is_better = self.rank(present) < self.rank(self.level)
        if present is self.level:
            self.message = cause
        elif is_better and self.is_latched:
            self.message = f"{self._reached} (latched since {self._since:.1f} s, {present.name} now)"
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
        was_latched = self.is_latched
        if was_latched:
            self._since = math.inf
        return was_latched

    @property
    def latched(self) -> LatchedLevel:
        """Return what is latched, for `recall`."""
        return LatchedLevel(self.key, self.level, self._since, self._reached)

    def recall(self, latched: LatchedLevel) -> None:
        """Go on with what was latched before a restart; a level that is worse by now stays."""
        if self.analyzer.latch:
            if self.rank(latched.level) >= self.rank(self.level):
                self.level, self._reached = latched.level, latched.message
            self._since = min(self._since, latched.since)

    def take_over(self, old: Group) -> None:
        """Go on with the level of the group that was in this place."""
        self.level, self._since, self._reached = old.level, old._since, old._reached
        self._leaving = old._leaving
        self._born, self._empty_since, self.had_items = old._born, old._empty_since, old.had_items
        self.message = old.message

    def shown(self) -> DiagnosticStatus:
        """Return the header, with what each item and group below it reports."""
        items = tuple(KeyValue(member.item.name, member.message()) for member in self.sorted_members)
        groups = tuple(
            KeyValue(child.analyzer.path or child.key[-1], child.message) for child in self.children if child.is_visible
        )
        return DiagnosticStatus(int(self.level), self.path, self.message, values=items + groups)


@dataclass(frozen=True, slots=True)
class TreeRow:
    """A header or an item of the tree; `status.name` is its path, `depth` the number of headers above it."""

    name: str
    depth: int
    is_group: bool
    status: DiagnosticStatus


class LevelHistory:
    """The last changes of levels, at most `MOST_CHANGES`; all are counted."""

    def __init__(self) -> None:
        self._changes: deque[LevelChange] = deque(maxlen=MOST_CHANGES)
        self.count = 0

    def add(self, time: float, path: str, old: Level, new: Level, cause: str) -> None:
        """Add a change at robot time `time` [s]."""
        self.count += 1
        self._changes.append(LevelChange(self.count, time, path, old, new, cause[:_LONGEST]))

    def after(self, number: int) -> Iterable[LevelChange]:
        """Return the changes with greater numbers that are still known, oldest first; all if there never was one."""
        known = min(self.count - (number if number <= self.count else 0), len(self._changes))
        return list(self._changes)[len(self._changes) - known :] if known > 0 else []


class GroupLayout:
    """All groups of a tree: `groups` has each after those that it depends on.

    `matching` are the groups with items of their own, `silent` the analyzers whose statuses are shown nowhere, `other`
    is where the rest goes. Raises ValueError if groups suppress each other.
    """

    def __init__(self, settings: DiagnosticsModel, born: float) -> None:
        self._settings, self._born = settings, born
        base = f"/{settings.base.strip('/')}" if settings.base else ""
        self.root = Group((), AnalyzerModel(type="group", path=settings.base), None, base, born)
        self.silent: list[AnalyzerModel] = []
        found: list[Group] = []
        self._add(self.root, settings.analyzers, found)
        others = [one for one in found if one.analyzer.kind == "other"]
        self.other = others[0] if others else self._own_other(base)
        self.other.floor = _FLOORS.get(settings.other, Level.OK)
        self.groups: list[Group] = []
        for group in found:
            group.suppressor = _named(group, group.analyzer.suppressed_by)
        for group in (self.root, *([] if others else [self.other])):
            self._order(group, ())
        for index, group in enumerate(self.groups):
            group.index, group.is_classic = index, settings.is_classic
            if group.suppressor is not None:
                group.suppressor.dependents.append(group)
        self.matching = [one for one in found if one.analyzer.kind == "generic"]

    def tops(self) -> list[Group]:
        """Return the groups from which all that is shown hangs."""
        is_apart = self.other.parent is None and self._settings.other != "hide"
        return [self.root, self.other] if is_apart else [self.root]

    def level(self) -> tuple[Level, str]:
        """Return the level of all that is shown, and the first group that has it, with its message."""
        counted = [*self.root.children, *self.tops()[1:]]
        shown = [child for child in counted if child.is_visible]
        levels = {child.level for child in shown}
        level = max(levels, key=self.root.rank, default=Level.OK)
        if self._settings.is_classic and Level.STALE in levels and len(levels) > 1:
            level = Level.ERROR
        worst = max(shown, key=lambda child: child.rank(child.level), default=None)
        return level, "" if worst is None or level is Level.OK else f"{worst.path or '/'}: {worst.message}"

    def _own_other(self, base: str) -> Group:
        analyzer = AnalyzerModel(type="other", discard_stale=True)
        return Group((OTHER,), analyzer, None, f"{base}/{OTHER}", self._born)

    def _add(self, parent: Group, analyzers: Mapping[str, AnalyzerModel], found: list[Group]) -> None:
        for name in sorted(analyzers):  # as plans come from other processes
            model = analyzers[name]
            if model.kind not in SHOWN:
                self.silent.append(model)
                continue
            step = name if model.path is None else model.path
            path = f"{parent.path}/{step}" if step else parent.path
            group = Group((*parent.key, name), model, parent, path, self._born)
            parent.children.append(group)
            found.append(group)
            self._add(group, model.analyzers, found)

    def _order(self, group: Group, above: tuple[Group, ...]) -> None:
        if group in self.groups:
            return
        if group in above:
            raise ValueError(f"the level of {group.path} would depend on itself")
        for child in (*group.children, *([group.suppressor] if group.suppressor else ())):
            self._order(child, (*above, group))
        self.groups.append(group)


def _named(group: Group, name: str | None) -> Group | None:
    """Return the group that another one means by a name: one beside it, else beside what is above it."""
    parent = group.parent
    while name and parent is not None:
        found = next((child for child in parent.children if child.key[-1] == name), None)
        if found is not None:
            return found
        parent = parent.parent
    return None


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
            item.status, item.received_at = self.admission.fitted(status), now
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

    def latched(self) -> tuple[LatchedLevel, ...]:
        """Return all that is latched."""
        return tuple(group.latched for group in self._layout.groups if group.is_latched)

    def recall(self, now: float, latched: Iterable[LatchedLevel]) -> None:
        """Go on with what was latched before a restart, in the groups that are still there."""
        known = {row.key: row for row in latched}
        for group in self._layout.groups:
            if group.key in known:
                group.recall(known[group.key])
                self._touch(group)
        self._settle(now)

    def level(self) -> tuple[Level, str]:
        """Return the level of the whole robot, and the group that gives it with its cause."""
        return self._layout.level()

    def paths(self) -> list[str]:
        """Return the paths of all groups."""
        return [group.path for group in self._layout.groups if group.has_header]

    def report(self, now: float) -> tuple[TreeRow, ...]:
        """Return the tree: the header of each group, followed by its items by name and the groups below it."""
        for group in self._layout.groups:
            group.update_message(now)
        return tuple(row for top in self._layout.tops() for row in _rows(top, 0))

    def take_over(self, old: Aggregator, now: float) -> None:
        """Go on with what another aggregator knew: its items, and the levels of groups that are the same."""
        self.admission = old.admission
        for name, before in old._items.items():
            if before.status is None and not before.cause:
                continue
            item = self._items.get(name) or self._entered(name, before.received_at)
            item.status, item.received_at, item.level, item.cause = (
                before.status,
                before.received_at,
                before.level,
                before.cause,
            )
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
            for member in list(self._items[component].members):
                self._leave(member, now)
        return self._place(Item(name, now, is_own=self._is_own(name)))

    def _place(self, item: Item) -> Item:
        """Put an item into all groups that match it, else into `Other`; one that is ignored into none."""
        self._items[item.name], name = item, item.name
        wanted: list[Group] = []
        if not any(fits(condition, name) for condition in self._settings.ignore):
            wanted = [group for group in self._layout.matching if matches(group.analyzer, name)]
            silent = any(matches(model, name) for model in self._layout.silent)
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
                member.group.check_at = min(member.group.check_at, item.received_at + timeout)
                self._check_at = min(self._check_at, member.group.check_at)
            if member.group.is_urgent:
                self._touch(member.group)

    def _move(self, member: GroupItem, level: Level, now: float) -> None:
        old = member.level
        member.group.move(member, level)
        self.history.add(now, member.path, old, level, member.message())
        self._touch(member.group)

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
            if now - item.received_at <= timeout:
                group.check_at = min(group.check_at, item.received_at + timeout)
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
            for dependent in group.dependents if group.is_failed is not had_failed else ():
                self._touch(dependent)
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

"""The aggregator of ROS 1, rule by rule: what `diagnostic_aggregator` 1.11 does, its mistakes included.

The rules were read in its sources (github.com/ros/diagnostics, branch noetic-devel: status_item, generic_analyzer,
generic_analyzer_base, analyzer_group, other_analyzer, aggregator). It reports at its rate only. Ours is that a lost
component is STALE with the cause, that statuses without a name are left out, and the bound on their number.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level, level_of
from rbxcompose.domains.diagnostics.core import Admission, LevelHistory, TreeRow
from rbxcompose.domains.diagnostics.requests import LatchedLevel
from rbxcompose.domains.diagnostics.settings import (
    DEFAULT_TIMEOUT,
    OTHER,
    AnalyzerModel,
    DiagnosticsModel,
    component_of,
    fits,
)
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus, KeyValue

OK, WARN, ERROR, STALE = Level
_WORDS = ("OK", "Warning", "Error", "Stale")
_SOME_STALE = "Some diagnostics are stale - setting combined level to ERROR."
_ALL_STALE = "All diagnostics are stale - setting combined level to STALE."
_FOREIGN = 'Unanalyzed items found in "Other"'


@dataclass(frozen=True, slots=True)
class HeardItem:
    """The latest status of a name, with a known level; `received_at` is robot time [s]."""

    status: DiagnosticStatus
    received_at: float

    def shown(self, path: str, *, is_stale: bool) -> TreeRow:
        """Return it as an item below `path`."""
        name = self.status.name.replace("/", " ")
        level = STALE if is_stale else self.status.level
        shown = replace(self.status, name=f"{'' if path == '/' else path}/{name}", level=int(level))
        return TreeRow(name, _depth(path), is_group=False, status=shown)


def _missing(name: str, now: float, message: str = "Missing") -> HeardItem:
    return HeardItem(DiagnosticStatus(int(STALE), name, message), now)


def _combined(levels: Sequence[int], *, empty: Level, is_classic: bool) -> Level:
    """Return the worst level; some STALE ones are an ERROR, or with the policy `stale` no more than STALE."""
    if not levels:
        return empty
    if is_classic:
        return ERROR if STALE in levels and min(levels) < STALE else Level(max(levels))
    return ERROR if ERROR in levels else Level(max(levels))


def _depth(path: str) -> int:
    return 0 if path in ("", "/") else path.count("/")


def without_prefix(path: str, prefix: str) -> str:
    """Return a path whose last step has lost a prefix, then a colon, then spaces.

    The prefix stays if it also occurs further in front, and colon and spaces go in any case: so it was.
    """
    above, slash, name = path.rpartition("/")
    if path.find(prefix) == len(above + slash):
        name = name.removeprefix(prefix)
    return f"{above}{slash}{name.removeprefix(':').lstrip(' ')}"


class Generic:
    """GenericAnalyzer: the items that match, below a header."""

    def __init__(self, analyzer: AnalyzerModel, path: str, name: str, now: float, *, is_classic: bool) -> None:
        self.analyzer, self.path, self.name, self._is_classic = analyzer, path, name, is_classic
        self.items = {expected: _missing(expected, now) for expected in analyzer.expected}
        self._discards = analyzer.discard_stale and analyzer.timeout > 0
        self._prefixes = [prefix.replace("/", " ") for prefix in analyzer.prefixes]
        self._reported, self._reported_at = OK, now  # the level of the header, and since when it has it

    @property
    def is_sound(self) -> bool:
        """Return whether anything can match."""
        return bool(self.analyzer.match or self.analyzer.expected or self.analyzer.strip_prefix)

    def match(self, name: str) -> bool:
        """Return whether an item belongs here."""
        model = self.analyzer
        return (
            any(fits(each, name) for each in model.conditions)
            or name in model.expected
            or name.startswith(model.strip_prefix)
        )

    def take(self, item: HeardItem) -> None:
        """Keep an item."""
        self.items[item.status.name] = item

    def report(self, now: float) -> list[TreeRow]:
        """Return the header and the items by name."""
        rows = self._base(now)
        missing = [name for name in self.analyzer.expected if not self._has(rows, name)]
        are_stale = all(row.status.level == STALE for row in rows)
        rows += [_missing(name, now).shown(self.path, is_stale=True) for name in missing]
        for prefix in self._prefixes:
            rows = [_renamed(row, without_prefix(row.status.name, prefix)) for row in rows]
        return [self._lacking(row, missing, are_stale) if missing else row for row in rows]

    def _has(self, rows: Sequence[TreeRow], name: str) -> bool:
        wanted = {name, name.replace("/", " "), *(without_prefix(name, prefix) for prefix in self._prefixes)}
        return any(row.status.name.rpartition("/")[2] in wanted for row in rows)

    def _lacking(self, row: TreeRow, missing: Sequence[str], are_stale: bool) -> TreeRow:
        if row.status.name != self.path:
            return row
        level, words = (STALE, _ALL_STALE) if are_stale else (ERROR, _SOME_STALE)
        values = (*row.status.values, *(KeyValue(name, "Missing") for name in missing))
        return replace(row, status=replace(row.status, level=int(level), message=words, values=values))

    def _base(self, now: float) -> list[TreeRow]:
        timeout, rows, levels, values = self.analyzer.timeout, list[TreeRow](), list[int](), list[KeyValue]()
        for name in sorted(self.items):
            item = self.items[name]
            is_stale = timeout > 0 and now - item.received_at > timeout
            if is_stale and self._discards:
                del self.items[name]
                continue
            rows.append(item.shown(self.path, is_stale=is_stale))
            levels.append(rows[-1].status.level)
            values.append(KeyValue(name, item.status.message))
        level = _combined(levels, empty=STALE, is_classic=self._is_classic)
        level, message = self._counted(level)
        was_stale = timeout > 0 and self._reported is STALE and now - self._reported_at > timeout
        if level is not self._reported:
            self._reported, self._reported_at = level, now
        if self._discards and not rows and was_stale:
            return []
        header = DiagnosticStatus(int(level), self.path, message, values=tuple(values))
        return [TreeRow(self.name, _depth(self.path) - 1, is_group=True, status=header), *rows]

    def _counted(self, level: Level) -> tuple[Level, str]:
        found, counted = len(self.items), self.analyzer.counted
        if counted is None or (counted == (0, 0) and found):
            return level, _WORDS[level]  # that none was expected is not noticed
        least, most = counted
        if not found and not least:
            return OK, "OK"
        if found >= least and (most is None or found <= most):
            return level, _WORDS[level]
        wanted = str(least) if least == most else f"{least} to {'any' if most is None else most}"
        words = f"Expected {wanted}, found {found}" if found else f"No items found, expected {wanted}"
        return max(ERROR, level), words


class Other(Generic):
    """OtherAnalyzer: what nothing matches; it forgets what is silent for 5 s."""

    def __init__(self, base: str, now: float, *, as_errors: bool, is_classic: bool) -> None:
        analyzer = AnalyzerModel(timeout=DEFAULT_TIMEOUT, discard_stale=True)
        super().__init__(analyzer, f"{base}/{OTHER}", OTHER, now, is_classic=is_classic)
        self._as_errors = as_errors

    def report(self, now: float) -> list[TreeRow]:
        """Return nothing without items."""
        rows = self._base(now)
        if len(rows) > 1 and self._as_errors:
            rows[0] = replace(rows[0], status=replace(rows[0].status, level=int(ERROR), message=_FOREIGN))
        return rows if len(rows) > 1 else []


class Discard(Generic):
    """DiscardAnalyzer: matches, and shows nothing."""

    def report(self, now: float) -> list[TreeRow]:
        """Return nothing."""
        return []


class Ignore(Generic):
    """IgnoreAnalyzer: matches nothing, so that `Other` gets its items."""

    is_sound = True

    def match(self, name: str) -> bool:
        """Return that nothing belongs here."""
        return False

    def report(self, now: float) -> list[TreeRow]:
        """Return nothing."""
        return []


_KINDS = {"generic": Generic, "discard": Discard, "ignore": Ignore}


class AnalyzerGroup:
    """AnalyzerGroup: analyzers by name, and a header above them if it has a path."""

    def __init__(
        self, base: str, name: str, analyzers: Mapping[str, AnalyzerModel], now: float, *, is_classic: bool
    ) -> None:
        self._is_classic = is_classic
        self.name, self.path = name, f"/{'/'.join(step for step in (base.strip('/'), name) if step)}"
        self.analyzers: list[Generic | AnalyzerGroup] = []
        self._broken: list[HeardItem] = []
        for key in sorted(analyzers):
            made = self._made(key, analyzers[key], now)
            if made.is_sound:
                self.analyzers.append(made)
            else:
                self._broken.append(_missing(key, now, "Analyzer init failed"))

    @property
    def is_sound(self) -> bool:
        """Return whether it has analyzers, and no broken ones: the group above leaves out any other."""
        return bool(self.analyzers) and not self._broken

    def _made(self, key: str, model: AnalyzerModel, now: float) -> Generic | AnalyzerGroup:
        name = key if model.path is None else model.path
        if model.kind == "group":
            return AnalyzerGroup(self.path, name, model.analyzers, now, is_classic=self._is_classic)
        path = f"/{'/'.join(step for step in (self.path.strip('/'), name) if step)}"
        return _KINDS.get(model.kind, Ignore)(model, path, name, now, is_classic=self._is_classic)

    def match(self, name: str) -> bool:
        """Return whether an item belongs to one of the analyzers."""
        return any(analyzer.match(name) for analyzer in self.analyzers)

    def take(self, item: HeardItem) -> None:
        """Give an item to each analyzer that it belongs to."""
        for analyzer in self.analyzers:
            if analyzer.match(item.status.name):
                analyzer.take(item)

    def report(self, now: float) -> list[TreeRow]:
        """Return what the analyzers report, followed by the header, followed by the analyzers that are broken."""
        if not self.analyzers:
            status = DiagnosticStatus(int(ERROR), "/AnalyzerGroup" if self.path == "/" else self.path, "No analyzers")
            return [TreeRow(self.name or "AnalyzerGroup", _depth(self.path), is_group=True, status=status)]
        rows, levels, values = list[TreeRow](), list[int](), list[KeyValue]()
        for analyzer in self.analyzers:
            reported = analyzer.report(now)
            rows += reported
            for header in (row.status for row in reported if row.status.name == analyzer.path):
                levels.append(header.level)
                values.append(KeyValue(analyzer.name, header.message))
        level = _combined(levels, empty=OK, is_classic=self._is_classic)
        if self.path != "/":
            status = DiagnosticStatus(int(level), self.path, _WORDS[level], values=tuple(values))
            rows.append(TreeRow(self.name, _depth(self.path) - 1, is_group=True, status=status))
        return rows + [item.shown(self.path, is_stale=True) for item in self._broken]


class Ros1Aggregator:
    """The aggregator itself; it has the methods of `Aggregator`."""

    def __init__(self, settings: DiagnosticsModel, expected: Sequence[str] = (), *, started: float = 0.0) -> None:
        self._settings = settings
        base = f"/{settings.base.strip('/')}" if settings.base else ""
        classic = settings.is_classic
        self._root = AnalyzerGroup("", settings.base, settings.analyzers, started, is_classic=classic)
        self._other = Other(base, started, as_errors=settings.other == "error", is_classic=classic)
        self.items: dict[str, HeardItem] = {}
        self._places: dict[str, tuple[Generic | AnalyzerGroup, ...]] = {}
        self._levels: dict[str, Level] = {}
        self._level, self._cause = OK, ""
        self.history, self.admission, self.has_news = LevelHistory(), Admission(), False

    def feed(self, now: float, statuses: Iterable[DiagnosticStatus]) -> None:
        """Receive statuses that arrived at `now`."""
        for status in statuses:
            if status.name in self._places or self.admission.takes(status, len(self._places)):
                fitted = self.admission.fitted(status)
                level = level_of(status.level)
                self._take(HeardItem(fitted if level == fitted.level else replace(fitted, level=int(level)), now))

    def _take(self, item: HeardItem) -> None:
        name = item.status.name
        if name not in self._places:
            is_ignored = any(fits(condition, name) for condition in self._settings.ignore)
            self._places[name] = () if is_ignored else (self._root if self._root.match(name) else self._other,)
        self.items[name] = item
        for place in self._places[name]:
            place.take(item)

    def lost(self, now: float, names: Iterable[str], cause: str) -> None:
        """Mark components as STALE with the cause."""
        for name in names:
            known = [other for other in self.items if name in (other, component_of(other))]
            for text in known or [name]:
                self._take(_missing(text, now, cause))

    def advance(self, now: float) -> None:
        """Do nothing: time counts when it reports."""

    def acknowledge(self, now: float, path: str = "") -> list[str]:
        """Return nothing: no level is latched."""
        return []

    def latched(self) -> tuple[LatchedLevel, ...]:
        """Return nothing: see `acknowledge`."""
        return ()

    def recall(self, now: float, latched: Iterable[LatchedLevel]) -> None:
        """Do nothing: see `acknowledge`."""

    def level(self) -> tuple[Level, str]:
        """Return the level of the last report, and its cause."""
        return self._level, self._cause

    def paths(self) -> list[str]:
        """Return nothing: see `acknowledge`."""
        return []

    def report(self, now: float) -> tuple[TreeRow, ...]:
        """Return the tree: the header of an analyzer before its items, that of a group behind all that is in it."""
        rows = [*self._root.report(now), *(self._other.report(now) if self._settings.other != "hide" else ())]
        levels = [row.status.level for row in rows]
        self._level = _combined(levels, empty=OK, is_classic=self._settings.is_classic)
        worst = max(rows, key=lambda row: row.status.level, default=None)
        self._cause = f"{worst.status.name}: {worst.status.message}" if worst and self._level is not OK else ""
        self._remember(rows, now)
        return tuple(rows)

    def _remember(self, rows: Iterable[TreeRow], now: float) -> None:
        levels = {row.status.name: (Level(row.status.level), row.status.message) for row in rows}
        for path, (level, message) in levels.items():
            if (old := self._levels.get(path, OK)) is not level:
                self.history.add(now, path, old, level, message)
        self._levels = {path: level for path, (level, _) in levels.items()}

    def take_over(self, old: Ros1Aggregator, now: float) -> None:
        """Go on with the items that another aggregator knew."""
        self.history, self.admission, self._levels = old.history, old.admission, old._levels
        for item in old.items.values():
            self._take(item)


def _renamed(row: TreeRow, path: str) -> TreeRow:
    return replace(row, name=path.rpartition("/")[2], status=replace(row.status, name=path))

"""The groups of a tree in the order in which their levels follow from each other."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.diagnostics.group import Group
from rbxcompose.diagnostics.settings import OTHER, SHOWN, AnalyzerModel, DiagnosticsModel
from rbxcompose.levels import Level

_FLOORS = {"warn": Level.WARN, "error": Level.ERROR}


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
        shown = [one for one in counted if one.is_visible]
        levels = {one.level for one in shown}
        level = max(levels, key=self.root.rank, default=Level.OK)
        if self._settings.is_classic and Level.STALE in levels and len(levels) > 1:
            level = Level.ERROR
        worst = max(shown, key=lambda one: one.rank(one.level), default=None)
        return level, "" if worst is None or level is Level.OK else f"{worst.path or '/'}: {worst.message}"

    def _own_other(self, base: str) -> Group:
        analyzer = AnalyzerModel(type="other", discard_stale=True)
        return Group((OTHER,), analyzer, None, f"{base}/{OTHER}", self._born)

    def _add(self, parent: Group, analyzers: Mapping[str, AnalyzerModel], found: list[Group]) -> None:
        for name in sorted(analyzers):  # as plans come from other processes
            one = analyzers[name]
            if one.kind not in SHOWN:
                self.silent.append(one)
                continue
            step = name if one.path is None else one.path
            path = f"{parent.path}/{step}" if step else parent.path
            group = Group((*parent.key, name), one, parent, path, self._born)
            parent.children.append(group)
            found.append(group)
            self._add(group, one.analyzers, found)

    def _order(self, group: Group, above: tuple[Group, ...]) -> None:
        if group in self.groups:
            return
        if group in above:
            raise ValueError(f"the level of {group.path} would depend on itself")
        for one in (*group.children, *([group.suppressor] if group.suppressor else ())):
            self._order(one, (*above, group))
        self.groups.append(group)


def _named(group: Group, name: str | None) -> Group | None:
    """Return the group that another one means by a name: one beside it, else beside what is above it."""
    parent = group.parent
    while name and parent is not None:
        found = next((one for one in parent.children if one.key[-1] == name), None)
        if found is not None:
            return found
        parent = parent.parent
    return None

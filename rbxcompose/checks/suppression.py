"""A group that follows from one that does not exist, or from itself."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import SHOWN, AnalyzerModel
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.references import ANALYZER

GroupPath = tuple[str, ...]


@check("RBX5013", is_fixable=True, closed=(ANALYZER,))
def suppression(robot: Robot) -> Iterator[Finding]:
    """A group is silenced by one that does not exist, or by itself."""
    groups = dict(_groups(robot.manifest.diagnostics.analyzers, ()))
    for path, one in groups.items():
        name = one.suppressed_by
        if name is None:
            continue
        place = robot.value("diagnostics", "analyzers", *_keys(path), "suppressed_by")
        meant = _meant(groups, path, name)
        if meant is None:
            known = {one[-1] for one in groups if one[:-1] == path[: len(one) - 1] and one != path[: len(one)]}
            message = f"there is no group '{name}' beside '{path[-1]}' or above it"
            yield suppression.misspelt(place, message, name, known, "groups there")
        elif circle := _circle(groups, path, meant):
            names = " -> ".join(f"'{one[-1]}'" for one in (path, *circle))
            yield suppression.at(place, f"the level of '{path[-1]}' would depend on itself: {names}", help="omit it")


def _groups(analyzers: Mapping[str, AnalyzerModel], above: GroupPath) -> Iterator[tuple[GroupPath, AnalyzerModel]]:
    for name, one in analyzers.items():
        if one.kind in SHOWN:
            yield (*above, name), one
            yield from _groups(one.analyzers, (*above, name))


def _keys(path: GroupPath) -> list[str]:
    return [key for name in path[:-1] for key in (name, "analyzers")] + [path[-1]]


def _meant(groups: Mapping[GroupPath, AnalyzerModel], path: GroupPath, name: str) -> GroupPath | None:
    """Return the group that a name means for another one: the nearest one beside it or beside what is above it."""
    places = ((*path[:length], name) for length in range(len(path) - 1, -1, -1))
    return next((one for one in places if one in groups), None)


def _circle(groups: Mapping[GroupPath, AnalyzerModel], start: GroupPath, first: GroupPath) -> list[GroupPath]:
    """Return the way on which the level of `first` depends on that of `start`; empty if it does not."""
    way: dict[GroupPath, GroupPath | None] = {first: None}
    waiting = [first]
    while waiting:
        path = waiting.pop()
        if path == start:
            found: list[GroupPath] = []
            last: GroupPath | None = path
            while last is not None:
                found.insert(0, last)
                last = way[last]
            return found
        below = [one for one in groups if one[:-1] == path]
        by = groups[path].suppressed_by
        meant = _meant(groups, path, by) if by is not None else None
        for one in (*below, *([meant] if meant is not None else [])):
            if one not in way:
                way[one] = path
                waiting.append(one)
    return []

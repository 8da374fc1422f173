"""Which statuses belong to an analyzer, and what they are called in the tree.

Statuses are named `component` or `component: detail`; a pattern that matches the component matches its details too.
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from rbxcompose.diagnostics.name_regex import fits_regex
from rbxcompose.diagnostics.settings import AnalyzerModel, Condition

_GLOB = frozenset("*?[")


def component_of(name: str) -> str:
    """Return the component in the name of a status."""
    return name.partition(": ")[0]


def is_glob(pattern: str) -> bool:
    """Return whether a pattern can match other names than itself."""
    return not _GLOB.isdisjoint(pattern)


def fits(condition: Condition, name: str) -> bool:
    """Return whether a pattern or matcher means the status called `name`."""
    if isinstance(condition, str):
        return _is_like(condition, name)
    tests = (
        condition.name is None or name == condition.name,
        condition.startswith is None or name.startswith(condition.startswith),
        condition.contains is None or condition.contains in name,
        condition.any is None or any(fits(one, name) for one in condition.any),
        all(fits(one, name) for one in condition.all or ()),
        condition.unless is None or not fits(condition.unless, name),
    )
    return all(tests) and (condition.regex is None or fits_regex(condition.regex, name))


def matches(analyzer: AnalyzerModel, name: str) -> bool:
    """Return whether the status called `name` belongs to the group of an analyzer itself, not to one below it."""
    return (
        any(fits(one, name) for one in analyzer.conditions)
        or any(_is_like(one, name) for one in analyzer.expected)
        or name.startswith(analyzer.strip_prefix)
    )


def flat(name: str) -> str:
    """Return a name as one step of a path: a slash would add a level."""
    return name.strip("/").replace("/", " ")


def stripped(name: str, prefixes: Sequence[str]) -> str:
    """Return a name of the tree without the longest prefix that it begins with, and what then stands in front of it."""
    for prefix in sorted(map(flat, prefixes), key=len, reverse=True):
        if prefix and name.startswith(prefix):
            return name[len(prefix) :].removeprefix(":").lstrip(" ") or name
    return name


def _is_like(pattern: str, name: str) -> bool:
    # Equality first: a name may contain brackets, which have a meaning in globs.
    component = component_of(name)
    if pattern in (name, component):
        return True
    return is_glob(pattern) and (fnmatchcase(name, pattern) or fnmatchcase(component, pattern))

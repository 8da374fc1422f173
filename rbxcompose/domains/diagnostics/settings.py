"""How statuses are sorted into groups: the settings of the aggregator, as the section `diagnostics` gives them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import ANALYZER, RUNNING, Config, Frequency, Name, Refers, Time

LONGEST = 300  # characters of an expression
MOST_REPEATS = 3
_COUNTED = re.compile(r"\{\d*+(?:,\d*+)?+\}")
_CLASS = re.compile(r"\[\^?+\]?+(?:\\.|[^\]\\])*+\]")
DEFAULT_TIMEOUT = 5.0  # [s]
OTHER = "Other"  # the group of statuses that no analyzer matches
SHOWN = ("generic", "group", "other")  # types of analyzers that have a header in the tree
_GLOB = re.compile(r"\*+([\w /-]+)\**")  # of a shell: `*camera*`
_CONDITIONS_GLOB = frozenset("*?[")


def fits_regex(text: str, name: str) -> bool:
    """Return whether an expression without trouble fits a whole name."""
    return re.compile(text).fullmatch(name) is not None  # `re` remembers what it has compiled


def trouble_of(text: str) -> str:
    """Return why an expression is not taken; empty if it is."""
    if len(text) > LONGEST:
        return f"it has more than {LONGEST} characters"
    try:
        re.compile(text)
    except (re.error, RecursionError, OverflowError) as error:
        return str(error)
    return _slow(text)


def _slow(text: str) -> str:
    """Return what could take long in a sound expression."""
    has_choice = [False]  # of each open group: whether it holds a repeat or a choice
    is_repeatable, repeats, place = True, 0, 0
    while place < len(text):
        size, last_group = 1, False
        match text[place]:
            case "\\":
                if text[place + 1].isdigit():
                    return "it refers back to a group"
                size = 2
            case "[":
                found = _CLASS.match(text, place)
                size = len(found.group()) if found else 1
            case "(":
                if text.startswith("(?", place) and not text.startswith("(?:", place):
                    return "of groups with '(?', only '(?:...)' is taken"
                has_choice.append(False)
                size = 3 if text.startswith("(?:", place) else 1
            case ")":
                last_group = has_choice.pop()
                has_choice[-1] = has_choice[-1] or last_group
            case "|":
                has_choice[-1] = True
            case "*" | "+" | "{":
                counted = _COUNTED.match(text, place)
                if text[place] != "{" or counted:
                    if not is_repeatable:
                        return "it repeats a group that holds a repeat or a choice itself, which could take for ever"
                    repeats += 1
                    has_choice[-1] = True
                    size = len(counted.group()) if counted else 1
        is_repeatable, place = not last_group, place + size
    return f"it has more than {MOST_REPEATS} repeats, which could take long" if repeats > MOST_REPEATS else ""


Pattern = Annotated[str, Refers(RUNNING, is_reported=True)]


def _shape(value: object) -> str:
    return "map" if isinstance(value, Mapping | BaseModel) else "word"


def _regex(text: str) -> str:
    if trouble := trouble_of(text):
        if glob := _GLOB.fullmatch(text):
            cure = f"'*' repeats what is before it: write '.*{glob[1]}.*', or 'contains: {glob[1]}' instead of 'regex'"
            raise PydanticCustomError("regex", "this is a pattern of a shell, not a regular expression", {"help": cure})
        raise PydanticCustomError("regex", "not a regular expression for names: {trouble}", {"trouble": trouble})
    return text


def _path(text: str) -> str:
    if text and not all(step.strip() for step in text.split("/")):
        help_text = "write names with single slashes between them, none in front: 'Sensors/Laser'"
        raise PydanticCustomError("path", "this is not a path in the tree", {"help": help_text})
    return text


TreePath = Annotated[str, Field(max_length=200), AfterValidator(_path)]


class Matcher(Config):
    """Which names of statuses are meant. Of several keys, all must hold; the whole name counts, with its detail."""

    name: str | None = None
    """The whole name."""
    startswith: str | None = Field(None, min_length=1)
    """How the name begins."""
    contains: str | None = Field(None, min_length=1)
    """What is somewhere in the name."""
    regex: Annotated[str, AfterValidator(_regex)] | None = None
    """A regular expression of Python for the whole name."""
    any: tuple[Condition, ...] | None = Field(None, min_length=1)
    """At least one of these."""
    all: tuple[Condition, ...] | None = Field(None, min_length=1)
    """Each of these."""
    unless: Condition | None = Field(None, alias="not")
    """Not this."""

    @model_validator(mode="after")
    def _says_something(self) -> Matcher:
        if not self.model_fields_set:
            help_text = "write one of name, startswith, contains, regex, any, all, not"
            raise PydanticCustomError("empty", "this says nothing about the name", {"help": help_text})
        return self


Condition = Annotated[Annotated[Pattern, Tag("word")] | Annotated[Matcher, Tag("map")], Discriminator(_shape)]
Matcher.model_rebuild()


class Count(Config):
    """How many items a group has."""

    min: int = Field(0, ge=0)
    """Fewer are an ERROR; none at all, where there should be some, are STALE."""
    max: int | None = Field(None, ge=0)
    """More are an ERROR."""


class Debounce(Config):
    """How long a level must last before it counts."""

    up: Time = Field(0.0, ge=0)
    """A worse one. A component that is lost counts immediately."""
    down: Time = Field(0.0, ge=0)
    """A better one."""


class AnalyzerModel(Config):
    """One group of statuses."""

    type: Literal["generic", "group", "ignore", "discard", "other"] | None = None
    """`group` has groups below it, `ignore` and `discard` show nowhere what they match, `other` takes what is left."""
    match: tuple[Condition, ...] | None = Field(None, min_length=1)
    """Names of components, patterns with `*`, or maps that say more about names; one must fit."""
    expected: tuple[Pattern, ...] = ()
    """Names that must report, whatever matches."""
    timeout: Time = Field(DEFAULT_TIMEOUT, ge=0)
    """A status that is older is STALE; with 0 it never is."""
    discard_stale: bool = False
    """Whether what is STALE disappears, except what is expected; an empty group disappears after another `timeout`."""
    strip_prefix: tuple[Annotated[str, Field(min_length=1)], ...] = ()
    """Beginnings of names that match, too, and are left out in the tree."""
    remove_prefix: tuple[Annotated[str, Field(min_length=1)], ...] = ()
    """Beginnings of names that are left out in the tree, and match nothing by themselves."""
    count: Annotated[Annotated[int, Field(ge=0), Tag("word")] | Annotated[Count, Tag("map")], Discriminator(_shape)] | (
        None
    ) = None
    """How many items there must be: a number, or `min` and `max`."""
    path: TreePath | None = None
    """Its name in the tree, instead of its key; slashes make levels. With an empty one, a `group` has no header."""
    debounce: (
        Annotated[Annotated[Time, Field(ge=0), Tag("word")] | Annotated[Debounce, Tag("map")], Discriminator(_shape)]
        | None
    ) = None
    """How long another level must last before the group has it: a time, or `up` and `down`."""
    latch: bool = False
    """Whether the worst level stays until `rbxcompose diag ack`."""
    suppressed_by: Annotated[str, Refers(ANALYZER, is_reported=True)] | None = None
    """The group of whose failure all here is only a consequence: while it is ERROR or STALE, this one is OK. It is one
    beside this group, or beside one above it."""
    analyzers: dict[Name, AnalyzerModel] = {}
    """Groups below this one, by name."""

    @property
    def kind(self) -> str:
        """Return the type, also where it is not written."""
        return self.type or ("group" if self.analyzers else "generic")

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Return what `match` lists."""
        return self.match or ()

    @property
    def prefixes(self) -> tuple[str, ...]:
        """Return the beginnings of names that are left out in the tree."""
        return self.strip_prefix + self.remove_prefix

    @property
    def holds(self) -> tuple[float, float]:
        """Return how long a worse and a better level must last [s]."""
        if isinstance(self.debounce, Debounce):
            return self.debounce.up, self.debounce.down
        return self.debounce or 0.0, self.debounce or 0.0

    @property
    def counted(self) -> tuple[int, int | None] | None:
        """Return the least and greatest number of items; None if any number will do."""
        if isinstance(self.count, Count):
            return self.count.min, self.count.max
        return None if self.count is None else (self.count, self.count)


class DiagnosticsModel(Config):
    """How the states of components are grouped."""

    profile: Literal["modern", "ros1"] = "modern"
    """`ros1` follows all rules of ROS 1's `diagnostic_aggregator`; it knows no `debounce`, `latch`, `suppressed_by`."""
    rate: Frequency = Field(1.0, gt=0, le=100)
    """How often the tree is published; changed levels are published at once, except with the profile `ros1`."""
    base: TreePath = ""
    """The path above all groups; with one, there is a header for all of them."""
    other: Literal["ok", "warn", "error", "hide"] = "ok"
    """The least level of statuses in `Other` that no component of this robot sends; `hide` shows no `Other` at all."""
    stale_policy: Literal["stale", "classic"] | None = None
    """What a group with STALE items is: `stale`, unless there is an ERROR (default), or `classic`: ERROR, unless all
    are STALE (default of `ros1`)."""
    ignore: tuple[Condition, ...] = ()
    """Statuses that are not taken at all."""
    analyzers: dict[Name, AnalyzerModel] = {}
    """Groups by name."""

    @property
    def is_classic(self) -> bool:
        """Return whether a group of which only a part is STALE is an ERROR."""
        return self.stale_policy == "classic" or (self.stale_policy is None and self.profile == "ros1")

    @property
    def headers(self) -> dict[str, str]:
        """Return the paths of the groups that have a header at the top, by name; without the slash in front."""
        steps = {name: name if analyzer.path is None else analyzer.path for name, analyzer in self.analyzers.items()}
        shown = (name for name, analyzer in self.analyzers.items() if analyzer.kind in SHOWN and steps[name])
        return {name: "/".join(filter(None, (self.base.strip("/"), steps[name]))) for name in shown}


def each_analyzer(
    analyzers: Mapping[str, AnalyzerModel], above: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], AnalyzerModel]]:
    """Yield all analyzers, each before those below it, with its keys below the section's `analyzers`."""
    for name, analyzer in analyzers.items():
        yield (*above, name), analyzer
        if analyzer.analyzers:
            yield from each_analyzer(analyzer.analyzers, (*above, name, "analyzers"))


def component_of(name: str) -> str:
    """Return the component in the name of a status."""
    return name.partition(": ")[0]


def is_glob(pattern: str) -> bool:
    """Return whether a pattern can match other names than itself."""
    return not _CONDITIONS_GLOB.isdisjoint(pattern)


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
        any(fits(condition, name) for condition in analyzer.conditions)
        or any(_is_like(pattern, name) for pattern in analyzer.expected)
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

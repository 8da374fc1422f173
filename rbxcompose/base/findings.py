"""Findings: what the compiler reports about a manifest, as data with a place, worded for people; rules find them.

The subject of a rule depends on its family: the checks in `checks/` examine a robot, those in `missions/checks` a
mission. Fixes are applied byte-exact outside of what they replace; callers read and write the files.
"""

from __future__ import annotations

import difflib
import heapq
import inspect
import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field, replace
from enum import StrEnum
from functools import lru_cache, wraps
from itertools import islice, product
from typing import Generic, NamedTuple, ParamSpec, TypeVar, cast

from rbxcompose.base.dataclass import dataclass

P = ParamSpec("P")
S = TypeVar("S")
T = TypeVar("T")

GUESSES = 4_000_000  # units of work, each about 0.1 us


NeededFile = tuple[str, str]
"""A file beside manifests, or a folder with all that is in it: a folder of the project, and the path from there."""


@dataclass(slots=True)
class _Memory:
    """What one compile has found out, by function and arguments, and what it may still spend on guesses."""

    known: dict[tuple[object, ...], object] = field(default_factory=dict)
    left: int = GUESSES
    needed: set[NeededFile] = field(default_factory=set)


_MEMORY: ContextVar[_Memory | None] = ContextVar("memory", default=None)


@contextmanager
def one_compile() -> Iterator[None]:
    """Remember and limit what is done in this block."""
    token = _MEMORY.set(_Memory())
    try:
        yield
    finally:
        _MEMORY.reset(token)


def need(folder: str, path: str) -> None:
    """Note what this compile's robot needs beside the manifests that are read: it travels to other hosts with them."""
    if (memory := _MEMORY.get()) is not None:
        memory.needed.add((folder, path))


def needed() -> frozenset[NeededFile]:
    """Return what this compile has noted."""
    memory = _MEMORY.get()
    return frozenset(memory.needed) if memory is not None else frozenset()


def once(function: Callable[P, T]) -> Callable[P, T]:
    """Call a function only once per compile for the same positional arguments, which must be hashable."""

    @wraps(function)
    def remembered(*args: P.args, **kwargs: P.kwargs) -> T:
        memory, key = _MEMORY.get(), (function, *args)
        if memory is None or kwargs:
            return function(*args, **kwargs)
        if key not in memory.known:
            memory.known[key] = function(*args)  # type: ignore[call-arg]
        return cast(T, memory.known[key])

    return remembered


@dataclass(frozen=True, slots=True, eq=False)
class Itself(Generic[T]):
    """A large value as an argument of a function that is called `once`: it is known again only as the same object."""

    value: T

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Itself) and other.value is self.value

    def __hash__(self) -> int:
        return id(self.value)


def may_guess(work: int = 0) -> bool:
    """Spend units of work on a guess; return whether this compile may go on guessing."""
    memory = _MEMORY.get()
    if memory is None:
        return True
    memory.left -= work
    return memory.left >= 0


SIMILAR = 0.6  # difflib ratio above which a name is offered as "did you mean"
LEAST_WORD = 2  # characters of a word that makes two names alike
SOMEWHAT = 0.4  # difflib ratio above which a name comes first in a list of valid names
MOST_NAMES = 8  # valid names listed when none is similar
_CHANCE = 0.7  # difflib ratio below which names without a common word are alike by chance
_LONG, _ALIKE = 6, 0.65  # names of as many characters have more in common by chance: `camera` and `charger`
SURE = 0.8  # difflib ratio above which a similar name may replace a misspelt one,
LEAD = 0.1  # if it leads every other name by this much
VALID = "valid names"
DID_YOU_MEAN = "did you mean"  # how the help begins if there is one name that was probably meant
MOST_COMPARED = 100  # names; with more, only those one slip away are considered
_LONGEST_COMPARED = 60  # characters of a name
_PER_LOOKUP, _PER_NAME, _PER_CHARACTER, _PER_RATIO = 300, 12, 3, 500  # units of work of guessing


class Severity(StrEnum):
    """The severity of a finding; only errors keep a robot from starting."""

    ERROR = "error"
    WARNING = "warning"


class Span(NamedTuple):
    """A place in a text: lines and columns count from 1, the end is exclusive and on the same or a later line.

    A tuple, since the compiler makes thousands of them.
    """

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def __str__(self) -> str:
        return f"{self.place}:{self.column}"

    @property
    def place(self) -> str:
        """Return the file and the line."""
        return f"{self.file}:{self.line}"

    def contains(self, other: Span) -> bool:
        """Return whether another place lies inside this one."""
        starts = (self.line, self.column) <= (other.line, other.column)
        ends = (other.end_line, other.end_column) <= (self.end_line, self.end_column)
        return self.file == other.file and starts and ends


@dataclass(frozen=True, slots=True)
class Related:
    """A second place that a finding is about, with a short note on it."""

    span: Span
    message: str


@dataclass(frozen=True, slots=True)
class Edit:
    """Replaces `old`, the text required at `span` (perhaps in quotes), with `text`.

    If `old` is not there, the edit does not apply: the value came from elsewhere, or is written in another way. An edit
    whose `text` equals `old` changes nothing; it only guards that the text is there.
    """

    span: Span
    old: str
    text: str


@dataclass(frozen=True, slots=True)
class Fix:
    """Edits that together correct a mistake; a safe fix cannot change what the author meant. `title` describes it."""

    edits: tuple[Edit, ...]
    is_safe: bool
    title: str


@dataclass(frozen=True, slots=True)
class Finding:
    """One mistake: `message` says what is wrong, `label` stands beside the caret, `help` says what to do.

    `about` are the names of what it misses, or rests on: of components, topics, skills, places and so on, or a key.
    """

    code: str
    message: str
    span: Span | None = None
    label: str = ""
    help: str = ""
    related: tuple[Related, ...] = ()
    severity: Severity = Severity.ERROR
    fix: Fix | None = None
    about: tuple[str, ...] = field(default=(), compare=False)


@dataclass(frozen=True, slots=True)
class FindingKind:
    """A kind of finding: a stable code and its severity; `docs/findings/CODE.md` is its page.

    `is_fixable` means that `check --fix` corrects at least some of its findings. `doc` is the page of a kind of another
    package (first line: title). `origin` is where it is declared.
    """

    code: str
    severity: Severity = Severity.ERROR
    is_fixable: bool = False
    doc: str = ""
    origin: str = ""

    def at(
        self,
        span: Span | None,
        message: str,
        *,
        label: str = "",
        help: str = "",
        related: Iterable[Related] = (),
        fix: Fix | None = None,
        about: Iterable[str] = (),
    ) -> Finding:
        """Return a finding of this kind at `span`."""
        return Finding(self.code, message, span, label, help, tuple(related), self.severity, fix, tuple(about))

    def misspelt(
        self,
        span: Span | None,
        message: str,
        name: str,
        valid: Iterable[str],
        what: str = VALID,
        *,
        taken: Collection[str] = (),
        within: str = "",
    ) -> Finding:
        """Return a finding about a `name` at `span` that is not in `valid`, with the name that was probably meant.

        `what` describes the valid names, which are listed if none is similar; see `correction` for the other arguments.
        If `valid` holds things with a `span` by their names, the place of that name is told, too.
        """
        names = _ordered(valid)
        fix = correction(name, names, span, taken=taken, within=within)
        related = _declared(name, valid) if isinstance(valid, Mapping) else ()
        return self.at(span, message, help=suggest(name, names, what), related=related, fix=fix, about=[name])


def _declared(name: str, valid: Mapping[str, object]) -> Iterator[Related]:
    """Yield the place of the name that was probably meant."""
    for near in nearest(name, valid):
        if isinstance(span := getattr(valid[near], "span", None), Span):
            yield Related(span, f"'{near}' is declared here")


KINDS: dict[str, FindingKind] = {}  # every kind that has been imported, by code


def kind(code: str, severity: Severity = Severity.ERROR, *, is_fixable: bool = False, doc: str = "") -> FindingKind:
    """Declare a kind of finding beside the code that finds it.

    Raises:
        ValueError: if another kind has this code.
    """
    caller = sys._getframe(1)
    made = FindingKind(code, severity, is_fixable, doc, f"{caller.f_globals['__name__']}:{caller.f_lineno}")
    register_kind(made)
    return made


def register_kind(made: FindingKind) -> None:
    """Enter a kind into `KINDS`; a code belongs to one kind only, whose module may be imported again."""
    if KINDS.setdefault(made.code, made).origin != made.origin:
        raise ValueError(f"two kinds of finding have the code {made.code}")


@dataclass(slots=True)
class Report:
    """Collects the findings of one run."""

    findings: list[Finding] = field(default_factory=list)

    def add(self, finding: Finding) -> None:
        """Add one finding."""
        self.findings.append(finding)

    def extend(self, findings: Iterable[Finding]) -> None:
        """Add several findings."""
        self.findings.extend(findings)

    def new_among(self, findings: Iterable[Finding]) -> list[Finding]:
        """Return those of several findings whose code, place and message are not there yet."""
        known = {(finding.code, finding.span, finding.message) for finding in self.findings}
        return [each for each in findings if (each.code, each.span, each.message) not in known]

    @property
    def has_errors(self) -> bool:
        """Return whether anything found keeps the robot from starting."""
        return any(finding.severity is Severity.ERROR for finding in self.findings)

    def __iter__(self) -> Iterator[Finding]:
        """Yield each distinct finding once, sorted by place."""
        return iter(sorted(dict.fromkeys(self.findings), key=_place))


def _place(finding: Finding) -> tuple[bool, Span | None, str, str]:
    # Findings without a place come first: they are about the whole run.
    return (finding.span is not None, finding.span, finding.code, finding.message)


def suggest(name: str, valid: Iterable[str], what: str = VALID) -> str:
    """Return the help for a misspelt `name`: the nearest of `valid`, else the first of them, else nothing.

    They are listed by their likeness to `name`; those that are equally unlike it keep their order, so callers put the
    more likely kind first. A compile that has spent its guesses on thousands of other names gives no help any more.
    """
    if not may_guess():
        return ""
    names = _ordered(valid)
    near = _completed(name, names) or nearest(name, names)
    if near and not _is_chance(name, near[0]) and not _is_one_of_many(name, near[0], names):
        return f"{DID_YOU_MEAN} '{near[0]}'?"
    if not names:
        return ""
    rest = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"{what}: {', '.join(_by_likeness(name, names)[:MOST_NAMES])}{rest}"


def clauses(*parts: str) -> str:
    """Return the parts of a sentence that are not empty, joined by semicolons."""
    return "; ".join(filter(None, parts))


def _is_chance(name: str, near: str) -> bool:
    """Return whether two names are only somewhat alike, in no word: `wheel_separation` and `acceleration`."""
    if name.casefold() == near.casefold():
        return False
    words, others = _words(name), _words(near)
    pairs = [(name, near), *product(words, others)]
    if not may_guess(2 * len(name) * len(near)):
        return True
    if not _shared(words, others) and all(_edits(word, other) > max(1, len(word) // 3) for word, other in pairs):
        return True
    if min(len(name), len(near)) >= _LONG and _similarity(name, near) < _ALIKE and not _shared(words, others):
        return not any(_is_slip(word, other) for word in words for other in others)
    if _is_slip(name, near) or _shared(words, others) or _similarity(name, near) >= _CHANCE:
        return False
    return not any(_similarity(word, other) >= SURE for word in words for other in others)


def _is_one_of_many(name: str, near: str, names: list[str]) -> bool:
    """Return whether a name is like another only in a word that several have: `ram_monitor` and `cpu_monitor`."""
    words = _words(name)
    if _is_slip(name, near) or len(names) > MOST_COMPARED or not may_guess(_PER_NAME * len(names)):
        return False
    both = words & _words(near)
    others = [word for word in words - both if word.isalpha()]
    differs = [one for one in others if all(_similarity(one, other) < SIMILAR for other in _words(near))]
    return bool(both and differs) and sum(bool(both & _words(one)) for one in names) > 2


def _completed(name: str, names: list[str]) -> list[str]:
    """Return the only name that begins with the words of a shorter one: `XL430` is that of `XL430-W250`."""
    begun = [other for other in names if len(name) > LEAST_WORD and other != name and other.startswith(name)]
    longer = [one for one in begun if not one[len(name)].isalnum()]
    return longer if len(longer) == 1 and name not in names else []


def _ordered(names: Iterable[str]) -> list[str]:
    """Return names once each, in their order; those of a set, which has none, by the alphabet."""
    return sorted(names) if isinstance(names, set | frozenset) else list(dict.fromkeys(names))


def _by_likeness(name: str, names: list[str]) -> list[str]:
    """Return names with those first that share words with `name`, then those that are spelt a little like it."""
    if len(names) > MOST_COMPARED or not may_guess(_PER_NAME * len(names)):
        return names
    words = _words(name)
    spelt = {text: rank for rank, text in enumerate(nearest(name, names, most=MOST_NAMES, cutoff=SOMEWHAT))}
    return sorted(names, key=lambda one: (-_shared(words, _words(one)), spelt.get(one, MOST_NAMES)))


def _shared(words: set[str], others: set[str]) -> int:
    """Return how many words are in both sets, or begin one there: `baud` and `baudrate`."""
    return sum(any(word.startswith(other) or other.startswith(word) for other in others) for word in words)


def _words(name: str) -> set[str]:
    return {word for word in re.split(r"[\W_]+", name.casefold()) if len(word) >= LEAST_WORD}


def nearest(name: str, valid: Iterable[str], *, most: int = 1, cutoff: float = SIMILAR) -> list[str]:
    """Return the valid names most similar to `name`, nearest first; among very many, only those one slip away.

    Those that differ only in the case of letters are nearest, and alone.

    Comparing takes time, and a file may contain thousands of wrong names: after many, a compile finds nothing near.
    """
    if not may_guess():
        return []
    names = frozenset(valid)
    may_guess(_PER_NAME * len(names))
    if len(names) > MOST_COMPARED:
        slips = _slips(names)
        names = frozenset(near for short in _shortened(name) for near in slips.get(short, ()))
    same = sorted(other for other in names if other.casefold() == name.casefold())
    return same[:most] if same and name not in same else _closest(name, sorted(names), most, cutoff)


_LOOK_ALIKE = str.maketrans("1I0O", "lloo")


def _closest(name: str, names: list[str], most: int, cutoff: float) -> list[str]:
    """Do what `difflib.get_close_matches` does, but count the work."""
    may_guess(_PER_LOOKUP + _PER_NAME * len(names))
    matcher = difflib.SequenceMatcher(None, "", name)
    near = []
    for other in names:
        matcher.set_seq1(other)
        if matcher.real_quick_ratio() < cutoff or not may_guess(_PER_CHARACTER * len(other)):
            continue
        if matcher.quick_ratio() < cutoff or not may_guess(_PER_RATIO + len(other) * len(name)):
            continue
        if (ratio := matcher.ratio()) >= cutoff:
            near.append((ratio, _seen(other) == _seen(name), other))
    return [one for *_, one in heapq.nlargest(most, near)]


def _seen(name: str) -> str:
    """Return a name as it looks: `corner_l` is `corner_1`."""
    return name.translate(_LOOK_ALIKE)


@lru_cache(maxsize=8)
def _slips(names: frozenset[str]) -> dict[str, list[str]]:
    """Return, for each text that is left when at most one character is removed, the names it comes from."""
    found: dict[str, list[str]] = {}
    for name in names:
        may_guess(_PER_NAME * len(name))
        for short in _shortened(name):
            found.setdefault(short, []).append(name)
    return found


def _shortened(name: str) -> set[str]:
    kept = name[:_LONGEST_COMPARED]
    return {kept, *(kept[:index] + kept[index + 1 :] for index in range(len(kept)))}


def correction(
    name: str, valid: Iterable[str], span: Span | None, *, taken: Collection[str] = (), within: str = ""
) -> Fix | None:
    """Return the safe fix for a misspelt `name` at `span`, None if no name or more than one may be meant.

    `taken` are names already used there: using one again would be a mistake, too. If the name is only part of the text
    at `span`, `within` is the whole text, and `name` is its first occurrence there.
    """
    meant = surely_meant(name, valid)
    if span is None or meant is None or meant in taken:
        return None
    old = within or name
    new = old.replace(name, meant, 1)
    return replacement(span, old, new)


def replacement(span: Span, old: str, new: str, *, is_safe: bool = True) -> Fix:
    """Return the fix that replaces `old` with `new`."""
    return Fix((Edit(span, old, new),), is_safe, f"'{old}' -> '{new}'")


def surely_meant(name: str, valid: Iterable[str]) -> str | None:
    """Return the one name that `name` is a typing slip for, None if there is no such name."""
    near = nearest(name, valid, most=2, cutoff=SURE - LEAD)
    ratios = [_similarity(text, name) for text in near]
    is_near = bool(near) and (ratios[0] >= SURE or _is_swap(name, near[0]))
    is_clear = is_near and ratios[0] - sum(ratios[1:]) >= LEAD * len(near[1:])
    return near[0] if is_clear and _is_slip(name, near[0]) else None


def _similarity(text: str, other: str) -> float:
    return difflib.SequenceMatcher(None, text, other).ratio()


def _edits(text: str, other: str) -> int:
    """Return how many characters were changed, added, removed or swapped with their neighbour, at the least."""
    before: list[int] = []
    row = list(range(len(other) + 1))
    for at, character in enumerate(text, 1):
        above, row, older = row, [at], before
        for to, wanted in enumerate(other, 1):
            cost = min(above[to] + 1, row[-1] + 1, above[to - 1] + (character != wanted))
            if at > 1 and to > 1 and character == other[to - 2] and wanted == text[at - 2]:
                cost = min(cost, older[to - 2] + 1)
            row.append(cost)
        before = above
    return row[-1]


def _is_swap(name: str, meant: str) -> bool:
    """Return whether two neighbouring characters are swapped."""
    swaps = (name[:at] + name[at + 1] + name[at] + name[at + 2 :] for at in range(len(name) - 1))
    return meant in swaps


def _is_slip(name: str, meant: str) -> bool:
    """Return whether two names differ within words: `corner_2` for `corner_1` or `min_speed` for `max_speed` do not."""
    if re.findall(r"\d+", name) != re.findall(r"\d+", meant):
        return False
    words, others = re.split(r"[\W_]+", name), re.split(r"[\W_]+", meant)
    if len(words) != len(others):
        return _similarity("".join(words), "".join(others)) >= 1 - LEAD
    return all(_similarity(word, other) >= SIMILAR for word, other in zip(words, others, strict=True))


Sources = Mapping[str, str]  # text of every file that a span may refer to


WIRING, NAMES, MISSIONS, OWN, ALL = "wiring", "names", "missions", "own file", "everything"
"""What rules may take for known: all ports with their topics; the names of all components; all missions; the mission
file that a finding is in; everything. The name of a section means its contents."""
EVERYTHING = (ALL, WIRING, NAMES, MISSIONS, OWN)
OUR_CODES = "RBX"  # how the codes of this project begin
MOST_FOUND = 100  # findings of one rule about one subject: a thousand things make a million pairs


@dataclass(frozen=True, slots=True)
class Rule(FindingKind, Generic[S]):
    """A kind of finding together with the function that finds it.

    `closed` is what it takes for known, because it concludes something from what is not there; with an error in that,
    it is silent. `None` stands for everything in warnings, for nothing in errors.
    """

    find: Callable[[S], Iterable[Finding]] = lambda subject: ()
    closed: tuple[str, ...] | None = None

    @property
    def relies_on(self) -> tuple[str, ...]:
        """Return what it takes for known."""
        if self.closed is None:
            return EVERYTHING if self.severity is Severity.WARNING else ()
        return self.closed

    def __call__(self, subject: S) -> Iterable[Finding]:
        """Return what is wrong with `subject`: at most the first `MOST_FOUND` findings."""
        found = list(islice(self.find(subject), MOST_FOUND + 1))
        if len(found) > MOST_FOUND:
            rest, last = f"there are more than these {MOST_FOUND} findings of {self.code}", found[MOST_FOUND - 1]
            found[MOST_FOUND - 1 :] = [replace(last, help=clauses(last.help, rest))]
        return found


def declared(
    find: Callable[[S], Iterable[Finding]],
    code: str,
    severity: Severity,
    is_fixable: bool,
    closed: tuple[str, ...] | None = None,
) -> Rule[S]:
    """Enter a rule under a code. The docstring of a rule of another package is its docs page.

    Raises:
        ValueError: if it has no docstring, or its code is taken.
    """
    if not find.__doc__:
        raise ValueError(f"check {code} has no docstring, so it would have no docs page")
    doc = "" if code.startswith(OUR_CODES) else inspect.cleandoc(find.__doc__)
    origin = f"{find.__module__}.{find.__qualname__}"
    made: Rule[S] = Rule(code, severity, is_fixable, doc, origin, find=find, closed=closed)
    register_kind(made)
    return made


def belonging(
    find: Callable[[S], Iterable[Finding]], kind: FindingKind, closed: tuple[str, ...] | None = None
) -> Rule[S]:
    """Return a rule for a kind of finding that is declared elsewhere, because not only rules find it."""
    return Rule(kind.code, kind.severity, kind.is_fixable, kind.doc, kind.origin, find=find, closed=closed)


COMMAND_LINE = "--"  # prefix of the names of texts that are not files, such as `--set`
_BYTE_ORDER_MARK = "\ufeff"
_QUOTES = "'\""


@dataclass(frozen=True, slots=True)
class EditPlace:
    """Where an edit applies: offsets in the text of a file, and the new text for them."""

    file: str
    start: int
    end: int
    text: str
    is_guard: bool = False

    def meets(self, other: EditPlace) -> bool:
        """Return whether the two edits overlap and at least one of them changes text."""
        if self.file != other.file or (self.is_guard and other.is_guard):
            return False
        return self.start == other.start or (self.start < other.end and other.start < self.end)


@dataclass(slots=True)
class Applied:
    """The result of applying fixes: the new texts, the fixes applied, and those postponed since they overlap others."""

    texts: dict[str, str]
    done: list[Fix] = field(default_factory=list)
    postponed: list[Fix] = field(default_factory=list)


def apply_fixes(fixes: Iterable[Fix], texts: Mapping[str, str]) -> Applied:
    """Apply each fix completely or not at all; of overlapping fixes, only the first.

    `texts` are whole files as they are on disk, with byte order mark and line endings. A fix is skipped if one of its
    edits is for another file, or does not find the text that it expects.
    """
    lines = {file: _Lines(text) for file, text in texts.items()}
    out = Applied(dict(texts))
    taken: list[EditPlace] = []
    for fix in dict.fromkeys(fixes):
        places = _places(fix, lines)
        if places is None:
            continue
        if any(edit_place.meets(other) for edit_place in places for other in taken):
            out.postponed.append(fix)
            continue
        taken.extend(places)
        out.done.append(fix)
    for place in sorted(taken, key=lambda place: place.start, reverse=True):
        if not place.is_guard:
            text = out.texts[place.file]
            out.texts[place.file] = text[: place.start] + place.text + text[place.end :]
    return out


def places_of_fixes(fixes: Iterable[Fix], texts: Mapping[str, str]) -> Iterator[list[EditPlace] | None]:
    """Yield where the edits of each fix apply; None for a fix that does not."""
    lines = {file: _Lines(text) for file, text in texts.items()}
    return (_places(fix, lines) for fix in fixes)


def safe_fixes(findings: Iterable[Finding], sources: Sources) -> list[Fix]:
    """Return the safe fixes that can be applied to the texts that were read, each once."""
    lines: dict[str, _Lines] = {}
    found = []
    for fix in dict.fromkeys(finding.fix for finding in findings):
        if fix is None or not fix.is_safe or any(edit.span.file.startswith(COMMAND_LINE) for edit in fix.edits):
            continue
        for edit in fix.edits:
            if edit.span.file in sources and edit.span.file not in lines:
                lines[edit.span.file] = _Lines(sources[edit.span.file])
        if _places(fix, lines) is not None:
            found.append(fix)
    return found


def exact_fix(fix: Fix | None, sources: Sources) -> Fix | None:
    """Return a fix whose edits span exactly the text they replace (within quotes), None if they do not apply."""
    if fix is None:
        return None
    edits = []
    for edit in fix.edits:
        lines = _Lines(sources.get(edit.span.file, ""))
        place = lines.place(edit)
        start = lines.offset(edit.span.line, edit.span.column)
        if place is None or start is None:
            return None
        shift = place.start - start
        span = edit.span._replace(column=edit.span.column + shift, end_column=edit.span.end_column - shift)
        edits.append(replace(edit, span=span))
    return replace(fix, edits=tuple(edits))


def _places(fix: Fix, lines: Mapping[str, _Lines]) -> list[EditPlace] | None:
    """Return the places of all edits of a fix, None if one of them does not find the text that it expects."""
    found = [lines[edit.span.file].place(edit) if edit.span.file in lines else None for edit in fix.edits]
    places = [place for place in found if place is not None]
    return places if len(places) == len(found) else None


class _Lines:
    """A text by lines and columns, which count characters from 1; a byte order mark is not counted."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines = text.split("\n")
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line) + 1)
        self.mark = len(_BYTE_ORDER_MARK) if text.startswith(_BYTE_ORDER_MARK) else 0

    def offset(self, line: int, column: int) -> int | None:
        """Return the offset of a line and column, None if it is outside of the text."""
        if not 1 <= line <= len(self.lines):
            return None
        offset = column - 1 + (self.mark if line == 1 else 0)
        return self.starts[line - 1] + offset if 0 <= offset <= len(self.lines[line - 1]) else None

    def place(self, edit: Edit) -> EditPlace | None:
        """Return where an edit lands: at its span or, in quotes, within them."""
        span = edit.span
        start, end = self.offset(span.line, span.column), self.offset(span.end_line, span.end_column)
        if start is None or end is None or end < start:
            return None
        there = self.text[start:end].replace("\r\n", "\n")
        place = EditPlace(span.file, start, end, edit.text, edit.text == edit.old)
        if there == edit.old:
            return place
        is_plain = not set(edit.text) & set(_QUOTES + "\\")
        if is_plain and any(there == f"{quote}{edit.old}{quote}" for quote in _QUOTES):
            return replace(place, start=start + 1, end=end - 1)
        return None

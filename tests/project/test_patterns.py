"""Every regular expression of the package takes time that grows with its text, not with the square of it."""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Callable, Iterator
from functools import cache
from re import _constants as codes  # type: ignore[attr-defined]
from re import _parser as parser  # type: ignore[attr-defined]
from time import thread_time
from types import ModuleType
from typing import Any

import pytest

from tests.project.package import PACKAGE, files, module_of, modules, text_of

N = 2_000  # characters of a near-miss
SHORT = 0.002  # [s] in which a linear expression is through with any of them
METHODS = ("match", "fullmatch", "search", "findall", "finditer", "sub", "split")
SAMPLES = "\n\t -_.,:/#$'\"[]{}()!|>aAeisx01°"


def known(module: str, name: str) -> str:
    """Return the name of a pattern: one that is private is used in its module only, and is named after it."""
    return f"{module.removeprefix('rbxcompose.').removesuffix('.__init__')}.{name}" if name.startswith("_") else name


@cache
def compiled() -> tuple[tuple[ModuleType, str, re.Pattern[Any]], ...]:
    """Return all patterns that are compiled in modules, with their names."""
    found = ((module, word, value) for module in modules() for word, value in vars(module).items())
    return tuple((module, word, value) for module, word, value in found if isinstance(value, re.Pattern))


@cache
def calls() -> tuple[dict[str, set[str]], tuple[tuple[str, str, ast.expr], ...]]:
    """Return the methods by which patterns are used, by their names, and patterns that stand where they are used."""
    used: dict[str, set[str]] = {}
    in_place = []
    names = sorted({"re", *(word for _, word, _ in compiled())})
    call = re.compile(rf"\b(?:{'|'.join(names)})\s*\.\s*(?:{'|'.join(METHODS)})\b")
    for path in files():
        for node in ast.walk(ast.parse(text_of(path))) if call.search(text_of(path)) else ():
            match node:
                case ast.Attribute(value=ast.Name(id=name) | ast.Attribute(attr=name), attr=method):
                    if method in METHODS:
                        used.setdefault(known(module_of(path), name), set()).add(method)
                case ast.Call(func=ast.Attribute(value=ast.Name("re"), attr=method), args=[written, *_]):
                    if method in METHODS:
                        in_place.append((f"{path.relative_to(PACKAGE)}:{node.lineno}", method, written))
    return used, tuple(in_place)


def patterns() -> dict[tuple[str, Any], set[str]]:
    """All patterns that are compiled in modules, with the methods by which anybody uses them."""
    used, in_place = calls()
    found: dict[tuple[str, Any], set[str]] = {}
    for module, word, value in compiled():
        name = known(module.__name__, word)
        found.setdefault((name, value), set()).update(used.get(name, ()))
    for where, method, written in in_place:
        if isinstance(written, ast.Constant):
            found.setdefault((where, re.compile(written.value)), set()).add(method)
    return found


def character(items: list[Any]) -> str:
    """A character that a set of characters holds, or nothing."""
    for one in SAMPLES:
        if any(holds(item, one) for item in items) != (items[0][0] is codes.NEGATE):
            return one
    return ""


def holds(item: Any, text: str) -> bool:
    match item:
        case (codes.LITERAL, number):
            return bool(ord(text) == number)
        case (codes.RANGE, (low, high)):
            return bool(low <= ord(text) <= high)
        case (codes.CATEGORY, codes.CATEGORY_SPACE):
            return text.isspace()
        case (codes.CATEGORY, codes.CATEGORY_NOT_SPACE):
            return not text.isspace()
        case (codes.CATEGORY, codes.CATEGORY_DIGIT):
            return text.isdigit()
        case (codes.CATEGORY, codes.CATEGORY_WORD):
            return text.isalnum() or text == "_"
        case (codes.CATEGORY, codes.CATEGORY_NOT_WORD):
            return not (text.isalnum() or text == "_")
    return False


def sample(tree: Any) -> str:
    """A short text that a part of a pattern takes, as far as that can be told without looking around."""
    text = ""
    for code, value in tree:
        match code:
            case codes.LITERAL:
                text += chr(value)
            case codes.NOT_LITERAL:
                text += next(one for one in SAMPLES if ord(one) != value)
            case codes.ANY:
                text += "a"
            case codes.IN:
                text += character(value)
            case codes.BRANCH:
                text += sample(value[1][0])
            case codes.SUBPATTERN:
                text += sample(value[3])
            case codes.ATOMIC_GROUP:
                text += sample(value)
            case codes.MAX_REPEAT | codes.MIN_REPEAT | codes.POSSESSIVE_REPEAT:
                text += sample(value[2]) * max(value[0], 0)
    return text


def starts(tree: Any, before: str = "") -> Iterator[tuple[str, str]]:
    """For each repetition in a pattern: what can stand before it, and what it repeats."""
    for code, value in tree:
        match code:
            case codes.MAX_REPEAT | codes.MIN_REPEAT | codes.POSSESSIVE_REPEAT:
                yield before, sample(value[2])
                yield from starts(value[2], before)
            case codes.SUBPATTERN:
                yield from starts(value[3], before)
            case codes.ATOMIC_GROUP:
                yield from starts(value, before)
            case codes.BRANCH:
                for branch in value[1]:
                    yield from starts(branch, before)
        before += sample([(code, value)])


def near_misses(pattern: re.Pattern[Any]) -> Iterator[tuple[str, str, str]]:
    """Beginnings, what is repeated behind them, and ends that spoil the match."""
    found = {(before[-60:], pump) for before, pump in starts(parser.parse(pattern.pattern, pattern.flags & ~re.DEBUG))}
    befores = {before for before, _ in found} | {f"{before}{pump}" for before, pump in found} | {""}
    pumps = {pump for _, pump in found if pump} | {" ", "a", "\n", "a ", "- "}
    yield from itertools.product(sorted(befores), sorted(pumps), ("\x00", "a:", ""))


def seconds(call: Callable[[Any], object], text: Any, runs: int = 2) -> float:
    """The least processor time of some runs: others use the machine, too."""
    took = []
    for _ in range(runs):
        before = thread_time()
        call(text)
        took.append(thread_time() - before)
    return min(took)


def run_of(pattern: re.Pattern[Any], method: str) -> Callable[[Any], object]:
    match method:
        case "finditer":
            return lambda text: sum(1 for _ in pattern.finditer(text))
        case "sub":
            return lambda text: pattern.sub(text[:0], text)
    made: Callable[[Any], object] = getattr(pattern, method)
    return made


def slow_texts(pattern: re.Pattern[Any], methods: set[str]) -> Iterator[str]:
    for method in sorted(methods):
        call = run_of(pattern, method)
        for before, pump, end in near_misses(pattern):
            texts = [f"{before}{pump * (n // len(pump))}{end}" for n in (N, 2 * N)]
            once, twice = (text.encode() if isinstance(pattern.pattern, bytes) else text for text in texts)
            again = range(3)  # the speed of a processor changes, too
            if all(seconds(call, once, runs=1) > SHORT for _ in range(2)) and all(
                seconds(call, twice) > 3 * seconds(call, once) for _ in again
            ):
                yield f"{method}: {before!r} {pump!r} * n {end!r}"


@pytest.mark.timeout(200)
def test_every_pattern_is_linear() -> None:
    found = patterns()
    assert {where for (where, _), methods in found.items() if not methods} == set(), "used by no method known here"
    slow = {where: next(slow_texts(where[1], methods), None) for where, methods in found.items()}
    assert {where: text for where, text in slow.items() if text} == {}


def test_no_pattern_is_put_together_where_this_test_cannot_see_it() -> None:
    assert [where for where, _, written in calls()[1] if not isinstance(written, ast.Constant)] == []

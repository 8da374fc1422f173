"""Random expressions, read, checked and computed in a process that can neither hang nor take much memory.

Run as a program with a first and a last seed, it prints what it found as JSON.
"""

from __future__ import annotations

import contextlib
import inspect
import json
import random
import resource
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path

from rbxcompose.base.expressions.check import check
from rbxcompose.base.expressions.evaluate import evaluate, holds
from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.text import fill, parse_template
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.expressions.types import FLAG, TYPES, UNKNOWN, Type, list_of, map_of
from rbxcompose.base.expressions.values import NOT_ARRIVED, EvaluationError, NotArrived, NotArrivedError, Value
from rbxcompose.missions.engine.world import show

MEMORY = 200_000_000  # bytes of address space beyond what the process has at its start
DEADLINE = 20  # [s] of processor time for a batch of 500, more for more
SLOW = 0.5  # [s] of processor time for one expression
MOST, LONGEST, MOST_ITEMS = 1e15, 4096, 1000
FORBIDDEN = ("open", "exec", "compile", "import", "subprocess", "os.", "socket", "ctypes", "pickle", "marshal", "code.")
TOKENS = [
    *("0", "1", "-1", "0.5", "1e14", "1e-300", "9" * 39, "30 %", "5 s", "0.3 m/s", "90 deg", "2 m", "true", "false"),
    *("$number", "$level", "$text", "$long", "$list", "$lists", "$map", "$place", "$trap", "$late", "$nobody", "dock"),
    *("red", "'a'", '"b"', "''", "__class__", "None", "lambda", "import", "self", "[]", "[1, 2]", "forever"),
    *("(", ")", "[", "]", ",", ".", ".x", ".__class__", "[0]", "[-1]", "[$list]", "['key']", "[1e14]"),
    *("+", "-", "*", "/", "<", "<=", ">", ">=", "==", "!=", "in", "not in", "not", "and", "or", "**", "//", "%", "="),
    *(
        "count(",
        "age(",
        "new(",
        "distance(",
        "min(",
        "max(",
        "abs(",
        "round(",
        "print(",
        "eval(",
        "$",
        "${",
        "$$",
        "\\",
    ),
]
OPERATORS = ["+", "-", "*", "/", "<", "<=", "==", "!=", "in", "not in", "and", "or"]
FUNCTIONS = ["count", "age", "new", "distance", "min", "max", "abs", "round"]
ATOMS = [
    *("0", "1", "0.5", "1e14", "30 %", "5 s", "0.3 m/s", "2 m", "true", "false", "dock", "red", "'a'", "[]", "[1, 2]"),
    *(
        "$number",
        "$level",
        "$text",
        "$long",
        "$list",
        "$lists",
        "$map",
        "$map.x",
        "$place",
        "$trap",
        "$late",
        "$list[0]",
    ),
]


class Trap:
    """Something opaque that notices when an expression reaches into it."""

    touched: list[str] = []

    def __getattr__(self, name: str) -> object:
        if name not in ("x", "y", "name", "heading"):
            self.touched.append(name)
        raise AttributeError(name)

    def __call__(self, *values: object) -> object:
        self.touched.append("()")
        return self


@dataclass(frozen=True)
class Spot:
    """A place."""

    name: str
    x: float
    y: float
    heading: float = 0.0


class World:
    """What expressions can name, for checking and for computing."""

    values: dict[str, Value] = {
        "number": 3.5,
        "level": 0.3,
        "text": "hello",
        "long": "x" * 4000,
        "list": [1.0, 2.0, 3.0],
        "lists": [[1.0] * 900, [2.0] * 900],
        "map": {"key": 1.0, "x": "y", "__class__": 2.0},
        "place": Spot("dock", 1.0, 2.0),
        "trap": Trap(),
        "late": NOT_ARRIVED,
    }
    types: dict[str, Type] = {
        "number": TYPES["number"],
        "level": TYPES["ratio"],
        "text": TYPES["text"],
        "long": TYPES["text"],
        "list": list_of(TYPES["number"]),
        "lists": list_of(list_of(TYPES["number"])),
        "map": map_of(UNKNOWN),
        "place": TYPES["place"],
        "late": FLAG,
        "trap": UNKNOWN,
    }

    def variable(self, name: str) -> Value | NotArrived:
        return self.values[name]

    def word(self, name: str) -> Value:
        return Spot(name, 0.0, 0.0) if name == "dock" else name

    def age(self, name: str) -> float | NotArrived:
        return 1.0 if self.values[name] is not NOT_ARRIVED else NOT_ARRIVED

    def is_new(self, name: str) -> bool:
        return name in self.values


class StaticWorld:
    """The same names with their types."""

    def variable(self, name: str) -> Type | None:
        return World.types.get(name)

    def word(self, name: str) -> Type | None:
        return TYPES["place"] if name == "dock" else None

    def variables(self) -> Iterable[str]:
        return World.types

    def words(self) -> Iterable[str]:
        return ["dock"]


@dataclass(slots=True)
class Tally:
    """What a batch has shown; `failures` are texts with what they did."""

    tried: int = 0
    computed: int = 0
    slowest: float = 0.0
    failures: list[str] = field(default_factory=list)


def expression(seed: int) -> str:
    """Return the text of a seed: a soup of tokens, or one that follows the grammar, sometimes with a slip."""
    source = random.Random(seed)
    how = source.random()
    if how < 0.3:
        return source.choice((" ", "")).join(source.choices(TOKENS, k=source.randint(1, 30)))
    if how < 0.4:
        piece = source.choice(TOKENS)
        return (piece + source.choice(("", " ", "+", "("))) * source.randint(1, 400)
    text = _nested(source, source.randint(0, 7))
    if how < 0.6:
        place = source.randrange(len(text) + 1)
        text = text[:place] + source.choice(TOKENS) + text[place + source.randint(0, 3) :]
    return text


def _nested(source: random.Random, levels: int) -> str:
    if levels == 0:
        return source.choice(ATOMS)
    match source.randrange(7):
        case 0:
            arguments = ", ".join(_nested(source, levels - 1) for _ in range(source.choice((1, 1, 2, 3))))
            return f"{source.choice(FUNCTIONS)}({arguments})"
        case 1:
            return f"({_nested(source, levels - 1)})"
        case 2:
            return f"[{_nested(source, levels - 1)}, {_nested(source, levels - 1)}]"
        case 3:
            return f"{_nested(source, levels - 1)}[{_nested(source, levels - 1)}]"
        case 4:
            return f"{source.choice(('-', 'not '))}{_nested(source, levels - 1)}"
        case _:
            return f"{_nested(source, levels - 1)} {source.choice(OPERATORS)} {_nested(source, levels - 1)}"


def attempt(text: str) -> bool:
    """Read, check and compute one text; return whether it has a value.

    Raises:
        AssertionError: if the value is none that an expression may have.
    """
    world = World()
    for _ in parse_templates(text):
        pass
    try:
        read = parse(text)
    except ExpressionError as error:
        require_inside(error, text)
        return False
    check(read, StaticWorld())
    with contextlib.suppress(EvaluationError):
        holds(read, world)
    try:
        value = evaluate(read, world)
    except (EvaluationError, NotArrivedError):
        return False
    require_value(value)
    show(None, value)
    return True


def require_inside(error: ExpressionError, text: str) -> None:
    """Raise AssertionError for an error that points nowhere."""
    assert 0 <= error.start <= error.end <= max(len(text), error.start), "an error outside of its text"


def parse_templates(text: str) -> Iterable[str]:
    """Fill a text in which names stand."""
    try:
        yield fill(parse_template(text), World(), lambda name, value: show(None, value))
    except (ExpressionError, EvaluationError, NotArrivedError):
        return


def require_value(value: Value, level: int = 0) -> None:
    """Raise AssertionError for what no expression may give."""
    match value:
        case bool() | Spot() | Trap():
            return
        case int() | float():
            assert abs(value) < MOST, "a number without bounds"
        case str():
            assert len(value) <= LONGEST, "a text without bounds"
        case list() | tuple():
            assert len(value) <= MOST_ITEMS, "a list without bounds"
            assert level < 60, "a list without end"
            for item in value:
                require_value(item, level + 1)
        case dict():
            for item in value.values():
                require_value(item, level + 1)
        case _:
            raise AssertionError(f"a value of another kind: {type(value).__name__}")


def main(first: int, last: int) -> None:
    """Try all seeds in this process, within its limits."""
    events: list[str] = []
    tally = Tally()
    attempt("1 + count([1])")  # so that nothing is imported later
    for module in [module for name, module in sys.modules.items() if name.startswith("rbxcompose")]:
        for cls in filter(inspect.isclass, vars(module).values()):
            _ = cls.__init__  # nor compiled: dataclasses make theirs at first use
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    seconds = int(time.process_time() + DEADLINE * max(1, (last - first) / 500))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    sys.addaudithook(lambda event, _: events.append(event) if event.startswith(FORBIDDEN) else None)
    for seed in range(first, last):
        text = expression(seed)
        started = time.process_time()
        try:
            tally.computed += attempt(text)
            assert not events, f"reached the system: {events}"
            assert not Trap.touched, f"reached into an object: {Trap.touched}"
        except Exception as error:  # any at all is what is looked for
            tally.failures.append(f"seed {seed}: {text[:300]!r}: {error!r}")
            events.clear()
            Trap.touched.clear()
        taken = time.process_time() - started
        if taken > SLOW:
            tally.failures.append(f"seed {seed}: {text[:300]!r}: {taken:.2f} s")
        tally.slowest = max(tally.slowest, taken)
        tally.tried += 1
    sys.stdout.write(json.dumps(asdict(tally)))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))

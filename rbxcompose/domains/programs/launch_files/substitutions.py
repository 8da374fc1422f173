"""Texts of launch files with `$(...)` in them: how they are read, and what they become in a context."""

from __future__ import annotations

import ast
import math
import operator
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any, NamedTuple

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.printable import plain

MOST = 64_000  # characters of a text that is filled in, and of one that is read
_ABOVE = 5  # folders above a file in which its package and the others of its workspace are looked for
_DEPTH = 16  # of substitutions in each other
_PACKAGE = re.compile(r"[A-Za-z][\w-]*", re.ASCII)
_FLAGS = {"true": True, "1": True, "false": False, "0": False}


class UnknownValueError(ValueError):
    """Raised for a text whose value cannot be known here; its text says why."""


class SubstitutionCall(NamedTuple):
    """A substitution: `$(name argument ...)`."""

    name: str
    arguments: tuple[LaunchText, ...] = ()


LaunchText = tuple[str | SubstitutionCall, ...]
"""Pieces as they follow each other: words as they are, and what is filled in."""


def read_launch_text(text: str) -> LaunchText:
    """Return the pieces of a text.

    Raises:
        UnknownValueError: if a substitution has no end, or they are nested too deep.
    """
    if len(text) > MOST:
        raise UnknownValueError(f"it has more than {MOST:,} characters")
    pieces, end = _pieces(text, 0, "", 0)
    return pieces if end == len(text) else (*pieces, text[end:])


def _pieces(text: str, at: int, ends: str, depth: int) -> tuple[LaunchText, int]:
    """Return the pieces from a place to the first of some characters, or to the end, and where that is."""
    if depth > _DEPTH:
        raise UnknownValueError(f"substitutions are nested more than {_DEPTH} levels deep")
    pieces, words = list[str | SubstitutionCall](), ""
    while at < len(text) and text[at] not in ends:
        if text.startswith("$(", at):
            call, at = _call(text, at + 2, depth + 1)
            pieces += [words, call] if words else [call]
            words = ""
        elif text[at] == "\\" and text[at + 1 : at + 2] in ("$", "\\", "'", '"') and (ends or text[at + 1] == "$"):
            words, at = words + text[at + 1], at + 2
        else:
            words, at = words + text[at], at + 1
    return (*pieces, words) if words else tuple(pieces), at


def _call(text: str, at: int, depth: int) -> tuple[SubstitutionCall, int]:
    arguments: list[LaunchText] = []
    while True:
        while text[at : at + 1].isspace():
            at += 1
        if at >= len(text):
            raise UnknownValueError("a '$(' has no ')'")
        if text[at] == ")":
            break
        if (quote := text[at]) in "'\"":
            found, at = _pieces(text, at + 1, quote, depth)
            if at >= len(text):
                raise UnknownValueError(f"a {quote} has no end")
            at += 1
        else:
            found, at = _pieces(text, at, " \t\n)", depth)
        arguments.append(found)
    if not arguments or len(arguments[0]) != 1 or not isinstance(name := arguments[0][0], str):
        raise UnknownValueError("a '$(' has no name")
    return SubstitutionCall(name, tuple(arguments[1:])), at + 1


@dataclass(slots=True)
class SubstitutionContext:
    """What substitutions are filled in with: the values of arguments, variables of the environment, and places.

    `prefixes` are folders into which packages are installed. `notes` are remarks on what was filled in.
    """

    file: Path
    prefixes: Sequence[Path] = ()
    values: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def perform(self, text: LaunchText) -> str:
        """Return a text with all of it filled in.

        Raises:
            UnknownValueError: if something in it is not known here.
        """
        found = ""
        for piece in text:
            found += piece if isinstance(piece, str) else self._performed(piece)
            if len(found) > MOST:
                raise UnknownValueError(f"it becomes longer than {MOST:,} characters")
        return found

    def holds(self, text: LaunchText) -> bool:
        """Return whether a condition holds.

        Raises:
            UnknownValueError: if it is not known, or is neither true nor false.
        """
        found = self.perform(text).strip()
        if found.lower() not in _FLAGS:
            raise UnknownValueError(f"'{plain(found, 60)}' is neither true nor false")
        return _FLAGS[found.lower()]

    def prefix_of(self, package: str) -> Path:
        """Return the folder that a package is installed into.

        Raises:
            UnknownValueError: if it is not there.
        """
        if _PACKAGE.fullmatch(package):
            for prefix in self.prefixes:
                if (prefix / "share" / package).is_dir():
                    return prefix
        raise UnknownValueError(f"there is no package '{plain(package, 60)}' in AMENT_PREFIX_PATH")

    def share_of(self, package: str) -> Path:
        """Return the folder with the files of a package: where it is installed, or beside or above this file.

        Raises:
            UnknownValueError: if it is in none of them.
        """
        above = self.file.parents[:_ABOVE] if _PACKAGE.fullmatch(package) else ()
        for folder in (each for parent in above for each in (parent, parent / package)):
            if folder.name == package and (folder / "package.xml").is_file():
                return folder
        return self.prefix_of(package) / "share" / package

    def _performed(self, call: SubstitutionCall) -> str:
        if call.name not in _KNOWN:
            raise UnknownValueError(_REFUSED.get(call.name, f"'$({plain(call.name, 60)})' is not known here"))
        function, least, most = _KNOWN[call.name]
        if not least <= len(call.arguments) <= most:
            raise UnknownValueError(f"'$({call.name})' takes {least if least == most else f'{least} to {most}'} words")
        return function(self, *(_Lazy(self, argument) for argument in call.arguments))


@dataclass(slots=True)
class _Lazy:
    """An argument of a substitution, filled in only when it is asked for, as a default is."""

    context: SubstitutionContext
    text: LaunchText

    def __str__(self) -> str:
        return self.context.perform(self.text)


def _variable(known: Mapping[str, str], what: str, given: Sequence[_Lazy]) -> str:
    name = str(given[0])
    if name in known:
        return known[name]
    if len(given) > 1:
        return str(given[1])
    raise UnknownValueError(f"there is no {what} '{plain(name, 60)}'")


def _executable(context: SubstitutionContext, name: _Lazy) -> str:
    if found := shutil.which(str(name), path=context.environment.get("PATH", "")):
        return found
    raise UnknownValueError(f"there is no program '{plain(str(name), 60)}' on the PATH")


def _anonymous(context: SubstitutionContext, name: _Lazy) -> str:
    context.notes.append(f"'$(anon {plain(str(name), 60)})' becomes '{plain(str(name), 60)}': names are fixed here")
    return str(name)


def _rewritten(context: SubstitutionContext, file: _Lazy) -> str:
    context.notes.append("the values that RewrittenYaml changes are not carried over: the file is taken as it is")
    return str(file)


def _flag(is_so: bool) -> str:
    return "true" if is_so else "false"


_SOME = 64  # words that a substitution takes
_KNOWN: dict[str, tuple[Callable[..., str], int, int]] = {
    "var": (lambda context, *given: _variable(context.values, "launch argument", given), 1, 2),
    "env": (lambda context, *given: _variable(context.environment, "variable of the environment", given), 1, 2),
    "find-pkg-share": (lambda context, name: str(context.share_of(str(name))), 1, 1),
    "find-pkg-prefix": (lambda context, name: str(context.prefix_of(str(name))), 1, 1),
    "exec-in-pkg": (lambda context, name, package: f"{context.prefix_of(str(package))}/lib/{package}/{name}", 2, 2),
    "find-exec": (_executable, 1, 1),
    "dirname": (lambda context: str(context.file.parent), 0, 0),
    "filename": (lambda context: str(context.file), 0, 0),
    "anon": (_anonymous, 1, 1),
    "as-flag": (lambda context, name: _flag(context.holds((SubstitutionCall("var", (name.text,)),))), 1, 1),
    "rewritten": (_rewritten, 1, 1),
    "eval": (lambda context, *given: evaluated(" ".join(map(str, given))), 1, _SOME),
    "join-path": (lambda context, *given: str(Path(*map(str, given))), 0, _SOME),
    "not": (lambda context, each: _flag(not context.holds(each.text)), 1, 1),
    "and": (lambda context, *given: _flag(all(context.holds(each.text) for each in given)), 1, _SOME),
    "or": (lambda context, *given: _flag(any(context.holds(each.text) for each in given)), 1, _SOME),
    "equals": (lambda context, left, right: _flag(str(left) == str(right)), 2, 2),
    "not-equals": (lambda context, left, right: _flag(str(left) != str(right)), 2, 2),
    "if": (lambda context, which, yes, no="": str(yes if context.holds(which.text) else no), 2, 3),
}
_KNOWN |= {"all": _KNOWN["and"], "any": _KNOWN["or"]}
_REFUSED = {
    "command": "'$(command)' would run a program, and an import runs none",
    "file-content": "the text of a file is not copied into a manifest",
}

_CONSTANTS = {"true": True, "false": False, "pi": math.pi, "inf": math.inf}
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.Not: operator.not_,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda each, many: each in many,
    ast.NotIn: lambda each, many: each not in many,
}
_LONGEST = 2_000  # characters of an expression


def evaluated(expression: str) -> str:
    """Return the value of an expression of Python that has only numbers, texts, and operators on them.

    Raises:
        UnknownValueError: if there is anything else in it.
    """
    shown = f"'$(eval {plain(expression, 60)})'"
    if len(expression) > _LONGEST:
        raise UnknownValueError(f"{shown} is too long")
    try:
        return str(_value(ast.parse(expression.strip(), mode="eval").body))
    except (SyntaxError, TypeError, ValueError, ArithmeticError, RecursionError, MemoryError) as error:
        if isinstance(error, UnknownValueError):
            raise
        raise UnknownValueError(f"{shown} has no value: {error}") from None


def _value(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=bool() | int() | float() | str() as value):
            return value
        case ast.Name(id=name) if name in _CONSTANTS:
            return _CONSTANTS[name]
        case ast.Attribute(value=ast.Name(id="math"), attr="pi"):
            return math.pi
        case ast.BoolOp(op=ast.And()):
            return _first(node.values, wanted=False)
        case ast.BoolOp():
            return _first(node.values, wanted=True)
        case ast.UnaryOp() if type(node.op) in _UNARY:
            return _UNARY[type(node.op)](_value(node.operand))
        case ast.BinOp() if type(node.op) in _BINARY:
            return _small(_BINARY[type(node.op)], _value(node.left), _value(node.right))
        case ast.Compare() if all(type(each) in _COMPARE for each in node.ops):
            values = [_value(each) for each in (node.left, *node.comparators)]
            return all(map(_compared, node.ops, values, values[1:]))
        case ast.IfExp():
            return _value(node.body if _value(node.test) else node.orelse)
        case ast.List() | ast.Tuple():
            return [_value(each) for each in node.elts]
    raise UnknownValueError(f"'{plain(ast.unparse(node), 60)}' is not evaluated: only numbers, texts and operators are")


def _first(nodes: Sequence[ast.expr], *, wanted: bool) -> Any:
    """Return the first value that counts as wanted, or the last one, as `and` and `or` do."""
    values: Iterator[Any] = map(_value, nodes)
    value = None
    for value in values:
        if bool(value) is wanted:
            break
    return value


def _compared(how: ast.cmpop, left: Any, right: Any) -> bool:
    return bool(_COMPARE[type(how)](left, right))


def _small(how: Callable[[Any, Any], Any], left: Any, right: Any) -> Any:
    """Compute what cannot become large: texts are only put together, and whole numbers have a limit."""
    if (isinstance(left, str | list) or isinstance(right, str | list)) and how is not operator.add:
        raise UnknownValueError("texts can only be added")
    found = how(left, right)
    if isinstance(found, int) and abs(found) > 1 << 64:
        raise UnknownValueError("a number becomes too large")
    return found

"""Runs a launch file in Python in a process of its own, within a fence, and answers with what it declares."""

from __future__ import annotations

import builtins
import importlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

from rbxcompose.base.processes import answer_all, fence
from rbxcompose.domains.programs.launch_files.stand_ins import (
    FILE,
    LET,
    MODULES,
    Data,
    DeclaredAction,
    LaunchContext,
    LaunchDescription,
    UnknownStandIn,
    entity,
    install,
    line_here,
)
from rbxcompose.domains.programs.launch_files.substitutions import SubstitutionContext, UnknownValueError

_OFFERED = (
    "argparse", "ast", "collections", "collections.abc", "contextlib", "copy", "dataclasses", "datetime", "enum",
    "errno", "functools", "getpass", "glob", "inspect", "io", "itertools", "json", "logging", "math", "multiprocessing",
    "operator", "os", "os.path", "pathlib", "platform", "pprint", "random", "re", "shlex", "shutil", "signal", "socket",
    "string", "subprocess", "sys", "tempfile", "textwrap", "threading", "time", "traceback", "types", "typing", "uuid",
    "warnings", "xml", "xml.dom", "xml.dom.minidom", "xml.etree", "xml.etree.ElementTree", "yaml", "__future__",
)  # fmt: skip
"""Modules that a file may import: much of what they do is refused, but not their names."""
_REMOVED = ("rbxcompose", "ctypes", "_ctypes", "resource", "gc")
Errors = list[tuple[str, int]]
_HARMLESS = ("sys._getframe", "os.putenv", "os.unsetenv")


def main() -> None:
    """Answer requests."""
    answer_all(_answer)


def _answer(request: Data, start: float) -> Data:
    context = SubstitutionContext(Path(request["file"]), [*map(Path, request["prefixes"])], request["values"])
    for name in _OFFERED:
        importlib.import_module(name)

    context.environment = dict(os.environ)
    install(context)
    for name in [name for name in sys.modules if name.partition(".")[0] in _REMOVED]:
        del sys.modules[name]
    fence(request["roots"], set(), start, "a launch file", _HARMLESS)
    builtins.__import__ = _limited(builtins.__import__)
    errors: Errors = []
    entities: list[Data] = []
    try:
        entities += _entities(_run(request["text"], request["file"]), context, errors)
    except BaseException as error:  # it may raise anything
        errors.append((_words(error), _line(error)))
    return {"errors": errors, "entities": entities}


def _limited(load: Callable[..., ModuleType]) -> Callable[..., ModuleType]:
    """Return what imports only modules that are here: others would have to be read."""
    here = frozenset((*sys.modules, *MODULES))

    def limited(name: str, *rest: Any, **named: Any) -> ModuleType:
        level = named.get("level", rest[3] if len(rest) > 3 else 0)
        if not level and name not in here:
            raise ModuleNotFoundError(f"it imports '{name}', which is not there", name=name)
        return load(name, *rest, **named)

    return limited


def _run(text: str, file: str) -> Iterable[Any]:
    names: Data = {"__name__": "launch_file", "__file__": file, FILE: True}
    exec(compile(text, file, "exec"), names)  # noqa: S102  (within the fence)
    if "generate_launch_description" not in names:
        raise LookupError("it has no function 'generate_launch_description'")
    found = names["generate_launch_description"]()
    if not isinstance(found, LaunchDescription):
        raise TypeError("'generate_launch_description' returns no LaunchDescription")
    return found.entities


def _entities(actions: Iterable[Any], context: SubstitutionContext, errors: Errors) -> Iterator[Data]:
    """Yield what actions declare; functions among them are called with the values that arguments have up to there."""
    for action in actions:
        if isinstance(action, LaunchDescription):
            yield entity("group", {"scoped": "false"}, _entities(action.entities, context, errors))
        elif not isinstance(action, DeclaredAction):
            raise TypeError(f"a {type(action).__name__} is no action")
        else:
            if isinstance(action, UnknownStandIn) or _holds(action, context):
                _set(action.entity, context)
                action.entity["children"] += _below(action, context, errors)
            if action.kind == "function":
                action.entity |= {"kind": "group"}
                action.entity["attributes"] = {**_condition(action), "scoped": ("false",)}
            yield action.entity


def _condition(action: DeclaredAction) -> Data:
    return {} if action.condition is None else {action.condition.name: action.condition.text}


def _below(action: DeclaredAction, context: SubstitutionContext, errors: Errors) -> list[Data]:
    if action.kind == "function":
        named = action.named
        try:
            found = action.function(LaunchContext(context), *named.get("args") or (), **named.get("kwargs") or {})
            return [*_entities(found or (), context, errors)]
        except BaseException as error:  # the others may be fine
            errors.append((_words(error), _line(error, 1)))
            return []
    is_scoped = action.entity["attributes"].get("scoped") != ("false",)
    inner = replace(context, values=dict(context.values)) if is_scoped else context
    for child in action.entity["children"] if action.kind == "group" else ():
        _set(child, inner)
    return [*_entities(action.actions, inner, errors)]


def _holds(action: DeclaredAction, context: SubstitutionContext) -> bool:
    """Return whether an action is carried out; one whose condition is not known may be."""
    if action.condition is None:
        return True
    try:
        return context.holds(action.condition.text) is (action.condition.name == "if")
    except UnknownValueError:
        return True


def _set(found: Data, context: SubstitutionContext) -> None:
    """Give an argument its value, for the functions that ask for it."""
    given = found["attributes"]
    try:
        if found["kind"] in ("arg", LET) and (value := given.get("default", given.get("value"))) is not None:
            name = context.perform(given["name"])
            if found["kind"] == LET or name not in context.values:
                context.values[name] = context.perform(value)
    except UnknownValueError:  # which is reported where it counts
        return


def _words(error: BaseException) -> str:
    match error:
        case MemoryError() | RecursionError():
            return "it needs more memory or deeper calls than a launch file may"
        case ModuleNotFoundError() | UnknownValueError() | PermissionError():
            return str(error)
        case SystemExit():
            return "it ends the process"
    return f"{type(error).__name__}: {error}"


def _line(error: BaseException, above: int = 2) -> int:
    """Return the line in the file that an error comes from: below this module's own, the first that is no stand-in."""
    if isinstance(error, SyntaxError):
        return error.lineno or 1
    trace = error.__traceback__
    for _ in range(above):
        trace = trace.tb_next if trace is not None else None
    return trace.tb_lineno if trace is not None else line_here()

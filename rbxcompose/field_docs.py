"""The docstrings below the fields of a model: what its keys are for, for editors and the reference.

They are read from the source when something asks for them: a robot can be checked and run without.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import pairwise

FieldDocs = Mapping[str, str]
_Classes = Mapping[str, FieldDocs]  # by qualified name


@cache
def field_docs(model: type) -> FieldDocs:
    """Return the docstring of each field that has one; that of an inherited field stands in the class that has it."""
    found: dict[str, str] = {}
    for cls in reversed(model.__mro__):
        own = _of_module(cls.__module__).get(cls.__qualname__, {})
        for name in inspect.get_annotations(cls):
            found[name] = own.get(name, "")
    return {name: text for name, text in found.items() if text}


@cache
def _of_module(name: str) -> _Classes:
    module = sys.modules.get(name)
    try:
        return dict(_of_body(ast.parse(inspect.getsource(module)).body, "")) if module is not None else {}
    except (OSError, TypeError):  # it has no source, as what is compiled or typed in has none
        return {}


def _of_body(body: list[ast.stmt], prefix: str) -> Iterator[tuple[str, FieldDocs]]:
    """Yield the fields of the classes in a body, at any depth."""
    for statement in body:
        if isinstance(statement, ast.ClassDef):
            name = f"{prefix}{statement.name}"
            yield name, dict(_of_class(statement.body))
            yield from _of_body(statement.body, f"{name}.")
        elif isinstance(statement, ast.FunctionDef):
            yield from _of_body(statement.body, f"{prefix}{statement.name}.<locals>.")


def _of_class(body: list[ast.stmt]) -> Iterator[tuple[str, str]]:
    for field, below in pairwise(body):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                yield name, inspect.cleandoc(text)

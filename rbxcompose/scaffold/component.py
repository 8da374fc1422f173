"""A new component type, as a small distribution of its own, found once it is installed."""

from __future__ import annotations

import importlib.util
import keyword
import sys

from rbxcompose.scaffold.answers import NAME, AnswerError, read_name
from rbxcompose.scaffold.texts import class_name, render
from rbxcompose.sdk.registry import component_names

_CLASSES = frozenset({"Component", "Config", "Field", "Float32", "In", "Level", "Out", "Path", "Ratio"})


def read_component_name(text: str) -> str:
    """Return the name of a new component type, which is also the name of a Python module.

    Raises:
        AnswerError: if it is no valid name, or already has a meaning in Python or rbxcompose.
    """
    name = read_name(text, "a component type", component_names())
    if keyword.iskeyword(name) or keyword.issoftkeyword(name):
        raise _taken(name, "it is a reserved word of Python")
    if name in sys.stdlib_module_names or _is_module(name):
        raise _taken(name, "there is a Python module of that name")
    if not class_name(name).isidentifier() or class_name(name) in _CLASSES:
        raise _taken(name, f"its class would be called '{class_name(name)}'")
    return name


def _is_module(name: str) -> bool:
    spec = importlib.util.find_spec(name)
    return spec is not None and spec.origin is not None  # a plain folder has none


def _taken(name: str, why: str) -> AnswerError:
    finding = NAME.at(None, f"'{name}' cannot be the name of a component type: {why}", help=f"such as 'my_{name}'")
    return AnswerError(finding)


def component_files(name: str) -> dict[str, str]:
    """Return the texts of the distribution by path."""
    said = {"name": name, "distribution": "rbxcompose-" + name.strip("_").replace("_", "-")}
    made = {
        "pyproject.toml": "pyproject.toml",
        "README.md": "README.md",
        f"{name}.py": "component.py",
        f"tests/test_{name}.py": "test.py",
    }
    return {f"{name}/{path}": render(f"component/{template}.j2", **said) for path, template in made.items()}

"""Formats of findings: each is one file here, declared by one decorator, found by its name.

A file whose name would clash with one of Python's ends in an underscore, which is not part of the format's name.
"""

from collections.abc import Callable
from typing import TypeVar

from rbxcompose.base.findings import Report, Sources
from rbxcompose.base.plugins import Plugins

Render = Callable[[Report, Sources, bool], str]
"""Findings, the texts that they point into, whether colours help -> the whole output, ending in a newline if any."""

PLUGINS = Plugins("format", "formats")
R = TypeVar("R", bound=Render)
_RENDERS: dict[str, Render] = {}


def output_format(name: str) -> Callable[[R], R]:
    """Declare the function that writes findings for `--format NAME`."""

    def declare(render: R) -> R:
        _RENDERS[name] = render
        return render

    return declare


def format_names() -> list[str]:
    """Return the names of all formats, sorted."""
    return sorted(name.removesuffix("_") for name in PLUGINS.names())


def renderer(name: str) -> Render:
    """Return the function that writes findings in a format.

    Raises:
        KeyError: if there is no such format.
    """
    if not PLUGINS.load(name):
        PLUGINS.load(f"{name}_")
    return _RENDERS[name]

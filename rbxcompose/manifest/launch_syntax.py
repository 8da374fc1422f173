"""Substitutions of other tools in a manifest: `$(arg speed)` of ROS launch files, `${HOME:-/root}` of shells."""

from __future__ import annotations

import re
from collections.abc import Container
from typing import NamedTuple

from rbxcompose.printable import plain

PATTERN = r"\$\((?P<verb>arg|var|env|optenv|find|find-pkg-share|eval|anon) (?P<of>[^)$]*)\)"
_WITH_DEFAULT = re.compile(r"(?P<name>(?:args\.)?+[A-Za-z_]\w*+)(?P<rest>:?+[-?].*+)", re.DOTALL)
_ARGUMENTS = ("arg", "var")
_PATHS = ("find", "find-pkg-share")


class Cure(NamedTuple):
    """What to do instead, and the text that surely means the same; empty if there is none."""

    help: str
    meant: str = ""


def cure_of_variable(body: str) -> Cure | None:
    """Return the cure of a variable with a default as a shell and Docker Compose have it; None for anything else."""
    found = _WITH_DEFAULT.fullmatch(body.strip())
    if found is None:
        return None
    name, rest = found["name"], plain(found["rest"], 60)
    if name.startswith("args."):
        return Cure(f"write '${{{name}}}', and its 'default' where it is declared below 'args'")
    return Cure(f"write '${{env.{name}{rest}}}'", f"${{env.{name}{found['rest']}}}")


def cure_of(verb: str, of: str, known: Container[str], *, runs: bool) -> Cure:
    """Return the cure of a substitution; `known` are the names to fill in, `runs` tells that it is in a mission."""
    name = of.strip().partition(" ")[0]
    if verb in _ARGUMENTS and runs:
        return Cure(f"write '${name}', and declare '{name}' under 'inputs'")
    if verb in _ARGUMENTS:
        filled = f"${{args.{name}}}"
        if f"args.{name}" in known:
            return Cure(f"write '{filled}'", filled)
        return Cure(f"write '{filled}', and declare '{name}' under 'args'")
    if verb == "env":
        return Cure(f"write '${{env.{name}}}'", f"${{env.{name}}}")
    if verb == "optenv":
        return Cure(f"write '${{env.{name}:-DEFAULT}}'")
    if verb in _PATHS:
        return Cure("a path is relative to the file that writes it: write it without this")
    return Cure("write the value, or fill it in by '${...}'")

"""Robots that ship, compiled once in a session: one takes up to a second, and nothing changes what is compiled."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from rbxcompose.base.findings import Report
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan

ROOT = Path(__file__).parents[1]
OF_THE_TEST = {"PYTEST_CURRENT_TEST"}  # variables of the environment that no robot asks for


def compiled(
    path: str,
    *,
    environment: Mapping[str, str],
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    sets: Sequence[str] = (),
    **others: Any,
) -> Compilation:
    """Compile a robot as `compile_robot` does, if it ships only once; any other one may have changed since."""
    if not others.get("unsaved"):
        others.pop("unsaved", None)
    if overlays or "unsaved" in others or not Path(path).resolve().is_relative_to(ROOT / "robots"):
        return compile_robot(path, environment=environment, profiles=profiles, overlays=overlays, sets=sets, **others)
    variables = tuple(sorted((name, value) for name, value in environment.items() if name not in OF_THE_TEST))
    made = _compiled(os.getcwd(), path, variables, tuple(profiles), tuple(sets), tuple(sorted(others.items())))
    return Compilation(made.robot, made.plan, Report(list(made.report)), dict(made.sources))


@cache
def _compiled(
    folder: str,
    path: str,
    variables: tuple[tuple[str, str], ...],
    profiles: tuple[str, ...],
    sets: tuple[str, ...],
    others: tuple[tuple[str, Any], ...],
) -> Compilation:
    """Compile it; findings name files as they are seen from the folder."""
    return compile_robot(path, environment=dict(variables), profiles=profiles, sets=sets, **dict(others))


def robot_and_plan(name: str, *profiles: str) -> tuple[Robot, Plan]:
    """Return a robot that ships, without a mistake."""
    made = compiled(str(ROOT / "robots" / name), profiles=profiles, environment={})
    assert made.robot
    assert made.plan
    return made.robot, made.plan

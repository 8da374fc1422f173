"""Checking a manifest written in a test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rbxcompose.compiler import Compilation, compile_robot
from rbxcompose.dataclass import dataclass
from rbxcompose.plan.model import Plan
from rbxcompose.rendering.text import render_text


@dataclass(frozen=True, slots=True)
class Checked:
    """The compiler's result for a text."""

    compilation: Compilation

    @property
    def text(self) -> str:
        """Return the findings as a person reads them."""
        return render_text(self.compilation.report, self.compilation.sources)

    @property
    def codes(self) -> list[str]:
        """Return the codes of the findings, by place."""
        return [finding.code for finding in self.compilation.report]

    @property
    def plan(self) -> Plan:
        """Return the plan.

        Raises:
            AssertionError: with the findings, if there is none.
        """
        if self.compilation.plan is None:
            raise AssertionError(self.text)
        return self.compilation.plan


def check_text(
    text: str,
    folder: Path,
    *,
    others: Mapping[str, str] | None = None,
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    sets: Sequence[str] = (),
    real: bool = False,
    environment: Mapping[str, str] | None = None,
) -> Checked:
    """Write `text` to `robot.yaml` in `folder`, with `others` beside it by their paths, and compile the robot."""
    for name, other in {**(others or {}), "robot.yaml": text}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(other, encoding="utf-8")
    file = folder / "robot.yaml"
    return check_file(file, profiles=profiles, overlays=overlays, sets=sets, real=real, environment=environment)


def check_file(
    path: Path,
    *,
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    sets: Sequence[str] = (),
    real: bool = False,
    environment: Mapping[str, str] | None = None,
) -> Checked:
    """Compile a robot's file."""
    return Checked(
        compile_robot(
            str(path),
            profiles=profiles,
            overlays=overlays,
            sets=sets,
            real=real,
            environment=environment or {},
        )
    )

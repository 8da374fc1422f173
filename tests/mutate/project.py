"""A copy of the shipped manifests in which one file is changed, and what must hold of each robot in it."""

from __future__ import annotations

import shutil
import time
import traceback
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from rbxcompose.base.findings import Severity, Span
from rbxcompose.commands.formats import format_names, renderer
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.plan.dump import dump, load
from tests.conftest import ROOT
from tests.mutate.mutants import Mutant, mutant, originals

SLOW = 6.0  # [s] of processor time: three times what any manifest may take, since machines differ by that factor
PLACELESS = {"RBX1103", "RBX1301"}  # what is wrong with a whole file, before there is a text to point into


@dataclass(slots=True)
class Found:
    """What became of some mutants: how many were refused, how many are robots, and the first failure of each kind."""

    examples: int = 0
    refused: int = 0
    codes: Counter[str] = field(default_factory=Counter)
    failures: dict[str, tuple[Mutant, str]] = field(default_factory=dict)

    def add(self, other: Found) -> None:
        """Count what another process has found."""
        self.examples += other.examples
        self.refused += other.refused
        self.codes.update(other.codes)
        self.failures = {**other.failures, **self.failures}


class Project:
    """The manifests in a folder of their own; all robots are tried, or these, with the files that they read."""

    def __init__(self, folder: Path, robots: Collection[str] = ()) -> None:
        self.folder = folder
        self.files = originals()
        for name, data in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        shutil.copytree(ROOT / "parts/body", folder / "parts/body")  # as they are
        names = robots or [name for name in self.files if name.endswith("robot.yaml")]
        self.unchanged = {name: self.compile(name) for name in names}
        self.read = {name: self.read_by(out) for name, out in self.unchanged.items()}
        if robots:
            read = set[str]().union(*self.read.values())
            self.files = {name: data for name, data in self.files.items() if name in read}

    def read_by(self, out: Compilation) -> set[str]:
        """Return the files that a robot is made of, itself included."""
        found = (Path(source) for source in out.sources)
        return {str(path.relative_to(self.folder)) for path in found if path.is_relative_to(self.folder)}

    def judge(self, changed: dict[str, bytes]) -> list[Compilation]:
        """Compile every robot that the change may concern.

        Raises:
            AssertionError: if one of them is neither a robot nor refused, or a finding points nowhere.
        """
        for name, data in changed.items():
            (self.folder / name).write_bytes(data)
        try:
            return [self.compile(robot) for robot, files in self.read.items() if not files.isdisjoint(changed)]
        finally:
            for name in changed:
                (self.folder / name).write_bytes(self.files[name])

    def compile(self, robot: str) -> Compilation:
        """Compile one robot, and write its findings in every format, or its plan."""
        started = time.process_time()
        out = compile_robot(str(self.folder / robot), environment={}, tries_profiles=True)
        assert (out.plan is None) == out.report.has_errors
        for finding in out.report:
            assert finding.message, finding
            assert finding.span or finding.code in PLACELESS, finding
            for span in (finding.span, *(related.span for related in finding.related)):
                assert span is None or is_in_text(span, out.sources), (finding.code, span)
        for name in format_names():
            renderer(name)(out.report, out.sources, False)
        if out.plan is not None:
            text = dump(out.plan)
            again = load(text)
            assert again == out.plan
            assert dump(again) == text
        taken = time.process_time() - started
        assert taken < SLOW, f"{taken:.1f} s"
        return out

    def try_all(self, seeds: Iterable[int]) -> Found:
        """Return what became of the mutants with these seeds."""
        found = Found()
        for seed in seeds:
            one = mutant(seed, self.files)
            found.examples += 1
            try:
                outs = self.judge({one.file: one.data})
            except Exception as error:  # any at all is what is looked for
                last = traceback.extract_tb(error.__traceback__)[-1]
                where = f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno}"
                found.failures.setdefault(where, (one, traceback.format_exc()))
                continue
            found.refused += any(out.report.has_errors for out in outs)
            errors = (finding.code for out in outs for finding in out.report if finding.severity is Severity.ERROR)
            found.codes.update(set(errors))
        return found


def is_in_text(span: Span, sources: dict[str, str]) -> bool:
    """Tell whether a place lies in one of the texts that were read; the end of a text counts."""
    if span.file not in sources:
        return False
    lines = sources[span.file].count("\n") + 1
    return 1 <= span.line <= span.end_line <= lines + 1 and span.column >= 1

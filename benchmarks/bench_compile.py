"""The compiler: robots of many lines and of many components."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml

from benchmarks.generate import of_lines, robot, write
from benchmarks.measuring import BARE, COMMAND, Row, in_turns, program
from rbxcompose.compiler.compile import compile_robot

MEASURES = ("rbxcompose/base", "rbxcompose/manifest", "rbxcompose/compiler", "rbxcompose/domains/diagnostics/checks.py")

LINES, COMPONENTS = 3200, 1000


def rows() -> list[Row]:
    """Return the compiler's figures."""
    with TemporaryDirectory() as folder:
        path = write(of_lines(LINES), Path(folder))
        return [_in_process(path), _whole_command(path), _many_components(Path(folder))]


def _in_process(path: Path) -> Row:
    text = path.read_text(encoding="utf-8")
    ours, peer = in_turns(_compiled(path), lambda: yaml.load(text, Loader=yaml.CSafeLoader), rounds=15)
    return Row(
        name=f"compile {text.count(chr(10)):,} lines, after import",
        unit="ms",
        how="`compile_robot` in one process, beside PyYAML's C loader on the same text",
        ours=ours.median * 1e3,
        p99=ours.p99 * 1e3,
        peer=peer.median * 1e3,
        against="PyYAML CSafeLoader",
        most=150,
        most_ratio=3.5,
    )


def _whole_command(path: Path) -> Row:
    ours, peer = in_turns(program([*COMMAND, "check", str(path)]), program(BARE), rounds=9, clock=time.perf_counter)
    return Row(
        name="`check` of these lines, whole command",
        unit="ms",
        how="from start to exit of the process, beside `python -c pass`",
        ours=ours.median * 1e3,
        p99=ours.p99 * 1e3,
        peer=peer.median * 1e3,
        against="python -c pass",
        most=600,
    )


def _many_components(folder: Path) -> Row:
    path = write(robot(COMPONENTS), folder)
    text = path.read_text(encoding="utf-8")
    ours, peer = in_turns(_compiled(path), lambda: yaml.load(text, Loader=yaml.CSafeLoader), rounds=5)
    return Row(
        name=f"compile {COMPONENTS:,} components",
        unit="ms",
        how=f"`compile_robot`, {text.count(chr(10)):,} lines",
        ours=ours.median * 1e3,
        p99=ours.p99 * 1e3,
        peer=peer.median * 1e3,
        against="PyYAML CSafeLoader",
        most=2000,
        most_ratio=2.0,
    )


def _compiled(path: Path) -> Callable[[], object]:
    def run() -> object:
        out = compile_robot(str(path), environment={})
        if out.plan is None or list(out.report):
            raise ValueError(f"the generated robot has findings: {list(out.report)[:3]}")
        return out

    return run

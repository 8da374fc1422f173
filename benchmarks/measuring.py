"""What benchmarks share: rows of the table, samples taken in turns, runs of programs."""

from __future__ import annotations

import contextlib
import gc
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
COMMAND = [sys.executable, "-m", "rbxcompose"]
BARE = [sys.executable, "-c", "pass"]


@dataclass(frozen=True, slots=True)
class Samples:
    """Times of one thing [s], or other figures of it."""

    values: tuple[float, ...]

    @property
    def median(self) -> float:
        """Return the median."""
        return statistics.median(self.values)

    @property
    def p99(self) -> float:
        """Return what 99 of 100 stay below; of few samples, the largest."""
        ordered = sorted(self.values)
        return ordered[min(len(ordered) - 1, int(len(ordered) * 0.99))]


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table: our figure, that of a peer in the same run, and the bars that they are held to.

    `most` bounds our figure, `most_ratio` ours over the peer's, `least` and `least_ratio` where more is better.
    """

    name: str
    unit: str
    how: str
    ours: float
    p99: float | None = None
    peer: float | None = None
    against: str = ""
    most: float | None = None
    least: float | None = None
    most_ratio: float | None = None
    least_ratio: float | None = None

    @property
    def ratio(self) -> float | None:
        """Return ours over the peer's."""
        return self.ours / self.peer if self.peer else None

    @property
    def met(self) -> bool | None:
        """Tell whether all bars that can be judged are met; None if there is none."""
        bars = [
            (self.ours, self.most, self.least),
            *([(self.ratio, self.most_ratio, self.least_ratio)] if self.ratio is not None else []),
        ]
        judged = [figure <= most for figure, most, _ in bars if most is not None]
        judged += [figure >= least for figure, _, least in bars if least is not None]
        return all(judged) if judged else None

    @property
    def bar(self) -> str:
        """Return the bars in words."""
        words = [f"≤ {self.most:g} {self.unit}"] if self.most is not None else []
        words += [f"≥ {self.least:g} {self.unit}"] if self.least is not None else []
        words += [f"≤ {self.most_ratio:g}x"] if self.most_ratio is not None else []
        words += [f"≥ {self.least_ratio:g}x"] if self.least_ratio is not None else []
        return ", ".join(words)


def in_turns(*jobs: Callable[[], object], rounds: int, clock: Callable[[], float] = time.process_time) -> list[Samples]:
    """Time each job once per round, one after the other, so that what disturbs the machine disturbs all of them.

    The clock is that of the processor, for jobs within this process; others need `time.perf_counter`.
    """
    for job in jobs:
        job()
    times: list[list[float]] = [[] for _ in jobs]
    for _ in range(rounds):
        for job, found in zip(jobs, times, strict=True):
            gc.collect()
            started = clock()
            job()
            found.append(clock() - started)
    return [Samples(tuple(found)) for found in times]


def timed(job: Callable[[], object], rounds: int) -> Samples:
    """Return the wall times of a job alone [s]."""
    return in_turns(job, rounds=rounds, clock=time.perf_counter)[0]


def program(command: Sequence[str], environment: dict[str, str] | None = None) -> Callable[[], object]:
    """Return a job that runs a program to its end.

    Raises:
        CalledProcessError: if it fails.
    """
    # Bytecode is kept, as it is where something is installed, whatever this shell says.
    own = {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": ""}
    whole = {**os.environ, **own, **(environment or {})}

    def run() -> object:
        done = subprocess.run(command, capture_output=True, text=True, env=whole, cwd=ROOT)
        if done.returncode:
            raise subprocess.CalledProcessError(done.returncode, command, done.stdout[-2000:], done.stderr[-2000:])
        return done.stdout

    return run


def memory_of(pid: int) -> int:
    """Return the proportional set size of a process [bytes]: shared pages count in parts."""
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8").splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) * 1024
    return 0


def tree(pid: int) -> list[int]:
    """Return a process, those that it has started, and theirs."""
    children: list[int] = []
    tasks: list[Path] = []
    with contextlib.suppress(FileNotFoundError):  # it has ended meanwhile
        tasks += Path(f"/proc/{pid}/task").iterdir()
    for task in tasks:
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # a thread that has ended meanwhile
            children += map(int, (task / "children").read_text(encoding="ascii").split())
    return [pid, *(found for child in children for found in tree(child))]


def processor_time(pid: int) -> float:
    """Return the time that a process has had a processor, all of its threads together [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_now() -> int:
    """Return the memory that this process has at present [bytes]."""
    return int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * os.sysconf("SC_PAGE_SIZE")

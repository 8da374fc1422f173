"""What each process of the patrol robot takes: `python -m docs.generating.small_machines` measures it again.

It writes `docs/small_machines.json`, from which `make docs` makes the table of the page. Nothing else of rbxcompose may
run in the same environment meanwhile: the proportional set size counts what processes share in parts.
"""

from __future__ import annotations

import json
import platform
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from docs.generating.markdown import table

KEPT = Path(__file__).parents[1] / "small_machines.json"
WAYS: Mapping[str, Sequence[str]] = {
    "as it is": (),
    "with a console": ("--set", "console={}"),
    "in one process": ("--set", "process=world"),
    "`--profile fleet`": ("--profile", "fleet"),
}
ABOUT: Mapping[str, str] = {
    "supervisor": "starts all others, and starts them again",
    "parent": "has all modules; the others are forked from it",
    "router": "where processes, commands and other hosts find each other",
    "world": "simulated hardware: base, battery",
    "robot": "go_to, charger, mux, transforms, diagnostics",
    "mission": "the engine of missions",
    "gateway": "the console's page",
}
_SETTLED = 15.0  # [s] after the start, when the threads that make links have ended
_WATCHED = 15.0  # [s] in which the processor is measured
_MB = 1e6


@dataclass(frozen=True, slots=True)
class Cost:
    """What a process takes: proportional set size [bytes], and share of a core."""

    memory: int
    processor: float


def measured() -> dict[str, dict[str, Cost]]:
    """Return the cost of each process by the way in which the robot is up."""
    from benchmarks.bench_robot import ROBOT, supervisor, up  # only needed to measure

    found = {}
    for name, options in WAYS.items():
        with TemporaryDirectory() as folder:
            environment = {"XDG_RUNTIME_DIR": folder}
            with up(ROBOT, environment, *options):
                time.sleep(_SETTLED)
                found[name] = costs(supervisor(environment))
    return found


def costs(pid: int, watched: float = _WATCHED) -> dict[str, Cost]:
    """Return the cost of a process and of those below it, by their names, after watching them for a time [s].

    One that ends meanwhile is left out.
    """
    from benchmarks.measuring import memory_of, processor_time, tree

    before: dict[int, float] = {}
    began = time.monotonic()
    for one in tree(pid):
        with suppress(FileNotFoundError, ProcessLookupError):
            before[one] = processor_time(one)
    time.sleep(watched)
    lasted = time.monotonic() - began
    found: dict[str, Cost] = {}
    for one, had in before.items():
        with suppress(FileNotFoundError, ProcessLookupError):
            found[name_of(one)] = Cost(memory_of(one), (processor_time(one) - had) / lasted)
    return found


def name_of(pid: int) -> str:
    """Return the name of a process behind that of its robot."""
    title = Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8").rstrip("\0 ")
    return title.rpartition(": ")[2]


def small_machines() -> str:
    """Return the table, from what was measured last."""
    ways: dict[str, dict[str, Any]] = json.loads(KEPT.read_text(encoding="utf-8"))["ways"]
    names = [name for name in ABOUT if any(name in way for way in ways.values())]
    rows = [(f"`{name}`", ABOUT[name], *(_mega(way.get(name)) for way in ways.values())) for name in names]
    whole = [sum(cost["memory"] for cost in way.values()) for way in ways.values()]
    busy = [sum(cost["processor"] for cost in way.values()) for way in ways.values()]
    rows.append(("**all**", "memory [MB]", *(f"**{size / _MB:.0f}**" for size in whole)))
    rows.append(("**all**", "processor [% of a core]", *(f"**{share:.1%}**".replace("%", "") for share in busy)))
    return table(("process", "what it is", *ways), rows)


def _mega(cost: Mapping[str, float] | None) -> str:
    return f"{cost['memory'] / _MB:.0f}" if cost else ""


def main() -> None:
    """Measure, keep it, and print the table."""
    ways = {name: {process: asdict(cost) for process, cost in way.items()} for name, way in measured().items()}
    kept = {"python": platform.python_version(), "machine": platform.machine(), "ways": ways}
    KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(small_machines())


if __name__ == "__main__":
    main()

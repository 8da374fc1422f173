"""Writes `docs/quality.md` from what `make soak` has found, which is in `docs/quality.json`."""

from __future__ import annotations

import json
from pathlib import Path

DOCS = Path(__file__).parent
ABOUT = """# Quality

What random and hostile input has found, by the suites below. `make test` tries a part of each (some hundreds of
examples), `make soak` what stands in the table; a failure becomes a file that is tried in each run from then on.

{table}

- **Mutants of manifests** (`tests/mutate`): one file of the shipped robots, missions and parts is changed, up to three
  times: bytes, lines, keys, values, parts of the tree. Each mutant must be refused, in every format and with places
  that lie in its texts, or be a robot; then its plan, written down and read again, must be the same plan.
- **Random expressions** (`tests/properties`): none may raise what is not declared, reach into an object or the system,
  give a value beyond the limits, or take half a second; each batch has 200 MB.
- **Hostile manifests** (`tests/hostile`): made to take time or memory, to read what they may not, or to write to the
  terminal; each must be refused with a place, within 2 s (times 3 for slow machines) and 200 MB.
- **Storms over simulated robots** (`tests/simulated_faults`): the patrol robot as its real conductor and processes, in
  virtual time, over a network that delays, loses, doubles and reorders; processes are killed and hang, links part,
  components raise, commands make no sense, people stop, release and set parameters, all from one seed. What the run has
  told is judged by `rbxcompose/testing/invariants.py`, which defines what is safe.
- **Disks that fail** (`tests/io`): each call that a writer makes of the system fails once, in each way that a disk can
  fail. Nothing that was there is torn or lost, it is told, and the next try works.
- **Links that fail** (`tests/net`): a proxy before the router delays, slows down, cuts and freezes the links.
- **Faults of processes** (`tests/faults`): each process of a patrolling robot is killed and stopped (`SIGKILL`,
  `SIGSTOP`) in turn, in a random order. What can come back does, and the mission succeeds; else all end in
  order. A process outside of the robot listens: the base moves by live commands alone, and rests in time after the
  last one.
  A page of faults with the test of each is `tests/faults/test_table.py`.
- **Flood of commands** (`tests/faults`): as many messages as a process can send, none of them a command, at the base.
- **Attacks on listeners** (`tests/exposure`): what a running robot listens on, from the kernel's tables, and what
  becomes of nonsense, floods and crowds there.
- **Fuzzing** (`tests/fuzz`, extra `fuzz`): inputs that are led by the code they reach.
"""


def page() -> str:
    """Return the page."""
    rows = json.loads((DOCS / "quality.json").read_text(encoding="utf-8"))
    lines = ["| suite | examples | failures | of these |", "| --- | ---: | ---: | --- |"]
    lines += [f"| {row['suite']} | {row['examples']:,} | {row['failures']} | {row['note']} |" for row in rows]
    return ABOUT.format(table="\n".join(lines))


if __name__ == "__main__":
    (DOCS / "quality.md").write_text(page(), encoding="utf-8")

"""Writes `docs/quality.md` from the results of `make soak` in `docs/quality.json`."""

from __future__ import annotations

import json
from pathlib import Path

DOCS = Path(__file__).parent
ABOUT = """# Quality

Random and hostile input, and faults of processes, hosts, links and disks, look for mistakes that nobody thought of.
`make test` runs a few examples of each suite, `make soak` as many as the table says. An input that fails
becomes a file that every later run tries again. [What the suites do](#what-the-suites-do) stands below the table.

{table}

## What the suites do
- **Mutants of manifests** (`tests/mutate`): change one file of the shipped robots, missions and parts up to three
  times: bytes, lines, keys, values, branches of the tree. Each mutant must either be refused, in every format and with
  places that lie in its texts, or be a robot. Its plan, written and read again, must then be the same plan.
- **Random expressions** (`tests/properties`): none may raise an undeclared exception, reach into an object or the
  system, give a value beyond the limits, or take half a second; each batch has 200 MB.
- **Hostile manifests** (`tests/hostile`): written to take time or memory, to read what they may not, or to write to the
  terminal. Each must be refused with a place, within 2 s (times 3 for slow machines) and 200 MB.
- **Poses of links** (`tests/body`): where every link of a body is at random positions of its joints, by our model, by
  Pinocchio and by yourdfpy. No entry of a matrix may differ by more than 1e-9.
- **Published robots** (`tests/body`): read, check, place and draw the [robots of a public
  package](robots_tried.md), each in a process of its own. Each must be read as Pinocchio reads it and be drawn, or be
  refused with a finding.
- **Storms over simulated robots** (`tests/simulated_faults`): run the patrol robot with its real supervisor and
  processes, in virtual time, over a network that delays, loses, duplicates and reorders. Processes are killed and
  hang, links break, components raise, commands make no sense, people stop, release and set parameters, all from one
  seed. `tests/simulated_faults/safety.py` defines what is safe and judges the record of the run.
- **Disks that fail** (`tests/io`): each system call of a writer fails once, in each way that a disk can
  fail. Existing data is never torn or lost, the failure is reported, and the next try works.
- **Links that fail** (`tests/net`): a proxy before the router delays, slows down, cuts and freezes the links.
- **Faults of processes** (`tests/faults`): kill and stop each process of a patrolling robot (`SIGKILL`, `SIGSTOP`) in
  turn, in a random order. What can come back does, and the mission succeeds; otherwise everything ends in order. A
  process outside the robot listens: the base moves by live commands alone, and rests in time after the last one.
  `tests/faults/test_table.py` has a table of faults with the test of each.
- **Two hosts** (`tests/systems`): the [faults](systems.md#faults) of hosts, links, disks and clocks of a robot that is
  driven from another host.
- **Floods** (`tests/faults`): one process sends the base as many messages as it can, none of them a command; others
  send goals, requests and queries. The patrol continues with the same processes. Liveliness tokens are
  a known limit: a Zenoh session (1.4 to 1.10) keeps the key of every token that has ever crossed one of its links, 9 kB
  each, and searches all of them for the next one. A client that declares 140 tokens a second holds up the robot's
  messages for over 2 s after a minute: the robot then brakes and goes down. The soak floods for 30 s.
- **Attacks on listeners** (`tests/exposure`): find in the kernel's tables what a running robot listens on, and send
  nonsense, floods and crowds there.
- **Fuzzing** (`tests/fuzz`, extra `fuzz`): coverage-guided inputs.
"""


def page() -> str:
    """Return the page."""
    rows = json.loads((DOCS / "quality.json").read_text(encoding="utf-8"))
    lines = ["| suite | examples | failures | of these |", "| --- | ---: | ---: | --- |"]
    lines += [f"| {row['suite']} | {row['examples']:,} | {row['failures']} | {row['note']} |" for row in rows]
    return ABOUT.format(table="\n".join(lines))


if __name__ == "__main__":
    (DOCS / "quality.md").write_text(page(), encoding="utf-8")

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

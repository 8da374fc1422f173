"""Writes `docs/robots_tried.md` from what `make soak` has found in published robots, in `docs/robots_tried.json`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
ABOUT = """# Robots that were tried

The URDF files of the package [example-robot-data](https://github.com/Gepetto/example-robot-data), as they are:
quadrupeds, humanoids, arms, hands and flying robots of many makers. `make soak` reads, checks, places and draws each in
a process of its own if the package is installed.

{table}

- **findings**: what the checks of [bodies](body.md) report, by code. Each kind was compared with the files. The two
  that are refused mimic joints under names without their prefix, and have no links at all; the meshes that do not exist
  are at `package:///`, which names no package, and on the disk of their author.
- **reading** is the processor time to read and check the file, after import; **drawing** that of a picture with all
  libraries that it needs. **memory** is the most that the process had, which is mostly the picture.
- **poses**: the largest difference between an entry of a link's pose and that of Pinocchio, at 20 random positions of
  all joints.
"""


def page() -> str:
    """Return the page."""
    rows = json.loads((DOCS / "robots_tried.json").read_text(encoding="utf-8"))
    lines = [
        "| robot | links | loads | findings | reading | poses | drawn | drawing | memory |",
        "| --- | ---: | --- | --- | ---: | ---: | --- | ---: | ---: |",
    ]
    lines += [f"| {' | '.join(_cells(row))} |" for row in rows]
    return ABOUT.format(table="\n".join(lines))


def _cells(row: dict[str, Any]) -> list[str]:
    codes = ", ".join(f"[{code}](findings/{code}.md): {count}" for code, count in row["findings"].items())
    poses = f"{row['difference']:.0e}" if row["difference"] is not None else row["refused"]
    if not row["loads"]:
        return [row["robot"], "", "**no**", codes, f"{row['reading']:.0f} ms", "", "", "", ""]
    drawing = f"{row['drawing']:.1f} s"
    memory = f"{row['memory']} MB"
    links, reading = str(row["links"]), f"{row['reading']:.0f} ms"
    return [row["robot"], links, "yes", codes, reading, poses, row["drawn"], drawing, memory]


if __name__ == "__main__":
    (DOCS / "robots_tried.md").write_text(page(), encoding="utf-8")

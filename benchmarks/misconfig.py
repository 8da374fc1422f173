"""Figures of the corpus of misconfigured robots: how much of it `check` catches, and how many false alarms it gives.

Run it from the repository's root: `python -m benchmarks.misconfig`, with `--json` for a program, with `--write` to
write `docs/misconfig.md`.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path

from tests.misconfig.corpus import figures
from tests.misconfig.page import page

PAGE = Path(__file__).parents[1] / "docs" / "misconfig.md"


def main(options: list[str]) -> None:
    """Print the figures, or write the page."""
    if "--write" in options:
        PAGE.write_text(page(), encoding="utf-8")
        return
    found = figures()
    if "--json" in options:
        print(json.dumps(asdict(found)))  # noqa: T201 - it is what this script is for
        return
    print(  # noqa: T201
        f"misconfigurations: {found.caught} of {found.wrong} caught at the right line "
        f"({found.kinds_caught} of {found.kinds} kinds), {found.elsewhere} elsewhere, {found.missed} missed; "
        f"{found.false_alarms} false alarms in {found.right} right robots"
    )


if __name__ == "__main__":
    main(sys.argv[1:])

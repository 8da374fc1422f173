"""Writes the generated pages of the documentation: one page per code of a finding.

Run it with `make docs`; a test fails when a page is out of date.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from pathlib import Path

import rbxcompose
from rbxcompose.findings import KINDS

INTRODUCTION = "# Findings\n\nWhat `rbxcompose check` may say, by code.\n\n"


def import_all() -> None:
    """Import every module of the package, so that every kind of finding is declared."""
    for module in pkgutil.walk_packages(rbxcompose.__path__, "rbxcompose."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)


def pages() -> dict[str, str]:
    """Return file name -> text of all pages, the index included."""
    import_all()
    found = {}
    index = INTRODUCTION
    for code, kind in sorted(KINDS.items()):
        title, _, body = kind.doc.strip().partition("\n")
        found[f"{code}.md"] = f"# {code}: {title.rstrip('.')}\n\n{body.strip()}\n".replace("\n\n\n", "\n\n")
        index += f"- [{code}]({code}.md) ({kind.severity.value}): {title.rstrip('.')}\n"
    found["README.md"] = index
    return found


def main(folder: Path) -> None:
    """Write all pages into `folder` and remove those of codes that are gone."""
    folder.mkdir(parents=True, exist_ok=True)
    made = pages()
    for old in folder.glob("*.md"):
        if old.name not in made:
            old.unlink()
    for name, text in made.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "findings")

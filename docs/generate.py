"""Writes what is generated in the documentation, from models, registries and docstrings.

Whole pages: reference, and the manual page. In pages that people write: tables between two comments, and the line of
facts below the title of a finding. Run it with `make docs`; a test fails when a page is out of date.
"""

from __future__ import annotations

from pathlib import Path

from docs.generating import commands, components, controllers, expressions, findings, man, missions, robot, sdk, tables

DOCS = Path(__file__).parent
REFERENCE = "reference"
FOLDERS = ("findings", REFERENCE)  # in them is nothing else


def pages() -> dict[str, str]:
    """Return the path below `docs/` -> text of all pages."""
    reference = {
        "robot": robot.whole_page(),
        "components": components.whole_page(),
        "controllers": controllers.whole_page(),
        "missions": missions.whole_page(),
        "expressions": expressions.whole_page(),
        "commands": commands.whole_page(),
        "sdk": sdk.whole_page(),
    }
    return {
        **{f"findings/{name}": text for name, text in findings.pages().items()},
        **{f"reference/{name}.md": text for name, text in reference.items()},
        man.PAGE: man.whole_page(),
        **{name: tables.filled((DOCS / name).read_text(encoding="utf-8")) for name in tables.PAGES},
    }


def written() -> dict[str, str]:
    """Return the path below `docs/` -> text of the pages that are there."""
    whole = (page for folder in FOLDERS for page in (DOCS / folder).glob("*.md"))
    there = [*whole, *(DOCS / name for name in tables.PAGES), *DOCS.glob(man.PAGE)]
    return {page.relative_to(DOCS).as_posix(): page.read_text(encoding="utf-8") for page in there}


def main() -> None:
    """Write all pages, and remove references of what is gone."""
    made = pages()
    for path in written().keys() - made.keys():
        if path.startswith(REFERENCE):
            (DOCS / path).unlink()
    for path, text in made.items():
        (DOCS / path).parent.mkdir(exist_ok=True)
        (DOCS / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

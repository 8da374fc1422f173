"""The families of codes: what each is about, which packages declare its kinds of findings, the next free code."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import rbxcompose
from docs.generating.markdown import table
from rbxcompose.commands.finding_pages import FAMILIES

_DECLARED = re.compile(r"\w\(\s*\"(RBX\d{4})\"")


def families() -> str:
    """Return a table of the families."""
    homes: dict[str, set[str]] = {family: set() for family in FAMILIES}
    for home, code in declared():
        homes[code[3:5]].add(f"`{home}`")
    rows = [(f"RBX{family}", FAMILIES[family], ", ".join(sorted(packages))) for family, packages in homes.items()]
    return table(("codes", "about", "declared in"), rows)


@cache
def declared() -> tuple[tuple[str, str], ...]:
    """Return the package or module and the code of each kind of finding that ships."""
    [home] = map(Path, rbxcompose.__path__)
    return tuple(
        (path.relative_to(home).parts[0].removesuffix(".py"), code)
        for path in sorted(home.rglob("*.py"))
        for code in _DECLARED.findall(path.read_text(encoding="utf-8"))
    )


def next_code(family: str) -> str:
    """Return the code behind the last one of a family: what was used once is never used for anything else."""
    used = [int(code[5:]) for _, code in declared() if code[3:5] == family]
    return f"RBX{family}{max(used, default=0) + 1:02}"


def main() -> None:
    """Print the next free code of each family."""
    for family, words in FAMILIES.items():
        print(f"{next_code(family)}  {words}")  # noqa: T201


if __name__ == "__main__":
    main()

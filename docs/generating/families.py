"""The families of codes: what each is about, which packages declare its kinds of findings, the next free code."""

from __future__ import annotations

from docs.generating.markdown import table
from rbxcompose.base.plugins import domain_of
from rbxcompose.commands.finding_pages import FAMILIES, declared

LAST = 99  # of a family: a code has four digits


def families() -> str:
    """Return a table of the families."""
    homes: dict[str, set[str]] = {family: set() for family in FAMILIES}
    for module, code in declared():
        domain = domain_of(module)
        homes[code[3:5]].add(f"`domains/{domain}`" if domain else f"`{module.split('.')[1]}`")
    rows = [(f"RBX{family}", FAMILIES[family], ", ".join(sorted(packages))) for family, packages in homes.items()]
    return table(("codes", "about", "declared in"), rows)


def next_code(family: str) -> str:
    """Return the code behind the last one of a family, empty if there is none: no code is ever used again."""
    last = max((int(code[5:]) for _, code in declared() if code[3:5] == family), default=0)
    return f"RBX{family}{last + 1:02}" if last < LAST else ""


def main() -> None:
    """Print the next free code of each family."""
    for family, words in FAMILIES.items():
        print(f"{next_code(family) or f'RBX{family} is full:'}  {words}")  # noqa: T201


if __name__ == "__main__":
    main()

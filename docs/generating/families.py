"""The families of codes: what each is about, which packages declare its kinds of findings, the next free code."""

from __future__ import annotations

from docs.generating.markdown import table
from rbxcompose.commands.finding_pages import FAMILIES, declared


def families() -> str:
    """Return a table of the families."""
    homes: dict[str, set[str]] = {family: set() for family in FAMILIES}
    for module, code in declared():
        homes[code[3:5]].add(f"`{module.split('.')[1]}`")
    rows = [(f"RBX{family}", FAMILIES[family], ", ".join(sorted(packages))) for family, packages in homes.items()]
    return table(("codes", "about", "declared in"), rows)


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

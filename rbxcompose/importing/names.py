"""Names of other programs as names of manifests."""

from __future__ import annotations

from rbxcompose.scaffold.answers import LONGEST_NAME, name_like


class FreeNames:
    """Gives names that manifests may have, each once."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def take(self, wanted: str, otherwise: str) -> str:
        """Return the name that is most like a wanted one and not taken; `otherwise` if none is like it."""
        name = first = name_like(wanted) or otherwise
        count = 1
        while name in self._taken:
            count += 1
            end = f"_{count}"
            name = f"{first[: LONGEST_NAME - len(end)]}{end}"
        self._taken.add(name)
        return name

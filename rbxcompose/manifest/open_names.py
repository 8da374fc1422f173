"""Names of which some could not be read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar

T = TypeVar("T")


class OpenNames(Mapping[str, T]):
    """Things by name; one that may have been among those that could not be read is there, too, with a stand-in."""

    def __init__(self, known: Mapping[str, T], may_have: Callable[[str], bool], stand_in: Callable[[str], T]) -> None:
        self._known, self._may_have, self._stand_in = known, may_have, stand_in

    def __getitem__(self, name: str) -> T:
        if name in self._known:
            return self._known[name]
        if not self._may_have(name):
            raise KeyError(name)
        return self._stand_in(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)

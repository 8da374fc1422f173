"""One public name stands for one thing, and modules are nouns."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from tests.project.package import PACKAGE, files, text_of

TWO_SIDES = {  # what a component sees, as a protocol of the SDK, and the bus's implementation of just that
    "ActionServer",
    "SentGoal",
    "ServedGoal",
    "Window",
}
NOUNS = {"driving", "ray_casting", "tag_docking", "wiring"}  # modules with a noun in `ing` as their name


DEFINITION = re.compile(r"^(?:class (\w+)|([A-Z]\w*)(?:: [^=\n]*)? = )", re.MULTILINE)


def defined(path: Path) -> Iterator[tuple[str, bool]]:
    """Yield the public names of classes and of aliases of types, and whether each is a class."""
    for name, alias in DEFINITION.findall(text_of(path)):
        if name or not alias.isupper():
            yield name or alias, bool(name)


def test_each_public_name_of_a_class_stands_for_nothing_else() -> None:
    places: dict[str, list[str]] = defaultdict(list)
    classes: set[str] = set()
    for path in files():
        for name, is_class in defined(path):
            places[name].append(str(path.relative_to(PACKAGE)))
            classes |= {name} if is_class and not name.startswith("_") else set()
    assert "Node" not in places, "say of what"
    shared = {name: places[name] for name in classes if len(places[name]) > 1}
    assert {name: found for name, found in shared.items() if name not in TWO_SIDES} == {}
    assert shared.keys() == TWO_SIDES  # no exception outlives its reason


def test_no_module_is_named_by_a_verb() -> None:
    found = {path.stem for path in PACKAGE.rglob("*ing.py")}
    assert found == NOUNS, "name a module by a noun; one that ends in `ing` stands in NOUNS above"

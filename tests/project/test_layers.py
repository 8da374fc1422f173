"""Imports point one way: the order of the rooms stands here, once."""

from __future__ import annotations

import re
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

from tests.project import package
from tests.project.package import PACKAGE, imported_by

ROOMS = (
    "base",
    "msgs",
    "manifest",
    "sdk",
    "bus",
    "missions",
    "compiler",
    "runtime",
    "commands",
    "domains",
    "testing",
    "tools",
)
"""Each imports only from itself and from those before it; what stands behind it, it loads by name."""
DOMAINS = {
    "arms": "body servos worlds",
    "bases": "body devices servos worlds",
    "console": "body",
    "navigation": "bases body vision worlds",
    "programs": "body",
    "servos": "body devices",
    "vision": "bases body worlds",
    "worlds": "body",
}
"""Which other domains a domain may import; one that is not named here imports none."""
IMPURE = ("bus", "runtime", "testing", "tools")
"""What the core of a domain does not import: all of it but its plug-ins, a bridge, and what belongs to its commands."""
PLUG_IN = re.compile(r"bridge|components|sections|commands|command_\w+|controllers|importers|bus_types|checks")


def imports(path: Path) -> set[str]:
    """Return the modules of the package that a file imports, wherever in it."""
    found = {
        f"{module}.{taken}" if taken and module in ("rbxcompose", "rbxcompose.domains") else module
        for module, taken in imported_by(path)
    }
    return {name for name in found if name.startswith("rbxcompose.") and name != "rbxcompose.__version__"}


@cache
def files() -> dict[Path, set[str]]:
    return {path: imports(path) for path in package.files()}


def room_of(module: str) -> str:
    return module.split(".")[1]


def domain_of(module: str) -> str:
    return module.split(".")[2]


def module_of(path: Path) -> str:
    return ".".join(("rbxcompose", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


def test_every_module_is_in_a_room() -> None:
    names = {room_of(module_of(path)) for path in files() if path.parent != PACKAGE}
    assert names == set(ROOMS)
    assert {path.name for path in files() if path.parent == PACKAGE} == {"__init__.py", "__main__.py"}


def test_a_room_imports_only_from_those_before_it() -> None:
    wrong = [
        f"{module_of(path)} imports {name}"
        for path, names in files().items()
        if path.parent != PACKAGE
        for name in sorted(names)
        if ROOMS.index(room_of(name)) > ROOMS.index(room_of(module_of(path)))
    ]
    assert wrong == []


def test_a_domain_imports_only_those_domains_that_its_row_names() -> None:
    wrong = [
        f"{module} imports {name}"
        for path, names in files().items()
        if (module := module_of(path)).startswith("rbxcompose.domains.")
        for name in sorted(names)
        if name.startswith("rbxcompose.domains.")
        and domain_of(name) not in (domain_of(module), *DOMAINS.get(domain_of(module), "").split())
    ]
    assert wrong == []
    TopologicalSorter({name: row.split() for name, row in DOMAINS.items()}).prepare()


def test_the_core_of_a_domain_needs_no_bus_and_nothing_that_runs() -> None:
    wrong = [
        f"{module} imports {name}"
        for path, names in files().items()
        if (module := module_of(path)).startswith("rbxcompose.domains.")
        and not any(map(PLUG_IN.fullmatch, module.split(".")[3:4]))
        for name in sorted(names)
        if room_of(name) in IMPURE
    ]
    assert wrong == []

"""The extras with what each brings and weighs: `python -m docs.generating.extras` writes `docs/extras.json`.

It asks the environment of the tests, which has all of them in the versions of `requirements-test.lock`. Bytecode is not
counted. What rbxcompose itself needs is a row of its own, and counted in no other; what two extras share is counted in
both.
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from docs.generating.markdown import code, table

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "docs" / "extras.json"
OURSELVES = ""
"""The row of rbxcompose without extras."""

PURPOSES: Mapping[str, str] = {
    OURSELVES: "all robots",
    "arm": "arms: planning, kinematics, collisions, the scene",
    "console": "the page of a robot, `console: {}`",
    "detector": "networks that find things in pictures",
    "fast": "arms that plan in compiled code",
    "foxglove": "a server for Foxglove and Lichtblick beside the page",
    "gamepad": "driving by a gamepad",
    "graph": "pictures that Graphviz lays out: `graph`, machines of missions, trees of bodies",
    "lerobot": "`record --format lerobot`, data sets for learning",
    "lsp": "`rbxcompose lsp`, the server for editors",
    "mcp": "`rbxcompose mcp`, for clients of the Model Context Protocol",
    "monitors": "monitors of processor, memory, disk and network",
    "navigation": "maps, localisation, ways around obstacles, people",
    "physics": "`simulator: physics`",
    "picture": "`body picture` and `body simplify`",
    "policy": "policies: networks that command joints or the base",
    "serial": "sensors and bases at serial ports",
    "servos": "real Dynamixel servos",
    "vision": "cameras, tags, things on tables",
}
FOR_DEVELOPERS = {"bench", "docs", "fuzz", "test"}
_MB = 1e6


def declared() -> dict[str, list[str]]:
    """Return the requirements of each extra for users, and of rbxcompose itself, as `pyproject.toml` has them."""
    project: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras: dict[str, list[str]] = project["optional-dependencies"]
    users = {name: wanted for name, wanted in extras.items() if name not in FOR_DEVELOPERS}
    return {OURSELVES: project["dependencies"], **dict(sorted(users.items()))}


def closure(wanted: Iterable[str]) -> set[str]:
    """Return the names of the packages that requirements bring here, with all that those need.

    Raises:
        PackageNotFoundError: if one is not installed.
    """
    todo = [Requirement(each) for each in wanted]
    done: dict[str, set[str]] = {}
    while todo:
        one = todo.pop()
        name, extras = canonicalize_name(one.name), one.extras
        if name in done and extras <= done[name]:
            continue
        done[name] = done.get(name, set()) | extras
        todo += _needed_by(name, done[name])
    return set(done)


def _needed_by(name: str, extras: set[str]) -> Iterator[Requirement]:
    for text in metadata.requires(name) or ():
        one = Requirement(text)
        if one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
            yield one


def size_of(name: str) -> int:
    """Return the bytes of an installed package without its bytecode."""
    files = [each for each in metadata.files(name) or () if each.suffix != ".pyc"]
    return sum(path.stat().st_size for each in files if (path := Path(str(each.locate()))).is_file())


def measured() -> dict[str, dict[str, Any]]:
    """Return, for each extra, what it asks for, which packages it brings beside our own, and their bytes."""
    ours = closure(declared()[OURSELVES])
    found = {}
    for name, wanted in declared().items():
        brought = sorted(closure(wanted) - (set() if name == OURSELVES else ours))
        found[name] = {"wanted": wanted, "packages": brought, "bytes": sum(map(size_of, brought))}
    return found


def extras() -> str:
    """Return the table, from what was measured last."""
    kept: dict[str, dict[str, Any]] = json.loads(KEPT.read_text(encoding="utf-8"))
    rows = [
        (code(name) or "*none*", PURPOSES[name], ", ".join(found["packages"]), f"{_mega(found['bytes'])}")
        for name, found in kept.items()
    ]
    return table(("extra", "what for", "packages", "MB"), rows)


def _mega(size: int) -> str:
    return f"{size / _MB:.0f}" if size >= _MB else f"{size / _MB:.1f}"


if __name__ == "__main__":
    KEPT.write_text(json.dumps(measured(), indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(extras())

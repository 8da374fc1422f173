"""What the package costs, room by room: no figure grows, and a limit follows a figure that shrinks.

A room is a package or module at the top of `rbxcompose`, or a folder of those in `WITH_ROOMS`. Who adds a room gives it
a row, and who makes one larger says so here.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.project.package import IMPORT, PACKAGE, ROOT, files, text_of

WITH_ROOMS = ("domains",)
SLACK = 0.02  # by which a figure may lie below its limit before the limit has to follow


class Cost(NamedTuple):
    """What a room costs: lines of code, files, files of 1 to 30 lines of code, and lines of imports."""

    code: int
    files: int
    small: int
    imports: int


ROOMS: dict[str, Cost] = {
    "__init__": Cost(code=1, files=1, small=1, imports=0),
    "__main__": Cost(code=8, files=1, small=1, imports=3),
    "base": Cost(code=3808, files=25, small=3, imports=215),
    "bus": Cost(code=2395, files=17, small=0, imports=162),
    "commands": Cost(code=2716, files=24, small=3, imports=343),
    "compiler": Cost(code=7824, files=53, small=1, imports=881),
    "domains/__init__": Cost(code=0, files=1, small=0, imports=0),
    "domains/arms": Cost(code=12864, files=64, small=1, imports=1118),
    "domains/bases": Cost(code=2194, files=17, small=0, imports=198),
    "domains/body": Cost(code=3609, files=27, small=2, imports=365),
    "domains/console": Cost(code=3606, files=20, small=0, imports=260),
    "domains/devices": Cost(code=1898, files=15, small=0, imports=183),
    "domains/diagnostics": Cost(code=2420, files=23, small=4, imports=212),
    "domains/muxes": Cost(code=2121, files=13, small=1, imports=133),
    "domains/navigation": Cost(code=4167, files=27, small=2, imports=378),
    "domains/policies": Cost(code=889, files=6, small=0, imports=73),
    "domains/power": Cost(code=439, files=5, small=0, imports=31),
    "domains/programs": Cost(code=3848, files=26, small=0, imports=372),
    "domains/servos": Cost(code=7981, files=47, small=2, imports=559),
    "domains/vision": Cost(code=2558, files=24, small=1, imports=302),
    "domains/worlds": Cost(code=4463, files=36, small=3, imports=517),
    "manifest": Cost(code=3590, files=19, small=1, imports=272),
    "missions": Cost(code=12031, files=78, small=3, imports=1030),
    "msgs": Cost(code=1579, files=14, small=3, imports=95),
    "runtime": Cost(code=7773, files=38, small=0, imports=680),
    "sdk": Cost(code=1426, files=8, small=0, imports=162),
    "testing": Cost(code=384, files=5, small=2, imports=57),
    "tools": Cost(code=17808, files=116, small=8, imports=1865),
}
"""Of each room: lines of code, files, files of 1 to 30 lines of code, lines of imports."""

WHOLE = {
    "lines of code": 114389,
    "files": 750,
    "files of 1 to 30 lines of code": 42,
    "lines of imports": 10464,
    "packages at the top": 12,
    "modules at the top": 0,
    "kB of schemas": 370,
    "tell, tells, told": 255,
    "names that are 'one'": 1809,
    "modules that 'check robots/turtlebot' imports": 217,
    "pages of findings in code": 0,
}

STRING_OR_COMMENT = re.compile(
    r"""(^[ \t]*r?)?(?:#[^\n]*|("{3}|'{3})(?:\\.|[^\\])*?\2|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')""",
    re.MULTILINE | re.DOTALL,
)
SMALL = 30  # [lines of code]
PAGE = re.compile(r"\(\s*\"RBX\d{4}\",\s*(?:doc=)?\"\"\"")
TELL = re.compile(r"\b(?:tell|tells|told)\b")


def shown(found: re.Match[str]) -> str:
    """Return what stands for a string or a comment: for a docstring and a comment nothing, else `s` for each line."""
    before = found.string[max(0, found.start() - 200) : found.start()].rstrip()
    is_statement = found[1] is not None and found[2] and before[-1:] not in tuple("([{,=+")
    is_comment = found[0].lstrip().startswith("#")
    return "" if is_statement or is_comment else "\n".join("s" for _ in found[0].split("\n"))


@cache
def cost_of(path: Path) -> tuple[Cost, int]:
    """Return what a file costs, and how often a name in it is `one`."""
    lines = [line for line in STRING_OR_COMMENT.sub(shown, text_of(path)).splitlines() if line.strip()]
    code = "\n".join(lines)
    imports = sum(found[0].count("\n") + 1 for found in IMPORT.finditer(code))
    return Cost(len(lines), 1, int(0 < len(lines) <= SMALL), imports), len(re.findall(r"\bone\b", code))


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return "/".join(parts[: 2 if parts[0] in WITH_ROOMS else 1])


def rooms() -> dict[str, Cost]:
    found: dict[str, list[Cost]] = defaultdict(list)
    for path in files():
        found[room_of(path)].append(cost_of(path)[0])
    return {room: Cost(*map(sum, zip(*costs, strict=True))) for room, costs in sorted(found.items())}


def modules_of_check() -> int:
    """Return how many modules of ours a process imports to check the patrol robot."""
    script = (
        "import sys\nfrom rbxcompose.commands.main import main\nmain(['check', 'robots/turtlebot'])\n"
        "sys.stderr.write(str(sum(name.partition('.')[0] == 'rbxcompose' for name in sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    return int(done.stderr)


def pages_in_code() -> int:
    """Return how many kinds of findings are declared with the text of their page."""
    return sum(len(PAGE.findall(text_of(path))) for path in files())


def whole() -> dict[str, int]:
    costs = rooms()
    at_top = [path for path in PACKAGE.iterdir() if not path.name.startswith("_")]
    return {
        "lines of code": sum(cost[0] for cost in costs.values()),
        "files": len(files()),
        "files of 1 to 30 lines of code": sum(cost[2] for cost in costs.values()),
        "lines of imports": sum(cost[3] for cost in costs.values()),
        "packages at the top": sum((path / "__init__.py").exists() for path in at_top),
        "modules at the top": sum(path.suffix == ".py" for path in at_top),
        "kB of schemas": sum(path.stat().st_size for path in (ROOT / "schemas").iterdir()) // 1000,
        "tell, tells, told": sum(len(TELL.findall(text_of(path))) for path in files()),
        "names that are 'one'": sum(cost_of(path)[1] for path in files()),
        "modules that 'check robots/turtlebot' imports": modules_of_check(),
        "pages of findings in code": pages_in_code(),
    }


def is_off(found: int, limit: int) -> bool:
    return not (1 - SLACK) * limit <= found <= limit


def test_every_room_keeps_its_budget() -> None:
    found = rooms()
    off = [
        f'    "{room}": {cost},'
        for room, cost in found.items()
        if room not in ROOMS or any(map(is_off, cost, ROOMS[room]))
    ]
    gone = sorted(ROOMS.keys() - found.keys())
    assert off == [], f"make these rooms smaller, or write these rows into ROOMS:\n{chr(10).join(off)}"
    assert gone == [], f"take these rows out of ROOMS: {gone}"


def test_the_whole_keeps_its_budget() -> None:
    off = [f'    "{name}": {value},' for name, value in whole().items() if is_off(value, WHOLE.get(name, -1))]
    assert off == [], f"make these figures smaller, or write these rows into WHOLE:\n{chr(10).join(off)}"

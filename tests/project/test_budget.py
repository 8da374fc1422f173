"""What the package costs, room by room: no figure grows, and a limit follows a figure that shrinks.

A room is a package or module at the top of `rbxcompose`, or a folder of those in `WITH_ROOMS`. Who adds a room gives it
a row, and who makes one larger says so here.
"""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tokenize
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.project.package import PACKAGE, ROOT, files, text_of

pytestmark = pytest.mark.timeout(100)
WITH_ROOMS = ("domains",)
SLACK = 0.02  # by which a figure may lie below its limit before the limit has to follow


class Cost(NamedTuple):
    """What a room costs: lines of code, files, files of at most 30 lines of code, and lines of imports."""

    code: int
    files: int
    small: int
    imports: int


ROOMS: dict[str, tuple[int, int, int, int]] = {
    "__init__": (1, 1, 1, 0),
    "__main__": (4, 1, 1, 2),
    "actuation": (1964, 30, 8, 213),
    "arm_config": (168, 1, 0, 32),
    "arm_goals": (131, 1, 0, 30),
    "arm_hand": (122, 1, 0, 21),
    "arm_location": (58, 1, 0, 9),
    "arm_model": (23, 1, 1, 6),
    "arm_moveit": (108, 1, 0, 21),
    "arm_pictures": (40, 1, 0, 9),
    "arm_processes": (110, 1, 0, 16),
    "arm_servo": (110, 1, 0, 15),
    "atomic_files": (37, 1, 0, 6),
    "body": (3092, 36, 4, 353),
    "bus": (2413, 31, 5, 246),
    "bus_types": (11, 2, 2, 6),
    "check_runner": (76, 1, 0, 13),
    "checks": (4475, 137, 83, 1188),
    "cli": (11009, 166, 43, 2127),
    "clock": (92, 1, 0, 5),
    "cloud_config": (21, 1, 1, 5),
    "compiler": (137, 1, 0, 21),
    "components": (3359, 28, 5, 639),
    "composition": (1673, 18, 4, 241),
    "config": (124, 1, 0, 20),
    "control": (1631, 17, 2, 144),
    "controller_interface": (143, 1, 0, 16),
    "controller_manager": (98, 1, 0, 6),
    "controller_requests": (34, 1, 0, 4),
    "controllers": (933, 7, 1, 127),
    "dataclass": (106, 1, 0, 7),
    "devices": (378, 6, 1, 30),
    "diagnostics": (1118, 13, 2, 76),
    "doctor": (872, 18, 5, 140),
    "edits": (98, 1, 0, 5),
    "endpoints": (47, 1, 0, 6),
    "executive": (954, 13, 2, 124),
    "exporting": (515, 7, 1, 56),
    "expressions": (1370, 12, 3, 154),
    "fence": (55, 1, 0, 9),
    "field_docs": (37, 1, 0, 7),
    "finding_pages": (59, 1, 0, 9),
    "findings": (229, 1, 0, 11),
    "foreign_units": (40, 1, 0, 3),
    "formats": (20, 1, 1, 5),
    "geometry": (125, 1, 0, 4),
    "hand_config": (30, 1, 1, 5),
    "importing": (2239, 26, 5, 276),
    "inspection": (1634, 22, 1, 175),
    "key_feed": (27, 1, 1, 3),
    "levels": (12, 1, 1, 2),
    "lsp": (2184, 22, 1, 259),
    "manifest": (4004, 71, 40, 557),
    "mission_tests": (2156, 25, 4, 311),
    "missions": (9571, 187, 74, 1698),
    "model": (1166, 18, 4, 206),
    "monitors": (147, 5, 2, 19),
    "motion": (7625, 78, 7, 846),
    "msgs": (5654, 43, 13, 301),
    "mux": (796, 12, 2, 70),
    "navigation": (113, 3, 1, 8),
    "params": (453, 6, 2, 51),
    "per_compile": (39, 1, 0, 8),
    "plan": (574, 7, 2, 57),
    "plugins": (83, 1, 0, 10),
    "printable": (37, 1, 0, 3),
    "process_end": (11, 1, 1, 4),
    "qos": (12, 1, 1, 2),
    "recording": (681, 13, 6, 109),
    "references": (66, 1, 0, 6),
    "regular_files": (23, 1, 1, 5),
    "rendering": (230, 5, 1, 26),
    "replay": (432, 7, 2, 86),
    "requests": (42, 1, 0, 6),
    "restarts": (11, 1, 1, 4),
    "robot_events": (20, 1, 1, 2),
    "rules": (43, 1, 0, 8),
    "runtime": (6436, 69, 17, 808),
    "scaffold": (427, 9, 2, 68),
    "scene_requests": (75, 1, 0, 8),
    "scene_view": (59, 1, 0, 9),
    "scheduler": (100, 1, 0, 6),
    "schema": (938, 13, 3, 148),
    "sdk": (860, 8, 0, 116),
    "sections": (2825, 28, 9, 422),
    "servo_bus_config": (130, 1, 0, 22),
    "servo_bus_line": (41, 1, 0, 12),
    "servo_report": (38, 1, 0, 12),
    "sim": (145, 4, 2, 10),
    "skills": (15, 2, 2, 2),
    "slips": (58, 1, 0, 9),
    "systems": (1602, 16, 1, 185),
    "testing": (609, 9, 3, 100),
    "twins": (850, 10, 1, 66),
    "typed_json": (101, 1, 0, 8),
    "units": (250, 1, 0, 9),
}
"""Of each room: lines of code, files, files of at most 30 lines of code, lines of imports."""

WHOLE = {
    "lines of code": 93_894,
    "files": 1_312,
    "files of at most 30 lines of code": 391,
    "lines of imports": 13_330,
    "packages at the top": 43,
    "modules at the top": 51,
    "kB of schemas": 1_178,
    "tell, tells, told": 1_498,
    "names that are 'one'": 7_112,
    "modules that 'check robots/turtlebot' imports": 640,
    "pages of findings in code": 268,
}

SKIPPED = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    tokenize.ENDMARKER,
}
ENDS = (tokenize.NEWLINE, tokenize.ENDMARKER)  # of a statement
SMALL = 30  # [lines of code]
PAGE = re.compile(r"\(\s*\"RBX\d{4}\",\s*(?:doc=)?\"\"\"")
TELL = re.compile(r"\b(?:tell|tells|told)\b")


@cache
def cost_of(path: Path) -> tuple[Cost, int]:
    """Return what a file costs, and how often a name in it is `one`."""
    code = imports = ones = 0
    statement: list[tokenize.TokenInfo] = []
    for token in tokenize.generate_tokens(io.StringIO(text_of(path)).readline):
        ones += token.type == tokenize.NAME and token.string == "one"
        if token.type not in SKIPPED:
            statement.append(token)
        elif token.type in ENDS and statement:
            if any(part.type != tokenize.STRING for part in statement):  # no docstring
                lines = len({line for part in statement for line in range(part.start[0], part.end[0] + 1)})
                code += lines
                imports += lines if statement[0].string in ("from", "import") else 0
            statement = []
    return Cost(code, 1, int(code <= SMALL), imports), ones


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return "/".join(parts[: 2 if parts[0] in WITH_ROOMS else 1])


def rooms() -> dict[str, tuple[int, int, int, int]]:
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
        "files of at most 30 lines of code": sum(cost[2] for cost in costs.values()),
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
        f'    "{room}": {tuple(cost)},'
        for room, cost in found.items()
        if room not in ROOMS or any(map(is_off, cost, ROOMS[room]))
    ]
    gone = sorted(ROOMS.keys() - found.keys())
    assert off == [], f"make these rooms smaller, or write these rows into ROOMS:\n{chr(10).join(off)}"
    assert gone == [], f"take these rows out of ROOMS: {gone}"


def test_the_whole_keeps_its_budget() -> None:
    off = [f'    "{name}": {value},' for name, value in whole().items() if is_off(value, WHOLE.get(name, -1))]
    assert off == [], f"make these figures smaller, or write these rows into WHOLE:\n{chr(10).join(off)}"

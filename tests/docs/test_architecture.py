"""The architecture page is true to the tree: rooms and domains, stages, files, families of codes."""

from __future__ import annotations

import ast
import re

from tests.docs.examples import ROOT
from tests.project.test_layers import DOMAINS, ROOMS

PACKAGE = ROOT / "rbxcompose"
PAGE = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
MAP = PAGE.partition("## Package map\n")[2].partition("\n## ")[0]
PICTURE = MAP.split("```")[1].strip().splitlines()
STAGES = re.findall(r"^\d+\. \*\*.+?\*\* by `(\w+)` in `([\w/.]+)`", PAGE, re.MULTILINE)
FILE = re.compile(r"`([\w/]+\.py)`")
ITEM = re.compile(r"^- `([\w/]+)`: (.*(?:\n  .*)*)", re.MULTILINE)
THERE = {path.name for path in (PACKAGE / "domains").iterdir() if (path / "__init__.py").exists()}


def calls_of(file: str, function: str) -> list[str]:
    """Return the names that a function calls, in the order of the text."""
    [found] = [node for node in functions(file) if node.name == function]
    calls = [node for node in ast.walk(found) if isinstance(node, ast.Call)]
    ordered = [call.func for call in sorted(calls, key=lambda call: (call.lineno, call.col_offset))]
    return [call.attr if isinstance(call, ast.Attribute) else getattr(call, "id", "") for call in ordered]


def functions(file: str) -> list[ast.FunctionDef]:
    tree = ast.parse((PACKAGE / file).read_text(encoding="utf-8"))
    return [node for node in tree.body if isinstance(node, ast.FunctionDef)]


def test_the_picture_has_the_rooms_in_the_order_of_imports_and_fits_a_screen() -> None:
    assert re.findall(r"^[├└]── (\w+)/", "\n".join(PICTURE), re.MULTILINE) == list(ROOMS)
    assert len(PICTURE) <= 30
    assert max(map(len, PICTURE)) <= 80


def test_the_picture_has_every_domain_below_those_that_it_imports() -> None:
    rows = re.findall(r"^│   [├└]── (\w+)/(?:.*may import ([\w, ]+))?", "\n".join(PICTURE), re.MULTILINE)
    assert {name: " ".join(others.split(", ")) for name, others in rows if others} == DOMAINS
    names = [name for name, _ in rows]
    assert sorted(names) == sorted(THERE)
    assert all(names.index(other) < names.index(name) for name, row in DOMAINS.items() for other in row.split())


def test_the_lists_below_the_picture_have_every_room_and_every_domain() -> None:
    named = [name for name, _ in ITEM.findall(MAP)]
    assert [name for name in named if "/" not in name] == list(ROOMS)
    assert {name.removeprefix("domains/") for name in named if "/" in name} == THERE


def test_every_stage_is_a_function_of_the_file_that_is_named() -> None:
    assert len(STAGES) == 8
    assert [name for name, file in STAGES if name not in {function.name for function in functions(file)}] == []


def test_the_compiler_calls_the_stages_in_this_order() -> None:
    names = [name for name, _ in STAGES]
    called = [name for name in calls_of("compiler/compile.py", "compile_robot") if name in names]
    assert called == names[:4]


def test_up_compiles_and_then_runs_the_plan() -> None:
    called = calls_of("tools/commands/up.py", "run")
    assert called.index("compiled") < called.index("run_plan")
    assert "compile_robot" in calls_of("commands/targets.py", "compiled")
    assert "start_supervisor" in calls_of("tools/run_view.py", "run_plan")


def test_every_family_of_codes_has_a_row_and_every_row_a_family() -> None:
    rows = set(re.findall(r"^\| (RBX\d\d) \|", PAGE, re.MULTILINE))
    assert rows == {page.stem[:5] for page in (ROOT / "docs/findings").glob("RBX*.md")}


def test_every_file_that_is_named_exists() -> None:
    homes = (PACKAGE, *(PACKAGE / room for room in ("runtime", "runtime/supervision", "runtime/process_group")), ROOT)
    files = set(FILE.findall(ITEM.sub("", PAGE)))
    assert [file for file in files if not any((home / file).exists() for home in homes)] == []


def test_every_file_that_an_item_of_the_map_names_is_in_its_room() -> None:
    items = [(PACKAGE / room, FILE.findall(text)) for room, text in ITEM.findall(MAP)]
    assert [f"{home}: {file}" for home, files in items for file in files if not any(home.rglob(file))] == []

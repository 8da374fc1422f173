"""The architecture page is true to the tree: rooms, stages, families of codes."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.docs.examples import ROOT
from tests.project.test_layers import DOMAINS, ROOMS

PACKAGE = ROOT / "rbxcompose"
PAGE = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
MAP = re.findall(r"^- `(\w+)`: ", PAGE.partition("## Package map\n")[2].partition("\n## ")[0], re.MULTILINE)
STAGES = re.findall(r"^\d+\. \*\*.+?\*\* by `(\w+)` in `([\w/.]+)`", PAGE, re.MULTILINE)


def calls_of(file: str, function: str) -> list[str]:
    """Return the names that a function calls, in the order of the text."""
    [found] = [node for node in functions(file) if node.name == function]
    calls = [node for node in ast.walk(found) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    ordered = sorted(calls, key=lambda call: (call.lineno, call.col_offset))
    return [call.func.id for call in ordered if isinstance(call.func, ast.Name)]


def functions(file: str) -> list[ast.FunctionDef]:
    tree = ast.parse(place(file).read_text(encoding="utf-8"))
    return [node for node in tree.body if isinstance(node, ast.FunctionDef)]


def place(file: str) -> Path:
    """Return the file that the page names, from the package, a room of it, or the repository."""
    rooms = (PACKAGE / room for room in (*ROOMS, "runtime/supervision", "runtime/process_group"))
    domains = (path for path in (PACKAGE / "domains").iterdir() if path.is_dir())
    return next((home / file for home in (PACKAGE, *rooms, *domains, ROOT) if (home / file).exists()), PACKAGE / file)


def test_the_map_names_every_room_in_its_order_and_every_domain() -> None:
    domains = {path.parent.name for path in (PACKAGE / "domains").glob("*/__init__.py")}
    assert [name for name in MAP if name not in domains] == list(ROOMS)
    assert {name for name in MAP if name not in ROOMS} == domains
    assert domains > DOMAINS.keys()


def test_every_stage_is_a_function_of_the_file_that_is_named() -> None:
    assert len(STAGES) == 8
    assert [name for name, file in STAGES if name not in {function.name for function in functions(file)}] == []


def test_the_compiler_calls_the_stages_in_this_order() -> None:
    names = [name for name, _ in STAGES]
    called = [name for name in calls_of("compiler/compile.py", "compile_robot") if name in names]
    assert called == names[:4]


def test_up_compiles_and_then_runs_the_plan() -> None:
    assert [name for name in calls_of("tools/commands/up.py", "run") if name in ("compile_robot", "run_plan")] == [
        "compile_robot",
        "run_plan",
    ]
    assert "start_supervisor" in calls_of("tools/run_view.py", "run_plan")


def test_every_family_of_codes_is_told_and_every_one_that_is_told_exists() -> None:
    told = set(re.findall(r"^\| (RBX\d\d) \|", PAGE, re.MULTILINE))
    assert told == {page.stem[:5] for page in (ROOT / "docs/findings").glob("RBX*.md")}


def test_every_file_that_is_named_exists() -> None:
    files = set(re.findall(r"`([\w/]+\.py)`", PAGE))
    assert [file for file in files if not place(file).exists()] == []

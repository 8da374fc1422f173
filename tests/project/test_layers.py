"""Imports point one way: who may import whom stands here, once."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "rbxcompose"

# Each part may import those before it in its row, the rows of BASE, and itself.
BASE = {
    "units",
    "expressions",
    "findings",
    "formats",
    "clock",
    "config",
    "edits",
    "geometry",
    "msgs",
    "plain",
    "plugins",
    "qos",
    "regular_files",
    "replacing",
    "restarts",
    "rules",
    "scheduler",
}
CORES = {"body", "diagnostics", "missions", "mux", "navigation", "params", "sim"}
MAY_IMPORT: dict[str, set[str]] = {
    **dict.fromkeys(BASE, BASE),
    **{core: BASE | {core} for core in CORES},
    "missions": BASE | {"missions", "manifest.brackets", "manifest.scalars", "manifest.tree", "diagnostics.levels"},
    "sim": BASE | {"sim", "diagnostics.levels"},
    "sdk": BASE | {"sdk", "diagnostics.levels"},
    "skills": BASE | {"sdk"},
    "executive": BASE | CORES | {"executive", "sdk"},
    "components": BASE | CORES | {"executive", "sdk"},
    "bus": BASE | {"bus", "sdk.bound"},
    "manifest": BASE | {"manifest", "sdk"},
    "recording": BASE
    | {
        "recording",
        "bus.attachment",
        "bus.classes",
        "bus.names",
        "bus.tokens",
        "bus.transport",
        "bus.witness",
    },
    "rendering": BASE | {"rendering"},
    "model": BASE | CORES | {"model", "manifest", "sdk"},
    "checking": BASE | {"missions", "model"},
    "checks": BASE | CORES | {"checks", "checking", "model", "manifest", "sdk"},
    "plan": BASE | CORES | {"plan", "model", "manifest.shapes", "manifest.tree", "manifest.validate", "sdk"},
    "scaffold": BASE | {"missions", "scaffold", "manifest.files", "sdk"},
    "seeing": BASE | CORES | {"seeing", "plan", "model", "manifest", "schema", "sdk", "bus.names", "bus.wire"},
    "schema": BASE | {"missions", "schema", "manifest", "sdk"},
}


def part_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def imports(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return {name for name in found if name.startswith("rbxcompose.")}


def files() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def allowed(name: str, permitted: set[str]) -> bool:
    path = name.removeprefix("rbxcompose.")
    return any(path == one or path.startswith(f"{one}.") or one.startswith(f"{path}.") for one in permitted)


@pytest.mark.parametrize("path", files(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_module_imports_only_from_the_layers_below_it(path: Path) -> None:
    part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    if part not in MAY_IMPORT:
        return  # the upper layers may import everything; what they are is tested below
    wrong = {name for name in imports(path) if not allowed(name, MAY_IMPORT[part] | {part})}
    assert wrong == set()


def test_every_part_has_its_place() -> None:
    upper = {
        "compiler",
        "doctor",
        "pages",
        "rerun",
        "runtime",
        "cli",
        "lsp",
        "testing",
        "trials",
        "__init__",
        "__main__",
    }
    parts = {path.name.removesuffix(".py") for path in PACKAGE.iterdir() if path.suffix == ".py" or path.is_dir()}
    parts -= {"__pycache__", "py.typed"}
    assert parts - set(MAY_IMPORT) - upper == set()


def test_only_the_command_line_imports_the_command_line() -> None:
    others = [path for path in files() if "cli" not in path.relative_to(PACKAGE).parts]
    importing = {path for path in others if any(name.startswith("rbxcompose.cli") for name in imports(path))}
    assert importing <= {PACKAGE / "__main__.py"}

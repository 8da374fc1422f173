"""A new part: a file with arguments that robots include, and a test with two instances of it in one robot."""

from __future__ import annotations

from rbxcompose.scaffold.texts import render

ABOUT = "A simulated battery, and the group of its status."


def part_files(name: str, about: str = ABOUT) -> dict[str, str]:
    """Return the texts of the part's file and its test, by path."""
    return {
        f"parts/{name}.yaml": render("part.yaml.j2", name=name, about=about),
        f"tests/test_{name}.py": render("part_test.py.j2", name=name),
    }

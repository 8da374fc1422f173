"""The outline shows what a manifest names, and the steps and states of a mission."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.tools.lsp.answers import OutlineEntry, outline
from tests.conftest import ROOT
from tests.loops import for_all
from tests.lsp.places import PATROL, ROBOT


def shown(entries: tuple[OutlineEntry, ...], level: int = 0) -> list[str]:
    return [
        line
        for entry in entries
        for line in (f"{'  ' * level}{entry.name} {entry.detail}".rstrip(), *shown(entry.below, level + 1))
    ]


def outlined(path: Path) -> list[str]:
    return shown(tuple(outline(path.read_text(encoding="utf-8"))))


def test_a_robot_is_shown_by_its_sections_and_names() -> None:
    lines = outlined(ROBOT)
    assert lines[:3] == ["args", "  speed speed", "places"]
    assert lines[lines.index("components") + 1] == "  battery battery_sim"


def test_a_mission_is_shown_by_its_steps() -> None:
    assert outlined(PATROL) == [
        "inputs",
        "  rounds count",
        "  low ratio",
        "interrupts",
        "  battery_low",
        "    go_to dock",
        "    recharge",
        "do",
        "  repeat $rounds",
        "    for corner",
        "      go_to $corner",
    ]


@for_all("path", sorted((ROOT / "missions").glob("*.yaml")))
def test_each_name_lies_within_its_entry(path: Path) -> None:
    def check(entry: OutlineEntry) -> None:
        assert entry.span.contains(entry.key)
        for outline_entry in entry.below:
            assert entry.span.contains(outline_entry.span)
            check(outline_entry)

    for entry in outline(path.read_text(encoding="utf-8")):
        check(entry)


def test_a_text_that_is_no_yaml_has_no_outline() -> None:
    assert outline("components: [") == []

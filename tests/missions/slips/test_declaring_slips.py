"""How slips are declared: their order never depends on chance, and each repairs a node once at most."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.base.findings import Report
from rbxcompose.manifest.slips import Repair, Slips, repaired

Find = Callable[[str, str], Repair[str] | None]


def family() -> Slips[Find]:
    return Slips("rbxcompose.commands.formats")  # any package whose files declare none


def replacing(old: str, new: str) -> Find:
    return lambda place, node: Repair(node.replace(old, new, 1), ()) if old in node else None


def named(name: str, find: Find) -> Find:
    find.__name__ = name
    return find


def test_slips_of_a_place_come_by_name_but_for_what_they_say_themselves() -> None:
    slips = family()
    names = ("c", "b", "a", "d")
    c, b, a, d = (named(name, replacing("x", name)) for name in names)
    for find in (c, b):
        slips("here")(find)
    slips("here", after=(c,))(a)
    slips("here", "there", before=(b,))(d)
    assert [find.__name__ for find in slips.at("here")] == ["c", "d", "a", "b"]
    assert slips.at("there") == [d]
    assert slips.at("nowhere") == []


def test_what_one_slip_uncovers_another_repairs() -> None:
    report = Report()
    assert repaired([replacing("b", "c"), replacing("a", "b")], "place", "a", report) == "c"


def test_slips_that_undo_each_other_come_to_an_end() -> None:
    assert repaired([replacing("a", "b"), replacing("b", "a")], "place", "a", Report()) == "a"

"""Graphs of robots with many missions and joints: what is alike is one box or one wire, and the tables have all."""

from __future__ import annotations

import pytest

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.tools.inspection.diagram import MANY, BoxShape, Diagram, diagram_of, folded
from rbxcompose.tools.inspection.pages import html
from tests.conftest import ROOT


@pytest.fixture(scope="module")
def porter() -> Diagram:
    robot = compile_robot(str(ROOT / "robots/porter"), environment={}).robot
    assert robot
    return diagram_of(robot)


def test_many_missions_and_open_wires_are_folded(porter: Diagram) -> None:
    drawn = folded(porter)
    programs = [box for box in porter.boxes if box.shape is BoxShape.PROGRAM]
    [fold] = [box for box in drawn.boxes if box.shape is BoxShape.PROGRAM]
    assert (fold.name, fold.about) == (f"{len(programs)} missions", ", ".join(box.name for box in programs))
    assert drawn.runs == (("mission", fold.key),)
    known = {box.key for box in drawn.boxes}
    assert {tip.box for wire in drawn.wires for tip in (*wire.sources, *wire.targets)} <= known
    whole, names = {wire.name for wire in porter.wires}, {wire.name for wire in drawn.wires}
    assert {name.partition(" ")[2] for name in names - whole} == {"services", "topics"}
    connected = {wire.name for wire in porter.wires if wire.sources and wire.targets}
    assert connected <= names


def test_the_tables_have_what_is_folded(porter: Diagram) -> None:
    tables = html(folded(porter), porter).partition("<h2>Components")[2]
    assert all(f"<td>{box.name}<" in tables for box in porter.boxes)
    assert all(f"<td>{wire.name}<" in tables for wire in porter.wires)


def test_the_start_mission_keeps_its_box_and_few_are_drawn_as_they_are(porter: Diagram) -> None:
    start = next(box.key for box in porter.boxes if box.shape is BoxShape.PROGRAM)
    drawn = folded(Diagram(porter.robot, "", porter.groups, porter.boxes, porter.wires, porter.runs, start))
    assert start in [box.key for box in drawn.boxes]
    few = Diagram("few", "", porter.groups, porter.boxes[:MANY], (), ())
    assert folded(few) == few

"""What is left of a value with mistakes: all that could be read, and stand-ins for the rest."""

from __future__ import annotations

from typing import TypeVar

import pytest

from rbxcompose.domains.diagnostics.settings import AnalyzerModel
from rbxcompose.domains.muxes.sections.muxes import MuxModel
from rbxcompose.domains.power.components.battery_sim import BatterySimConfig
from rbxcompose.domains.worlds.components.camera_sim import CameraSimConfig
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.section import ComponentOptions
from rbxcompose.manifest.validate import salvaged

M = TypeVar("M")


def left(model: type[M], text: str) -> M | None:
    root, findings = read_text(text, "robot.yaml")
    assert root is not None, findings
    return salvaged(model, root)


def test_a_wrong_value_has_its_default_and_the_others_stay() -> None:
    read = left(BatterySimConfig, "{runtime: 45 s, initial: full, warn: 60 %}")
    assert read is not None
    assert (read.runtime, read.initial, read.warn) == (45.0, 1.0, 0.6)


@pytest.mark.parametrize("text", ["{warn: 60 %}", "{runtime: long, warn: 60 %}", "{runtme: 5 s, warn: 60 %}"])
def test_what_must_be_there_gets_a_stand_in(text: str) -> None:
    read = left(BatterySimConfig, text)
    assert read is not None
    assert (read.warn, read.runtime) == (0.6, 1.0)


def test_an_input_of_a_mux_keeps_its_name_and_its_source() -> None:
    read = left(MuxModel, "{inputs: {a: {from: go_to, priority: high}, b: {priority: 1, timeout: 1 s}}, locks: 5}")
    assert read is not None
    assert {name: mux_input.source for name, mux_input in read.inputs.items()} == {"a": "go_to", "b": None}


def test_the_items_of_a_list_keep_their_places() -> None:
    read = left(AnalyzerModel, "match: [base, [go_to], charger]")
    assert read is not None
    assert (read.conditions[0], read.conditions[2]) == ("base", "charger")


def test_one_wrong_topic_leaves_the_others_connected() -> None:
    read = left(ComponentOptions, "connect: {odom: wheels/odom, cmd_vel: [x]}")
    assert read is not None
    assert read.connect["odom"] == "wheels/odom"


def test_a_list_that_needs_another_item_has_its_default() -> None:
    read = left(CameraSimConfig, "{frame: base_footprint, size: [320]}")
    assert read is not None
    assert (read.frame, read.size) == ("base_footprint", (320, 240))


@pytest.mark.parametrize("text", ["word", "[a, b]", "inputs: {}"])
def test_nothing_is_left_of_what_is_no_such_thing(text: str) -> None:
    assert left(MuxModel, text) is None

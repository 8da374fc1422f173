"""A type of bus from elsewhere is a file: robots name it, its models are known, and its driver is opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.domains.servos import bus as bus_types
from rbxcompose.domains.servos.bus import ServoBus
from rbxcompose.domains.servos.models import ServoModel, servo_models
from rbxcompose.domains.servos.twins.servo_twin import TwinBus
from rbxcompose.testing import Bench, FakeServo, check_text
from tests.sections.test_servo_sections import BODY, HEAD, SERVOS

TOYS = {"TOY-1": replace(servo_models()["XL430-W250"], name="TOY-1", number=9999)}
CHANGES = {
    "type: dynamixel": "type: toy_bus, port: /dev/toys, fast: true",
    "XL430-W250": "TOY-1",
    "AX-12": "toy 1",
    "neutral: 500": "neutral: 2000",
}
ROBOT = reduce(lambda text, change: text.replace(*change), CHANGES.items(), HEAD + SERVOS)


@pytest.fixture(autouse=True)
def opened() -> Iterator[list[str]]:
    """Declare the type; return the paths at which it was opened."""
    paths: list[str] = []

    @bus_types.bus_type_declared("toy_bus", lambda: TOYS)
    def open_toys(
        path: str, servos: Mapping[int, ServoModel], *, baud: int, clock: Callable[[], float], is_fast: bool
    ) -> ServoBus:
        assert is_fast
        paths.append(path)
        return TwinBus([FakeServo(model, id_) for id_, model in servos.items()], clock)

    yield paths
    del bus_types._TYPES["toy_bus"]


def driver(folder: Path, *, real: bool) -> Any:
    checked = check_text(ROBOT, folder, others={"head.urdf": BODY}, real=real)
    assert checked.codes == [], checked.text
    [found] = [instance for instance in checked.plan.instances if instance.type == "servo_bus"]
    return found


def test_real_servos_are_opened_by_it(tmp_path: Path, opened: list[str]) -> None:
    bench = Bench(driver(tmp_path, real=True), start=False)
    bench.advance(0.2)
    assert opened == ["/dev/toys"]
    component: Any = bench.component("servos")
    assert {servo.model.name for drive in component.cycle.drives.values() for servo in drive.joint.servos} == {"TOY-1"}


def test_simulated_servos_are_of_its_models(tmp_path: Path, opened: list[str]) -> None:
    bench = Bench(driver(tmp_path, real=False), start=False)
    bench.advance(0.2)
    assert opened == []
    component: Any = bench.component("servos")
    assert {servo.model.name for servo in component.cycle.bus.line.servos} == {"TOY-1"}


def test_models_of_other_types_are_not_known_there(tmp_path: Path) -> None:
    wrong = ROBOT.replace("TOY-1", "XL430-W250")
    checked = check_text(wrong, tmp_path, others={"head.urdf": BODY})
    assert "RBX2213" in checked.codes


def test_a_type_that_nobody_declares_is_told_with_the_nearest(tmp_path: Path) -> None:
    checked = check_text(ROBOT.replace("toy_bus", "dynamixle"), tmp_path, others={"head.urdf": BODY})
    assert "RBX1004" in checked.codes
    assert "did you mean 'dynamixel'" in checked.text

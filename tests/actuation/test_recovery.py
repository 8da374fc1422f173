"""An adapter that is unplugged, and plugged in again as another terminal."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.devices.serial_ports import LostPortError, PortError, port_path
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.domains.servos.twins.servo_twin import FakePort
from tests.actuation.conftest import Plugged
from tests.devices.machine_tree import MachineTree

MODELS = {1: servo_models()["AX-12"], 2: servo_models()["XL430-W250"], 3: servo_models()["XL430-W250"]}


def test_a_bus_recovers_with_a_new_port_relaxed_and_verified(plugged: Plugged) -> None:
    port = plugged(FakeServo("AX-12", 1), FakeServo("XL430-W250", 2), FakeServo("XM430-W350", 3))
    with DynamixelBus(str(port.path), MODELS, timeout=0.2) as bus:
        bus.write({number: {"torque_enable": 1} for number in MODELS}, is_confirmed=True)
        assert port.line[2].get("torque_enable") == 1
        port.unplug()
        for _ in range(3):
            with pytest.raises(LostPortError):
                bus.read([1, 2], ["present_position"])
        assert not bus.is_open
        with pytest.raises(PortError, match="does not exist"):
            bus.reopen()
        port.replug()
        found = bus.reopen()
        assert [servo and servo.name for servo in found.values()] == ["AX-12", "XL430-W250", "XM430-W350"]
        assert [port.line[number].get("torque_enable") for number in MODELS] == [0, 0, 0]
        assert bus.read([1, 2], ["present_position"]).keys() == {1, 2}


def test_a_bus_that_is_named_by_its_device_is_found_under_another_number(
    tmp_path: Path, clock: SteppedClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbxcompose.domains.servos.dynamixel_bus.port_path", lambda name: port_path(name, tmp_path))
    first, second = (MachineTree(tmp_path / name) for name in ("a", "b"))
    paths = [tree.plug(name, serial="FT4") for tree, name in ((first, "ttyUSB0"), (second, "ttyUSB1"))]
    (tmp_path / "sys").symlink_to(first.root / "sys")
    (tmp_path / "dev").symlink_to(first.root / "dev")
    line = FakeLine([FakeServo("XL430-W250", 2)], clock.now)
    with ExitStack() as stack:
        port = stack.enter_context(FakePort(line, paths[0]))
        bus = stack.enter_context(DynamixelBus("dev:arm=usb:0403:6014:FT4", {2: MODELS[2]}, timeout=0.2))
        port.unplug()
        for name in ("sys", "dev"):
            (tmp_path / name).unlink()
        with pytest.raises(PortError, match="is not connected"):
            bus.reopen()
        for name in ("sys", "dev"):
            (tmp_path / name).symlink_to(second.root / name)
        stack.enter_context(FakePort(line, paths[1]))
        assert [servo and servo.name for servo in bus.reopen().values()] == ["XL430-W250"]
        assert bus.opened_at == str(tmp_path / "dev/ttyUSB1")


def test_a_bus_may_be_opened_again_without_letting_go(plugged: Plugged) -> None:
    port = plugged(FakeServo("XL430-W250", 2))
    with DynamixelBus(str(port.path), {2: MODELS[2]}, timeout=0.2) as bus:
        bus.write({2: {"torque_enable": 1}}, is_confirmed=True)
        bus.reopen(is_relaxed=False)
        assert port.line[2].get("torque_enable") == 1


def test_servos_at_another_baud_rate_are_silent(plugged: Plugged) -> None:
    port = plugged(FakeServo("AX-12", 1, baud=57_600), FakeServo("XL430-W250", 2, baud=4_500_000))
    for baud, known in ((1_000_000, []), (57_600, [1]), (4_500_000, [2])):
        with DynamixelBus(str(port.path), baud=baud, timeout=0.05) as bus:
            assert [servo.id for servo in bus.scan((1, 2))] == known

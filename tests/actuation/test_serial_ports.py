"""The serial ports of a machine, and the ports that are named by their USB devices."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.actuation.port_errors import DeviceNotUniqueError, NoDeviceError
from rbxcompose.actuation.serial_ports import SerialPort, UsbDevice, latency_timers, port_path, serial_ports
from tests.actuation.machine_tree import MachineTree


def test_ports_are_listed_with_their_devices_and_the_names_that_stay(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    first, second = tree.plug("ttyUSB0", serial="FT4"), tree.plug("ttyACM0", "2341", "0043")
    (tmp_path / "dev/ttyS0").touch()  # which any computer has, with nothing behind it
    onboard = tmp_path / "dev/ttyAMA0"
    onboard.touch()
    link = tmp_path / "dev/serial/by-id/usb-FT4-if00-port0"
    assert serial_ports(tmp_path) == [
        SerialPort(str(second), (), UsbDevice("2341", "0043")),
        SerialPort(str(onboard)),
        SerialPort(str(first), [str(link)], UsbDevice("0403", "6014", "FT4")),
    ]
    assert [one.shown for one in serial_ports(tmp_path)] == [
        f"{second} (2341:0043)",
        str(onboard),
        f"{link} ({first}, 0403:6014 FT4)",
    ]


def test_a_machine_without_ports_has_none(tmp_path: Path) -> None:
    assert serial_ports(tmp_path) == []


def test_latency_timers_are_read_of_adapters_that_have_one(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    tree.plug("ttyACM0")
    slow, fast = tree.plug("ttyUSB0", latency=16), tree.plug("ttyUSB1", latency=1)
    assert latency_timers(tmp_path) == {str(slow): 0.016, str(fast): 0.001}
    assert latency_timers(tmp_path / "nowhere") == {}


def test_a_port_is_found_by_its_device_wherever_it_is_now(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    tree.plug("ttyUSB0", serial="other")
    port = tree.plug("ttyUSB1", serial="FT4:1")
    for name in ("usb:0403:6014:FT4:1", str(port)):
        assert port_path(name, tmp_path) == str(port)
    only = tree.plug("ttyACM0", "2341", "00ab")
    assert port_path("usb:2341:00AB", tmp_path) == str(only)


def test_a_device_that_is_not_connected_is_told_with_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(NoDeviceError) as error:
        port_path("usb:0403:6001:A7", tmp_path)
    assert error.value.finding().help == "no USB serial port is connected: plug the adapter in"
    port = MachineTree(tmp_path).plug("ttyUSB0")
    with pytest.raises(NoDeviceError, match="the USB device 0403:6001 A7 is not connected") as error:
        port_path("usb:0403:6001:A7", tmp_path)
    assert error.value.finding().help == f"connected: {port} (0403:6014)"


def test_a_device_that_is_there_twice_is_not_chosen(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    tree.plug("ttyUSB0", serial="A")
    tree.plug("ttyUSB1", serial="B")
    with pytest.raises(DeviceNotUniqueError, match="has 2 ports"):
        port_path("usb:0403:6014", tmp_path)


@pytest.mark.parametrize("device", [UsbDevice("0403", "6014"), UsbDevice("0403", "6014", "00:11:22")])
def test_a_device_is_the_one_that_the_name_of_its_port_gives(device: UsbDevice) -> None:
    assert UsbDevice.of(device.port) == device
    assert UsbDevice.of("/dev/ttyUSB0") is None

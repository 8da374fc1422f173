"""The serial ports of a machine, and the ports that are named by their USB devices."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rbxcompose.domains.devices.serial_ports import (
    PortError,
    SerialPort,
    UsbDevice,
    latency_timers,
    port_path,
    serial_ports,
)
from tests.devices.machine_tree import MachineTree


def test_ports_are_listed_with_their_devices_and_the_names_that_stay(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    first = tree.plug("ttyUSB0", serial="FT4")
    second = tree.plug("ttyACM0", "2341", "0043", about=("Arduino", "Uno"), driver="cdc_acm")
    (tmp_path / "dev/ttyS0").touch()  # which any computer has, with nothing behind it
    onboard = tmp_path / "dev/ttyAMA0"
    onboard.touch()
    link = tmp_path / "dev/serial/by-id/usb-FT4-if00-port0"
    assert serial_ports(tmp_path) == [
        SerialPort(str(second), (), UsbDevice("2341", "0043", "", "1-2", 0), "cdc_acm", "Arduino Uno"),
        SerialPort(str(onboard)),
        SerialPort(str(first), [str(link)], UsbDevice("0403", "6014", "FT4", "1-1", 0), "ftdi_sio"),
    ]
    assert [port.shown for port in serial_ports(tmp_path)] == [
        f"{second} (2341:0043 at USB port 1-2)",
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
    with pytest.raises(PortError, match="is not connected") as error:
        port_path("usb:0403:6001:A7", tmp_path)
    assert error.value.finding().help == "no USB serial port is connected: plug the adapter in"
    port = MachineTree(tmp_path).plug("ttyUSB0")
    with pytest.raises(PortError, match="the USB device 0403:6001 A7 is not connected") as error:
        port_path("usb:0403:6001:A7", tmp_path)
    assert error.value.finding().help == f"connected: {port} (0403:6014 at USB port 1-1)"


def test_a_device_that_is_there_twice_is_not_chosen(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    tree.plug("ttyUSB0", serial="A")
    tree.plug("ttyUSB1", serial="B")
    with pytest.raises(PortError, match="has 2 ports"):
        port_path("usb:0403:6014", tmp_path)


def test_devices_without_serial_numbers_are_told_apart_by_their_sockets(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    left, right = (
        tree.plug(name, "1a86", "7523", usb_port=place) for name, place in (("ttyUSB0", "1-1.4"), ("ttyUSB1", "1-1.2"))
    )
    assert port_path("usb@1-1.4:1a86:7523", tmp_path) == str(left)
    assert port_path("usb@1-1.2", tmp_path) == str(right)
    with pytest.raises(PortError, match="1a86:7523 at USB port 1-1 is not"):
        port_path("usb@1-1:1a86:7523", tmp_path)


def test_the_ports_of_one_device_are_told_apart_by_their_interfaces(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    ports = [
        tree.plug(f"ttyUSB{index}", "0403", "6011", serial="F4", usb_port="1-3", interface=index) for index in range(4)
    ]
    assert [port_path(f"usb#{index}:0403:6011:F4", tmp_path) for index in range(4)] == [str(port) for port in ports]


def test_a_serial_number_may_be_written_as_udev_does(tmp_path: Path) -> None:
    port = MachineTree(tmp_path).plug("ttyUSB0", serial="Left (arm) 1")
    for name in ("usb:0403:6014:Left (arm) 1", "usb:0403:6014:Left__arm__1"):
        assert port_path(name, tmp_path) == str(port)


def test_the_link_of_a_rule_decides_among_those_that_are_meant(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    tree.plug("ttyUSB0")
    port = tree.plug("ttyUSB1")
    link = tree.link("arm", "ttyUSB1")
    assert port_path("dev:arm=usb:0403:6014", tmp_path) == str(port)
    other = tree.plug("ttyUSB2", serial="FT4")
    assert port_path("dev:arm=usb:0403:6014:FT4", tmp_path) == str(other), "the link is of an old rule"
    link.unlink()
    with pytest.raises(PortError, match=r"the device 'arm' \(0403:6014\) has 3 ports"):
        port_path("dev:arm=usb:0403:6014", tmp_path)


def test_the_link_counts_where_the_kernel_tells_nothing(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    tree.link("arm", "/dev/pts/ptmx")
    assert port_path("dev:arm=usb:0403:6014", tmp_path) == "/dev/pts/ptmx"
    with pytest.raises(PortError, match="is not connected"):
        port_path("dev:leg=usb:0403:6014", tmp_path)


def test_what_is_no_regular_file_in_a_tree_is_not_read(tmp_path: Path) -> None:
    tree = MachineTree(tmp_path)
    tree.plug("ttyUSB0", serial="FT4")
    serial = tmp_path / "sys/bus/usb/devices/1-1/serial"
    serial.unlink()
    os.mkfifo(serial)
    assert [port.device and port.device.serial for port in serial_ports(tmp_path)] == [""]


DEVICES = [
    UsbDevice("0403", "6014"),
    UsbDevice("0403", "6014", "00:11:22"),
    UsbDevice("0403", "6014", "@1-1#2:", "1-1.4", 2, "arm"),
    UsbDevice(usb_port="2-1", name="left"),
]


@pytest.mark.parametrize("device", DEVICES)
def test_a_device_is_the_one_that_the_name_of_its_port_gives(device: UsbDevice) -> None:
    assert UsbDevice.of(device.port) == device
    assert UsbDevice.of("/dev/ttyUSB0") is None

"""The ports that a robot opens, on machines that have them or not."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.domains.devices.serial_ports import SerialPort, UsbDevice
from rbxcompose.domains.devices.udev import PortFile, look_at, port_findings
from rbxcompose.testing import check_text
from tests.checks import strangers

PORTS = (
    SerialPort("/dev/ttyUSB0", ("/dev/serial/by-id/usb-FT4",), UsbDevice("0403", "6014", "FT4")),
    SerialPort("/dev/ttyUSB1", (), UsbDevice("1a86", "7523")),
    SerialPort("/dev/ttyUSB2", (), UsbDevice("1a86", "7523")),
)
SEEN = "/dev/serial/by-id/usb-FT4 (/dev/ttyUSB0, 0403:6014 FT4), /dev/ttyUSB1 (1a86:7523), /dev/ttyUSB2 (1a86:7523)"
SCANNER = "rbx: 1\nkind: Robot\nname: cart\ncomponents:\n  scanner:\n    type: toy_sonar\n    device: {}\n"


def told(folder: Path, name: str, file: PortFile, ports: tuple[SerialPort, ...] = PORTS) -> list[tuple[str, str, str]]:
    """Return the code, the words and the help of each finding; all are at the line of the port."""
    assert strangers.Scanner.type_name == "toy_sonar"
    robot = check_text(SCANNER.format(name), folder).compilation.robot
    assert robot is not None
    found = list(port_findings(robot, ports, lambda path: file))
    assert {(finding.span.line, finding.span.column) for finding in found if finding.span} <= {(7, 13)}
    return [(finding.code, finding.message, finding.help) for finding in found]


@pytest.mark.parametrize("name", ["/dev/ttyUSB0", "usb:0403:6014", "usb:0403:6014:FT4"])
def test_a_port_that_can_be_opened_is_fine(name: str, tmp_path: Path) -> None:
    assert told(tmp_path, name, PortFile()) == []


def test_a_port_that_is_missing_is_told_with_those_that_are_there(tmp_path: Path) -> None:
    missing = PortFile(exists=False)
    assert told(tmp_path, "/dev/ttyUSB7", missing) == [("RBX2201", "/dev/ttyUSB7 does not exist", f"connected: {SEEN}")]
    assert told(tmp_path, "/dev/ttyUSB7", missing, ()) == [
        ("RBX2201", "/dev/ttyUSB7 does not exist", "no serial port is connected: plug the adapter in")
    ]


def test_a_port_that_is_none_or_not_for_this_user_is_told(tmp_path: Path) -> None:
    [(code, words, _)] = told(tmp_path, "/etc/hosts", PortFile(is_device=False))
    assert (code, words) == ("RBX2204", "/etc/hosts is not a serial port")
    assert told(tmp_path, "/dev/ttyUSB0", PortFile(may_open=False, group="uucp")) == [
        ("RBX2202", "/dev/ttyUSB0 may not be opened by this user", "sudo usermod -aG uucp $USER, then log in again")
    ]


def test_a_device_that_is_missing_or_there_twice_is_told(tmp_path: Path) -> None:
    assert told(tmp_path, "usb:0403:6014:A7", PortFile()) == [
        ("RBX2251", "the USB device 0403:6014 A7 is not connected", f"connected: {SEEN}")
    ]
    twice = "connected: /dev/ttyUSB1 (1a86:7523), /dev/ttyUSB2 (1a86:7523)"
    assert told(tmp_path, "usb:1a86:7523", PortFile()) == [("RBX2252", "the USB device 1a86:7523 has 2 ports", twice)]
    [(code, words, _)] = told(tmp_path, "dev:lidar=usb:0403:6014:A7", PortFile())
    assert (code, words) == ("RBX2251", "the device 'lidar' (0403:6014 A7) is not connected")


def test_an_adapter_that_holds_replies_back_is_warned_of(tmp_path: Path) -> None:
    [(code, words, _)] = told(tmp_path, "usb:0403:6014", PortFile(latency=0.016))
    assert (code, words) == ("RBX2206", "the adapter of /dev/ttyUSB0 holds replies back for up to 16 ms")
    assert told(tmp_path, "/dev/ttyUSB0", PortFile(latency=0.001)) == []


def test_what_is_at_a_path_of_this_machine_is_seen(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert look_at(str(tmp_path / "nothing")) == PortFile(exists=False)
    assert not look_at(str(tmp_path / "file")).is_device
    device = look_at("/dev/null")
    assert (device.exists, device.is_device, device.may_open, device.latency) == (True, True, True, None)

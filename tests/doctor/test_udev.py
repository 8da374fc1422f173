"""Devices of a robot on machines where they are, are not, or are called otherwise."""

from __future__ import annotations

import pytest

from rbxcompose.base.findings import Finding, Span
from rbxcompose.domains.devices.serial_ports import SerialPort, UsbDevice
from rbxcompose.domains.devices.udev import Account, PortFile, device_answers, group_answer, rules_answer

ARM = UsbDevice("0403", "6014", "FT4", name="arm")
PLACE = Span("robot.yaml", 5, 3, 5, 6)
PORT = SerialPort("/dev/ttyUSB0", ("/dev/arm",), UsbDevice("0403", "6014", "FT4", "1-1", 0))
OTHER = SerialPort("/dev/ttyUSB1", (), UsbDevice("0403", "6014", "FT5", "1-2", 0))


def told(*ports: SerialPort, file: PortFile | None = None, are_right: bool = True) -> list[tuple[str, str]]:
    found = file or PortFile()
    answers = list(device_answers({"arm": (ARM, PLACE)}, ports, lambda path: found, rules_are_right=are_right))
    assert {answer.span for answer in answers if isinstance(answer, Finding) and answer.code != "RBX9415"} <= {PLACE}
    return [("ok", answer) if isinstance(answer, str) else (answer.code, answer.message) for answer in answers]


FINE = ("ok", "'arm' is /dev/ttyUSB0 (0403:6014 FT4)")


def unlinked(port: SerialPort, *links: str) -> SerialPort:
    return SerialPort(port.path, links, port.device)


def test_a_device_that_is_there_and_named_is_fine() -> None:
    assert told(PORT, OTHER) == [FINE]


def test_what_is_wrong_with_a_device_is_told() -> None:
    assert told(OTHER) == [("RBX2251", "the device 'arm' (0403:6014 FT4) is not connected")]
    assert told(unlinked(PORT)) == [FINE, ("RBX9413", "'arm' is /dev/ttyUSB0, but there is no link /dev/arm")]
    assert told(unlinked(PORT), are_right=False) == [FINE]
    assert told(unlinked(PORT), unlinked(OTHER, "/dev/arm")) == [
        FINE,
        ("RBX9417", "/dev/arm leads to /dev/ttyUSB1, but 'arm' is /dev/ttyUSB0"),
    ]
    closed = PortFile(may_open=False, group="uucp")
    assert told(PORT, file=closed) == [FINE, ("RBX2202", "'arm' is /dev/ttyUSB0, which may not be opened by this user")]


def test_adapters_with_one_serial_number_are_told() -> None:
    copy = SerialPort("/dev/ttyUSB2", (), UsbDevice("0403", "6014", "FT4", "1-3", 0))
    assert told(PORT, copy) == [
        FINE,
        ("RBX9415", "2 adapters report the same serial number 'FT4': /dev/ttyUSB0, /dev/ttyUSB2"),
    ]


@pytest.mark.parametrize(
    ("account", "words"),
    [
        (Account("ann", frozenset({"dialout"})), "ann may open what belongs to the group 'dialout'"),
        (Account("root", frozenset(), is_root=True), "root may open what belongs to the group 'dialout'"),
        (Account("ann", frozenset({"ann"})), "ann is not in the group 'dialout'"),
        (
            Account("ann", frozenset(), frozenset({"dialout"})),
            "ann has joined the group 'dialout', but not logged in since",
        ),
    ],
)
def test_whether_a_user_may_open_devices_is_told(account: Account, words: str) -> None:
    answer = group_answer(account, "dialout")
    assert (answer if isinstance(answer, str) else answer.message) == words


def test_rules_that_are_missing_or_others_are_told() -> None:
    assert rules_answer("a", "a", "/etc/r") == "/etc/r has the rules of the robot"
    for found, words in ((None, "/etc/r does not exist"), ("b", "/etc/r has other rules")):
        answer = rules_answer("a", found, "/etc/r")
        assert isinstance(answer, Finding)
        assert (answer.code, answer.message) == ("RBX9414", words)

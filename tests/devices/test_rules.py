"""Rules of udev: their text, and that each fits its device alone."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.devices.serial_ports import UsbDevice, as_udev_writes
from rbxcompose.domains.devices.udev import rules_text

ADAPTER = UsbDevice("0403", "6001", "A700eUxA", name="arm")
PLACED = UsbDevice("1a86", "7523", usb_port="1-1.4", interface=2, name="leg")


def test_each_device_has_its_group_its_mode_and_its_link() -> None:
    whole, *lines = rules_text("tried", [PLACED, ADAPTER], "uucp").splitlines()
    assert whole.startswith("# Made by `rbxcompose udev`")
    parent = 'SUBSYSTEMS=="usb", ATTRS{idVendor}=="0403", ATTRS{idProduct}=="6001", ATTRS{serial}=="A700eUxA"'
    assert lines == [
        f'SUBSYSTEM=="tty", {parent}, GROUP="uucp", MODE="0660", SYMLINK+="arm"',
        f'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", {parent}, ATTR{{latency_timer}}="1"',
        'SUBSYSTEM=="tty", SUBSYSTEMS=="usb", KERNELS=="1-1.4", ATTRS{idVendor}=="1a86", ATTRS{idProduct}=="7523", '
        'ENV{ID_USB_INTERFACE_NUM}=="02", GROUP="uucp", MODE="0660", SYMLINK+="leg"',
    ]


def pattern_of(serial: str) -> str:
    found = re.search(r'ATTRS\{serial\}=="([^"]*)"', rules_text("r", [UsbDevice("1a86", "7523", serial, name="a")]))
    assert found
    return found[1]


@given(st.text(st.characters(min_codepoint=33, max_codepoint=382, exclude_categories=("C", "Z")), min_size=1))
def test_the_pattern_of_a_serial_number_fits_it_and_can_be_read(serial: str) -> None:
    assert fnmatchcase(serial, pattern_of(serial))
    assert not re.search(r'["\\|\n]', pattern_of(serial))
    assert fnmatchcase(serial, pattern_of(as_udev_writes(serial)))


@pytest.mark.parametrize(("serial", "other"), [("A*", "AB"), ("A?", "AB"), ("[AB]", "A"), ("a7", "A7"), ("A7", "A70")])
def test_it_fits_no_other(serial: str, other: str) -> None:
    assert not fnmatchcase(other, pattern_of(serial))

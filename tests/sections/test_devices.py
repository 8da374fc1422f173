"""Devices by name: what a bus is given for one, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.testing.manifests import Checked, check_text
from tests.sections.test_servo_sections import BODY, HEAD, SERVOS

DEVICES = "devices:\n  usb2dynamixel: {vendor: 0403, product: 6001, serial: A700eUxA}\n"


def check(folder: Path, port: str, devices: str = DEVICES) -> Checked:
    text = HEAD + devices + SERVOS.replace("rate: 50 Hz", f"port: {port}")
    return check_text(text, folder, others={"head.urdf": BODY}, real=True)


def port_of(checked: Checked) -> Any:
    [found] = [one.config for one in checked.plan.instances if one.type == "servo_bus"]
    return getattr(found, "port", None)


def test_a_bus_is_given_the_device_that_its_port_names(tmp_path: Path) -> None:
    assert port_of(check(tmp_path, "dev:usb2dynamixel")) == "usb:0403:6001:A700eUxA"
    assert port_of(check(tmp_path, "/dev/ttyUSB0")) == "/dev/ttyUSB0"


@pytest.mark.parametrize(
    ("device", "port"),
    [
        ("{vendor: 0403, product: 6014}", "usb:0403:6014"),
        ("{vendor: '0403', product: 0x6014}", "usb:0403:6014"),
        ("{vendor: 1A86, product: 1e10}", "usb:1a86:1e10"),  # which YAML reads as a number
        ("{vendor: 0403, product: 6014, serial: 0123}", "usb:0403:6014:0123"),
        ('{vendor: 0403, product: 6014, serial: "a:b"}', "usb:0403:6014:a:b"),
    ],
)
def test_numbers_keep_the_digits_that_are_written(device: str, port: str, tmp_path: Path) -> None:
    assert port_of(check(tmp_path, "dev:it", f"devices: {{it: {device}}}\n")) == port


@pytest.mark.parametrize("number", ["403", "04030", "zzzz", "ftdi", "-403", "''"])
def test_what_is_no_number_of_a_vendor_is_told(number: str, tmp_path: Path) -> None:
    checked = check(tmp_path, "dev:it", f"devices: {{it: {{vendor: {number}, product: 6014}}}}\n")
    assert checked.codes == ["RBX1003"]
    assert "'vendor': must be four hexadecimal digits, as 'lsusb' shows them: 0403" in checked.text


def test_a_misspelt_device_is_told_with_the_one_that_is_meant(tmp_path: Path) -> None:
    checked = check(tmp_path, "dev:usb2dynamixl")
    assert checked.codes == ["RBX1004"]
    assert "'port': there is no device 'dev:usb2dynamixl'" in checked.text
    assert "did you mean 'dev:usb2dynamixel'?" in checked.text


def test_a_device_without_a_section_is_told(tmp_path: Path) -> None:
    assert check(tmp_path, "dev:usb2dynamixel", "").codes == ["RBX1004"]


PART = f"""rbx: 1
kind: Part
name: head
args:
  port: {{type: text, default: "dev:own"}}
devices:
  own: {{vendor: 0403, product: 6014}}
body: {{urdf: head.urdf}}
{SERVOS.replace("rate: 50 Hz", "port: PORT")}"""


@pytest.mark.parametrize(
    ("port", "given", "found"),
    [
        ("dev:own", "", "usb:0403:6014"),
        ("dev:robots", "", "usb:1a86:7523"),
        ("'${args.port}'", ", with: {port: dev:robots}", "usb:1a86:7523"),
    ],
)
def test_a_part_may_bring_its_device_or_use_one_of_the_robot(port: str, given: str, found: str, tmp_path: Path) -> None:
    robot = "rbx: 1\nkind: Robot\nname: r\ndevices: {robots: {vendor: 1a86, product: 7523}}\ninclude:\n  left: "
    others = {"head.urdf": BODY, "part.yaml": PART.replace("PORT", port)}
    checked = check_text(f"{robot}{{part: part.yaml{given}}}\n", tmp_path, others=others, real=True)
    assert checked.text == ""
    assert port_of(checked) == found

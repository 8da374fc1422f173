"""Devices by name: what a bus is given for one, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.testing.manifests import Checked, check_text
from tests.loops import for_all
from tests.sections.test_servo_sections import BODY, HEAD, SERVOS

DEVICES = "devices:\n  usb2dynamixel: {vendor: 0403, product: 6001, serial: A700eUxA}\n"


def check(folder: Path, port: str, devices: str = DEVICES) -> Checked:
    text = HEAD + devices + SERVOS.replace("rate: 50 Hz", f"port: {port}")
    return check_text(text, folder, others={"head.urdf": BODY}, real=True)


def port_of(checked: Checked) -> Any:
    [found] = [instance.config for instance in checked.plan.instances if instance.type == "servo_bus"]
    return getattr(found, "port", None)


def test_a_bus_is_given_the_device_that_its_port_names(tmp_path: Path) -> None:
    assert port_of(check(tmp_path, "dev:usb2dynamixel")) == "dev:usb2dynamixel=usb:0403:6001:A700eUxA"
    assert port_of(check(tmp_path, "/dev/ttyUSB0")) == "/dev/ttyUSB0"


@for_all(
    "device, port",
    [
        ("{vendor: 0403, product: 6014}", "dev:it=usb:0403:6014"),
        ("{vendor: '0403', product: 0x6014}", "dev:it=usb:0403:6014"),
        ("{vendor: 1A86, product: 1e10}", "dev:it=usb:1a86:1e10"),  # which YAML reads as a number
        ("{vendor: 0403, product: 6014, serial: 0123}", "dev:it=usb:0403:6014:0123"),
        ("{vendor: 0403, product: 6014, serial: 1e5}", "dev:it=usb:0403:6014:1e5"),
        ("{vendor: 0403, product: 6014, serial: 12:30}", "dev:it=usb:0403:6014:12:30"),
        ("{vendor: 0403, product: 6014, serial: 0x1F}", "dev:it=usb:0403:6014:0x1F"),
        ("{vendor: 0403, product: 6014, serial: yes}", "dev:it=usb:0403:6014:yes"),
        ("{usb_port: 1-1.4, vendor: 1a86, product: 7523, interface: 2}", "dev:it=usb@1-1.4#2:1a86:7523"),
        ("{usb_port: 2-1}", "dev:it=usb@2-1"),
        ('{vendor: 0403, product: 6014, serial: "a:b"}', "dev:it=usb:0403:6014:a:b"),
    ],
)
def test_numbers_keep_the_digits_that_are_written(device: str, port: str, tmp_path: Path) -> None:
    assert port_of(check(tmp_path, "dev:it", f"devices: {{it: {device}}}\n")) == port


@pytest.mark.parametrize("number", ["403", "04030", "zzzz", "ftdi", "-403", "''"])
def test_what_is_no_number_of_a_vendor_is_told(number: str, tmp_path: Path) -> None:
    checked = check(tmp_path, "dev:it", f"devices: {{it: {{vendor: {number}, product: 6014}}}}\n")
    assert checked.codes == ["RBX1003"]
    assert "'vendor': must be four hexadecimal digits, as 'lsusb' shows them: 0403" in checked.text


@for_all("serial", ["", "~", "null", "''", '"  "', "#5", "[1]", '"\\t"'])
def test_a_serial_number_that_is_lost_or_none_is_told(serial: str, tmp_path: Path) -> None:
    device = f"devices:\n  it:\n    vendor: 0403\n    product: 6014\n    serial: {serial}\n"
    checked = check(tmp_path, "dev:it", device)
    assert [
        finding.span.line for finding in checked.compilation.report if finding.span and finding.code == "RBX1003"
    ] == [9]


@pytest.mark.parametrize("place", ["1", "1.4", "1-", "1-1.4:1.0", "usb1"])
def test_what_is_no_usb_port_is_told(place: str, tmp_path: Path) -> None:
    checked = check(tmp_path, "dev:it", f"devices: {{it: {{usb_port: '{place}'}}}}\n")
    assert "must be a USB port as 'rbxcompose udev scan' shows it: 1-1.4" in checked.text


@pytest.mark.parametrize(
    ("entries", "code", "line"),
    [
        ("it: {serial: A7}", "RBX2260", 6),
        ("it: {vendor: 0403, serial: A7}", "RBX2260", 6),
        ("other: {vendor: 0403, product: 6014}\n  it: {product: 6014, vendor: 0403}", "RBX2261", 7),
        ("other: {usb_port: 1-1}\n  it: {usb_port: 1-1}", "RBX2261", 7),
        ("other: {vendor: 0403, product: 6014}\n  it: {product: 6014, vendor: 0403, serial: A}", "RBX2262", 7),
        ("it: {usb_port: 1-1}\n  ttyusb0: {usb_port: 1-2}", "RBX2263", 7),
        ("it: {usb_port: 1-1}\n  'null': {usb_port: 1-2}", "RBX2263", 7),
    ],
)
def test_devices_that_are_not_clear_are_told(entries: str, code: str, line: int, tmp_path: Path) -> None:
    checked = check(tmp_path, "dev:it", f"devices:\n  {entries}\n")
    assert [(finding.code, finding.span.line) for finding in checked.compilation.report if finding.span] == [
        (code, line)
    ]


def test_devices_that_differ_are_fine(tmp_path: Path) -> None:
    entries = "it: {vendor: 0403, product: 6014, serial: A}\n  b: {vendor: 0403, product: 6014, serial: B}"
    assert check(tmp_path, "dev:it", f"devices:\n  {entries}\n  c: {{usb_port: 1-1}}\n").codes == []


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
ARGS
devices:
  own: {{vendor: 0403, product: 6014}}
body: {{urdf: head.urdf}}
{SERVOS.replace("rate: 50 Hz", "port: PORT")}"""


@pytest.mark.parametrize(
    ("port", "given", "found"),
    [
        ("dev:own", "", "dev:left_own=usb:0403:6014"),
        ("dev:robots", "", "dev:robots=usb:1a86:7523"),
        ("'${args.port}'", ", with: {port: dev:robots}", "dev:robots=usb:1a86:7523"),
    ],
)
def test_a_part_may_bring_its_device_or_use_one_of_the_robot(port: str, given: str, found: str, tmp_path: Path) -> None:
    robot = "rbx: 1\nkind: Robot\nname: r\ndevices: {robots: {vendor: 1a86, product: 7523}}\ninclude:\n  left: "
    declared = 'args: {port: {type: text, default: "dev:own"}}' if given else ""
    others = {"head.urdf": BODY, "part.yaml": PART.replace("PORT", port).replace("ARGS", declared)}
    checked = check_text(f"{robot}{{part: part.yaml{given}}}\n", tmp_path, others=others, real=True)
    assert checked.text == ""
    assert port_of(checked) == found


RECEIVER = "rbx: 1\nkind: Robot\nname: cart\n{devices}components:\n  gps: {{type: gps, port: {port}}}\n"


def test_a_component_is_given_the_device_that_its_port_names(tmp_path: Path) -> None:
    checked = check_text(RECEIVER.format(devices=DEVICES, port="dev:usb2dynamixel"), tmp_path)
    [found] = [instance.config for instance in checked.plan.instances if instance.type == "gps"]
    assert getattr(found, "port", None) == "dev:usb2dynamixel=usb:0403:6001:A700eUxA"


@pytest.mark.parametrize(
    ("port", "words"),
    [("dev:gps", "there is no device 'dev:gps'"), ("ttyUSB0", "must be a path: write '/dev/ttyUSB0'")],
)
def test_a_component_with_a_port_that_is_none_is_told_where(port: str, words: str, tmp_path: Path) -> None:
    checked = check_text(RECEIVER.format(devices=DEVICES, port=port), tmp_path)
    assert words in checked.text
    assert "robot.yaml:7:26" in checked.text

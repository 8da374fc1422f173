"""`udev` on a made machine: what a person reads, what is written, and that nothing else is."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.testing.golden import Golden
from tests.devices.machine_tree import MachineTree

ROBOT = """rbx: 1
kind: Robot
name: armed
devices:
  arm: {vendor: 0403, product: 6001, serial: A700eUxA}
  lidar: {vendor: 10c4, product: ea60, serial: 0001}
  camera: {usb_port: 1-9}
"""
RULES = Path("etc/udev/rules.d/99-rbxcompose-armed.rules")


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine with some adapters, seen from the folder of a robot."""
    tree = MachineTree(tmp_path / "machine")
    tree.root.mkdir()
    tree.plug("ttyUSB0", product="6001", serial="A700eUxA", usb_port="1-1.4", about=("FTDI", "FT232R USB UART"))
    tree.plug("ttyUSB1", "1a86", "7523", usb_port="1-1.2", driver="ch341")
    for number in (2, 3):
        tree.plug(f"ttyUSB{number}", "10c4", "ea60", serial="0001", usb_port=f"1-{number}", driver="cp210x")
    for part in (0, 1):
        tree.plug(f"ttyUSB{4 + part}", product="6011", serial="F4", usb_port="1-5", interface=part)
    tree.plug("ttyACM0", "2341", "0043", serial="Left #1", usb_port="2-1", driver="cdc_acm", about=("Arduino", "Uno"))
    robot = tmp_path / "armed"
    robot.mkdir()
    (robot / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    monkeypatch.chdir(robot)
    return tree.root


def run(machine: Path, words: str, code: int) -> None:
    assert command.main(["udev", *words.split(), "--root", str(machine)]) == code


@pytest.mark.parametrize(("action", "code"), [("scan", 0), ("generate", 0), ("check", 1)])
def test_what_a_person_reads(
    action: str, code: int, machine: Path, golden: Golden, capsys: pytest.CaptureFixture[str]
) -> None:
    run(machine, action, code)
    told = capsys.readouterr().out.replace(str(machine), "")
    told = re.sub("(?<=connected: ).*", "...", re.sub("   +", "   ", told))  # of a width that depends on the folder
    golden.check(f"udev_{action}.txt", "".join(f"{line}\n" for line in told.splitlines() if "'dialout'" not in line))


def test_a_machine_is_scanned_without_any_robot(
    machine: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(machine)
    run(machine, "scan --json", 0)
    found = json.loads(capsys.readouterr().out)
    assert [entry["devices"] for entry in found] == [[]] * 7
    assert found[0]["entry"] == {"vendor": "2341", "product": "0043", "serial": "Left #1"}
    assert found[2]["entry"] == {"vendor": "1a86", "product": "7523", "usb_port": "1-1.2"}


def test_the_entries_that_are_written_make_a_robot_that_knows_all(
    machine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    MachineTree(machine).plug("ttyUSB9", serial="\x1b[31m", usb_port="1-9")
    Path("robot.yaml").write_text(ROBOT.partition("devices")[0], encoding="utf-8")
    run(machine, "scan", 0)
    entries = capsys.readouterr().out.partition("devices:\n")[2].splitlines()
    named = "\n".join(entry.replace("NAME", f"it_{number}") for number, entry in enumerate(entries))
    Path("robot.yaml").write_text(f"{ROBOT.partition('devices')[0]}devices:\n{named}\n", encoding="utf-8")
    assert command.main(["check"]) == 0
    capsys.readouterr()
    run(machine, "scan --json", 0)
    found = json.loads(capsys.readouterr().out)
    assert sorted(name for entry in found for name in entry["devices"]) == [f"it_{number}" for number in range(8)]


def test_rules_are_written_when_they_differ_and_only_then(machine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(machine, "install", 2)
    assert not (machine / RULES).exists()
    run(machine, "install --yes", 0)
    written = capsys.readouterr().out
    assert (machine / RULES).read_text(encoding="utf-8") in written
    assert "sudo udevadm control --reload" in written
    assert oct((machine / RULES).stat().st_mode)[-3:] == "644"
    run(machine, "install --yes --json", 0)
    assert json.loads(capsys.readouterr().out)["written"] is False
    run(machine, "install --yes --group uucp", 0)
    assert '-SUBSYSTEM=="tty"' in capsys.readouterr().out
    assert 'GROUP="uucp"' in (machine / RULES).read_text(encoding="utf-8")
    run(machine, "check --json", 1)
    told = json.loads(capsys.readouterr().out)
    assert "RBX9414" in {finding["code"] for finding in told["findings"]}
    assert told["fine"][0] == f"'arm' is {machine}/dev/ttyUSB0 (0403:6001 A700eUxA)"


def test_what_cannot_be_written_is_told(machine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (machine / "etc").write_text("", encoding="utf-8")
    run(machine, "install --yes", 1)
    assert "RBX9418" in capsys.readouterr().err


def test_a_robot_with_errors_or_without_devices_gets_no_rules(
    machine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for text, code in ((ROBOT.replace("6001", "601"), "RBX1003"), (ROBOT.partition("devices")[0], "RBX9419")):
        Path("robot.yaml").write_text(text, encoding="utf-8")
        run(machine, "install --yes", 1)
        assert code in capsys.readouterr().err
    assert not (machine / RULES).exists()

"""Batteries are read as Linux shows them: a folder each, with what the battery tells."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.domains.diagnostics.components.host_battery import Supply, batteries


def made(folder: Path, name: str, **properties: str) -> None:
    (folder / name).mkdir()
    for key, text in properties.items():
        (folder / name / key).write_text(f"{text}\n", encoding="utf-8")


def test_what_a_battery_tells_is_read_in_volt_and_ampere(tmp_path: Path) -> None:
    made(tmp_path, "AC", type="Mains", online="1")
    made(tmp_path, "hidpp_battery_0", type="Battery", scope="Device", capacity="55")
    made(tmp_path, "BAT1", type="Battery", present="0", capacity="100")
    made(
        tmp_path,
        "BAT0",
        type="Battery",
        present="1",
        status="Discharging",
        capacity="76",
        voltage_now="11400000",
        current_now="-1500000",
        energy_full="40000000",
        energy_full_design="50000000",
    )
    assert batteries(tmp_path) == (Supply("BAT0", "Discharging", 0.76, 0.8, 11.4, -1.5),)


@pytest.mark.parametrize("number", ["", "abc", "1e9", "9" * 100])
def test_what_it_does_not_tell_is_unknown(tmp_path: Path, number: str) -> None:
    made(tmp_path, "BAT0", type="Battery", capacity=number, voltage_now=number)
    (found,) = batteries(tmp_path)
    assert found.status == "Unknown"
    assert found.health is found.current is None
    if not number.isdecimal():
        assert found.charge is found.voltage is None


def test_without_a_percentage_the_charge_is_a_share_of_the_capacity(tmp_path: Path) -> None:
    made(tmp_path, "BAT0", type="Battery", charge_now="1500000", charge_full="3000000")
    assert batteries(tmp_path)[0].charge == 0.5
    assert batteries(tmp_path / "nowhere") == ()

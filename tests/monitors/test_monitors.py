"""Monitors of this computer report what it is like, and nothing while time is simulated."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.components.network_monitor import NetworkMonitor, Traffic
from rbxcompose.domains.diagnostics.monitors import Usage
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.testing.bench import Bench, instance

EXAMPLES = {
    "cpu_monitor": {},
    "memory_monitor": {},
    "disk_monitor": {},
    "network_monitor": {"interface": "lo"},
    "host_battery": {},
    "clock_monitor": {"server": "127.0.0.1", "timeout": "10 ms"},
}


def measuring(type_name: str, **config: object) -> Bench:
    """Return a bench whose clock counts as real; `advance` makes the monitor look."""
    bench = Bench(instance("one", type_name, config))
    bench.clock.is_real = True
    return bench


@pytest.mark.parametrize("name", EXAMPLES)
def test_in_simulated_time_nothing_is_measured(name: str) -> None:
    bench = Bench(instance("one", name, EXAMPLES[name]))
    found = bench.statuses("one")
    bench.advance(2.0)
    assert (found[-1].level, found[-1].message) == (Level.OK, "not measured: time is simulated")


@pytest.mark.parametrize("name", ["cpu_monitor", "memory_monitor", "disk_monitor"])
def test_a_share_of_this_computer_is_told_and_judged(name: str) -> None:
    bench = measuring(name, warn="0 %", error="100 %", patience="0 s")
    read = bench.component("one").read  # type: ignore[attr-defined]
    usage = read()
    assert isinstance(usage, Usage)
    assert 0 <= usage.share <= 1
    found = bench.statuses("one")
    bench.advance(2.0)
    assert found[-1].values
    assert found[-1].level == (Level.WARN if name != "cpu_monitor" else found[-1].level)
    bench.set_live("one", warn="100 %")
    bench.advance(2.0)
    assert found[-1].level == Level.OK


def test_an_interface_is_told_that_is_absent_or_that_loses_packets() -> None:
    bench = measuring("network_monitor", interface="rbx_none")
    found = bench.statuses("one")
    bench.advance(1.0)
    assert (found[-1].level, found[-1].message) == (Level.ERROR, "'rbx_none' does not exist")
    monitor = bench.component("one")
    assert isinstance(monitor, NetworkMonitor)
    monitor.judge(Traffic(0, 0, 0), 1.0, 100)
    monitor.judge(Traffic(2**20, 2**21, 5), 1.0, 100)
    bench.advance(0.9)
    monitor.judge(Traffic(2**20, 2**21, 105), 1.0, 100)
    bench.advance(0.05)
    told = {(status.level, status.message) for status in found}
    assert (Level.WARN, "100 faulty packets a second") in told
    real = measuring("network_monitor", interface="lo")
    loopback = real.statuses("one")
    real.advance(2.0)
    assert loopback[-1].level == Level.OK


def test_the_battery_of_a_computer_takes_the_place_of_a_simulated_one(tmp_path: Path) -> None:
    battery = tmp_path / "BAT0"
    battery.mkdir()
    for key, text in {"type": "Battery", "status": "Discharging", "capacity": "30"}.items():
        (battery / key).write_text(text, encoding="utf-8")
    bench = measuring("host_battery", folder=str(tmp_path))
    found, levels = bench.statuses("one"), bench.collect("battery_level", Float32)
    bench.advance(1.0)
    assert (found[-1].level, found[-1].message) == (Level.WARN, "30%, discharging")
    assert levels[-1].data == 30.0
    (battery / "type").unlink()
    bench.advance(1.0)
    assert (found[-1].level, found[-1].message) == (Level.ERROR, "no battery reports its charge: there is none")


@pytest.mark.parametrize("charge", ["250", "-5"])
def test_a_charge_that_cannot_be_is_an_error_and_not_published(tmp_path: Path, charge: str) -> None:
    battery = tmp_path / "BAT0"
    battery.mkdir()
    for key, text in {"type": "Battery", "capacity": charge}.items():
        (battery / key).write_text(text, encoding="utf-8")
    bench = measuring("host_battery", folder=str(tmp_path))
    found, levels = bench.statuses("one"), bench.collect("battery_level", Float32)
    bench.advance(1.0)
    assert (found[-1].level, found[-1].message) == (Level.ERROR, f"the gauge of BAT0 is broken: it says {charge}%")
    assert levels == []
    (battery / "capacity").write_text("104", encoding="utf-8")
    bench.advance(1.0)
    assert (found[-1].level, levels[-1].data) == (Level.OK, 100.0)


def test_a_time_server_that_does_not_answer_leaves_the_offset_unknown() -> None:
    bench = measuring("clock_monitor", server="127.0.0.1", port=9, timeout="10 ms")
    found = bench.statuses("one")
    bench.advance(2.0)
    assert found[-1].level == Level.STALE

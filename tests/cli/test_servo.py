"""`rbxcompose servo`, with fake servos on a pseudo-terminal."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.commands.main import main
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.domains.servos.twins.servo_twin import FakePort

AX, XL, SLOW = "AX-12", "XL430-W250", 57_600


class Bench:
    """Servos on a port, and the command that talks to them."""

    def __init__(self, port: FakePort, capsys: pytest.CaptureFixture[str]) -> None:
        self.port, self.line, self._capsys = port, port.line, capsys

    def position(self, id: int) -> int:
        return self.line[id].get("present_position")

    def told(self, *words: str, code: int = 0) -> str:
        action, *rest = words
        assert main(["servo", action, "--port", str(self.port.path), "--timeout", "40ms", *rest]) == code
        out, err = self._capsys.readouterr()
        return out + err


@pytest.fixture
def servos(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Iterator[Bench]:
    fakes = [FakeServo(AX, 1), FakeServo(XL, 2), FakeServo(XL, 3, baud=SLOW)]
    with FakePort(FakeLine(fakes, SteppedClock().now), tmp_path / "servos") as port:
        yield Bench(port, capsys)


def test_a_scan_lists_servos_of_all_rates_and_protocols(servos: Bench) -> None:
    found = json.loads(servos.told("scan", "--last", "3", "--json"))
    assert found == [
        {"id": 3, "protocol": 2, "model": XL, "baud": SLOW},
        {"id": 1, "protocol": 1, "model": AX, "baud": 1_000_000},
        {"id": 2, "protocol": 2, "model": XL, "baud": 1_000_000},
    ]
    assert servos.told("scan", "--baud", "1000000", "--last", "2", "--protocol", "2").splitlines() == [
        "id  protocol  model       baud",
        "2   2.0       XL430-W250  1000000",
    ]
    assert "RBX2208" in servos.told("scan", "--baud", "9600", "--last", "1", code=1)


def test_a_ping_tells_who_answers(servos: Bench) -> None:
    assert "AX-12" in servos.told("ping", "1")
    told = servos.told("ping", "1", "9", code=1)
    assert "no servo answers at id 9" in told
    assert "AX-12" in told


def test_values_are_shown_raw_and_in_si(servos: Bench) -> None:
    assert "present_voltage   120  12 V" in servos.told("read", "1", "present_voltage", "present_position")
    told = json.loads(servos.told("read", "2", "present_position", "--json"))
    assert told["values"]["present_position"] == {"raw": 2048, "value": 0.0, "unit": "rad"}
    servos.line[2].motor.temperature = 99
    servos.line[2].step(0.1, 0.1)
    told = servos.told("info", "2")
    assert "present_temperature" in told
    assert "it reports: overheated" in told
    assert "did you mean 'present_position'" in servos.told("read", "1", "present_positon", code=1)


def test_values_are_written_raw_or_with_a_unit(servos: Bench) -> None:
    servos.told("write", "1", "goal_position=90 deg", "led=1")
    assert (servos.line[1].get("goal_position"), servos.line[1].get("led")) == (819, 1)
    servos.told("write", "2", "goal_position=-5", code=1)
    for wrong in ("led=bright", "led", "goal_position=3 V", "ledd=1", "goal_position=99999"):
        assert "RBX2210" in servos.told("write", "1", wrong, code=1)
    assert "RBX2211" in servos.told("write", "1", "present_position=5", code=1)


def test_an_id_is_changed_only_if_one_servo_has_it_and_the_new_one_is_free(servos: Bench) -> None:
    servos.told("enable", "2")
    servos.told("set-id", "2", "7")
    assert servos.line[7].model.name == XL
    assert "a servo has the id 1 already" in servos.told("set-id", "7", "1", code=1)
    assert "no servo answers at id 2" in servos.told("set-id", "2", "8", code=1)
    servos.line.servos.append(FakeServo(XL, 7))
    assert "more than one servo answers at id 7" in servos.told("set-id", "7", "8", code=1)
    assert [servo.id for servo in servos.line.servos] == [1, 7, 3, 7]


def test_torque_is_switched_on_where_servos_are_and_off_for_all(servos: Bench) -> None:
    servos.line[2].holds_on_enable = False
    servos.line[2].move_to(3000)
    servos.told("enable", "1", "2")
    assert (servos.line[2].get("torque_enable"), servos.line[2].get("goal_position")) == (1, 3000)
    assert "name ids, or use --all" in servos.told("relax", code=1)
    servos.told("relax", "1", "2")
    assert [servos.line[number].get("torque_enable") for number in (1, 2)] == [0, 0]


def test_a_disabled_servo_ignores_goals_until_it_is_enabled(servos: Bench) -> None:
    servos.told("enable", "1", "2")
    told = servos.told("disable", "1", "2")
    assert "the AX-12 at id 1 ignores goals until 'servo enable'" in told
    assert "the XL430-W250 at id 2 is relaxed: no goal switches its torque on" in told
    assert [servos.line[number].get("torque_enable") for number in (1, 2)] == [0, 0]
    before = servos.position(1)
    servos.told("write", "1", "goal_position=90 deg")
    assert servos.line[1].get("torque_enable") == 1  # by its firmware
    servos.line[1].step(1.0, 1.0)
    assert servos.position(1) == before
    servos.told("enable", "1")
    assert servos.line[1].get("torque_limit") == 1023
    assert servos.position(1) == before
    servos.told("write", "1", "goal_position=90 deg")
    servos.line[1].step(1.0, 1.0)
    assert servos.position(1) != before


def test_a_relaxed_servo_of_protocol_1_takes_torque_by_its_next_goal(servos: Bench) -> None:
    servos.told("relax", "1")
    servos.told("write", "1", "goal_position=90 deg")
    servos.line[1].step(1.0, 1.0)
    assert servos.position(1) == 819


def test_a_torque_limit_of_its_owner_survives(servos: Bench) -> None:
    servos.told("write", "1", "torque_limit=300")
    servos.told("relax", "1")
    servos.told("enable", "1")
    assert servos.line[1].get("torque_limit") == 300
    told = json.loads(servos.told("disable", "1", "2", "--json"))
    assert told == {"written": [1, 2], "failed": [], "limited": [1]}


def test_all_that_answer_are_relaxed(servos: Bench) -> None:
    servos.told("enable", "2")
    servos.told("relax", "--all", "--last", "3")
    assert servos.line[2].get("torque_enable") == 0


def test_reboot_and_identify(servos: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []
    look = SimpleNamespace(sleep=lambda _: seen.append(servos.line[2].get("led")))
    monkeypatch.setattr("rbxcompose.domains.servos.command_actions.time", look)  # there alone: other threads sleep, too
    servos.told("identify", "2")
    assert seen == [1, 0, 1, 0, 1, 0]
    servos.told("enable", "2")
    servos.told("reboot", "2")
    assert servos.line[2].get("torque_enable") == 0
    assert "switch it off and on" in servos.told("reboot", "1", code=1)


def test_a_port_that_cannot_be_used_is_told(servos: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    servos.port.unplug()
    assert "RBX2201" in servos.told("ping", "1", code=1)
    assert main(["servo", "scan", "--port", "/dev/null"]) == 1
    assert "RBX2204" in capsys.readouterr().err


def test_a_slow_adapter_is_warned_of(servos: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.servos.dynamixel_bus.latency_of", lambda _: 0.016)
    assert "RBX2206" in servos.told("ping", "1")


def test_servos_without_their_package_are_told_what_to_install(servos: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.servos.commands.servo.find_spec", lambda _: None)
    assert "pip install 'rbxcompose[servos]'" in servos.told("ping", "1", code=1)


def test_a_scan_spends_a_few_milliseconds_per_id(servos: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["servo", "scan", "--port", str(servos.port.path), "--baud", "1000000", "--last", "50"]
    began = time.monotonic()
    main(words)
    assert time.monotonic() - began < 51 * 2 * 0.02

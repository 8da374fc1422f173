"""The Dynamixel bus with the real SDK on a pseudo-terminal: mixed protocols, partial results, spoilt replies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from typing import Any, Protocol

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.servos.bus import FoundServo, ServoBus
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_line import READ, SYNC_READ, SYNC_WRITE, FakeReply, status
from rbxcompose.domains.servos.twins.servo_twin import FakePort
from tests.actuation.conftest import Plugged
from tests.soak import rare

STATE = ("present_position", "present_speed", "present_load")
PATIENT, BRISK = 0.2, 0.03  # [s] timeouts: where all answer, and where some do not
MIXED = {1: "AX-12", 2: "MX-28", 3: "XL430-W250", 4: "XM430-W350", 5: "PH54-200", 6: "XL-320", 7: "AX-18", 8: "MX-64"}
SIX = dict.fromkeys(range(1, 7), "XL430-W250")
SIX_OLD = dict.fromkeys(range(1, 7), "AX-12")


class Connect(Protocol):
    def __call__(self, names: dict[int, str], *, echo: bool = ..., **options: Any) -> tuple[DynamixelBus, FakePort]: ...


@pytest.fixture
def connect(plugged: Plugged) -> Iterator[Connect]:
    with ExitStack() as stack:

        def made(names: dict[int, str], *, echo: bool = False, **options: Any) -> tuple[DynamixelBus, FakePort]:
            port = plugged(*(FakeServo(name, one) for one, name in names.items()), has_echo=echo)
            models = {one: servo_models()[name] for one, name in names.items()}
            bus = stack.enter_context(DynamixelBus(str(port.path), models, **{"timeout": PATIENT, **options}))
            return bus, port

        yield made


def positions(bus: ServoBus, ids: Iterable[int]) -> dict[int, int]:
    found = bus.read(sorted(ids), STATE)
    return {number: reading.values["present_position"] for number, reading in found.items()}


def test_servos_of_both_protocols_and_all_tables_are_read_and_written_together(
    connect: Connect, clock: SteppedClock
) -> None:
    bus, port = connect(MIXED)
    for number in MIXED:
        port.line[number].move_to(100 + number)
    assert positions(bus, MIXED) == {one: 100 + one for one in MIXED}
    assert bus.write({one: {"torque_enable": 1} for one in MIXED}) == set()
    assert bus.write({one: {"goal_position": 200 + one} for one in MIXED}) == set()
    bus.read([1], STATE)  # a reply: what was sent before it has arrived
    clock.advance_to(5.0)
    assert positions(bus, MIXED) == {one: 200 + one for one in MIXED}
    assert all(bus.statistics[one].reads >= 2 and not bus.statistics[one].errors for one in MIXED)


def test_a_group_is_one_request_where_the_protocol_allows_it(connect: Connect) -> None:
    bus, port = connect({**SIX, 11: "AX-12", 12: "AX-12"})
    del port.line.received[:]
    bus.read(sorted(bus.servos), STATE)
    assert [packet.instruction for packet in port.line.received] == [SYNC_READ, READ, READ]
    bus.write({servo: {"goal_position": 300} for servo in bus.servos})
    bus.read([1], STATE)
    assert [packet.instruction for packet in port.line.received[3:5]] == [SYNC_WRITE] * 2


def test_values_have_their_signs(connect: Connect) -> None:
    bus, port = connect({1: "XL430-W250", 2: "AX-12", 3: "PH54-200"})
    port.line[1].move_to(-500)
    port.line[3].move_to(-123456)
    port.line[2].load = -0.25
    port.line[2].step(0.0, 0.0)
    found = bus.read([1, 2, 3], STATE)
    assert found[1].values["present_position"] == -500
    assert found[3].values["present_position"] == -123456
    assert found[2].values["present_load"] == -250


def test_what_looks_like_the_beginning_of_a_packet_is_sent_and_read_as_data(connect: Connect) -> None:
    bus, port = connect({1: "XL430-W250"})
    assert bus.write({1: {"operating_mode": 4}}, is_confirmed=True) == set()
    for raw in (0x00FDFFFF, 0x7DFDFFFF, -3, -259):
        assert bus.write({1: {"goal_position": raw}}, is_confirmed=True) == set()
        assert bus.read([1], ["goal_position"])[1].values["goal_position"] == raw
    assert port.line[1].get("goal_position") == -259


@pytest.mark.parametrize("is_fast", [True, *rare(False)])
@pytest.mark.parametrize("names", [SIX, SIX_OLD, dict.fromkeys(range(1, 7), "MX-28")], ids=["2.0", "1.0", "bulk"])
@pytest.mark.parametrize("silences_next", [False, True])
def test_a_mute_servo_costs_only_itself(
    connect: Connect, names: dict[int, str], silences_next: bool, is_fast: bool
) -> None:
    bus, port = connect(names, timeout=BRISK, is_fast=is_fast)
    port.line[2].faults.is_mute, port.line[2].faults.silences_next = True, silences_next
    for _ in range(4):
        assert bus.read(range(1, 7), STATE).keys() >= {1, 3, 4, 5, 6} - ({3} if silences_next else set())
    assert bus.attention.is_silent(2)
    assert bus.write({2: {"led": 1}, 3: {"led": 1}}) == {2}
    port.line[2].faults.is_mute = False
    bus.attention.forgive()
    assert 2 in bus.read(range(1, 7), STATE)


@pytest.mark.parametrize("names", [SIX, SIX_OLD], ids=["2.0", "1.0"])
@pytest.mark.parametrize("fault", ["corrupts", "cuts", "id", "garbage", "repeats"])
def test_a_spoilt_reply_costs_at_most_its_servo(connect: Connect, names: dict[int, str], fault: str) -> None:
    bus, port = connect(names, timeout=BRISK)
    values = {"corrupts": True, "cuts": 4, "id": 99, "garbage": b"\xff\xff\xfd\xff\x00\x01", "repeats": 2}
    setattr(port.line[2].faults, fault, values[fault])
    for number in names:
        port.line[number].move_to(500 + number)
    found = bus.read(range(1, 7), STATE)
    assert found.keys() >= {1, 3, 4, 5, 6}
    assert {one: reading.values["present_position"] for one, reading in found.items()} == {
        item: 500 + item for item in found
    }
    assert (2 in found) == (fault in ("garbage", "repeats"))
    assert bool(bus.statistics[2].errors + bus.statistics[2].timeouts) == (2 not in found)


def test_a_late_reply_costs_its_servo_and_spoils_nothing_after_it(connect: Connect) -> None:
    bus, port = connect(SIX, timeout=BRISK, retries=0)
    for index in SIX:
        port.line[index].move_to(500 + index)
    port.line[4].faults.delay = 1.5 * BRISK
    for _ in range(5):
        found = positions(bus, SIX)
        assert found.keys() >= SIX.keys() - {4}
        assert found == {number: 500 + number for number in found}


def test_a_late_reply_is_not_taken_for_that_of_another_item(connect: Connect) -> None:
    bus, port = connect({1: "XM430-W350"}, timeout=BRISK, retries=0)
    bus.write({1: {"bus_watchdog": 10}}, is_confirmed=True)
    hear, late = port.line.receive, list[FakeReply]()

    def delayed(data: bytes, baud: int | None = None) -> list[FakeReply]:
        replies, late[:] = [*late, *hear(data, baud)], []
        return replies

    def lost(data: bytes, baud: int | None = None) -> list[FakeReply]:
        late[:] = hear(data, baud)
        return []

    for item, other in (("bus_watchdog", "hardware_error"), ("hardware_error", "bus_watchdog")):
        port.line.receive = lost  # type: ignore[method-assign]
        assert bus.read([1], [item]) == {}
        port.line.receive = delayed  # type: ignore[method-assign]
        expected = {"hardware_error": 0, "bus_watchdog": 10}
        assert bus.read([1], [other])[1].values == {other: expected[other]}
        assert bus.read([1], [item])[1].values == {item: expected[item]}


def test_one_bad_reply_is_made_good_within_the_same_read(connect: Connect) -> None:
    bus, port = connect(SIX, timeout=BRISK)

    servo = port.line[3]
    servo.faults.corrupts = True
    hear = port.line.receive

    def healed(data: bytes, baud: int | None = None) -> Any:
        replies = hear(data, baud)
        servo.faults.corrupts = False
        return replies

    port.line.receive = healed  # type: ignore[method-assign]
    assert bus.read(range(1, 7), STATE).keys() == SIX.keys()
    assert bus.statistics[3].errors == 0


def test_no_retry_begins_when_the_budget_is_spent(connect: Connect) -> None:
    bus, port = connect(SIX, timeout=BRISK)
    port.line[2].faults.is_mute = True
    del port.line.received[:]
    bus.read(range(1, 7), STATE, budget=BRISK)
    assert [packet.instruction for packet in port.line.received] == [SYNC_READ]


def test_an_alert_is_told_beside_the_values_and_named_by_the_hardware_error(connect: Connect) -> None:
    bus, port = connect({1: "AX-12", 2: "XL430-W250"})
    for number in (1, 2):
        port.line[number].motor.temperature = 95
        port.line[number].step(0.1, 0.1)
    found = bus.read([1, 2], ["present_temperature", "hardware_error"])
    assert [found[one].values for one in (1, 2)] == [{"present_temperature": 95, "hardware_error": 4}] * 2
    assert (found[1].alert, found[2].alert) == (4, 128)
    port.line[2].motor.temperature = 30
    assert bus.write({2: {"torque_enable": 1}}, is_confirmed=True) == {2}
    assert bus.reboot(2)  # its reply tells the alert, and is no refusal
    assert not bus.reboot(1)
    assert bus.write({2: {"torque_enable": 1}}, is_confirmed=True) == set()


def test_an_adapter_that_echoes_is_noticed_and_its_echo_dropped(connect: Connect) -> None:
    bus, port = connect(MIXED, echo=True)
    assert bus.has_echo
    for number in MIXED:
        port.line[number].move_to(100 + number)
    assert positions(bus, MIXED) == {one: 100 + one for one in MIXED}
    assert bus.ping(1) == FoundServo(1, 1, 12, 1_000_000)


def test_a_refused_write_is_told_only_if_it_is_confirmed(connect: Connect) -> None:
    bus, port = connect({1: "AX-12", 2: "XL430-W250"})
    values = {number: {"goal_position": 5000} for number in (1, 2)}
    assert bus.write(values, is_confirmed=True) == {1, 2}
    assert bus.write(values) == set()
    with pytest.raises(ValueError, match="goal_position must be 0 to 65535"):
        bus.write({1: {"goal_position": -1}, 2: {"led": 1}})
    assert port.line[2].get("led") == 0


def test_a_scan_finds_servos_and_their_models(connect: Connect) -> None:
    bus, _ = connect({1: "AX-12", 9: "XL430-W250"}, timeout=BRISK)
    assert [(servo.id, servo.protocol, servo.name) for servo in bus.scan((0, 1, 9))] == [
        (1, 1, "AX-12"),
        (9, 2, "XL430-W250"),
    ]
    assert bus.ping(5) is None
    assert bus.count(1, 1) == 1
    assert bus.count(5, 2) == 0


@pytest.mark.parametrize(("model", "protocol"), [("AX-12", 1), ("XL430-W250", 2)])
def test_a_late_reply_to_something_else_tells_no_model(connect: Connect, model: str, protocol: int) -> None:
    bus, port = connect({1: model}, timeout=BRISK, retries=0)
    hear = port.line.receive
    port.line.receive = lambda data, baud=None: [FakeReply(0.0, status(protocol, 1, 0))]  # type: ignore[method-assign]
    assert bus.ping(1) is None
    port.line.receive = lambda data, baud=None: [  # type: ignore[method-assign]
        FakeReply(0.0, status(protocol, 1, 0)),
        *hear(data, baud),
    ]
    found = bus.ping(1)
    assert found
    assert found.name == model


@pytest.mark.parametrize("model", ["AX-12", "XL430-W250"])
def test_two_servos_with_one_id_are_told_apart_from_one(plugged: Plugged, model: str) -> None:
    port = plugged(FakeServo(model, 1), FakeServo(model, 1))
    with DynamixelBus(str(port.path), timeout=BRISK) as bus:
        assert bus.count(1, servo_models()[model].protocol) == 2

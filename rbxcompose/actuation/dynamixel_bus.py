"""A bus of Dynamixel servos of both protocols, over the SDK's packets on a port that waits without spinning."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Self

from dynamixel_sdk import COMM_SUCCESS

from rbxcompose.actuation.attention import Attention
from rbxcompose.actuation.bus import FoundServo, ServoReading, ServoStatistics
from rbxcompose.actuation.dynamixel_packets import Answer, NoAnswer, packets_by_protocol
from rbxcompose.actuation.dynamixel_port import BlockingPort
from rbxcompose.actuation.dynamixel_reads import GroupRead, ServoReader, in_other_order
from rbxcompose.actuation.groups import FACTORY_DELAY, in_chunks
from rbxcompose.actuation.servo_models import ServoModel
from rbxcompose.actuation.transfers import ReadPlan, Stretch, WritePlan, read_plan, write_plans
from rbxcompose.devices.port_errors import LostPortError
from rbxcompose.devices.serial_ports import latency_of, port_path

IDS = range(253)
_SLACK = 0.001  # [s] beyond the latency timer of an adapter
_MODEL = Stretch(0, 2)  # where all tables have the model's number
_NOBODY = b"\xff\xff\xfe\x04\x83\x00\x01\x79"  # a group write to no servo, for which nobody sends a reply


class DynamixelBus:
    """A bus on the serial port `path` at `baud` [bit/s], with models of servos by their ids.

    The path may be `usb:VENDOR:PRODUCT:SERIAL`, the name of a device, which is looked up whenever the port is opened.

    A reply may be `timeout` [s] later than wire and pauses allow (more if the adapter's latency timer is longer), and
    `return_delay` [s] is the longest pause of any servo before its reply. `retries` is how often a read tries again.
    With `is_fast`, servos of protocol 2.0 answer group reads in one packet, which old firmware cannot.

    Raises:
        PortError: if the port cannot be opened.
    """

    def __init__(
        self,
        path: str,
        servos: Mapping[int, ServoModel] | None = None,
        *,
        baud: int = 1_000_000,
        timeout: float = 0.002,
        retries: int = 1,
        return_delay: float = FACTORY_DELAY,
        is_fast: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.path, self.baud, self.retries, self.return_delay = path, baud, retries, return_delay
        self.is_fast = is_fast
        self.servos = dict(servos or {})
        self.attention = Attention()
        self._patience = timeout
        self._clock = clock
        self._packets = packets_by_protocol()
        self._reader = ServoReader(self._packets, clock)
        self._plans: dict[tuple[str, tuple[str, ...]], ReadPlan] = {}
        self._writes: dict[tuple[str, tuple[str, ...]], tuple[WritePlan, ...]] = {}
        self._port: BlockingPort | None = self._opened()

    def _opened(self) -> BlockingPort:
        self.opened_at = path = port_path(self.path)  # a device that was plugged in again may have another one
        self.latency = latency_of(path)
        self._timeout = self._patience if self.latency is None else max(self._patience, self.latency + _SLACK)
        port = BlockingPort(path, self.baud, timeout=self._timeout, clock=self._clock)
        try:
            port.writePort(_NOBODY)
            port.wait_for(len(_NOBODY))
            port.has_echo = port.readPort(len(_NOBODY)) == _NOBODY
        except LostPortError:
            port.closePort()
            raise
        port.reply_delay = self.return_delay
        return port

    def __enter__(self) -> Self:
        """Return the open bus."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    @property
    def statistics(self) -> Mapping[int, ServoStatistics]:
        """Return how well each servo answers, by id."""
        return self.attention.statistics

    @property
    def strays(self) -> int:
        """Return the number of replies that nobody waited for."""
        return self._reader.strays

    @property
    def is_open(self) -> bool:
        """Tell whether the port is there."""
        return self._port is not None

    @property
    def has_echo(self) -> bool:
        """Tell whether the adapter returns what it sends."""
        return self._port is not None and self._port.has_echo

    @contextmanager
    def _in_use(self) -> Iterator[BlockingPort]:
        """Lend the port; one that has gone is dropped, since the SDK never recovers an old one."""
        if self._port is None:
            raise LostPortError(self.path, "is not open")
        try:
            yield self._port
        except LostPortError:
            self.close()
            raise

    def ping(self, id: int, protocol: int | None = None) -> FoundServo | None:
        """Return the servo at an id, None if it is silent; of an id that is not known, ask in both protocols."""
        known = self.servos.get(id)
        protocols = (protocol,) if protocol else (known.protocol,) if known else (2, 1)
        found = (self._pinged(id, one) for one in protocols for _ in range(self.retries + 1))
        return next((one for one in found if one), None)

    def _pinged(self, id: int, protocol: int) -> FoundServo | None:
        with self._in_use() as port:
            number, result, _ = self._packets[protocol].ping(port, id)
        return FoundServo(id, protocol, number, self.baud) if result == COMM_SUCCESS else None

    def scan(self, ids: Iterable[int] = IDS, protocols: Sequence[int] = (1, 2)) -> Iterator[FoundServo]:
        """Yield the servos that answer, asking each id once in each protocol."""
        for servo in ids:
            for protocol in protocols:
                if found := self._pinged(servo, protocol):
                    yield found

    def count(self, id: int, protocol: int) -> int:
        """Return how many servos answer at an id, so far as their replies can be told apart; 0 if it is silent."""
        replies = 0
        with self._in_use() as port:
            packets = self._packets[protocol]
            packets.ask(port, {id: _MODEL})
            port.wait_for(2 * (packets.reply + _MODEL.length), replies=2)
            while (answer := packets.receive(port)) is not NoAnswer.SILENCE:
                # Two that speak at once spoil each other's reply.
                replies += 2 if answer is NoAnswer.CORRUPT else isinstance(answer, Answer)
        return replies

    def read(self, ids: Sequence[int], items: Sequence[str], *, budget: float | None = None) -> dict[int, ServoReading]:
        """Return the items of all servos that answered.

        What failed is tried again while less than `budget` [s] has passed, unless it had failed before this read.

        Raises:
            KeyError: if a servo is not known, or has no such item.
            PortError: if the port has gone.
        """
        began, names = self._clock(), tuple(items)
        read = GroupRead({one: self._plan(one, names) for one in self.attention.due(ids, began)})
        with self._in_use() as port:
            if self.is_fast:
                sure = [one for one in read.plans if not self.attention.of(one).misses]
                self._reader.attempt(port, read, self._models(sure), is_fast=True)
            asked = list(read.open)
            for _ in range(self.retries + 1):
                self._reader.attempt(port, read, self._models(asked))
                failed = [one for one in asked if one in read.open and not self.attention.of(one).misses]
                if not failed or (budget is not None and self._clock() - began + self._timeout > budget):
                    break
                asked = in_other_order(failed)
        return self._judged(read)

    def _judged(self, read: GroupRead) -> dict[int, ServoReading]:
        now = self._clock()
        found: dict[int, ServoReading] = {}
        for servo in read.plans:
            if servo in read.open:
                self.attention.missed(servo, now, is_corrupt=servo in read.corrupt)
            else:
                found[servo] = read.reading(servo)
                self.attention.answered(servo, found[servo].stamp)
        return found

    def _models(self, ids: Iterable[int]) -> dict[int, ServoModel]:
        return {one: self.servos[one] for one in ids}

    def _plan(self, id: int, names: tuple[str, ...]) -> ReadPlan:
        model = self.servos[id]
        key = (model.name, names)
        if key not in self._plans:
            self._plans[key] = read_plan(model, names)
        return self._plans[key]

    def _write_plans(self, id: int, names: tuple[str, ...]) -> tuple[WritePlan, ...]:
        model = self.servos[id]
        key = (model.name, names)
        if key not in self._writes:
            self._writes[key] = write_plans(model, names)
        return self._writes[key]

    def write(self, values: Mapping[int, Mapping[str, int]], *, is_confirmed: bool = False) -> set[int]:
        """Write raw values, by id and item; return the ids that failed.

        Without a confirmation, those fail that are silent already or whose packet was not sent.

        Raises:
            KeyError: if a servo is not known, or has no such item.
            ValueError: if a value does not fit into its item, or two are the same memory; then nothing is written.
            PortError: if the port has gone.
        """
        groups: dict[tuple[int, Stretch], dict[int, bytes]] = defaultdict(dict)
        for servo, raws in values.items():
            protocol = self.servos[servo].protocol
            for plan in self._write_plans(servo, tuple(raws)):
                groups[protocol, plan.stretch][servo] = plan.data(raws)
        failed = set() if is_confirmed else {one for one in values if self.attention.is_silent(one)}
        write = self._write_each if is_confirmed else self._write_group
        for (number, at), parts in groups.items():
            failed |= write(number, at, parts)
        return failed

    def _write_group(self, protocol: int, at: Stretch, data: Mapping[int, bytes]) -> set[int]:
        failed: set[int] = set()
        packets = self._packets[protocol]
        with self._in_use() as port:
            for chunk in in_chunks(data, 1 + at.length, packets.group):
                if not packets.write_group(port, at, {one: data[one] for one in chunk}):
                    failed.update(chunk)
        return failed

    def _write_each(self, protocol: int, at: Stretch, data: Mapping[int, bytes]) -> set[int]:
        return {one for one, part in data.items() if not self._is_written(protocol, one, at, part)}

    def _is_written(self, protocol: int, id: int, at: Stretch, data: bytes) -> bool:
        """Write to one servo until it confirms or refuses; return whether it has confirmed."""
        packets = self._packets[protocol]
        with self._in_use() as port:
            for _ in range(self.retries + 1):
                result, error = packets.writeTxRx(port, id, at.address, at.length, list(data))
                if result == COMM_SUCCESS:
                    return not packets.is_refusal(error)
        return False

    def reboot(self, id: int) -> bool:
        """Start a servo again, torque off; return whether it did, which only those of protocol 2.0 can."""
        with self._in_use() as port:
            packets = self._packets[self.servos[id].protocol]
            result, error = packets.reboot(port, id)
        return bool(result == COMM_SUCCESS and not packets.is_refusal(error))

    def verify(self) -> dict[int, FoundServo | None]:
        """Return who answers at the id of each servo, None where nobody does."""
        return {one: self.ping(one) for one in self.servos}

    def reopen(self, *, is_relaxed: bool = True) -> dict[int, FoundServo | None]:
        """Open the port anew, and return who answers at each id; with `is_relaxed`, torque is switched off first.

        Raises:
            PortError: if it cannot be opened.
        """
        self.close()
        self._port = self._opened()
        self.attention.forgive()
        if is_relaxed:
            self.relax(self.servos)
        return self.verify()

    def relax(self, ids: Iterable[int]) -> set[int]:
        """Switch torque off, twice, since nobody confirms it; return the ids that failed."""
        values = {one: {"torque_enable": 0} for one in ids}
        self.write(values)
        return self.write(values)

    def close(self) -> None:
        """Give the port back; torque stays as it is."""
        if self._port is not None:
            port, self._port = self._port, None
            port.closePort()

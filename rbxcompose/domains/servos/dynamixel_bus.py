"""A bus of Dynamixel servos of both protocols, over the SDK's packets on a port that waits with a deadline."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Self

from dynamixel_sdk import COMM_SUCCESS

from rbxcompose.base.findings import Finding
from rbxcompose.domains.devices.serial_ports import LostPortError, latency_of, port_path
from rbxcompose.domains.servos import bus as servo_bus
from rbxcompose.domains.servos.bus import ID_TAKEN, REFUSED, SILENT, UNKNOWN_MODEL
from rbxcompose.domains.servos.dynamixel_port import (
    MODEL,
    Answer,
    BlockingPort,
    NoAnswer,
    Packets,
    PacketsTwo,
    packets_by_protocol,
)
from rbxcompose.domains.servos.models import ServoModel
from rbxcompose.domains.servos.transfers import ReadPlan, Stretch, WritePlan, read_plan, write_plans


class Attention:
    """Keeps the statistics of servos, and skips those that missed `patience` reads in a row.

    One of those is probed each `period` [s], so that at most one silent servo costs its timeout in one cycle. The
    period is short against the time after which a joint without measurements is a fault: a few lost replies are none.
    """

    def __init__(self, patience: int = 3, period: float = 0.1) -> None:
        self.patience, self.period = patience, period
        self.statistics: defaultdict[int, servo_bus.ServoStatistics] = defaultdict(servo_bus.ServoStatistics)
        self._probed: dict[int, float] = {}

    def is_silent(self, id: int) -> bool:
        """Tell whether a servo is skipped."""
        return self.statistics[id].misses >= self.patience

    def due(self, ids: Iterable[int], now: float) -> list[int]:
        """Return whom to ask: those that answer in their order, then doubtful ones, then at most one probe.

        Those that may be silent are last, because some servos that follow a silent one keep waiting for it.
        """
        asked: list[int] = []
        doubtful: list[tuple[int, int]] = []
        for number in ids:
            misses = self.statistics[number].misses
            if misses:
                doubtful.append((misses, number))
            else:
                asked.append(number)
        asked += [one for misses, one in sorted(doubtful) if misses < self.patience]
        return asked + self._probe([one for misses, one in doubtful if misses >= self.patience], now)

    def _probe(self, silent: list[int], now: float) -> list[int]:
        waiting = [number for number in silent if now - self._probed[number] >= self.period]
        for chosen in sorted(waiting, key=self._probed.__getitem__)[:1]:
            self._probed[chosen] = now
            return [chosen]
        return []

    def answered(self, id: int, now: float) -> None:
        """Note a reply."""
        known = self.statistics[id]
        known.reads += 1
        known.misses, known.last_seen = 0, now

    def missed(self, id: int, now: float, *, is_corrupt: bool) -> None:
        """Note that a read has failed in all of its attempts."""
        known = self.statistics[id]
        known.misses += 1
        if is_corrupt:
            known.errors += 1
        else:
            known.timeouts += 1
        if known.misses == self.patience:
            self._probed[id] = now

    def forgive(self) -> None:
        """Ask all again, after the bus was opened again."""
        self._probed.clear()
        for known in self.statistics.values():
            known.misses = 0


class GroupRead:
    """One read of several servos: by id, how it is read and what has come of it so far."""

    def __init__(self, plans: Mapping[int, ReadPlan]) -> None:
        self.plans = plans
        self.open = {servo: plan.stretches[0] for servo, plan in plans.items()}
        """The next stretch of each servo that is not whole."""
        self.corrupt: set[int] = set()
        """Those whose reply was corrupt, or may have been."""
        self._parts: dict[int, list[bytes]] = {servo: [] for servo in plans}
        self._last: dict[int, tuple[float, int]] = {}  # time [s] and error byte of the last reply

    def next_of(self, ids: Iterable[int]) -> dict[int, Stretch]:
        """Return the next stretch of each of these servos that is not whole."""
        return {servo: self.open[servo] for servo in ids if servo in self.open}

    def take(self, answer: Answer, now: float) -> None:
        """Keep the next stretch of a servo."""
        parts, stretches = self._parts[answer.id], self.plans[answer.id].stretches
        parts.append(answer.data)
        self._last[answer.id] = now, answer.error
        if len(parts) < len(stretches):
            self.open[answer.id] = stretches[len(parts)]
        else:
            del self.open[answer.id]

    def reading(self, id: int) -> servo_bus.ServoReading:
        """Return what a servo reported, once it is whole."""
        stamp, alert = self._last[id]
        return servo_bus.ServoReading(self.plans[id].values(self._parts[id], alert), stamp, alert)


class ServoReader:
    """Carries out group reads on a port."""

    def __init__(self, packets: Mapping[int, Packets], clock: Callable[[], float]) -> None:
        self._packets, self._clock = packets, clock

    def attempt(
        self, port: BlockingPort, read: GroupRead, models: Mapping[int, ServoModel], *, is_fast: bool = False
    ) -> None:
        """Ask servos once, by id, for all that they have not reported yet; one that fails is not asked for the rest."""
        for protocol, group in servo_bus.request_groups(models):
            wanted = read.next_of(group)
            while wanted:
                found = self._exchange(port, protocol, wanted, read, is_fast=is_fast)
                wanted = read.next_of(found)

    def _exchange(
        self, port: BlockingPort, protocol: int, wanted: Mapping[int, Stretch], read: GroupRead, *, is_fast: bool
    ) -> list[int]:
        """Ask for one stretch of each servo; return those that answered."""
        packets = self._packets[protocol]
        missing = dict(wanted)
        if isinstance(packets, PacketsTwo) and is_fast and len(missing) > 1 and len(set(missing.values())) == 1:
            answers = _fast(port, packets, missing)
        else:
            answers = _plain(port, packets, missing)
        for answer in answers:
            if answer is NoAnswer.CORRUPT:
                read.corrupt |= missing.keys()
            elif isinstance(answer, Answer) and answer.id in missing and len(answer.data) == missing[answer.id].length:
                del missing[answer.id]
                read.take(answer, self._clock())
        return [servo for servo in wanted if servo not in missing]


def _plain(port: BlockingPort, packets: Packets, missing: Mapping[int, Stretch]) -> Iterator[Answer | NoAnswer]:
    """Yield replies until nothing is missing or the time of all replies is over."""
    if not packets.ask(port, missing):
        return
    length = sum(packets.reply + stretch.length for stretch in missing.values())
    port.wait_for(length, len(missing))
    while missing:
        answer = packets.receive(port)
        yield answer
        if answer is NoAnswer.SILENCE:
            break


def _fast(port: BlockingPort, packets: PacketsTwo, missing: Mapping[int, Stretch]) -> Iterator[Answer | NoAnswer]:
    [length] = {stretch.length for stretch in missing.values()}
    if packets.ask(port, missing, is_fast=True):
        port.wait_for(packets.reply + len(missing) * (length + 4), len(missing))
        yield from packets.receive_fast(port, length)


def in_other_order(ids: Sequence[int]) -> list[int]:
    """Return ids with the first one last: it may have kept those behind it from answering."""
    return [*ids[1:], *ids[:1]]


IDS = range(253)
_SLACK = 0.001  # [s] beyond the latency timer of an adapter
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
        return_delay: float = servo_bus.FACTORY_DELAY,
        is_fast: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.path, self.baud, self.retries, self.return_delay = path, baud, retries, return_delay
        self.is_fast = is_fast
        self.servos = dict(servos or {})
        self.attention = Attention()
        self.statistics = self.attention.statistics
        self._patience = timeout
        self._clock = clock
        self._packets = packets_by_protocol()
        self._reader = ServoReader(self._packets, clock)
        self._plans: dict[tuple[str, tuple[str, ...]], ReadPlan] = {}
        self._lengths: defaultdict[str, dict[int, int]] = defaultdict(dict)  # of stretches of a model, with their ends
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

    def ping(self, id: int, protocol: int | None = None) -> servo_bus.FoundServo | None:
        """Return the servo at an id, None if it is silent; of an id that is not known, ask in both protocols."""
        known = self.servos.get(id)
        protocols = (protocol,) if protocol else (known.protocol,) if known else (2, 1)
        found = (self._pinged(id, one) for one in protocols for _ in range(self.retries + 1))
        return next((servo for servo in found if servo), None)

    def _pinged(self, id: int, protocol: int) -> servo_bus.FoundServo | None:
        packets = self._packets[protocol]
        with self._in_use() as port:
            packets.ask_model(port, id)
            while (answer := packets.receive(port)) is not NoAnswer.SILENCE:
                if isinstance(answer, Answer) and answer.id == id and len(answer.data) == packets.greeting:
                    return servo_bus.FoundServo(id, protocol, int.from_bytes(answer.data[:2], "little"), self.baud)
        return None

    def scan(self, ids: Iterable[int] = IDS, protocols: Sequence[int] = (1, 2)) -> Iterator[servo_bus.FoundServo]:
        """Yield the servos that answer, asking each id once in each protocol."""
        for servo in ids:
            for protocol in protocols:
                if found := self._pinged(servo, protocol):
                    yield found

    def count(self, id: int, protocol: int) -> int:
        """Return how many servos answer at an id, so far as their replies can be distinguished; 0 if it is silent."""
        replies = 0
        with self._in_use() as port:
            packets = self._packets[protocol]
            packets.ask(port, {id: MODEL})
            port.wait_for(2 * (packets.reply + MODEL.length), replies=2)
            while (answer := packets.receive(port)) is not NoAnswer.SILENCE:
                # Two that speak at once spoil each other's reply.
                replies += 2 if answer is NoAnswer.CORRUPT else isinstance(answer, Answer)
        return replies

    def read(
        self, ids: Sequence[int], items: Sequence[str], *, budget: float | None = None
    ) -> dict[int, servo_bus.ServoReading]:
        """Return the items of all servos that answered.

        What failed is tried again while less than `budget` [s] has passed, unless it had failed before this read.

        Raises:
            KeyError: if a servo is not known, or has no such item.
            PortError: if the port has gone.
        """
        began, names = self._clock(), tuple(items)
        read = GroupRead({number: self._plan(number, names) for number in self.attention.due(ids, began)})
        with self._in_use() as port:
            if self.is_fast:
                sure = [number for number in read.plans if not self.statistics[number].misses]
                self._reader.attempt(port, read, self._models(sure), is_fast=True)
            asked = list(read.open)
            for _ in range(self.retries + 1):
                self._reader.attempt(port, read, self._models(asked))
                failed = [number for number in asked if number in read.open and not self.statistics[number].misses]
                if not failed or (budget is not None and self._clock() - began + self._timeout > budget):
                    break
                asked = in_other_order(failed)
        return self._judged(read)

    def _judged(self, read: GroupRead) -> dict[int, servo_bus.ServoReading]:
        now = self._clock()
        found: dict[int, servo_bus.ServoReading] = {}
        for servo in read.plans:
            if servo in read.open:
                self.attention.missed(servo, now, is_corrupt=servo in read.corrupt)
            else:
                found[servo] = read.reading(servo)
                self.attention.answered(servo, found[servo].stamp)
        return found

    def _models(self, ids: Iterable[int]) -> dict[int, ServoModel]:
        return {number: self.servos[number] for number in ids}

    def _plan(self, id: int, names: tuple[str, ...]) -> ReadPlan:
        model = self.servos[id]
        key = (model.name, names)
        if key not in self._plans:
            self._plans[key] = read_plan(model, names, self._lengths[model.name])
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
            for chunk in servo_bus.in_chunks(data, 1 + at.length, packets.group):
                if not packets.write_group(port, at, {number: data[number] for number in chunk}):
                    failed.update(chunk)
        return failed

    def _write_each(self, protocol: int, at: Stretch, data: Mapping[int, bytes]) -> set[int]:
        return {number for number, part in data.items() if not self._is_written(protocol, number, at, part)}

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

    def verify(self) -> dict[int, servo_bus.FoundServo | None]:
        """Return who answers at the id of each servo, None where nobody does."""
        return {number: self.ping(number) for number in self.servos}

    def reopen(self, *, is_relaxed: bool = True) -> dict[int, servo_bus.FoundServo | None]:
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
        values = {number: {"torque_enable": 0} for number in ids}
        self.write(values)
        return self.write(values)

    def close(self) -> None:
        """Give the port back; torque stays as it is."""
        if self._port is not None:
            port, self._port = self._port, None
            port.closePort()


_PROTOCOLS = (1, 2)
_ALONE = "disconnect all servos but the one that is meant"


def change_id(bus: DynamixelBus, old: int, new: int) -> Finding | None:
    """Give the only servo at `old` the free id `new`, with torque off; return what is wrong, None if it is done.

    Raises:
        ValueError: if an id is not 0 to 252.
        PortError: if the port has gone.
    """
    if old not in IDS or new not in IDS:
        raise ValueError("ids are 0 to 252")
    counted = sum(bus.count(old, protocol) for protocol in _PROTOCOLS)
    if not counted:
        return SILENT.at(None, f"no servo answers at id {old}", help="'rbxcompose servo scan' shows who does")
    if counted > 1:
        return ID_TAKEN.at(None, f"more than one servo answers at id {old}", help=_ALONE)
    if new != old and any(bus.count(new, protocol) for protocol in _PROTOCOLS):
        return ID_TAKEN.at(None, f"a servo has the id {new} already", help=_ALONE)
    return _changed(bus, old, new)


def _changed(bus: DynamixelBus, old: int, new: int) -> Finding | None:
    found = bus.ping(old)
    if found is None or found.model is None:
        return UNKNOWN_MODEL.at(None, f"the servo at id {old} is of no known model", help="use its maker's tool")
    bus.servos[old] = found.model
    bus.write({old: {"torque_enable": 0}}, is_confirmed=True)
    bus.write({old: {"id": new}}, is_confirmed=True)  # some confirm under the new id, so only a ping shows it
    del bus.servos[old]
    if bus.ping(new, found.protocol) is None:
        locked = "; its memory may be locked until it is switched off and on" if found.protocol == 1 else ""
        return REFUSED.at(None, f"the servo at id {old} has not taken the id {new}{locked}")
    return None

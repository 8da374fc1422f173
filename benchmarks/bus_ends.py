"""Ends of the bus, each a process of its own that takes orders by line: `python -m benchmarks.bus_ends ROLE PORT`.

An order is a JSON list of a method's name and its arguments; the answer is one line of JSON.
"""

from __future__ import annotations

import itertools
import json
import selectors
import sys
import threading
import time
from collections.abc import Callable
from itertools import count
from typing import Any

import zenoh
from zenoh.handlers import Callback

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import Attachment, data_key, decode_attachment
from rbxcompose.bus.services import Client
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterValue, SetParameters
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.runtime.process_group.connection import CallbackInbox, Turns
from rbxcompose.runtime.process_group.host import Host
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing.bench import instance

TWIST = Twist(linear=Vector3(x=0.3), angular=Vector3(z=-1.0))
PAYLOAD = encode(TWIST)
SOURCE = Attachment(1, 0, bytes(16)).encode()
ASK, FLOOD = "bare/ask", "bare/flood"
OUR_FLOOD = data_key(0, "/flood", Twist.TYPE, Twist.HASH)
PATIENCE = 10.0  # [s] for anything to come
QUIET = 0.3  # [s] without a message after which a flood is over
DOUBLE = 3  # the type of a parameter


class Ours:
    """A process as the runtime has it: one thread that turns the scheduler, and lends turns while it rests."""

    def __init__(self, port: int) -> None:
        self.clock, self.scheduler, self.inbox = MonotonicClock(), Scheduler(), CallbackInbox()
        self.turns = Turns(self.scheduler, self.clock, self.inbox)
        self.bus = Bus(
            self.scheduler,
            self.clock,
            transport=ZenohTransport(open_peer(f"tcp/127.0.0.1:{port}"), self.inbox.put, self.turns),
            log=lambda owner, text: None,
        )
        self._selector = selectors.SelectSelector()
        self._selector.register(self.inbox, selectors.EVENT_READ)
        self.turns.open()

    def turn(self, *also: Any) -> bool:
        """Wait for something and do it; return whether one of the files `also` can be read."""
        due = self.scheduler.next_due()
        longest = QUIET if due is None else max(0.0, min(QUIET, due - self.clock.now()))
        self.turns.rest(self.clock.now() + longest)
        ready = self._selector.select(longest)
        self.turns.resume()
        self.inbox.drain(self.scheduler)
        self.scheduler.advance(self.clock.now())
        return any(key.fileobj is sys.stdin for key, _ in ready)

    def until(self, condition: Callable[[], object]) -> None:
        """Turn until `condition` holds."""
        deadline = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > deadline:
                raise TimeoutError("the other end does not answer")
            self.turn()

    def serve_orders(self, handle: Callable[[str], None]) -> None:
        """Turn for ever and carry out what comes by line."""
        self._selector.register(sys.stdin, selectors.EVENT_READ)
        while True:
            if self.turn():
                handle(sys.stdin.readline())


class OurEcho(Ours):
    """Sends each twist back, answers requests, has a component with parameters."""

    def __init__(self, port: int) -> None:
        super().__init__(port)
        self.bus.subscribe("echo", "ping", Twist, Qos.COMMAND, self.bus.publisher("echo", "pong", Twist, Qos.COMMAND))
        self.bus.serve("echo", "ask", SetBool, lambda request: SetBool.Response(success=request.data))
        battery = instance("battery", "battery_sim", {"runtime": "45 s"})
        plan = Plan("bench", "bench.yaml", (battery,))
        host = Host(plan, [battery], self.scheduler, self.clock, self.bus, lambda record: None, lambda notice: None)
        host.configure()
        host.activate(["battery"])
        host.start()


class OurAsker(Ours):
    """Measures: how long a twist is on its way there and back, how long a request, how many of a flood are handled."""

    def __init__(self, port: int) -> None:
        super().__init__(port)
        self._back: list[float] = []
        self._handled: list[float] = []
        self._ping = self.bus.publisher("asker", "ping", Twist, Qos.COMMAND)
        self.bus.subscribe("asker", "pong", Twist, Qos.COMMAND, lambda message: self._note_back())
        self._flood = self.bus.subscribe(
            "asker", "flood", Twist, Qos.EVENT, lambda message: self._handled.append(time.perf_counter())
        )
        self._ask = self.bus.client("asker", "ask", SetBool)
        self._set = self.bus.client("asker", "battery/set_parameters", SetParameters)
        self.until(lambda: self._ping.has_match and self._ask.is_available and self._set.is_available)

    def hop(self, number: int, pause: float) -> list[float]:
        """Return the times of `number` twists there and back [s], with `pause` [s] between two."""
        return [self._timed(lambda: self._ping(TWIST), pause) for _ in range(number)]

    def ask(self, number: int) -> list[float]:
        """Return the times of `number` requests [s]."""
        return [self._timed(lambda: self._ask(SetBool.Request(data=True), self._note), 0.0) for _ in range(number)]

    def set(self, number: int) -> list[float]:
        """Return the times of setting a parameter `number` times [s]."""
        return [self._timed(lambda value=value: self._set_to(40.0 + value % 10), 0.0) for value in range(number)]  # type: ignore[misc]

    def count_flood(self, number: int) -> dict[str, float]:
        """Return how many messages per second [Hz] of a flood were received and were handled."""
        before, self._handled = self._flood._inbox._arrived, []
        self.until(lambda: self._handled)
        while time.perf_counter() - self._handled[-1] < QUIET:
            self.turn()
        lasted = self._handled[-1] - self._handled[0]
        return {"received": (self._flood._inbox._arrived - before) / lasted, "handled": len(self._handled) / lasted}

    def _set_to(self, value: float) -> None:
        parameter = Parameter(name="runtime", value=ParameterValue(type=DOUBLE, double_value=value))
        self._set(SetParameters.Request(parameters=(parameter,)), self._note)

    def _note(self, reply: Any) -> None:
        if reply.response is None:
            raise ValueError(reply.error)
        self._note_back()

    def _note_back(self) -> None:
        self._back.append(time.perf_counter())
        self.inbox.wake()  # this thread waits for it, which no component would

    def _timed(self, send: Callable[[], object], pause: float) -> float:
        self._back.clear()
        time.sleep(pause)
        started = time.perf_counter()
        send()
        self.until(lambda: self._back)
        return self._back[0] - started


class OurSetter(Ours):
    """Sets parameters of a robot that runs, as a tool of ROS 2 does that stays connected."""

    def __init__(self, port: int) -> None:
        super().__init__(port)
        self._count = itertools.count(1)

    def set(self, component: str, name: str, number: int) -> list[float]:
        """Return the times of setting a parameter to a value that it has never had, `number` times [s]."""
        client = self.bus.client("setter", f"{component}/set_parameters", SetParameters)
        self.until(lambda: client.is_available)
        times = [_set(self, client, name, 50.0 + next(self._count) / 100.0) for _ in range(number)]
        client.close()
        return times


def _set(end: Ours, client: Client[SetParameters.Request, SetParameters.Response], name: str, value: float) -> float:
    answers: list[tuple[float, Reply[SetParameters.Response]]] = []

    def take(reply: Reply[SetParameters.Response]) -> None:
        answers.append((time.perf_counter(), reply))
        end.inbox.wake()  # this thread waits for it, which no component would

    parameter = Parameter(name=name, value=ParameterValue(type=DOUBLE, double_value=value))
    started = time.perf_counter()
    client(SetParameters.Request(parameters=(parameter,)), take)
    end.until(lambda: answers)
    ((ended, reply),) = answers
    if reply.response is None or not reply.response.results[0].successful:
        raise ValueError(f"'{name}' was not set: {reply}")
    return ended - started


class Bare:
    """A process that has nothing but Zenoh, with callbacks that run in its threads."""

    ping, pong = "bare/ping", "bare/pong"

    def __init__(self, port: int) -> None:
        self.session = open_peer(f"tcp/127.0.0.1:{port}")

    def publisher(self, key: str) -> zenoh.Publisher:
        """Declare a publisher that sends as ours do with commands."""
        priority, drop = zenoh.Priority.REAL_TIME, zenoh.CongestionControl.DROP
        return self.session.declare_publisher(key, priority=priority, express=True, congestion_control=drop)

    def serve_orders(self, handle: Callable[[str], None]) -> None:
        """Carry out what comes by line."""
        while True:
            handle(sys.stdin.readline())


class BareEcho(Bare):
    """Sends bytes back, answers requests, floods."""

    def __init__(self, port: int) -> None:
        super().__init__(port)
        self._pong = self.publisher(self.pong)
        self._kept = (
            self.session.declare_subscriber(self.ping, _direct(self._send_back)),
            self.session.declare_queryable(ASK, _direct(self._answer)),
        )

    def _send_back(self, sample: zenoh.Sample) -> None:
        self._pong.put(sample.payload.to_bytes())

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            query.reply(ASK, b"yes")

    def flood(self, key: str, number: int) -> int:
        """Send `number` twists as fast as the link takes them."""
        wait = zenoh.CongestionControl.BLOCK
        publisher = self.session.declare_publisher(key, priority=zenoh.Priority.DATA_HIGH, congestion_control=wait)
        time.sleep(QUIET)  # until the other end is known
        for _ in range(number):
            publisher.put(PAYLOAD, attachment=SOURCE)
        publisher.undeclare()  # type: ignore[no-untyped-call]
        return number


class BareAsker(Bare):
    """Measures what `OurAsker` measures."""

    def __init__(self, port: int) -> None:
        super().__init__(port)
        self._back = threading.Event()
        self._at = 0.0
        self._received: list[float] = []
        self._ping = self.publisher(self.ping)
        self._querier = self.session.declare_querier(ASK, express=True, priority=zenoh.Priority.INTERACTIVE_LOW)
        self._kept = (
            self.session.declare_subscriber(self.pong, _direct(self._note)),
            self.session.declare_subscriber(FLOOD, _direct(self._count)),
        )
        deadline = time.monotonic() + PATIENCE
        ends: list[Any] = [self._ping, self._querier]
        while not all(end.matching_status.matching for end in ends):
            if time.monotonic() > deadline:
                raise TimeoutError("the other end does not answer")
            time.sleep(0.01)

    def hop(self, number: int, pause: float) -> list[float]:
        """Return the times of `number` messages there and back [s], with `pause` [s] between two."""
        return [self._timed(self._send, pause) for _ in range(number)]

    def ask(self, number: int) -> list[float]:
        """Return the times of `number` requests [s]."""
        return [self._timed(lambda: self._querier.get(_direct(self._note), payload=b"?"), 0.0) for _ in range(number)]

    def count_flood(self, number: int) -> dict[str, float]:
        """Return how many messages per second of a flood were received [Hz]."""
        self._received = []
        deadline = time.monotonic() + PATIENCE
        while not self._received or time.perf_counter() - self._received[-1] < QUIET:
            if not self._received and time.monotonic() > deadline:
                raise TimeoutError("there is no flood")
            time.sleep(0.01)
        return {"received": len(self._received) / (self._received[-1] - self._received[0])}

    def _send(self) -> None:
        self._ping.put(PAYLOAD)

    def _note(self, received: Any) -> None:
        self._at = time.perf_counter()
        self._back.set()

    def _count(self, sample: zenoh.Sample) -> None:
        sample.payload.to_bytes()
        self._received.append(time.perf_counter())

    def _timed(self, send: Callable[[], object], pause: float) -> float:
        self._back.clear()
        time.sleep(pause)
        started = time.perf_counter()
        send()
        if not self._back.wait(PATIENCE):
            raise TimeoutError("nothing came back")
        return self._at - started


class Coding(Bare):
    """The same, with what ROS 2's wire asks of a message: CDR and an attachment. There is no bus around it."""

    ping, pong = "coded/ping", "coded/pong"

    def __init__(self, port: int) -> None:
        self._number = count(1)
        super().__init__(port)

    def send(self, publisher: zenoh.Publisher, twist: Twist) -> None:
        """Write a twist and send it."""
        publisher.put(encode(twist), attachment=Attachment(next(self._number), time.time_ns(), bytes(16)).encode())

    def read(self, sample: zenoh.Sample) -> Twist:
        """Return the twist of a message."""
        decode_attachment(sample.attachment.to_bytes() if sample.attachment else b"")
        return decode(Twist, sample.payload.to_bytes())


class CodingEcho(Coding, BareEcho):
    """Reads what comes and writes it again."""

    def _send_back(self, sample: zenoh.Sample) -> None:
        self.send(self._pong, self.read(sample))


class CodingAsker(Coding, BareAsker):
    """Measures how long that takes there and back."""

    def _send(self) -> None:
        self.send(self._ping, TWIST)

    def _note(self, received: Any) -> None:
        self.read(received)
        super()._note(received)


def _direct(callback: Callable[[Any], None]) -> Callback[Any]:
    return Callback(callback, None, indirect=False)


ROLES: dict[str, Callable[[int], Any]] = {
    "our_echo": OurEcho,
    "our_asker": OurAsker,
    "our_setter": OurSetter,
    "bare_echo": BareEcho,
    "bare_asker": BareAsker,
    "coding_echo": CodingEcho,
    "coding_asker": CodingAsker,
}


def main(role: str, port: str) -> None:
    """Take orders until there are no more."""
    end = ROLES[role](int(port))
    sys.stdout.write('"ready"\n')
    sys.stdout.flush()

    def handle(line: str) -> None:
        if not line:
            raise SystemExit
        method, *arguments = json.loads(line)
        sys.stdout.write(json.dumps(getattr(end, method)(*arguments)) + "\n")
        sys.stdout.flush()

    end.serve_orders(handle)


if __name__ == "__main__":
    main(*sys.argv[1:3])

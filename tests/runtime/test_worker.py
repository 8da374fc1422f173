"""Components that may block: in a thread of their own they delay nobody, and no port is touched from there."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import pytest

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, answers
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.runtime.log import Record
from rbxcompose.runtime.process_group.connection import CallbackInbox
from rbxcompose.runtime.process_group.host import Host, Lifecycle
from rbxcompose.runtime.process_group.worker import CONFIGURE, LONGEST, Worker
from rbxcompose.sdk import Calls, Component, Config, In, Out, Refused, Reply, Serves, ServesAction, component
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

PATIENCE = 10.0  # [s]
SHARED = 40.0  # [s] of robot time by which a test may set the clock forward


class Gate:
    """Holds a thread at a known place."""

    def __init__(self) -> None:
        self.entered, self.opened = threading.Event(), threading.Event()

    def hold(self) -> None:
        self.entered.set()
        assert self.opened.wait(PATIENCE)


class NoConfig(Config):
    """Nothing to set."""


@dataclass(frozen=True, slots=True)
class PlanRoute(Command):
    """Plan a route."""

    about = "planner"
    goal: str


@component("toy_planner")
class Planner(Component[NoConfig]):
    """Blocks in its handler until it is let go."""

    blocking = True
    gate: ClassVar[Gate]
    released: ClassVar[list[str]]  # the thread of each end
    raises: ClassVar[type[BaseException] | None]
    work = In(Float32, "work", qos=Qos.EVENT)
    done = Out(Float32, "done", qos=Qos.EVENT)
    plan = Serves(Trigger, "plan")
    helper = Calls(Trigger, "help")
    trip = ServesAction(Recharge, "trip")
    tour = ServesAction(Recharge, "tour")

    def accept_tour(self, goal: Recharge.Goal) -> str:
        return ""

    def configure(self) -> None:
        self.threads: set[str] = {threading.current_thread().name}
        self.stops = self.brakes = 0
        self.replies: list[Reply[Trigger.Response]] = []
        self.at_end.callback(lambda: self.released.append(threading.current_thread().name))

    def on_work(self, message: Float32) -> None:
        self.threads.add(threading.current_thread().name)
        self.info(f"works on {message.data:g}")
        self.gate.hold()
        if self.raises:
            raise self.raises("planted")
        self.done(message)

    def on_plan(self, request: Trigger.Request) -> Trigger.Response:
        self.helper(Trigger.Request(), self.replies.append)
        if self.raises:
            raise Refused("not now")
        return Trigger.Response(success=True, message=threading.current_thread().name)

    def stop(self) -> None:
        self.stops += 1

    def brake(self) -> None:
        self.brakes += 1

    @answers(PlanRoute)
    def plan_route(self, request: PlanRoute) -> str:
        return f"route to {request.goal}"

    def deactivate(self) -> None:
        self.info("deactivated")


@component("toy_castors")
class Wheels(Component[NoConfig]):
    """Counts what it gets."""

    fast = In(Float32, "fast", qos=Qos.EVENT)

    def configure(self) -> None:
        self.count = 0

    def on_fast(self, message: Float32) -> None:
        self.count += 1


class Late(MonotonicClock):
    """Real time, which a test can set forward."""

    ahead = 0.0  # [s]

    def now(self) -> float:
        return super().now() + self.ahead


class Process:
    """A process group in real time, driven by the thread of the test."""

    def __init__(self) -> None:
        self.records: list[Record] = []
        self.clock, self.scheduler, self.inbox = Late(), Scheduler(), CallbackInbox()
        self.bus = Bus(self.scheduler, self.clock, log=lambda owner, text: None)
        both = (instance("planner", "toy_planner"), instance("wheels", "toy_castors"))
        self.senders: set[str] = set()
        self.host = Host(
            Plan("toys", "toys.yaml", both),
            both,
            self.scheduler,
            self.clock,
            self.bus,
            self._log,
            lambda notice: None,
            post=self.inbox.put,
        )
        self.host.configure()
        self.host.activate(["planner", "wheels"])
        self.until(lambda: {state for state, _ in self.host.states().values()} == {"active"})

    def _log(self, record: Record) -> None:
        self.senders.add(threading.current_thread().name)
        self.records.append(record)

    @property
    def planner(self) -> Planner:
        made = self.host.hosted["planner"].component
        assert isinstance(made, Planner)
        return made

    def turn(self) -> None:
        self.inbox.drain(self.scheduler)
        self.scheduler.advance(self.clock.now())

    def until(self, holds: Callable[[], object]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not holds():
            assert time.monotonic() < deadline, f"it never came true: {[record.text for record in self.records]}"
            self.turn()
            time.sleep(0)

    def send(self, topic: str, *values: float) -> None:
        publisher = self.bus.publisher("test", topic, Float32, Qos.EVENT)
        for value in values:
            publisher(Float32(data=value))
            self.turn()

    def diagnosed(self) -> dict[str, DiagnosticStatus]:
        """Return the statuses of the next report."""
        reports: list[DiagnosticArray] = []
        self.bus.subscribe("test", "/diagnostics", DiagnosticArray, Qos.EVENT, reports.append)
        self.host.statuses.publish()
        self.until(lambda: reports)
        return {status.name: status for status in reports[-1].status}

    def close(self) -> None:
        Planner.gate.opened.set()
        self.host.shutdown()
        self.bus.close()
        self.inbox.close()


@pytest.fixture
def process() -> Iterator[Process]:
    Planner.gate, Planner.raises, Planner.released = Gate(), None, []
    made = Process()
    yield made
    made.close()
    assert "planner" not in {thread.name for thread in threading.enumerate()}


def test_while_it_blocks_its_neighbours_get_every_message(process: Process) -> None:
    process.send("work", 1.0)
    assert Planner.gate.entered.wait(PATIENCE)
    process.send("fast", *range(100))
    wheels = process.host.hosted["wheels"].component
    assert isinstance(wheels, Wheels)
    assert wheels.count == 100
    assert process.host.hosted["planner"].is_busy


def test_it_runs_in_its_thread_and_what_it_sends_is_sent_from_the_schedulers(process: Process) -> None:
    done: list[float] = []
    threads: set[str] = set()

    def take(message: Float32) -> None:
        threads.add(threading.current_thread().name)
        done.append(message.data)

    process.bus.subscribe("test", "done", Float32, Qos.EVENT, take)
    Planner.gate.opened.set()
    process.send("work", 1.0, 2.0, 3.0)
    process.until(lambda: len(done) == 3)
    assert done == [1.0, 2.0, 3.0]
    assert process.planner.threads == {"planner"}
    assert threads == process.senders == {threading.current_thread().name}
    assert [record.text for record in process.records if "works" in record.text] == [f"works on {n}" for n in (1, 2, 3)]


def test_a_request_is_answered_when_it_has_returned_and_its_own_is_answered_in_its_thread(process: Process) -> None:
    replies: list[Reply[Trigger.Response]] = []
    process.bus.serve("test", "help", Trigger, lambda request: Trigger.Response(message="helped"))
    plan = process.bus.client("test", "plan", Trigger)
    process.send("work", 1.0)
    plan(Trigger.Request(), replies.append)
    process.turn()
    assert replies == []
    Planner.gate.opened.set()
    process.until(lambda: replies and process.planner.replies)
    assert [reply.response and reply.response.message for reply in replies] == ["planner"]
    assert [reply.response and reply.response.message for reply in process.planner.replies] == ["helped"]


def test_a_refusal_reaches_who_asked(process: Process) -> None:
    replies: list[Reply[Trigger.Response]] = []
    Planner.raises = ValueError
    process.bus.client("test", "plan", Trigger)(Trigger.Request(), replies.append)
    process.until(lambda: replies)
    assert replies == [Reply(None, "not now")]
    assert process.host.states()["planner"] == ("active", 0)


def test_orders_wait_for_it_and_commands_are_refused_meanwhile(process: Process) -> None:
    process.send("work", 1.0)
    process.host.stop()
    with pytest.raises(Refused, match="'planner' is busy"):
        process.host.ask("planner", PlanRoute("dock"))
    assert process.planner.stops == 0
    Planner.gate.opened.set()
    process.until(lambda: process.planner.stops == 1 and not process.host.hosted["planner"].is_busy)
    assert process.host.ask("planner", PlanRoute("dock")) == "route to dock"


def test_goals_are_refused_meanwhile_only_where_it_has_a_say_in_them(process: Process) -> None:
    process.send("work", 1.0)
    refused = {one.name: process.host.hosted["planner"].refusal(one) for one in (Planner.trip, Planner.tour)}
    assert refused == {"trip": "", "tour": "'planner' is busy"}
    Planner.gate.opened.set()


@pytest.mark.parametrize("raised", [ValueError, SystemExit])
def test_a_fault_in_its_thread_restarts_it_alone(process: Process, raised: type[BaseException]) -> None:
    Planner.raises = raised
    Planner.gate.opened.set()
    process.send("work", 1.0)
    process.until(lambda: process.host.states() == {"planner": ("active", 1), "wheels": ("active", 0)})
    error = next(record for record in process.records if record.level is Level.ERROR)
    assert error.source == "planner"
    assert error.text.startswith(f"on_work raised {raised.__name__}: planted (test_worker.py:")
    assert Planner.released == ["planner"]  # what it held, without delaying the others


def test_a_call_that_takes_long_is_told_and_one_that_never_returns_is_a_fault(process: Process) -> None:
    process.send("work", 1.0)
    assert Planner.gate.entered.wait(PATIENCE)
    process.clock.ahead = 3.0
    process.host.look_at_workers()
    shown = process.diagnosed()["planner"]
    assert (shown.level, shown.message) == (Level.WARN, "has been in on_work for 3 s")
    hung, Planner.gate = Planner.gate, Gate()
    process.clock.ahead = LONGEST + 1.0
    process.host.look_at_workers()
    error = next(record for record in process.records if record.level is Level.ERROR)
    assert "on_work has not returned for 30 s" in error.text
    assert "in hold" in error.detail  # where it hangs
    process.clock.ahead += 1.0
    process.until(lambda: process.host.states()["planner"] == ("active", 1))
    hung.opened.set()
    Planner.gate.opened.set()
    done: list[float] = []
    process.bus.subscribe("test", "done", Float32, Qos.EVENT, lambda message: done.append(message.data))
    process.send("work", 2.0)
    process.until(lambda: done)
    assert done == [2.0]  # and nothing of the one that was left behind
    assert Planner.released == ["planner"]  # but what it held, when it returned at last


def test_a_component_that_says_so_may_be_configured_for_longer() -> None:
    clock, gate, failures, returned = Late(), Gate(), list[BaseException](), threading.Event()
    worker = Worker("arm", clock, lambda owner, call: returned.set(), failures.append, configures_within=100.0)
    worker.submit(CONFIGURE, gate.hold)
    clock.ahead = LONGEST + 1.0
    assert worker.look() == "has been in configure for 31 s"
    assert failures == []
    clock.ahead = 101.0
    worker.look()
    assert [str(failure) for failure in failures] == ["configure has not returned for 100 s"]
    gate.opened.set()
    assert returned.wait(PATIENCE)
    assert worker.close(PATIENCE)


def test_one_that_becomes_active_while_the_robot_goes_down_brakes(process: Process) -> None:
    planner = process.host.hosted["planner"]
    planner.state = Lifecycle.INACTIVE
    planner.activate()  # in its thread; that it is active is known only after the next turn
    process.host.brake()
    assert process.planner.brakes == 0
    process.until(lambda: process.planner.brakes == 1)


def test_one_that_has_not_braked_yet_is_not_at_rest(process: Process) -> None:
    process.send("work", 1.0)
    assert Planner.gate.entered.wait(PATIENCE)
    process.host.brake()
    assert not process.host.is_at_rest
    Planner.gate.opened.set()
    process.until(lambda: process.host.is_at_rest)
    assert process.planner.brakes == 1


def test_one_that_runs_can_see_that_nobody_waits_for_it_any_more(process: Process) -> None:
    process.send("work", 1.0)
    assert Planner.gate.entered.wait(PATIENCE)
    context = process.planner.context
    before = context.is_over
    process.host.shutdown()
    assert (before, context.is_over) == (False, True)
    Planner.gate.opened.set()
    for thread in threading.enumerate():
        if thread.name == "planner":
            thread.join(PATIENCE)


def test_it_says_goodbye_in_order(process: Process) -> None:
    Planner.gate.opened.set()
    process.host.shutdown()
    assert process.records[-1].text == "deactivated"


def test_one_that_does_not_return_is_left_behind_when_the_robot_goes_down(process: Process) -> None:
    process.send("work", 1.0)
    assert Planner.gate.entered.wait(PATIENCE)
    process.host.shutdown()
    assert process.records[-1].text == "does not return from on_work: it is left behind"
    Planner.gate.opened.set()
    for thread in threading.enumerate():
        if thread.name == "planner":
            thread.join(PATIENCE)


def test_on_a_stepped_clock_it_runs_inline() -> None:
    Planner.gate, Planner.raises, Planner.released = Gate(), None, []
    Planner.gate.opened.set()
    bench = Bench(replace(instance("planner", "toy_planner")))
    done = bench.collect("done", Float32)
    bench.publish("work", Float32(data=1.0), Qos.EVENT)
    assert [item.data for item in done] == [1.0]
    planner = bench.component("planner")
    assert isinstance(planner, Planner)
    assert planner.threads == {threading.current_thread().name}


def test_a_callback_that_holds_up_its_process_is_named_in_diagnostics(process: Process) -> None:
    wheels = process.host.hosted["wheels"].component
    assert isinstance(wheels, Wheels)
    count = wheels.count

    def take_long(message: Float32) -> None:
        process.clock.ahead += 0.012

    wheels.on_fast = take_long  # type: ignore[method-assign]
    process.host.hosted["wheels"].do("on_fast", lambda: None)
    process.scheduler.post("wheels", lambda: process.host.hosted["wheels"].do("on_fast", lambda: take_long(Float32())))
    process.turn()
    values = {one.key: one.value for one in process.diagnosed()["wheels"].values}
    assert values["slow_callbacks"] == "1"
    assert values["slowest_callback"].startswith("on_fast, 12 ms")
    assert wheels.count == count

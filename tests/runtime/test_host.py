"""Mistakes of one component: told with their line, repaired by a restart, and nobody else's business."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from rbxcompose.base.config import Restart
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Query, answers, as_data
from rbxcompose.missions.execution.requests import PauseMission
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.msgs.std_msgs import Bool, Float32
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.runtime.channel import Failed
from rbxcompose.sdk import Component, Config, In, Later, Out, Refused, Reply, Serves, component
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance


class ToyConfig(Config):
    """When to break."""

    breaks_in: str = ""
    """Name of the method that raises."""
    times: int = 1
    """How often it does."""
    error: str = "ValueError"
    """What it raises; a library that calls sys.exit raises SystemExit."""


BROKEN: dict[str, int] = {}  # how often each test's component has raised
HELD: set[str] = set()  # components that hold what only one can hold at a time


@dataclass(frozen=True, slots=True)
class ToyLevel(Query[float]):
    """Asks for the number of its steps."""

    about = "toy_for_host"


@component("toy_for_host")
class Toy(Component[ToyConfig]):
    """Counts its steps and raises where it is told to."""

    rate = 10.0
    count = Out(Float32, "count")
    add = In(Float32, "add")
    offset = In(Float32, "offset", qos="latched")

    def configure(self) -> None:
        self.steps = 0
        self.life: list[str] = ["configure"]
        assert self.name not in HELD
        HELD.add(self.name)
        self.at_end.callback(HELD.discard, self.name)
        self.at_end.callback(self.break_in, "release")
        self.break_in("configure")

    def activate(self) -> None:
        self.life.append("activate")
        self.break_in("activate")

    def deactivate(self) -> None:
        self.life.append("deactivate")
        self.break_in("deactivate")

    def step(self, dt: float) -> None:
        self.break_in("step")
        self.steps += 1
        self.count(Float32(data=self.steps))

    def on_add(self, message: Float32) -> None:
        self.break_in("on_add")
        self.steps += int(message.data)

    def on_offset(self, message: Float32) -> None:
        self.steps += int(message.data)

    @answers(ToyLevel)
    def level(self, request: ToyLevel) -> float:
        self.break_in("level")
        return float(self.steps)

    def break_in(self, method: str) -> None:
        if method == self.config.breaks_in and BROKEN.get(self.name, 0) < self.config.times:
            BROKEN[self.name] = BROKEN.get(self.name, 0) + 1
            raise {"ValueError": ValueError, "SystemExit": SystemExit, "Refused": Refused}[self.config.error]("planted")


@pytest.fixture(autouse=True)
def _fresh() -> None:
    BROKEN.clear()
    HELD.clear()


def bench(breaks_in: str, times: int = 1, error: str = "ValueError") -> Bench:
    return Bench(
        instance("broken", "toy_for_host", {"breaks_in": breaks_in, "times": times, "error": error}),
        instance("healthy", "toy_for_host"),
    )


@pytest.mark.parametrize("error", ["ValueError", "SystemExit"])
@pytest.mark.parametrize("method", ["configure", "activate", "step"])
def test_a_component_that_raises_is_restarted_and_the_others_go_on(method: str, error: str) -> None:
    robot = bench(method, error=error)
    robot.advance(2.0)
    assert robot.host.states() == {"broken": ("active", 1), "healthy": ("active", 0)}
    assert robot.component("healthy").steps == 20  # type: ignore[attr-defined]


def test_what_a_component_holds_is_released_at_its_end_although_a_part_of_that_raises() -> None:
    robot = bench("release")
    robot.host.failed("broken", ValueError("elsewhere"))
    assert {"healthy"} == HELD
    assert "broken: not all is released: break_in raised ValueError: planted (test_host.py:" in "".join(robot.texts())
    robot.host.shutdown()
    assert set() == HELD


def test_a_mistake_is_told_with_method_cause_and_line_and_its_traceback_is_in_the_log() -> None:
    robot = bench("step")
    robot.advance(1.0)
    record = next(candidate for candidate in robot.records if candidate.level is Level.ERROR)
    assert record.source == "broken"
    assert record.text.startswith("break_in raised ValueError: planted (test_host.py:")
    assert "Traceback" in record.detail


@component("toy_for_answers")
class Answering(Component[ToyConfig]):
    """Gives wrong answers."""

    rate = 10.0
    answer: Later[Trigger.Response] | None = None
    prompt = Serves(Trigger, "prompt", skill=None)
    later = Serves(Trigger, "later", skill=None)

    def on_prompt(self, request: Trigger.Request) -> Trigger.Response:
        return None if self.config.times else Bool()  # type: ignore[return-value]

    def on_later(self, request: Trigger.Request) -> Later[Trigger.Response]:
        self.answer = Later[Trigger.Response]()
        return self.answer

    def step(self, dt: float) -> None:
        if self.answer is not None:
            self.answer.reply(Bool())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "times", "told"),
    [
        ("prompt", 1, "on_prompt returned None: '/prompt' takes std_srvs/srv/Trigger_Response, not NoneType"),
        ("prompt", 0, "on_prompt returned Bool: '/prompt' takes std_srvs/srv/Trigger_Response, not std_msgs/msg/Bool"),
        (
            "later",
            0,
            "step raised TypeError: '/later' takes std_srvs/srv/Trigger_Response, not std_msgs/msg/Bool (test",
        ),
    ],
)
def test_who_answers_with_something_else_is_named(name: str, times: int, told: str) -> None:
    robot = Bench(instance("answering", "toy_for_answers", {"times": times}))
    replies: list[Reply[Trigger.Response]] = []
    robot.bus.client("bench", name, Trigger)(Trigger.Request(), replies.append)
    robot.advance(1.0)
    assert told in "".join(robot.texts())
    assert name == "later" or replies == [Reply(None, told)]


def test_a_component_in_error_says_so_in_diagnostics_until_it_is_back() -> None:
    robot = bench("step")
    reports = robot.collect("/diagnostics", DiagnosticArray)
    robot.advance(0.15)
    assert {status.name: status.level for status in reports[-1].status} == {"broken": Level.ERROR, "healthy": Level.OK}
    robot.advance(2.0)
    assert {status.level for status in reports[-1].status} == {Level.OK}


def test_a_component_that_keeps_failing_has_failed_and_the_supervisor_is_told() -> None:
    robot = bench("step", times=100)
    robot.advance(10.0)
    assert robot.host.states()["broken"] == ("failed", 4)
    assert [event.instance for event in robot.events if isinstance(event, Failed)] == ["broken"]
    assert robot.host.states()["healthy"] == ("active", 0)


def with_restart(restart: Restart, times: int) -> Bench:
    broken = replace(instance("broken", "toy_for_host", {"breaks_in": "step", "times": times}), restart=restart)
    return Bench(broken, instance("healthy", "toy_for_host"))


def test_a_component_that_is_never_restarted_stays_failed_and_the_robot_goes_on() -> None:
    robot = with_restart(Restart(when="never"), times=1)
    robot.advance(10.0)
    assert robot.host.states() == {"broken": ("failed", 0), "healthy": ("active", 0)}
    assert "broken: stays failed: it is never restarted" in robot.texts()
    assert [event for event in robot.events if isinstance(event, Failed)] == []


def test_a_component_that_is_always_restarted_outlives_any_number_of_failures() -> None:
    robot = with_restart(Restart(when="always"), times=30)
    robot.advance(600.0)
    assert robot.host.states()["broken"] == ("active", 30)


def test_the_bound_of_failures_is_that_of_the_component() -> None:
    robot = with_restart(Restart(max=2), times=30)
    robot.advance(10.0)
    assert robot.host.states()["broken"] == ("failed", 1)
    assert [event.instance for event in robot.events if isinstance(event, Failed)] == ["broken"]


def test_a_message_that_breaks_its_handler_restarts_only_that_component() -> None:
    robot = bench("on_add")
    robot.publish("/add", Float32(data=5.0))
    robot.advance(1.0)
    assert robot.host.states() == {"broken": ("active", 1), "healthy": ("active", 0)}
    assert robot.component("healthy").steps == 15  # type: ignore[attr-defined]


def test_a_message_that_its_handler_refuses_is_counted_and_the_component_runs_on() -> None:
    robot = bench("on_add", times=2, error="Refused")
    statuses = robot.statuses("broken: add")
    for _ in range(3):
        robot.publish("/add", Float32(data=5.0))
    robot.advance(1.0)
    assert robot.host.states() == {"broken": ("active", 0), "healthy": ("active", 0)}
    assert [text for text in robot.texts() if "/add" in text] == ["broken: dropped a message on /add: planted"]
    assert statuses[0].message == "2 messages were refused on /add: unreadable content"


@pytest.mark.parametrize("error", ["ValueError", "SystemExit"])
def test_a_request_that_breaks_its_handler_restarts_only_that_component(error: str) -> None:
    robot = bench("level", error=error)
    with pytest.raises(Refused, match=f"'broken' has failed: {error}: planted"):
        robot.host.ask("broken", ToyLevel())
    robot.advance(1.0)
    assert robot.host.states() == {"broken": ("active", 1), "healthy": ("active", 0)}


def test_the_lifecycle_runs_in_order_and_again_in_reverse() -> None:
    robot = bench("")
    lives = [robot.component(name).life for name in ("broken", "healthy")]  # type: ignore[attr-defined]
    robot.host.shutdown()
    assert lives == [["configure", "activate", "deactivate"]] * 2
    assert {state for state, _ in robot.host.states().values()} == {"unconfigured"}


def test_a_component_that_raises_on_the_way_down_does_not_keep_the_others() -> None:
    robot = bench("deactivate")
    life = robot.component("broken").life  # type: ignore[attr-defined]
    robot.host.shutdown()
    robot.advance(5.0)
    assert life[-1] == "deactivate"
    assert {state for state, _ in robot.host.states().values()} == {"unconfigured"}


def test_a_latched_message_that_comes_before_a_component_is_active_is_handled_then() -> None:
    robot = bench("")
    robot.publish("offset", Float32(data=100.0), Qos.LATCHED)
    robot.host.prepare([instance("late", "toy_for_host")])
    robot.advance(0.0)
    assert robot.component("late").steps == 0  # type: ignore[attr-defined]
    robot.host.activate(["late"])
    robot.advance(0.0)
    assert robot.component("late").steps == 100  # type: ignore[attr-defined]


def test_a_request_that_a_component_does_not_take_is_refused() -> None:
    robot = bench("")
    pause = PauseMission()
    with pytest.raises(Refused, match="does not take the request"):
        robot.host.ask("healthy", pause)
    with pytest.raises(Refused, match="not active"):
        robot.host.ask("nobody", pause)
    with pytest.raises(Refused, match=r"'mission\.PauseMission' is not known here"):
        robot.host.request("healthy", as_data(pause))


def test_which_call_of_which_component_runs_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, places = bench(""), list[str]()
    monkeypatch.setattr(robot.component("healthy"), "brake", lambda: places.append(robot.host.place))
    robot.host.brake()
    assert (places, robot.host.place) == (["brake of 'healthy'"], "")


def test_nothing_of_a_component_is_left_on_the_bus_after_shutdown() -> None:
    robot = bench("")
    ends = len(robot.bus)
    robot.host.shutdown()
    of_each = 3 + 6  # its ports, and the services of its parameters
    assert len(robot.bus) == ends - 2 * of_each

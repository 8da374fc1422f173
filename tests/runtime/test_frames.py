"""What a process knows of frames, when it takes it, and how little it is woken for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.levels import Level
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import Attachment
from rbxcompose.bus.transport import Arrival, NoTransport
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.runtime.process_group.provided import MOST_LOGGED, Frames, Lookup
from rbxcompose.sdk.ports import Qos


@dataclass(frozen=True, slots=True)
class Came:
    """A message of another process."""

    payload: bytes
    attachment: bytes = Attachment(1, 0, bytes(16)).encode()


@dataclass
class World(NoTransport):
    """A process that hears of `/tf` from another one."""

    is_patient: bool
    woken: int = 0
    arrived: list[Callable[[Arrival], None]] = field(default_factory=list)
    logged: list[tuple[Level, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.clock, self.scheduler = SteppedClock(), Scheduler()
        bus = Bus(self.scheduler, self.clock, transport=self, log=lambda owner, text: None)
        log = self.logged.append
        self.frames = Frames(
            "host", bus, self.clock, is_patient=self.is_patient, log=lambda level, text: log((level, text))
        )
        self.look = Lookup(self.frames, "odom", "base")

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        self.woken += 1
        self.scheduler.post(owner, callback)

    bring = wake

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> NoTransport:
        if "/tf/" in key:
            self.arrived.append(arrived)
        return self

    def tell(self, time: float, x: float, child: str = "base", stamp: float = 0.0) -> None:
        """Have a pose arrive at `time` [s]; a stamp of 0 is none."""
        header = Header(frame_id="odom", stamp=to_time(round(stamp * 1e9)))
        self.clock.advance_to(time)
        placed = Transform(translation=Vector3(x, 0.0, 0.0), rotation=Quaternion(w=1.0))
        link = TransformStamped(header=header, child_frame_id=child, transform=placed)
        for arrived in self.arrived:
            arrived(Came(encode(TFMessage(transforms=(link,)))))

    def x(self) -> float | None:
        """Return where the base is [m], as who looks sees it."""
        pose = self.look.now()
        return pose.x if pose else None


def test_who_looks_sees_the_newest_pose_though_nobody_was_woken_for_it() -> None:
    world = World(is_patient=True)
    seen = []
    for number in range(20):
        world.tell(0.02 * number, float(number))
        seen.append(world.x())
    assert (seen, world.woken) == ([float(number) for number in range(20)], 0)


def test_while_nobody_looks_no_frame_is_lost_that_is_told_rarely() -> None:
    world = World(is_patient=True)
    world.tell(0.0, 5.0, child="lamp")
    for number in range(40):
        world.tell(0.02 * number, float(number))
        world.scheduler.advance(world.clock.now())
    assert Lookup(world.frames, "odom", "lamp").now() is not None
    assert world.x() == 39.0
    assert world.woken <= 10


def test_a_pose_is_as_old_as_its_arrival_however_late_it_was_taken() -> None:
    world = World(is_patient=True)
    world.tell(1.0, 0.0)
    world.clock.advance_to(1.5)
    world.x()
    assert world.frames.tree.age("odom", "base", 1.5) == pytest.approx(0.5)


@pytest.mark.parametrize("is_patient", [False, True])
def test_where_another_thread_looks_each_pose_is_taken_by_the_scheduler(*, is_patient: bool) -> None:
    world = World(is_patient=is_patient)
    world.frames.hurry()
    world.tell(0.0, 3.0)
    assert (world.x(), world.woken) == (None, 1)
    world.scheduler.advance(0.0)
    assert world.x() == 3.0


def test_who_looks_back_finds_the_pose_between_two_that_were_sent() -> None:
    world = World(is_patient=True)
    for number in (0, 1, 2):
        world.tell(float(number), 10.0 * number, stamp=number + 5.0)
    assert world.look.transform(at=6_500_000_000).translation == (15.0, 0.0, 0.0)
    assert world.look.transform().translation == (20.0, 0.0, 0.0)


def test_the_newest_time_is_that_of_the_frame_between_that_was_seen_first() -> None:
    world = World(is_patient=True)
    with pytest.raises(LookupError):
        world.look.newest()
    world.tell(1.0, 0.0, stamp=3.0)
    world.tell(1.0, 0.0, child="lamp", stamp=2.0)
    assert Lookup(world.frames, "base", "lamp").newest() == 2_000_000_000


def test_a_pose_without_a_stamp_was_measured_when_it_arrived() -> None:
    world = World(is_patient=True)
    world.tell(1.0, 1.0)
    world.x()
    world.tell(2.0, 2.0)
    world.clock.advance_to(2.5)
    assert world.look.transform(at=1_500_000_000).translation == (1.5, 0.0, 0.0)


def test_who_looks_in_vain_is_told_the_frames_or_the_times_that_there_are() -> None:
    world = World(is_patient=True)
    with pytest.raises(LookupError, match="there is no frame 'odom'; there are none yet"):
        world.look.transform()
    world.tell(1.0, 0.0)
    with pytest.raises(LookupError, match=r"known only until 1\.000 s, 1 s earlier"):
        world.look.transform(at=2_000_000_000)


def test_what_is_wrong_with_transforms_is_logged_once_and_not_without_end() -> None:
    world = World(is_patient=True)
    for number in range(100):
        world.tell(0.02 * number, 0.0, child="odom")
        world.tell(0.02 * number, 0.0, child="base", stamp=50.0 - 2.0 * (number % 2))
        world.x()
    assert world.logged == [
        (Level.WARN, "a transform is refused: 'odom' cannot be placed in 'odom': that is 'odom' itself or is below it"),
        (Level.OK, "the stamps of 'base' went back: its earlier poses are forgotten"),
    ]
    for number in range(100):
        world.tell(2.0 + 0.02 * number, math.nan, child=f"lamp_{number}")
        world.x()
    assert len(world.logged) == MOST_LOGGED

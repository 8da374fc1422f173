"""Runs one component of a recorded robot again."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from rbxcompose.clock import SteppedClock
from rbxcompose.dataclass import dataclass
from rbxcompose.levels import Level
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.tape import Tape
from rbxcompose.recording.topics import RecordedTopic
from rbxcompose.replay.aliases import Aliases
from rbxcompose.replay.comparison import RunComparison, RunDifference
from rbxcompose.replay.feed import ReplayFeed
from rbxcompose.replay.services import ReplayedServices
from rbxcompose.replay.stage import ReplayStage, StageBus
from rbxcompose.runtime.process_group.host import Host
from rbxcompose.runtime.records import Record
from rbxcompose.scheduler import Scheduler
from rbxcompose.sdk.ports import In, Looks
from rbxcompose.sdk.registry import component_type

FRAMES = ("/tf", "/tf_static")


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """The result: the number of messages that were as recorded, the first that was not, and what went wrong."""

    equal: int
    difference: RunDifference | None
    errors: tuple[str, ...]


def missing_topics(plan: Plan, instance: Instance, topics: Iterable[RecordedTopic]) -> list[str]:
    """Return the inputs of a component that the robot publishes but the recording lacks."""
    recorded = {topic.name for topic in topics}
    published = {wire.topic for one in plan.instances for wire in one.wires if wire.kind == "out"}
    wanted: set[str] = set()
    for name, port in component_type(instance.type).ports(instance.config).items():
        if isinstance(port, In) and instance.topic(name) in published:
            wanted.add(instance.topic(name))
        if isinstance(port, Looks):
            wanted |= {frame for frame in FRAMES if frame in published}
    return sorted(wanted - recorded)


def replayed(
    plan: Plan, instance: Instance, records: Iterable[Recorded], keep: Callable[[Recorded], None] | None = None
) -> ReplayResult:
    """Give a component its recorded inputs at their instants and compare its outputs.

    It stops at the first difference, unless there is a `keep`, which receives all outputs.
    """
    alone = plan.in_one_process()
    only = next(one for one in alone.instances if one.name == instance.name)
    clock, scheduler, aliases, services = SteppedClock(), Scheduler(), Aliases(), ReplayedServices(plan, only)
    comparison = RunComparison(aliases)
    errors: list[str] = []

    def sent(record: Recorded) -> None:
        if record.topic.node == only.name:
            if keep is not None:
                keep(record)
            comparison.sent(record)

    def log(record: Record) -> None:
        if record.level is Level.ERROR:
            errors.append(f"{record.source}: {record.text}")

    stage = ReplayStage(scheduler, services.is_served)
    tape = Tape(clock, lambda topic: None, sent)
    bus = StageBus(scheduler, clock, alone, only.name, stage, tape)
    host = Host(alone, [only], scheduler, clock, bus, log, lambda notice: None)
    feed = ReplayFeed(iter(records), only.name, alone.bus.domain, stage, services, aliases, comparison.expect)
    host.configure()
    feed.begin(scheduler, host)
    while (due := scheduler.next_due()) is not None and not feed.is_past(due):
        if comparison.difference is not None and keep is None:
            break
        clock.advance_to(max(due, clock.now()))
        scheduler.advance(clock.now())
    comparison.end(feed.cut_at)
    return ReplayResult(comparison.equal, comparison.difference, tuple(errors))

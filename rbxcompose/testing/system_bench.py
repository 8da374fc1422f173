"""A bench for the robots of a system: virtual time for all, a bus for each, and between these what they share."""

from collections.abc import Callable

from rbxcompose.base.clock import SteppedClock
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.share import exchanges
from rbxcompose.msgs import registry
from rbxcompose.runtime.process_group.exchange import Way, carry
from rbxcompose.testing.bench import Bench


class SystemBench:
    """Each robot of a system in a bench of its own, all on one stepped clock.

    What is due at one instant runs robot by robot, in the order of the system's file, so that two runs are alike.
    What robots share arrives at the same instant.
    """

    def __init__(self, system: System) -> None:
        """Take a system whose robots are all there.

        Raises:
            ValueError: if it has errors.
        """
        if system.report.has_errors:
            raise ValueError("; ".join(finding.message for finding in system.report))
        self.clock = SteppedClock()
        self.robots = {name: Bench(plan=robot.plan, clock=self.clock) for name, robot in system.robots.items()}
        shared = exchanges(system)
        givers = {wire.shared: (name, wire) for (name, _), each in shared.items() for wire in each.gives}
        for (name, _), each in shared.items():
            for wire in each.takes:
                giver, given = givers[wire.shared]
                registry.choose(self.robots[name].plan.messages)
                way = Way(self.robots[giver].bus, given.own, self.robots[name].bus, wire.own)
                carry(way, wire.type, wire.qos)
        self.advance(0.0)

    def advance(self, seconds: float) -> None:
        """Let `seconds` of robot time pass, event by event."""
        self.run_until(lambda: False, seconds)

    def run_until(self, reached: Callable[[], bool], most: float = 600.0) -> bool:
        """Advance time until `reached()` holds, by at most `most` [s] of robot time; return whether it does."""
        end = self.clock.now() + most
        self._settle()
        while not reached():
            due = min(self._due(), default=None)
            if due is None or due > end:
                self.clock.advance_to(end)
                self._settle()
                return reached()
            self.clock.advance_to(max(due, self.clock.now()))
            self._settle()
        return True

    def _due(self) -> list[float]:
        times = [robot.scheduler.next_due() for robot in self.robots.values()]
        return [time for time in times if time is not None]

    def _settle(self) -> None:
        """Run what is due now, and what that makes due."""
        now = self.clock.now()
        while True:
            for robot in self.robots.values():
                registry.choose(robot.plan.messages)
                robot.scheduler.advance(now)
            if min(self._due(), default=now + 1.0) > now:
                return

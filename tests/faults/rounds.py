"""A round: one process of a patrolling robot is killed or stopped, and what must follow does follow in time."""

from __future__ import annotations

import random
import signal
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice

from rbxcompose.runtime.processes import Process
from tests.faults.observer import MOTION
from tests.faults.patrol import LATE, LONGEST_STOP, MISSION, PARENT, ROBOT, ROUTER, SUPERVISOR, WORLD, Patrol

FATAL = (WORLD, PARENT, SUPERVISOR)  # without these the robot goes down; the others come back
SILENCE = 2.0  # [s] after which a process that was stopped is killed
LOOKS = 0.3  # [s] between two looks for silence, and to notice it
DOWN = 2.0  # [s] for an orderly end
BACK = 3.0  # [s] from the death of a process until another one is there
SLOW = 2.0  # bounds of time are so much larger here: a loaded machine forks, starts and ends later


@dataclass(frozen=True, slots=True)
class Fault:
    """What happens to which process."""

    process: str
    signal: signal.Signals

    def __str__(self) -> str:
        return f"{self.process}-{self.signal.name}"

    @property
    def is_stop(self) -> bool:
        """Tell whether the process stays, and says nothing any more."""
        return self.signal is signal.SIGSTOP

    @property
    def ends_the_robot(self) -> bool:
        """Tell whether the robot has to go down."""
        return self.process in FATAL


KINDS = [
    Fault(process, number)
    for process in (ROBOT, MISSION, ROUTER, WORLD, PARENT, SUPERVISOR)
    for number in (signal.SIGKILL, signal.SIGSTOP)
]


@dataclass
class Findings:
    """What rounds have shown."""

    rounds: int = 0
    wrong: list[str] = field(default_factory=list)
    stops: list[float] = field(default_factory=list)  # [s] from the last command to rest
    ends: list[float] = field(default_factory=list)  # [s] from the fault to the end of the last process
    runs: int = 0

    @property
    def summary(self) -> str:
        """Say in a line how it went."""
        stop, end = max(self.stops, default=0.0), max(self.ends, default=0.0)
        return "; ".join(
            [
                f"{self.runs} robots",
                f"at rest at most {stop:.2f} s after the last command (bound {LONGEST_STOP:.2f} s)",
                f"all ended at most {end:.1f} s after a fault that ends the robot",
                "no process, port or file left" if not self.wrong else f"wrong: {self.wrong}",
            ]
        )


def in_turn(seed: int, rounds: int) -> Iterator[list[Fault]]:
    """Yield the faults of each run, all kinds in turn: first what is survived in one run, then what is not."""
    chance = random.Random(seed)

    def blocks() -> Iterator[Fault]:
        while True:
            yield from sorted(chance.sample(KINDS, len(KINDS)), key=lambda one: one.ends_the_robot)

    survived: list[Fault] = []
    for fault in chain(islice(blocks(), rounds), [None]):
        if fault is not None and not fault.ends_the_robot:
            survived.append(fault)
            continue
        if survived:
            yield survived
            survived = []
        if fault is not None:
            yield [fault]


def run(patrol: Patrol, faults: Sequence[Fault], findings: Findings) -> list[Fault]:
    """Do rounds on one robot, and look at its end; return those that its mission was too short for."""
    findings.runs += 1
    left = list(faults)
    fault = left[0]
    while left and patrol.observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up):
        fault = left.pop(0)
        patrol.note_shared_memory()
        findings.rounds += 1
        wrong = _fatal(patrol, fault, findings) if fault.ends_the_robot else _survived(patrol, fault, findings)
        findings.wrong += [f"{fault}: {text}" for text in wrong]
    if not fault.ends_the_robot and (patrol.end() != 0 or "mission patrol: success" not in patrol.output):
        findings.wrong.append(f"{fault}: the mission did not succeed: {patrol.output}")
    patrol.end()
    if fault.process == SUPERVISOR and not fault.is_stop:
        patrol.do("down")  # what it has left tells this command, and the next `up`, what to look for
    last = patrol.observer.last(MOTION)
    if fault.process != WORLD and not (last and last.is_rest):
        findings.wrong.append(f"{fault}: the base was last seen in motion: {last}")
    findings.wrong += [f"{fault}: unsafe: {text}" for text in patrol.unsafe()]
    findings.wrong += [f"{fault}: left behind: {text}" for text in patrol.left_behind()]
    return left


def _struck(patrol: Patrol, fault: Fault) -> tuple[Process, float]:
    process = patrol.named(fault.process)
    assert process is not None, f"there is no process {fault.process}"
    at = time.monotonic()
    process.send_signal(fault.signal)
    return process, at


def _survived(patrol: Patrol, fault: Fault, findings: Findings) -> Iterator[str]:
    """Yield what is wrong with how the robot goes on."""
    old, at = _struck(patrol, fault)
    if not patrol.wait_for(lambda: patrol.named(fault.process) not in (None, old)):
        if patrol.is_up:
            yield "it did not come back"
        return  # the mission had ended before
    took, bound = time.monotonic() - at, BACK + SILENCE * fault.is_stop
    if took > SLOW * bound:
        yield f"it came back after {took:.2f} s"
    if not patrol.observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up) and patrol.is_up:
        yield "the robot did not move any more"
    stop = patrol.observer.time_to_rest(at) if fault.process == ROBOT else None
    if stop is not None:
        findings.stops.append(stop)
        if stop > LONGEST_STOP + LATE:
            yield f"the base came to rest {stop:.2f} s after the last command"


def _fatal(patrol: Patrol, fault: Fault, findings: Findings) -> Iterator[str]:
    """Yield what is wrong with how the robot ends."""
    _, at = _struck(patrol, fault)
    bound = DOWN
    if fault.is_stop and fault.process == SUPERVISOR:
        if not patrol.observer.wait_until_it_moves(at + LOOKS, lambda: patrol.is_up):
            yield "the robot does not go on without a sound supervisor"
        at = time.monotonic()
        patrol.do("down")
        bound += 1.0  # for the command to start
    elif fault.is_stop:
        bound += SILENCE + LOOKS
    if not patrol.wait_for_end(SLOW * bound):
        yield f"it has not ended after {SLOW * bound:.1f} s: {patrol.running()}"
        return
    findings.ends.append(time.monotonic() - at)
    if patrol.end() != 4:
        yield f"the exit code is {patrol.end()}: {patrol.output}"

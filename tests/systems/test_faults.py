"""What may happen to hosts and links while the base is driven from another host, one row of the page each."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.soak import Soak
from tests.systems.namespaces import Hosts, NotPermittedError
from tests.systems.patrol import ADDRESSES, PatrolOnHosts

STOP_WITHIN = 0.6  # [s] that the system declares
LATE = 0.15  # [s] that a loaded machine may hold up what is seen from outside
Deed = Callable[[PatrolOnHosts], object]


@dataclass(frozen=True)
class HostFault:
    """Something that happens, lasts [s], and is undone; if it cuts the commands, the base stands in time."""

    name: str
    strike: Deed
    undo: Deed = lambda patrol: None
    lasts: float = 0.0
    cuts_commands: bool = True
    is_quick: bool = False


def killed(host: str, process: str, *, is_quick: bool = False) -> HostFault:
    name = f"`{process}` of the {'base' if host == 'r' else 'other'} host is killed"
    # Another one is there before the base stands.
    return HostFault(name, lambda patrol: patrol.kill(host, process), cuts_commands=False, is_quick=is_quick)


def restarted(host: str, process: str) -> HostFault:
    name = f"`{process}` of the {'base' if host == 'r' else 'other'} host is killed, its share started again"

    def again(patrol: PatrolOnHosts) -> None:
        patrol.wait_until(lambda: (state := patrol.state(host)) is None or not state.alive())
        patrol.up(host)
        patrol.wait_until(lambda: patrol.is_active(host))
        if host == "r":
            patrol.watch()

    return HostFault(name, lambda patrol: patrol.kill(host, process), again, lasts=3.0, cuts_commands=host == "d")


FAULTS = [
    killed("d", "robot", is_quick=True),
    killed("d", "mission"),
    killed("d", "router"),
    killed("r", "router", is_quick=True),
    HostFault("the link is cut for 5 s", lambda one: one.hosts.cut("r"), lambda one: one.hosts.mend("r"), 5.0),
    HostFault("the link is cut for 30 s", lambda one: one.hosts.cut("r"), lambda one: one.hosts.mend("r"), 30.0),
    HostFault(
        "the other host freezes for 5 s", lambda one: one.hosts.freeze("d"), lambda one: one.hosts.thaw("d"), 5.0
    ),
    HostFault(
        "the base host freezes for 5 s",
        lambda one: one.hosts.freeze("r"),
        lambda one: one.hosts.thaw("r"),
        5.0,
        cuts_commands=False,
    ),
    restarted("d", "supervisor"),
    restarted("d", "parent"),
    restarted("r", "supervisor"),
]


@contextmanager
def patrolling(folder: Path, environment: Mapping[str, str] | None = None, links: str = "") -> Iterator[PatrolOnHosts]:
    """Run the robot on two hosts, for ever; the environment is for the host that drives."""
    try:
        hosts = Hosts(folder, ADDRESSES)
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        patrol = PatrolOnHosts(hosts)
        patrol.change_mission("repeat: $rounds", "repeat: 1000")
        patrol.change_system("hosts:", f"{links}hosts:")
        patrol.environment["d"] = {**(environment or {})}
        patrol.up("r")
        patrol.up("d")
        patrol.watch()
        yield patrol


def bear(patrol: PatrolOnHosts, fault: HostFault) -> tuple[float | None, float]:
    """Let a fault happen while the base moves; return after how long it stood [s] and, undone, moved again [s]."""
    patrol.wait_until(lambda: patrol.is_moving)
    at = time.monotonic()
    fault.strike(patrol)
    time.sleep(max(fault.lasts, STOP_WITHIN + LATE))
    rest = patrol.rest_after(at)
    if fault.cuts_commands:
        assert rest is not None, fault.name
        assert rest - at < STOP_WITHIN + LATE, fault.name
    undone = time.monotonic() if fault.lasts else at
    fault.undo(patrol)
    patrol.wait_until(lambda: patrol.is_active("r") and patrol.is_active("d"))
    patrol.wait_until(lambda: patrol.has_moved_since(max(undone, rest or undone)))
    moved = next(at for at, moves in patrol.motion() if moves and at > max(undone, rest or undone))
    return None if rest is None else rest - at, moved - undone


@pytest.mark.timeout(100)
def test_the_base_stands_in_time_and_all_goes_on(tmp_path: Path) -> None:
    with patrolling(tmp_path) as patrol:
        for fault in FAULTS:
            if fault.is_quick:
                bear(patrol, fault)
        assert patrol.rbx("d", "down", patrol.name).wait(30) == 0


@pytest.mark.timeout(240)
@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
@pytest.mark.soak
def test_each_fault(fault: HostFault, tmp_path: Path, soak: Soak) -> None:
    with patrolling(tmp_path) as patrol:
        stood, moved = bear(patrol, fault)
        stand = f"stood after {stood:.2f} s" if fault.cuts_commands else "need not stop"
        soak.tell(f"two hosts: {fault.name}", 1, 0, f"{stand}, moved again {moved:.1f} s after")


@pytest.mark.timeout(100)
@pytest.mark.soak
def test_without_what_cannot_come_back_all_hosts_go_down(tmp_path: Path, soak: Soak) -> None:
    with patrolling(tmp_path) as patrol:
        patrol.wait_until(lambda: patrol.is_moving)
        at = patrol.kill("r", "world")
        codes = [share.wait(30) for share in patrol.shares.values()]
        assert codes == [4, 4]
        told = f"all hosts down after {time.monotonic() - at:.1f} s, with exit code 4"
        soak.tell("two hosts: `world` of the base host is killed", 1, 0, told)

"""Whether clocks agree."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.tools.doctor import HostFacts, examination

MOST_STEP = 0.05  # [s] by which the wall clock may move against the monotonic one while we look
MOST_AHEAD, MOST_BEHIND = 0.05, 1.0  # [s] of a sender's stamps; those behind also include the transport time

WRONG_CLOCK = kind("RBX9404", Severity.WARNING)
OTHER_CLOCK = kind("RBX9405", Severity.WARNING)
HOSTS_DIFFER = kind("RBX6129", Severity.WARNING)
_HELP = "let a time server set it: timedatectl set-ntp true"


@examination
def clocks(facts: HostFacts) -> Iterator[str | Finding]:
    """Compare the wall clock with a time surely past, with the monotonic clock, and with the stamps of others."""
    clock = facts.clocks
    if clock.wall < clock.oldest:
        yield WRONG_CLOCK.at(
            None, "the clock of this machine is before the time at which rbxcompose was made", help=_HELP
        )
    elif abs(clock.step) > MOST_STEP:
        yield WRONG_CLOCK.at(
            None, f"the clock of this machine moved by {clock.step:+.3f} s while we looked", help=_HELP
        )
    else:
        yield f"the wall clock runs evenly{_server(clock.is_synchronised)}"
    for robot in facts.running:
        ages = robot.bus.ages if robot.bus else {}
        wrong = {node: age for node, age in ages.items() if not -MOST_AHEAD <= age <= MOST_BEHIND}
        for node, age in sorted(wrong.items()):
            words = f"{-age:.2f} s in the future" if age < 0 else f"{age:.2f} s in the past"
            yield OTHER_CLOCK.at(None, f"the stamps of '{node}' of '{robot.name}' are {words}", help=_HELP)
        if ages and not wrong:
            yield f"{robot.name}: the stamps of {len(ages)} nodes agree with this clock"
        for host, offset in sorted(robot.state.clocks.items()) if robot.state else ():
            told = f"{robot.name}: the clock of host '{host}' is {offset.words}"
            yield HOSTS_DIFFER.at(None, told, help=_HELP) if offset.is_too_far else told


def _server(is_synchronised: bool | None) -> str:
    if is_synchronised is None:
        return ""
    return (
        ", set by a time server" if is_synchronised else "; no time server sets it, which matters with several machines"
    )

"""Resource limits of this user's processes."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.tools.doctor import HostFacts, examination

FEWEST_FILES = 1024
SMALLEST_SHARED = 16_000_000  # [B]

LOW_LIMIT = kind("RBX9406", Severity.WARNING)


@examination
def limits(facts: HostFacts) -> Iterator[str | Finding]:
    """Report the limits and which of them are too low."""
    has = facts.limits
    if has.open_files is not None and has.open_files < FEWEST_FILES:
        words = f"a process may have only {has.open_files} open files"
        yield LOW_LIMIT.at(None, words, help=f"ulimit -n {FEWEST_FILES}, or more in /etc/security/limits.conf")
    if has.shared_memory is None or has.shared_memory < SMALLEST_SHARED:
        free = "there is none" if has.shared_memory is None else f"only {has.shared_memory / 1e6:.0f} MB of it free"
        yield LOW_LIMIT.at(None, f"shared memory: {free}", help="of a container: docker run --shm-size=256m")
    shared = "none" if has.shared_memory is None else f"{has.shared_memory / 1e6:.0f} MB"
    yield (
        f"open files {_number(has.open_files)}, real-time priority {_number(has.real_time_priority)}, "
        f"locked memory {_size(has.locked_memory)}, shared memory {shared}"
    )


def _number(value: int | None) -> str:
    return "without limit" if value is None else str(value)


def _size(value: int | None) -> str:
    return "without limit" if value is None else f"{value / 1e6:.0f} MB"

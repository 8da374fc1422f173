"""A robot on three hosts: the base on one, what drives it on another, its mission on the third."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.soak import Soak
from tests.systems.namespaces import Hosts, NotPermittedError
from tests.systems.patrol import ADDRESSES, PatrolOnHosts

SETTLED = 2.0  # [s] after which it no longer follows what was commanded before a cut
STOP_WITHIN = 1.2  # [s] after a cut, as the system declares and `check` has computed


SHORT_CUTS = (0.5, 0.7, 0.9, 1.1, 1.3, 1.5)  # [s]; links count as lost after 0.4 s of them
REPEATS = 12


@contextmanager
def three_hosts(folder: Path, rounds: int) -> Iterator[PatrolOnHosts]:
    """Make the hosts, where this is permitted, with a patrol whose mission runs on `m`."""
    try:
        hosts = Hosts(folder, {**ADDRESSES, "m": "10.42.7.3"})
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        patrol = PatrolOnHosts(hosts, rounds)
        patrol.change_system("  d: {}", "  d: {address: 10.42.7.1}\n  m: {}")
        patrol.change_system("battery: r}", "battery: r, mission: m}")
        patrol.change_system("stop_within: 0.6 s", f"stop_within: {STOP_WITHIN} s")
        yield patrol


@pytest.mark.timeout(100)
@pytest.mark.soak
def test_a_host_of_three_may_be_cut_off_and_the_patrol_succeeds_once_it_is_back(tmp_path: Path) -> None:
    with three_hosts(tmp_path, rounds=1) as patrol:
        shares = {host: patrol.up(host) for host in patrol.hosts.addresses}
        patrol.watch()
        patrol.wait_until(lambda: "host 'm' is there" in patrol.log("d"))
        patrol.wait_until(lambda: patrol.is_moving)
        cut = patrol.hosts.cut("m")
        patrol.wait_until(lambda: "host 'm' does not answer" in patrol.log("d"))
        patrol.wait_until(lambda: bool(patrol.motion()) and not patrol.has_moved_since(patrol.motion()[-1][0] - 0.5))
        assert not patrol.has_moved_since(cut + STOP_WITHIN), "its goal is cancelled"
        assert patrol.is_active("r")
        assert patrol.is_active("d")
        assert "host 'd' does not answer" not in patrol.log("r")
        back = patrol.hosts.mend("m")
        patrol.wait_until(lambda: patrol.has_moved_since(back))
        assert [share.wait(60) for share in shares.values()] == [0, 0, 0]


@pytest.mark.timeout(900)
@pytest.mark.soak
def test_it_goes_on_after_short_cuts_too_whenever_each_end_takes_note_of_them(tmp_path: Path, soak: Soak) -> None:
    with three_hosts(tmp_path, rounds=1000) as patrol:
        for host in patrol.hosts.addresses:
            patrol.up(host)
        patrol.watch()
        longest = 0.0
        for cut in SHORT_CUTS * REPEATS:
            patrol.wait_until(lambda: patrol.is_moving)
            patrol.hosts.cut("m")
            time.sleep(cut)  # what is tested is time
            back = patrol.hosts.mend("m")
            settled = back + SETTLED
            patrol.wait_until(lambda settled=settled: patrol.has_moved_since(settled))  # type: ignore[misc]
            longest = max(longest, time.monotonic() - back)
        note = f"moved again {longest:.1f} s after, or earlier"
        soak.tell("three hosts: the link is cut for 0.5 to 1.5 s", len(SHORT_CUTS) * REPEATS, 0, note)

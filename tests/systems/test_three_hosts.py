"""A robot on three hosts: the base on one, what drives it on another, its mission on the third."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.systems.namespaces import Hosts, NotPermittedError
from tests.systems.patrol import ADDRESSES, PatrolOnHosts

STOP_WITHIN = 1.2  # [s] after a cut, as the system declares and `check` has computed


@pytest.mark.timeout(100)
def test_a_host_of_three_may_be_cut_off_and_the_patrol_succeeds_once_it_is_back(tmp_path: Path) -> None:
    try:
        hosts = Hosts(tmp_path, {**ADDRESSES, "m": "10.42.7.3"})
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        patrol = PatrolOnHosts(hosts)
        patrol.change_system("  d: {}", "  d: {address: 10.42.7.1}\n  m: {}")
        patrol.change_system("battery: r}", "battery: r, mission: m}")
        patrol.change_system("stop_within: 0.6 s", f"stop_within: {STOP_WITHIN} s")
        shares = {host: patrol.up(host) for host in hosts.addresses}
        patrol.watch()
        patrol.wait_until(lambda: patrol.is_moving)
        cut = hosts.cut("m")
        patrol.wait_until(lambda: "host 'm' does not answer" in patrol.log("d"))
        patrol.wait_until(lambda: bool(patrol.motion()) and not patrol.has_moved_since(patrol.motion()[-1][0] - 0.5))
        assert not patrol.has_moved_since(cut + STOP_WITHIN), "its goal is cancelled"
        assert patrol.is_active("r")
        assert patrol.is_active("d")
        assert "host 'd' does not answer" not in patrol.log("r")
        back = hosts.mend("m")
        patrol.wait_until(lambda: patrol.has_moved_since(back))
        assert [share.wait(60) for share in shares.values()] == [0, 0, 0]

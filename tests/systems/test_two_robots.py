"""A robot that sends another one somewhere, each on a host of its own, with a cable that is pulled on the way."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.systems.namespaces import Hosts, NotPermittedError
from tests.systems.patrol import ADDRESSES, PatrolOnHosts

STOP_WITHIN = 1.2  # [s] after a cut, as the system declares and `check` has computed
CALLER = """
rbx: 1
kind: Robot
name: caller
places: {far: {x: 20 m, y: 0 m}}
missions: {send: {file: missions/send.yaml}}
start: send
"""
SEND = """
rbx: 1
kind: Mission
name: send
do:
  - call: /NAME/set_battery_level
    request: 55
    timeout: 10 s
  - {NAME/go_to: far}
"""


@pytest.mark.soak  # goals end with a link in `test_shared_calls`, and the base stands in time in `test_two_hosts`
@pytest.mark.timeout(100)
@pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")
def test_a_robot_stops_in_time_if_the_one_that_sent_it_is_cut_off_and_stays_there(tmp_path: Path) -> None:
    try:
        hosts = Hosts(tmp_path, ADDRESSES)
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        scout = PatrolOnHosts(hosts)
        caller = f"  caller_{scout.name}: {{robot: caller.yaml, on: d}}"
        scout.change_system("name: two_hosts", "name: two_hosts\nsecurity: mtls")
        scout.change_system("    on: d\n    place: {base: r, battery: r}", "    on: r")
        scout.change_system("stop_within: 0.6 s", f"stop_within: {STOP_WITHIN} s\n    callers: [caller_{scout.name}]")
        scout.change_system("    on: r", f"    on: r\n    share: [go_to, set_battery_level]\n{caller}")
        (tmp_path / "caller.yaml").write_text(CALLER, encoding="utf-8")
        (tmp_path / "missions/send.yaml").write_text(SEND.replace("NAME", scout.name), encoding="utf-8")
        robot = tmp_path / "robots/robot.yaml"
        robot.write_text(robot.read_text(encoding="utf-8").replace("start: patrol", ""), encoding="utf-8")
        made = scout.rbx("d", "security", "init", "system.yaml")
        assert made.wait(30) == 0, made.communicate()[0]
        shutil.copytree(tmp_path / "d/config", tmp_path / "r/config")
        shares = {host: scout.up(host) for host in hosts.addresses}
        scout.watch()
        scout.wait_until(lambda: scout.is_moving)
        assert "set to 55 %" in scout.log("r")
        cut = hosts.cut("d")
        scout.wait_until(lambda: (rest := scout.rest_after(cut)) is not None and scout.motion()[-1][0] > rest + 1.0)
        rest = scout.rest_after(cut)
        assert rest is not None
        assert rest - cut <= STOP_WITHIN
        assert not scout.has_moved_since(rest)
        ended = shares["d"].communicate(timeout=30)[0]
        assert "server is gone" in ended, "the mission fails, and its robot ends"
        back = hosts.mend("d")
        scout.wait_until(lambda: scout.motion()[-1][0] > back + 1.5)
        assert not scout.has_moved_since(rest)

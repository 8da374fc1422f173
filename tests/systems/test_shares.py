"""The shares of the hosts: together the whole robot, and what crosses is what has ends on two hosts."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.compiler.systems.model import PlacedRobot, Placement, System
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.compiler.systems.share import share_of
from rbxcompose.manifest.system_file import HostModel, LinkModel
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.inspection.plan_text import system_text
from tests.conftest import ROOT

HOSTS = {name: HostModel(address=f"10.0.0.{number}") for number, name in enumerate(("a", "b", "c"), 1)}
SYSTEM = compile_system(str(ROOT / "systems/patrol_two_hosts.yaml"), environment=os.environ)
ROBOT = SYSTEM.robots["turtlebot"]
SHARES = st.fixed_dictionaries({instance.name: st.sampled_from(sorted(HOSTS)) for instance in ROBOT.plan.instances})


def spread(hosts: dict[str, str]) -> tuple[System, PlacedRobot]:
    """Return the patrol robot with its components on these hosts."""
    robot = replace(ROBOT, placed={name: Placement(name, host, "by lot") for name, host in hosts.items()})
    return System(SYSTEM.path, "spread", SYSTEM.root, hosts=HOSTS, robots={robot.name: robot}), robot


@given(SHARES)
def test_the_shares_of_all_hosts_are_the_robot_and_their_text_can_be_read_back(hosts: dict[str, str]) -> None:
    system, robot = spread(hosts)
    shares = [share_of(system, robot, host) for host in sorted(set(hosts.values()))]
    names = [instance.name for share in shares for instance in share.instances]
    assert sorted(names) == sorted(hosts)
    for share in shares:
        order = [instance.name for instance in ROBOT.plan.instances if instance in share.instances]
        assert [instance.name for instance in share.instances] == order
        assert {instance.name for instance in share.everywhere} == set(hosts)
        assert load(dump(share, reveals_secrets=True)) == share


@given(SHARES)
def test_of_each_two_hosts_exactly_one_dials_the_other_which_listens(hosts: dict[str, str]) -> None:
    system, robot = spread(hosts)
    used = sorted(set(hosts.values()))
    shares = {host: share_of(system, robot, host).share for host in used}
    listens = {host: share.listen for host, share in shares.items() if share}
    for index, host in enumerate(used):
        for other in used[index + 1 :]:
            dialled = [
                there
                for here, there in ((host, other), (other, host))
                if (share := shares[here]) and set(share.connect) & set(listens[there])
            ]
            assert len(dialled) == 1


@given(SHARES)
def test_what_crosses_is_what_has_ends_on_two_hosts(hosts: dict[str, str]) -> None:
    _, robot = spread(hosts)
    for one in robot.crossings:
        assert all(any(giver.host != taker.host for giver in one.givers) for taker in one.takers)
        assert all(any(giver.host != taker.host for taker in one.takers) for giver in one.givers)
    crossing = {one.topic for one in robot.crossings}
    if hosts["base"] != hosts["cmd_vel"]:
        assert "/cmd_vel" in crossing
    if len(set(hosts.values())) == 1:
        assert not crossing


@given(SHARES)
def test_a_topic_is_downsampled_where_it_leaves_and_by_nobody_else(hosts: dict[str, str]) -> None:
    system, robot = spread(hosts)
    system.links = {"wifi": LinkModel(between=("a", "b"), downsample={"battery_level": 0.5, "odom": 1.0})}
    for host in set(hosts.values()):
        share = share_of(system, robot, host).share
        crosses = share is not None and {hosts[name] for name in ("charger", "mission")} - {hosts["battery"]}
        leaves = crosses and hosts["battery"] == host and host in ("a", "b")
        assert share is None or share.downsample == ({"/battery_level": 0.5} if leaves else {})


def test_a_link_decides_what_dials_it_by_which_protocol_and_what_its_limit_leaves_out() -> None:
    system, robot = spread(
        {
            **ROBOT.hosts,
            "base": "a",
            "battery": "a",
            **dict.fromkeys((name for name, host in ROBOT.hosts.items() if host == "desk"), "b"),
        }
    )
    wifi = LinkModel(between=("b", "a"), protocol="quic", limit=1e6, priorities={"battery_level": "low"})
    system.links, system.security = {"wifi": wifi}, "mtls"
    here, there = (share_of(system, robot, host).share for host in ("a", "b"))
    assert here is not None
    assert there is not None
    assert here.listen == there.connect == ("quic/10.0.0.1:7447",)
    assert (here.priorities, here.largest) == ({"/battery_level": "low"}, {"/battery_level": 125_000, "/tf": 125_000})
    assert (there.priorities, there.largest) == ({}, {})


def test_a_plan_shows_hosts_reasons_and_what_crosses(golden: Golden, repository: Path) -> None:
    golden.check("plan.txt", system_text(compile_system("systems/patrol_two_hosts.yaml", environment={})) + "\n")

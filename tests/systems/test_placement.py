"""Where components go: each to exactly one host, and for a reason."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.compiler.systems.model import HostOffer, Wishes, hosts_called, place
from rbxcompose.compiler.systems.reader import compile_system

NAMES = st.sampled_from([f"c{number}" for number in range(8)])
HOSTS = ("robot", "desk", "cloud")
LABELS = ("gpu", "fast")
PORTS = ("/dev/a", "/dev/b")
OFFERS = st.dictionaries(
    st.sampled_from(HOSTS),
    st.builds(HostOffer, st.frozensets(st.sampled_from(LABELS)), st.frozensets(st.sampled_from(PORTS))),
    min_size=1,
)


@st.composite
def robots(draw: st.DrawFn) -> tuple[list[str], dict[str, HostOffer], Wishes, dict[str, set[str]], dict[str, set[str]]]:
    components = draw(st.lists(NAMES, unique=True, min_size=1))
    hosts = draw(OFFERS)
    called = st.sampled_from([*hosts, *(label for label in LABELS if hosts_called(label, hosts))])
    parts = draw(st.dictionaries(st.sampled_from(["arm", "head"]), st.sets(st.sampled_from(components), min_size=1)))
    wishes = draw(st.dictionaries(st.sampled_from([*components, *parts]), called))
    devices = draw(st.dictionaries(st.sampled_from(components), st.sets(st.sampled_from(PORTS))))
    return components, hosts, Wishes(draw(st.none() | called), wishes), parts, devices


@given(robots())
def test_each_component_is_on_exactly_one_host_and_wishes_come_before_devices_before_the_rest(
    robot: tuple[list[str], dict[str, HostOffer], Wishes, dict[str, set[str]], dict[str, set[str]]],
) -> None:
    components, hosts, wishes, parts, devices = robot
    placed = place(components, hosts, wishes, parts, devices)
    assert list(placed) == components
    for name, placement in placed.items():
        assert placement.host in hosts
        assert placement.reason
        around = [wishes.place[part] for part in parts if name in parts[part] and part in wishes.place]
        ports = devices.get(name, set())
        having = [host for host, offer in hosts.items() if ports and offer.devices >= ports]
        if name in wishes.place:
            assert placement.host in hosts_called(wishes.place[name], hosts)
        elif around:
            assert any(placement.host in hosts_called(called, hosts) for called in around)
        elif having:
            assert placement.host == having[0]
        elif wishes.on is not None:
            assert placement.host in hosts_called(wishes.on, hosts)


def test_the_smallest_part_around_a_component_counts_and_a_label_goes_where_least_runs() -> None:
    hosts = {"robot": HostOffer(), "one": HostOffer(frozenset({"gpu"})), "two": HostOffer(frozenset({"gpu"}))}
    wishes = Wishes("robot", {"arm": "one", "arm.hand": "gpu"})
    parts = {"arm": {"elbow", "finger", "thumb"}, "arm.hand": {"finger", "thumb"}}
    placed = place(["base", "elbow", "finger", "thumb"], hosts, wishes, parts, {})
    assert {name: entry.host for name, entry in placed.items()} == {
        "base": "robot",
        "elbow": "one",
        "finger": "two",
        "thumb": "one",
    }


def test_a_robot_whose_host_is_a_label_runs_on_one_host_with_it_where_most_of_it_is_already() -> None:
    hosts = {key: HostOffer(frozenset({"floor"}), frozenset(ports)) for key, ports in (("a", ()), ("b", ("/dev/a",)))}
    names = ["base", "go_to", "mission"]
    for devices, host in (({}, "a"), ({"base": {"/dev/a"}}, "b")):
        placed = place(names, hosts, Wishes("floor"), {}, devices)
        assert [placed[name].host for name in names] == [host] * 3
        assert placed["mission"].reason == "the robot's host, by label 'floor'"


CART = """rbx: 1
kind: Robot
name: cart
devices: {arduino: {vendor: 2341, product: "0043"}, receiver: {vendor: 1546, product: 01a7}}
components:
  base: {type: serial_base, port: dev:arduino, ticks_per_metre: 4200, wheel_distance: 24 cm, max_speed: 0.4 m/s}
  gps: {type: gps, port: dev:receiver}
  lidar: {type: lidar, port: /dev/ttyUSB0, frame: base_link}
"""
SYSTEM = """rbx: 1
kind: System
name: carts
hosts:
  robot: {address: 10.0.0.1, devices: [dev:arduino, /dev/ttyUSB0]}
  desk: {address: 10.0.0.2, devices: ["usb:1546:01a7"]}
robots: {cart: {robot: cart.yaml, on: desk}}
"""


def test_whatever_opens_a_port_goes_where_that_is_connected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cart.yaml").write_text(CART, encoding="utf-8")
    Path("s.yaml").write_text(SYSTEM, encoding="utf-8")
    cart = compile_system("s.yaml", environment={}).robots["cart"]
    assert {name: cart.hosts[name] for name in ("base", "gps", "lidar")} == {
        "base": "robot",
        "gps": "desk",
        "lidar": "robot",
    }
    assert cart.placed["base"].reason == "has dev:arduino"
    Path("s.yaml").write_text(SYSTEM.replace("on: desk", "place: {base: desk, gps: robot}"), encoding="utf-8")
    found = [finding for finding in compile_system("s.yaml", environment={}).report if finding.code == "RBX6103"]
    assert [re.findall("'[a-z]+'|dev:[a-z]+", finding.message) for finding in found] == [
        ["'base'", "'desk'", "dev:arduino", "'robot'"],
        ["'gps'", "'robot'", "dev:receiver", "'desk'"],
    ]

"""Links that are slow, disks that are full, clocks that jump on one of two hosts: the base is driven all the same."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from rbxcompose.compiler.systems.certificates import folder_of, make_authority, make_certificate
from tests.conftest import ROOT
from tests.soak import Soak
from tests.systems.emulated_link import EmulatedLink
from tests.systems.namespaces import Hosts, NotPermittedError
from tests.systems.patrol import ADDRESSES
from tests.systems.test_faults import patrolling

WATCHED = 15.0  # [s]
MOVES = 0.3  # of the time at least; it turns, drives and charges
SLOW = {
    "128 kbit/s": ("tbf", "rate", "128kbit", "burst", "4kb", "latency", "300ms"),
    "256 kbit/s": ("tbf", "rate", "256kbit", "burst", "4kb", "latency", "300ms"),
}
LOSSY = {
    "neither delay nor loss": ("delay", "0ms"),
    "50 ms of delay": ("delay", "50ms"),
    "2 % of loss": ("loss", "2%"),
    "50 ms of delay and 2 % of loss": ("delay", "50ms", "loss", "2%"),
}  # each way
QUIC = "security: mtls\nlinks: {wifi: {between: [r, d], protocol: quic}}\n"
LINK = "links: {wifi: {between: [r, d], limit: 128 kbit/s, downsample: {/tf: 20 Hz}}}\n"
pytestmark = pytest.mark.soak
CLOCK = """
import os, time
_time, _time_ns, _jump = time.time, time.time_ns, os.environ["JUMP"]
time.time = lambda: _time() + 3600 * os.path.exists(_jump)
time.time_ns = lambda: _time_ns() + 3600 * 10**9 * os.path.exists(_jump)
"""


def share_of_motion(motion: list[tuple[float, bool]], since: float) -> float:
    seen = [moves for at, moves in motion if at > since]
    return sum(seen) / len(seen) if seen else 0.0


@pytest.mark.timeout(100)
@pytest.mark.parametrize("how", SLOW)
def test_a_slow_link_carries_the_commands(how: str, tmp_path: Path, soak: Soak) -> None:
    narrow = LINK if how == "128 kbit/s" else ""
    with patrolling(tmp_path, links=narrow) as patrol:
        try:
            for host in ("r", "d"):
                patrol.hosts.slow_down(host, *SLOW[how])
        except NotPermittedError as reason:
            pytest.skip(f"this kernel has no such link: {reason}")
        patrol.wait_until(lambda: patrol.is_moving)
        since = time.monotonic()
        patrol.wait_until(lambda: time.monotonic() > since + WATCHED)
        moved = share_of_motion(patrol.motion(), since)
        assert moved > MOVES
        assert "does not answer" not in patrol.log("r")
        soak.tell(f"two hosts: a link with {how}", 1, 0, f"moved for {moved:.0%} of the time")


@contextmanager
def lossy(hosts: Hosts, words: Sequence[str]) -> Iterator[None]:
    """Delay and lose what two hosts send, by this kernel or by an emulated one."""
    try:
        for host in ADDRESSES:
            hosts.slow_down(host, "netem", *words)
        yield
        return
    except NotPermittedError:
        pass
    try:
        link = EmulatedLink(hosts)
    except NotPermittedError as reason:
        pytest.skip(f"neither this kernel nor an emulated one has such a link: {reason}")
    with link:
        link.shape(*words)
        yield


def certify(folder: Path) -> None:
    """Make the certificates of both hosts."""
    system, made = "two_hosts", folder / "certificates"
    make_authority(made, system)
    for host, address in ADDRESSES.items():
        make_certificate(made, system, host, address)
    for host in ADDRESSES:
        shutil.copytree(made, folder_of(system, {"XDG_CONFIG_HOME": str(folder / host / "config")}))


@pytest.mark.timeout(400)
@pytest.mark.parametrize("protocol", ["tcp", "quic"])
@pytest.mark.parametrize("how", LOSSY)
def test_a_link_that_delays_and_loses_carries_the_commands(how: str, protocol: str, tmp_path: Path, soak: Soak) -> None:
    if protocol == "quic":
        certify(tmp_path)
    with patrolling(tmp_path, links=QUIC if protocol == "quic" else "") as patrol, lossy(patrol.hosts, LOSSY[how]):
        since, told = time.monotonic(), len(patrol.log("r"))
        patrol.wait_until(lambda: patrol.has_moved_since(since))
        since = time.monotonic()
        patrol.wait_until(lambda: time.monotonic() > since + 2 * WATCHED)
        moved = share_of_motion(patrol.motion(), since)
        assert moved > MOVES
        assert "does not answer" not in patrol.log("r")[told:]
        soak.tell(f"two hosts: a link with {how}, {protocol.upper()}", 1, 0, f"moved for {moved:.0%} of the time")


@pytest.mark.timeout(100)
@pytest.mark.parametrize("host", ["r", "d"])
def test_a_full_disk_stops_nothing(host: str, tmp_path: Path, soak: Soak) -> None:
    disk = tmp_path / host
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", disk], check=False)
    if mounted.returncode:
        pytest.skip("this user may not mount a disk")
    try:
        with patrolling(tmp_path) as patrol:
            patrol.wait_until(lambda: patrol.is_moving)
            filled = subprocess.run(["dd", "if=/dev/zero", f"of={disk / 'filler'}"], capture_output=True, check=False)
            assert b"No space left" in filled.stderr
            since = time.monotonic()
            patrol.wait_until(lambda: time.monotonic() > since + WATCHED)
            moved = share_of_motion(patrol.motion(), since)
            assert moved > MOVES
            assert patrol.rbx("r" if host == "d" else "d", "ps", patrol.name).wait(20) == 0
            name = "base" if host == "r" else "other"
            soak.tell(f"two hosts: the disk of the {name} host is full", 1, 0, f"moved for {moved:.0%} of the time")
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


@pytest.mark.timeout(100)
def test_a_wall_clock_that_jumps_by_an_hour_and_back_stops_nothing(tmp_path: Path, soak: Soak) -> None:
    (tmp_path / "clock").mkdir()
    (tmp_path / "clock/sitecustomize.py").write_text(CLOCK, encoding="utf-8")
    jump = tmp_path / "jump"
    with patrolling(tmp_path, {"PYTHONPATH": f"{tmp_path / 'clock'}:{ROOT}", "JUMP": str(jump)}) as patrol:
        patrol.wait_until(lambda: patrol.is_moving)
        moved = []
        for deed in (jump.touch, jump.unlink):
            deed()
            since = time.monotonic()
            patrol.wait_until(lambda since=since: time.monotonic() > since + WATCHED / 2)  # type: ignore[misc]
            moved.append(share_of_motion(patrol.motion(), since))
        assert min(moved) > MOVES
        soak.tell(
            "two hosts: the wall clock of the other host jumps by an hour, and back",
            2,
            0,
            f"moved for {min(moved):.0%} of the time; faked within Python",
        )

"""Hosts that report to each other try each other's access control with every report."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import time_ns

import pytest

from rbxcompose.bus.access_control import AllowedHost, access_control
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import RouterLink, open_router, tls_settings
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.plan.model import HostAccess, OtherHost, Share
from rbxcompose.compiler.systems.certificates import common_name, make_authority, make_certificate, tls_of
from rbxcompose.runtime.channel import HostReport
from rbxcompose.runtime.process_group.router import HostLine
from tests.systems.test_links import free_port, until

ROBOT, HOSTS = "walker", ("a", "b")
pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")


class Line:
    """One end: which hosts it has heard of, and what came through, in order."""

    def __init__(self, host: str, other: str, link: RouterLink) -> None:
        self.heard: list[str] = []
        self.transport = ZenohTransport(open_router(tcp_endpoint(free_port()), link), lambda owner, call: call())
        share = Share(host, (OtherHost(other, (), False),), access=(HostAccess(other, (), (), ()),))
        heard = self.heard.append
        told = lambda report: heard(report.host)  # noqa: E731
        self.line = HostLine(ROBOT, share, self.transport, told, heard, time_ns, lambda *_: None)
        self.report = HostReport(host, "1", f"run of {host}")


@contextmanager
def linked(folder: Path, *, is_open: bool) -> Iterator[tuple[Line, Line]]:
    """Link two hosts with certificates; if `is_open`, the one that is dialled lets everything through."""
    make_authority(folder, "lab")
    dialled, lines = (f"tls/127.0.0.1:{free_port()}",), []
    for host, other in (HOSTS, HOSTS[::-1]):
        make_certificate(folder, "lab", host, "127.0.0.1")
        files = tls_of(folder, host, "mtls")
        tls = tls_settings(files.authority, files.certificate, files.key, mutual=True)
        access = access_control(ROBOT, 0, [AllowedHost(common_name("lab", other), (), (), ())])
        is_first = host == HOSTS[0]
        listen, dial = (dialled, ()) if is_first else ((), dialled)
        lines.append(Line(host, other, RouterLink(listen, dial, tls, {} if is_open and is_first else access)))
    try:
        yield lines[0], lines[1]
    finally:
        for line in reversed(lines):
            line.transport.close()


def both_tell(lines: tuple[Line, Line]) -> bool:
    for one in lines:
        one.line.send(one.report)
    return all(line.heard for line in lines)


def test_a_report_arrives_and_what_is_denied_does_not(tmp_path: Path) -> None:
    with linked(tmp_path, is_open=False) as lines:
        until(lambda: both_tell(lines))
        assert [set(line.heard) for line in lines] == [{"b"}, {"a"}]


def test_a_router_that_lets_through_what_it_must_deny_is_found_before_the_first_report_counts(tmp_path: Path) -> None:
    with linked(tmp_path, is_open=True) as lines:
        until(lambda: both_tell(lines))
        assert lines[0].heard[0].startswith("RBX6142")
        assert set(lines[1].heard) == {"a"}

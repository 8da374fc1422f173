"""What is seen of one session on a link with it alone, while others have the same."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest
import zenoh

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import SessionLink, as_file, guest_settings, open_peer, open_router
from tests.programs.test_child import eventually
from tests.systems.test_links import free_port

Sessions = tuple[zenoh.Session, zenoh.Session, SessionLink]


@pytest.fixture
def sessions() -> Iterator[Sessions]:
    """The session of a program, that of somebody else, and the link with the program."""
    with ExitStack() as stack:
        router = stack.enter_context(open_router(at := tcp_endpoint(free_port())))
        settings, endpoint = guest_settings(at, "a1")
        link = SessionLink(endpoint, "a1", ["0/cmd_vel"], ["0/reset"])  # before the program is there
        stack.callback(link.close)
        program = stack.enter_context(zenoh.open(zenoh.Config.from_json5(as_file(settings))))
        other = stack.enter_context(open_peer(at))
        eventually(lambda: bool(other.info.peers_zid()) and len(router.info.peers_zid()) == 2)
        yield program, other, link


def test_what_a_session_subscribes_to_and_serves_is_seen_and_what_others_do_is_not(sessions: Sessions) -> None:
    program, other, link = sessions

    def declare(session: zenoh.Session) -> list[Any]:
        subscriber = session.declare_subscriber("0/cmd_vel", lambda sample: None)
        return [subscriber, session.declare_queryable("0/reset", lambda query: None, complete=True)]

    declare(other)
    assert link.matching() == []
    ends = declare(program)
    eventually(lambda: link.matching() == ["0/cmd_vel", "0/reset"])
    for end in ends:
        end.undeclare()
    eventually(lambda: link.matching() == [])


def test_another_session_at_its_endpoint_is_not_taken_for_it() -> None:
    with ExitStack() as stack:
        stack.enter_context(open_router(at := tcp_endpoint(free_port())))
        settings, endpoint = guest_settings(at, "a1")
        right, wrong = (SessionLink(endpoint, name, [], []) for name in ("a1", "b2"))
        stack.callback(right.close)
        stack.callback(wrong.close)
        stack.enter_context(zenoh.open(zenoh.Config.from_json5(as_file(settings))))
        eventually(lambda: right.is_linked and bool(wrong._session.info.peers_zid()))
        assert not wrong.is_linked


def test_what_a_session_publishes_is_heard_and_nobody_else_knows_of_that(sessions: Sessions) -> None:
    program, other, link = sessions
    of_other: Any = other.declare_publisher("0/odom")
    of_program: Any = program.declare_publisher("0/odom")
    link.listen("0/**")
    eventually(lambda: bool(of_program.matching_status.matching))

    def is_heard() -> bool:
        of_other.put(b"")
        program.put("0/without_a_publisher", b"")
        return link.heard() == ["0/without_a_publisher"]

    eventually(is_heard)
    assert not of_other.matching_status.matching
    link.listen(None)
    eventually(lambda: not of_program.matching_status.matching)

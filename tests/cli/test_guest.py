"""A visitor on a bus with many others."""

from __future__ import annotations

from contextlib import ExitStack

import pytest

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_router
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import BusPlace
from tests.programs.test_child import eventually
from tests.systems.test_links import free_port

MANY = 1000  # tokens, more than Zenoh's channels take


@pytest.mark.parametrize("stays", [False, True])
def test_tokens_that_arrive_while_it_asks_for_them_do_not_hold_it_up(stays: bool) -> None:
    with ExitStack() as stack:
        router = stack.enter_context(open_router(at := tcp_endpoint(free_port())))
        kept = [router.liveliness().declare_token(f"crowd/{number}") for number in range(MANY)]
        guest = stack.enter_context(Guest(BusPlace(at, 0), stays=stays))
        seen: set[str] = set()
        guest.transport.watch("crowd/**", lambda token, is_there: seen.add(token))
        eventually(lambda: bool(seen))  # and not all of them yet
        eventually(lambda: len(guest.tokens("crowd/**")) == len(kept))

from __future__ import annotations

import errno

import pytest

from rbxcompose.runtime.process_group import connection

MODULE = "rbxcompose.runtime.process_group.connection"


def opening(monkeypatch: pytest.MonkeyPatch, *waits: float) -> tuple[list[str], float]:
    """Open a session at a router that is late once for each of `waits` for a processor [s]; return tries and waits."""
    tries: list[str] = []
    total = [0.0]

    def open_lone(router: str) -> str:
        tries.append(router)
        if len(tries) > len(waits):
            return "session"
        total[0] += waits[len(tries) - 1]
        raise OSError(errno.ECONNREFUSED, "no router answers")

    monkeypatch.setattr(f"{MODULE}.open_lone", open_lone)
    monkeypatch.setattr(f"{MODULE}.waits_of", lambda pid: {"1": total[0]})
    assert connection._open_lone("tcp/127.0.0.1:7440")
    return tries, total[0]


def test_a_router_that_is_late_on_a_machine_with_too_much_to_do_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    assert opening(monkeypatch, 3.0, 2.0) == (["tcp/127.0.0.1:7440"] * 3, 5.0)


def test_a_router_that_does_not_answer_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OSError, match="no router answers"):
        opening(monkeypatch, 0.1)

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.missions.execution.mission_run import BLOCK, MOST_BLOCKS, LogStore


def store_of(count: int) -> LogStore:
    store = LogStore()
    for number in range(count):
        store.append({"event": "skill", "number": number, "values": [0.1, "corner_1", None]})
    return store


@given(count=st.integers(0, 5 * BLOCK), number=st.integers(0, 5 * BLOCK))
def test_what_was_written_since_comes_back_as_it_was(count: int, number: int) -> None:
    store = store_of(count)
    assert store.written == count
    assert [record["number"] for record in store.since(number)] == list(range(number, count))
    assert all(record["values"] == [0.1, "corner_1", None] for record in store.since(number))


def test_the_oldest_are_forgotten() -> None:
    count = BLOCK * (MOST_BLOCKS + 3) + 7
    kept = store_of(count).since(0)
    assert len(kept) == BLOCK * MOST_BLOCKS + 7
    assert kept[-1]["number"] == count - 1

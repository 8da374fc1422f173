"""The robot's log for pages."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.domains.console.feeds import MOST, tail
from rbxcompose.runtime.log import Record


def lines(*texts: str) -> bytes:
    return b"".join(f"{Record(1.5, Level.WARN, 'base', text).to_json()}\n".encode() for text in texts)


def texts(answer: dict[str, object]) -> list[str]:
    records = answer["records"]
    assert isinstance(records, list)
    return [record["text"] for record in records]


def test_records_come_once_and_only_whole(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    assert tail(path, 0) == {"records": [], "after": 0}
    path.write_bytes(lines("one") + lines("two")[:-5])
    first = tail(path, 0)
    assert first["records"] == [{"time": 1.5, "level": "warning", "source": "base", "text": "one"}]
    path.write_bytes(lines("one", "two"))
    second = tail(path, first["after"])
    assert texts(second) == ["two"]
    assert texts(tail(path, second["after"])) == []
    path.write_bytes(lines("new"))
    assert texts(tail(path, second["after"])) == ["new"]


def test_of_a_long_log_only_the_end_is_read(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    path.write_bytes(lines(*(f"line {number} {'x' * 300}" for number in range(5000))))
    found = texts(tail(path, 0))
    assert found[-1].startswith("line 4999")
    assert 100 < len(found) <= MOST


@given(st.binary(), st.integers())
def test_no_file_does_any_harm(tmp_path_factory: pytest.TempPathFactory, data: bytes, after: int) -> None:
    path = tmp_path_factory.getbasetemp() / "any.jsonl"
    path.write_bytes(data)
    assert 0 <= tail(path, after)["after"] <= len(data)

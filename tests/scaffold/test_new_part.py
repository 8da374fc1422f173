"""A new part."""

from __future__ import annotations

from rbxcompose.scaffold.part import part_files
from rbxcompose.testing import Golden


def test_it_is_written_as_people_would_write_it(golden: Golden) -> None:
    for name, text in part_files("pack").items():
        golden.check(f"part/{name}.txt", text)

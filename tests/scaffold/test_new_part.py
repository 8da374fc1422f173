"""A new part."""

from __future__ import annotations

from rbxcompose.testing import Golden
from rbxcompose.tools.scaffold import part_files


def test_it_is_written_as_people_would_write_it(golden: Golden) -> None:
    for name, text in part_files("pack").items():
        golden.check(f"part/{name}.txt", text)

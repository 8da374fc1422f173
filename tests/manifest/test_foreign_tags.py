"""Tags of other programs."""

from __future__ import annotations

import pytest

from rbxcompose.manifest.reader import read_text


@pytest.mark.parametrize(
    ("written", "cure"),
    [
        ("!secret wifi", "${secret.wifi}"),
        ("!env_var PORT /dev/ttyUSB0", "${env.PORT}"),
        ("!include servos.yaml", "write its contents here"),
        ("!important text", "put quotes around it"),
    ],
)
def test_a_tag_of_another_program_leads_to_what_is_written_here(written: str, cure: str) -> None:
    _, (finding,) = read_text(f"about: {written}\n", "robot.yaml")
    assert cure in finding.help

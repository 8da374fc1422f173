"""`top SYSTEM`: one picture of all hosts, in which one that does not answer is told."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from rbxcompose.commands.hosts import Remote
from rbxcompose.manifest.system_file import HostModel
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.commands.top import LiveShare
from rbxcompose.tools.top import SILENT, ShareView, system_lines
from tests.systems.test_links import until

TOLD: dict[str, Any] = {
    "is_supervised": True,
    "mission": "running patrol",
    "batteries": {"battery": "80 %"},
    "components": [
        {"name": "base", "state": "active", "restarts": 0, "rate": 50.0, "level": "OK", "message": ""},
        {"name": "battery", "state": "active", "restarts": 1, "rate": None, "level": "WARN", "message": "low"},
    ],
    "processes": [{"process": "world", "pid": 7, "cpu": 0.25, "memory": 50_000_000}],
    "warnings": [{"time": 4.0, "level": "WARN", "source": "battery", "text": "low"}],
}
STARTING = {**TOLD, "mission": "", "batteries": {}, "processes": [], "warnings": []}
STARTING["components"] = [{**TOLD["components"][0], "name": "go_to", "state": "starting", "rate": None}]
SHARES = [
    ShareView("scout_1", "robot", TOLD, 0.4),
    ShareView("scout_1", "desk", STARTING, 0.9),
    ShareView("scout_2", "hall", TOLD, SILENT + 4.0),
    ShareView("scout_3", "yard", None, 9.0, "ssh: connect to host yard: No route to host"),
]


def test_each_share_and_component_is_a_line_and_nothing_old_is_shown_as_new(golden: Golden) -> None:
    golden.check("top.txt", "\n".join(system_lines("fleet", SHARES, 100, 40)) + "\n")


def test_what_does_not_fit_is_counted() -> None:
    many = [ShareView(f"scout_{number}", "hall", TOLD, 0.0) for number in range(20)]
    lines = system_lines("fleet", [*many[:3]], 60, 12)
    assert len(lines) == 12
    assert all(len(line) <= 60 for line in lines)
    assert any(line.startswith("... and") for line in lines)


class _Host(Remote):
    """A host whose rbxcompose tells one picture and ends."""

    def rbxcompose(self, words: Sequence[str], *, folder: str = "", has_terminal: bool = False) -> list[str]:
        told = '{"components": [], "is_supervised": true, "warnings": []}'
        return [sys.executable, "-c", f"print('''{told}''', flush=True); print('gone')"]


def test_a_host_whose_command_ends_is_told_with_its_last_words() -> None:
    share = LiveShare("hall", "scout", _Host("hall", HostModel()))
    try:
        until(lambda: share.view().problem == "gone")
        assert share.view().answer is not None
    finally:
        share.close()

"""Which tests may run side by side: those of one file never do, nor do those that judge real processes by real time."""

from __future__ import annotations

from xdist.scheduler import LoadScopeScheduling

REAL_TIME = (
    "tests/exposure/",
    "tests/faults/",
    "tests/net/",
    "tests/runtime/test_apply_for_real",
    "tests/runtime/test_external_clock",
    "tests/runtime/test_lifeline",
    "tests/runtime/test_real_processes",
)
"""Tests with deadlines in real time. One process runs them all, so that they leave each other the processors."""


class ByFile(LoadScopeScheduling):
    """Gives each worker whole files, so that what a file's tests share is made once."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return "real time" if file.startswith(REAL_TIME) else file

"""A new entry that was to change one with a similar name, as in an overlay that misspells a place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from rbxcompose.findings import DID_YOU_MEAN, Finding, surely_meant
from rbxcompose.manifest.validate import MISSING_KEY


def with_namesake(findings: Iterable[Finding], name: str, names: Iterable[str]) -> Iterator[Finding]:
    """Yield the findings about an entry; one about a key that it lacks tells the entry that was surely meant."""
    others = [one for one in names if one != name]
    for finding in findings:
        is_lacking = finding.code == MISSING_KEY.code and not finding.help
        meant = surely_meant(name, others) if is_lacking else None
        yield replace(finding, help=f"{DID_YOU_MEAN} '{meant}', which has it?") if meant else finding

"""Which versions are installed, and which are locked."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.tools.doctor import HostFacts, Version, examination

OTHER_VERSION = kind("RBX9401", Severity.WARNING)


@examination
def versions(facts: HostFacts) -> Iterator[str | Finding]:
    """Compare the installed versions with the locked ones, if there is a lock file."""
    wrong = [one for one in facts.versions if _is_wrong(one)]
    for one in wrong:
        there = f"{one.name} {one.installed} is installed" if one.installed else f"{one.name} is not installed"
        locked = f", {one.locked} is locked" if one.locked else ""
        todo = "pip install -r requirements.lock" if one.locked else f"pip install {one.name}"
        yield OTHER_VERSION.at(None, there + locked, help=todo)
    fine = ", ".join(f"{one.name} {one.installed}" for one in facts.versions if one not in wrong)
    yield f"Python {facts.python}, {fine}" if fine else f"Python {facts.python}"


def _is_wrong(version: Version) -> bool:
    return version.installed is None or version.locked not in (None, version.installed)

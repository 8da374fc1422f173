"""What a profile removes while others still use it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from rbxcompose.base.findings import Finding, Related, Span, kind
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.manifest.registry import sections_in_use

STILL_USED = kind("RBX1310")
_QUOTED = re.compile(r"'([^']*)'")
_MOST_SHOWN = 8


def blamed(findings: Iterable[Finding], whole: Robot, changed: Robot, profile: Span) -> Iterator[Finding]:
    """Yield what only a profile causes, with one finding for each thing that it removes and that is still used.

    `whole` is the robot without the profile, `changed` the one with it.
    """
    history = changed.manifest.history
    removed = {name: span for section in sections_in_use() for name, span in history.removed(section.name).items()}
    removed = {name: span for name, span in removed.items() if profile.contains(span)}
    gone = [end for end in whole.ends if end.instance in removed]
    meant = {word: end.instance for end in gone for word in (end.skill, end.topic) if word}
    users: dict[str, list[Finding]] = {}
    for finding in findings:
        words = _QUOTED.findall(finding.message)
        name = next((meant.get(word, word) for word in words if meant.get(word, word) in removed), "")
        if not name:
            yield finding
        else:
            users.setdefault(name, []).append(finding)
    for name, used in users.items():
        related = [Related(one.span, one.message) for one in used if one.span]
        yield STILL_USED.at(
            removed[name],
            f"this profile removes '{name}', which is still used",
            help="keep it, or let the profile remove or change what uses it, too",
            related=related[:_MOST_SHOWN],
        )

"""Links that are seen and that arms do not watch."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.printable import plain
from rbxcompose.sections.arms import arms

_SHOWN = 3


@check("RBX2354", Severity.WARNING, closed=())
def seen_only(robot: Robot) -> Iterator[Finding]:
    """A link is seen, and arms move through it."""
    description = robot.manifest.body
    if description is None or not robot.manifest.contents.of(arms):
        return
    found = [one for one in description.body.links.values() if one.visuals and not one.collisions]
    if found:
        names = ", ".join(f"'{plain(one.name, 60)}'" for one in found[:_SHOWN])
        more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
        verb = "has" if len(found) == 1 else "have"
        yield seen_only.at(
            found[0].span,
            f"{names}{more} {verb} visual shapes and no collision shape, so arms may hit things with what is seen",
            help="give each a collision shape, or write 'cover: visual' under 'body'",
            related=[Related(one.span, "the next") for one in found[1:_SHOWN]],
        )

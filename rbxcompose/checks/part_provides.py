"""A promise that a part does not keep."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.part_needs import is_type, own_instances, short
from rbxcompose.composition.robot_manifest import About, Claim
from rbxcompose.findings import Finding, Related, suggest
from rbxcompose.manifest.library import PREFIX
from rbxcompose.manifest.tree import at
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd, resolve
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.ports import Serves, ServesAction, ServesTopic


@check("RBX3022", closed=(WIRING, NAMES, "values"))
def part_provides(robot: Robot) -> Iterator[Finding]:
    """A part lacks something that it says it provides."""
    for part in robot.manifest.parts.values():
        ends = [end for name in own_instances(part) & robot.components.keys() for end in robot.components[name].ends]
        if (part.components & robot.written) - robot.components.keys():
            continue  # one of its components has mistakes, which are reported at their own places
        for claim in part.claims:
            if claim.about is not About.NEED and (what := _lacking(robot, claim, ends)):
                message = f"part '{part.name}' does not have {what}, which it says it provides"
                is_own = part.components <= robot.components.keys() and not claim.span.file.startswith(PREFIX)
                if not is_own:  # something of it was removed or changed
                    yield part_provides.at(part.span, message, related=[Related(claim.span, "promised here")])
                    continue
                known = [end.skill for end in ends if _serves(end, end.skill)] if claim.about is About.SKILL else []
                help_text = suggest(claim.name, known, "its skills")
                yield part_provides.at(claim.span, message, help=help_text)


def _serves(end: PortEnd, skill: str) -> bool:
    return isinstance(end.port, Serves | ServesAction | ServesTopic) and end.skill == skill


def _lacking(robot: Robot, claim: Claim, ends: list[PortEnd]) -> str:
    """Return what a part promises but lacks, in words; empty if it keeps its promise."""
    match claim.about:
        case About.VALUE if at(robot.manifest.root, ("values", claim.name)) is None:
            return f"the value '{claim.name}'"
        case About.SKILL if claim.name not in robot.skills or not any(_serves(end, claim.name) for end in ends):
            return f"the skill '{claim.name}'"
        case About.PORT:
            topic = resolve(claim.name, robot.manifest.bus.namespace or "")
            if not any(end.topic == topic and is_type(end, claim.type) for end in ends):
                return f"the topic '{claim.name}' ({short(claim.type)})"
    return ""

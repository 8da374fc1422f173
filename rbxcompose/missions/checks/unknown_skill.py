"""Skills that the robot does not have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.findings import DID_YOU_MEAN, Finding, nearest, replacement, surely_meant
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.registry import kinds

_OURS = {
    "fallback": "selector sel priority_selector",
    "sequence": "seq steps sequential",
    "parallel": "par simultaneously together concurrently",
    "repeat": "loop",
    "for": "foreach for_each",
    "wait": "sleep delay pause",
    "wait_for": "wait_until await",
    "choose": "switch match case",
    "log": "print echo",
    "use": "subtree sub_tree submission include",
    "run": "exec script",
}
FOREIGN: Mapping[str, str] = {name: ours for ours, names in _OURS.items() for name in names.split()}
"""Our word for each of another mission language or of a behaviour tree."""


@mission_check("RBX4102", is_fixable=True)
def unknown_skill(mission: Examined) -> Iterator[Finding]:
    """A mission uses a skill that the robot does not have

    Skills are the actions that the robot's components serve. No component of this robot serves an action of this name.

    Bad:

    ```yaml
    do:
      goto: dock
    ```

    Good:

    ```yaml
    do:
      go_to: dock
    ```
    """
    skills = mission.robot.skills
    for node in mission.program.nodes:
        if node.skill and node.skill not in skills:
            known = (*skills, *kinds())
            close = nearest(node.skill, known)
            # Else it may belong to a component that could not be read.
            ours = FOREIGN.get(node.skill.casefold(), "")
            if mission.robot.is_complete or ours or surely_meant(node.skill, known):
                message = f"mission '{mission.program.name}' uses a skill that the robot does not have: '{node.skill}'"
                if ours in kinds():
                    fix = replacement(node.span, node.skill, ours, is_safe=False)  # what is below it may differ
                    yield unknown_skill.at(node.span, message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
                    continue
                valid = known if close else skills
                yield unknown_skill.misspelt(node.span, message, node.skill, valid, "skills of this robot")

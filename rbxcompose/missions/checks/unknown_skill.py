"""Skills that the robot does not have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, nearest, surely_meant
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.registry import kinds


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
            if mission.robot.is_complete or surely_meant(node.skill, known):
                message = f"mission '{mission.program.name}' uses a skill that the robot does not have: '{node.skill}'"
                valid = known if close else skills
                yield unknown_skill.misspelt(node.span, message, node.skill, valid, "skills of this robot")

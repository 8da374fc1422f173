"""Skills that the robot does not have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, nearest
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
            close = nearest(node.skill, (*skills, *kinds()))
            if close or mission.robot.is_complete:
                message = f"mission '{mission.program.name}' uses a skill that the robot does not have: '{node.skill}'"
                known = (*skills, *kinds()) if close else skills
                yield unknown_skill.misspelt(node.span, message, node.skill, known, "skills of this robot")

"""Skills that the robot does not have."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbxcompose.findings import DID_YOU_MEAN, Finding, nearest, replacement, surely_meant
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.language.foreign_steps import FOREIGN
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.missions.program.registry import kinds

_WORD = re.compile(r"[a-zA-Z_].*")


def _called(node: MissionNode) -> str:
    """Return the word after a step, as in 'service: go_to'."""
    words = (one.value.text for one in node.step.arguments if isinstance(one.value, ScalarNode))
    return next(words, "")


@mission_check("RBX4102", is_fixable=True)
def unknown_skill(mission: Examined) -> Iterator[Finding]:
    """A mission uses a skill that the robot does not have."""
    skills = mission.robot.skills
    for node in mission.program.nodes:
        if node.skill and node.skill not in skills:
            known = (*skills, *kinds())
            close = nearest(node.skill, known)
            # Else it may belong to a component that could not be read.
            ours = FOREIGN.get(node.skill.casefold(), "")
            if mission.robot.is_complete or ours or surely_meant(node.skill, known):
                message = f"mission '{mission.program.name}' uses a skill that the robot does not have: '{node.skill}'"
                if not _WORD.fullmatch(node.skill):
                    message = f"'{node.skill}' is no step"
                    yield unknown_skill.at(
                        node.span, message, help="write a step, or a list of steps, such as '- go_to: dock'"
                    )
                    continue
                if (called := _called(node)) in skills:
                    is_plain = f"a step is the name of its skill: '- {called}: ...'"
                    yield unknown_skill.at(node.span, message, help=f"{is_plain}, with its arguments after the colon")
                    continue
                if ours in kinds():
                    fix = replacement(node.span, node.skill, ours, is_safe=False)  # what is below it may differ
                    yield unknown_skill.at(node.span, message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
                    continue
                owner, is_other, own = node.skill.rpartition("/")
                if is_other and not close:
                    help_text = (
                        f"a robot '{owner}' of the system must share '{own}', and name this robot below 'callers'"
                    )
                    yield unknown_skill.at(node.span, message, help=help_text)
                    continue
                valid = known if close else skills
                yield unknown_skill.misspelt(node.span, message, node.skill, valid, "skills of this robot")

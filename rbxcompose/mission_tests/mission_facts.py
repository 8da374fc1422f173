"""What a mission and the missions it uses need from the robot, and the steps that they have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.dataclass import dataclass
from rbxcompose.mission_tests.model import FAILS, SUCCEEDS
from rbxcompose.missions.analysis.effects import sent_by
from rbxcompose.missions.analysis.endings import Ending
from rbxcompose.missions.engine.condition_watches import POSE
from rbxcompose.missions.program.program import Program, RobotNames, Skill


def missions_in(program: Program) -> Iterator[Program]:
    """Yield a linked mission and each mission that it uses, once per use."""
    yield program
    yield from (node.inner for node in program.nodes if node.inner)


@dataclass(frozen=True, slots=True)
class MissionFacts:
    """What a mission needs from the robot, and its steps by name, each with what its outcomes count as."""

    skills: Mapping[str, Skill]
    services: frozenset[str]
    values: frozenset[str]
    topics: frozenset[str]
    steps: Mapping[str, Mapping[str, str]]
    ends: Mapping[str, str]

    @classmethod
    def of(cls, program: Program, robot: RobotNames) -> MissionFacts:
        """Return the facts of a linked mission."""
        named: dict[str, Mapping[str, str]] = {}
        for node in program.nodes:
            if node.name:
                own = Ending(program, robot).of(node.number).named
                named[node.name] = {**named.get(node.name, {}), **own}
        skills = {node.skill: robot.skills[node.skill] for node in program.nodes if node.skill in robot.skills}
        published, called = sent_by([program])
        read = frozenset[str]().union(*(one.reads for one in missions_in(program)))
        return cls(
            skills,
            frozenset(called),
            read & {*robot.values, POSE} - {*program.inputs, *program.data},
            frozenset(published),
            {**named, **{name: skill.outcomes for name, skill in skills.items()}},
            {SUCCEEDS: SUCCEEDS, FAILS: FAILS, **Ending(program, robot).mission().named},
        )

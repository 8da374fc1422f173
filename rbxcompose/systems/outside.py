"""What robots of a system have of each other, before they are compiled with it. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from rbxcompose.missions.program.sources import SkillWay
from rbxcompose.model.outside import Outside
from rbxcompose.model.robot import RobotComponent
from rbxcompose.model.skills import served_skills
from rbxcompose.sdk.ports import Serves


def served_outside(components: Mapping[str, RobotComponent], robot: str, names: Mapping[str, str]) -> Outside:
    """Return the services and actions of a robot as others have them; `names` are those that they have for its own.

    A goal of another robot cannot be held, only cancelled and sent again, and takes a part of that robot.
    """
    ends = [end for one in components.values() for end in one.ends if end.topic in names]
    services = {names[end.topic]: end.type_name for end in ends if isinstance(end.port, Serves)}
    sources = [one for one in served_skills(components) if one.topic in names and one.way is not SkillWay.TOPIC]
    skills = [
        replace(
            one,
            topic=names[one.topic],
            skill=replace(
                one.skill,
                name=f"{robot}/{one.skill.name}",
                pausable=False,
                claims=one.skill.claims and f"{robot}/{one.skill.claims}",
            ),
        )
        for one in sources
    ]
    return Outside(frozenset(names.values()), services, tuple(skills))


def joined(parts: Iterable[Outside]) -> Outside:
    """Return all of it."""
    every = list(parts)
    return Outside(
        frozenset(name for one in every for name in one.names),
        {name: type_ for one in every for name, type_ in one.services.items()},
        tuple(skill for one in every for skill in one.skills),
    )

"""Claims of a part: the topics that it needs from outside, and what it provides to the rest of the robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.composition.instance_names import Renaming
from rbxcompose.composition.robot_manifest import About, Claim
from rbxcompose.manifest.section import Contents
from rbxcompose.manifest.tree import key_span, value_span
from rbxcompose.references import CONTROLLER, TOPIC, VALUE
from rbxcompose.sections.needs import needs
from rbxcompose.sections.provides import provides


def claims_of(part: Contents) -> Iterator[Claim]:
    """Yield the claims that a part's file makes under `needs:` and `provides:`."""
    needed, given = part.of(needs), part.of(provides)
    for section, about, ports in (("needs", About.NEED, needed.ports), ("provides", About.PORT, given.ports)):
        for topic, type_name in ports.items():
            yield Claim(about, topic, type_name, key_span(part.root, (section, "ports", topic)))
    for key, about, names in (("skills", About.SKILL, given.skills), ("values", About.VALUE, given.values)):
        for index, name in enumerate(names):
            yield Claim(about, name, "", value_span(part.root, ("provides", key, index)))


def renamed(claim: Claim, renaming: Renaming) -> Claim:
    """Return a claim with its name outside the part; a skill is a controller, or named like the topic of its action."""
    match claim.about:
        case About.VALUE:
            return replace(claim, name=renaming.name(VALUE, claim.name))
        case About.SKILL:
            name = renaming.name(CONTROLLER, claim.name)
            return replace(claim, name=renaming.topic(name).rpartition("/")[-1])
    return replace(claim, name=renaming.name(TOPIC, claim.name))

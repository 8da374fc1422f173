"""What a part says of itself: the topics that it needs outside, and what it gives to the rest of the robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TypeVar

from rbxcompose.findings import Report
from rbxcompose.manifest.models import About, Claim, Needs, Provides
from rbxcompose.manifest.renaming import Renaming
from rbxcompose.manifest.tree import Mapping, key_span, value_span
from rbxcompose.manifest.validate import validate

M = TypeVar("M", Needs, Provides)


def claims_of(root: Mapping, report: Report) -> Iterator[Claim]:
    """Yield what the file of a part says under `needs:` and `provides:`."""
    needs, provides = _read(Needs, root, "needs", report), _read(Provides, root, "provides", report)
    for section, about, ports in (("needs", About.NEED, needs.ports), ("provides", About.PORT, provides.ports)):
        for topic, type_name in ports.items():
            yield Claim(about, topic, type_name, key_span(root, (section, "ports", topic)))
    for key, about, names in (("skills", About.SKILL, provides.skills), ("values", About.VALUE, provides.values)):
        for index, name in enumerate(names):
            yield Claim(about, name, "", value_span(root, ("provides", key, index)))


def renamed(claim: Claim, renaming: Renaming) -> Claim:
    """Return a claim by the name outside of the part; a skill is named like the topic of its action."""
    match claim.about:
        case About.VALUE:
            return replace(claim, name=renaming.name_in("values")(claim.name))
        case About.SKILL:
            return replace(claim, name=renaming.topic(claim.name).rpartition("/")[-1])
    return replace(claim, name=renaming.topic(claim.name))


def _read(model: type[M], root: Mapping, key: str, report: Report) -> M:
    node = root.get(key)
    return (validate(model, node, (key,), report) if node is not None else None) or model()

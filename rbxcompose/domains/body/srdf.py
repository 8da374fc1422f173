"""SRDF, in which MoveIt keeps what a URDF does not say: groups of joints, their poses, and pairs of links to ignore."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.printable import plain
from rbxcompose.domains.body.link_pairs import REASONS, LinkPair, PairReason, pair_of
from rbxcompose.domains.body.xml_reader import XmlElement, quoted

Poses = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class SemanticGroup:
    """A group: chains of links, joints, the joints above links, and other groups; all of them together."""

    name: str
    chains: tuple[tuple[str, str], ...] = ()
    joints: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    span: Span | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class EndEffector:
    """A group at the end of another one, and the link that carries it."""

    name: str
    group: str
    parent_link: str
    parent_group: str = ""
    span: Span | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class OuterJoint:
    """A virtual joint: `kind` is as it is written, `child` should be the root of the URDF."""

    name: str
    kind: str
    frame: str
    child: str
    span: Span | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Semantics:
    """What an SRDF says; `poses` are positions of joints [rad or m] by group and name."""

    robot: str
    groups: Mapping[str, SemanticGroup] = field(default_factory=dict)
    poses: Mapping[str, Poses] = field(default_factory=dict)
    effectors: tuple[EndEffector, ...] = ()
    passive: tuple[str, ...] = ()
    pairs: Mapping[LinkPair, PairReason] = field(default_factory=dict)
    outer: tuple[OuterJoint, ...] = ()
    others: tuple[tuple[str, Span], ...] = field(default=(), compare=False)
    """What is understood by MoveIt alone, in words, with its places."""
    places: Mapping[tuple[str, ...], Span] = field(default_factory=dict, compare=False)
    """Where it is written, by the element and its names: of a state, its group comes first; links are in order."""


def is_srdf(root: XmlElement) -> bool:
    """Return whether a robot in XML is an SRDF: links stand in groups, and no joint has a parent."""
    return root.first("link") is None and any(
        child.name in ("group", "disable_collisions", "group_state", "end_effector", "virtual_joint")
        for child in root.children
    )


def read_semantics(root: XmlElement) -> Semantics:
    """Return what an SRDF says."""
    groups: dict[str, SemanticGroup] = {}
    poses: dict[str, dict[str, dict[str, float]]] = {}
    others: list[tuple[str, Span]] = []
    places: dict[tuple[str, ...], Span] = {}
    for element in root.all("group"):
        group = _group(element)
        if groups.setdefault(group.name, group) is not group:
            others.append((f"a further group '{plain(group.name, 60)}'", element.span))
    for state in root.all("group_state"):
        owner, name = _text(state, "group"), _text(state, "name")
        places["group_state", owner, name] = state.span
        positions = poses.setdefault(owner, {}).setdefault(name, {})
        for joint in state.all("joint"):
            value = _number(joint)
            if value is None:
                others.append((f"'{_text(joint, 'value')}' is not a single position of a joint", joint.span))
            else:
                positions[_text(joint, "name")] = value
    pairs: dict[LinkPair, PairReason] = {}
    for element in root.all("disable_collisions"):
        pair = pair_of(_text(element, "link1"), _text(element, "link2"))
        pairs[pair], places["disable_collisions", *pair] = _reason(_text(element, "reason")), element.span
    places |= {("passive_joint", _text(element, "name")): element.span for element in root.all("passive_joint")}
    known = ("group", "group_state", "end_effector", "passive_joint", "disable_collisions", "virtual_joint")
    others += [(f"the element '{child.name}'", child.span) for child in root.children if child.name not in known]
    return Semantics(
        root.attributes.get("name", ""),
        groups,
        poses,
        tuple(map(_effector, root.all("end_effector"))),
        tuple(_text(element, "name") for element in root.all("passive_joint")),
        pairs,
        tuple(map(_outer, root.all("virtual_joint"))),
        tuple(others),
        places,
    )


def _group(element: XmlElement) -> SemanticGroup:
    chains = tuple((_text(each, "base_link"), _text(each, "tip_link")) for each in element.all("chain"))
    joints, links, groups = (
        tuple(_text(each, "name") for each in element.all(key)) for key in ("joint", "link", "group")
    )
    return SemanticGroup(_text(element, "name"), chains, joints, links, groups, element.span)


def _effector(element: XmlElement) -> EndEffector:
    values = [_text(element, key) for key in ("name", "group", "parent_link", "parent_group")]
    return EndEffector(values[0], values[1], values[2], values[3], element.span)


def _outer(element: XmlElement) -> OuterJoint:
    values = [_text(element, key).strip() for key in ("name", "type", "parent_frame", "child_link")]
    return OuterJoint(values[0], values[1], values[2], values[3], element.span)


def _text(element: XmlElement, key: str) -> str:
    return element.attributes.get(key, "")


def _number(joint: XmlElement) -> float | None:
    try:
        value = float(_text(joint, "value"))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _reason(text: str) -> PairReason:
    """Return a reason; what a person wrote into the file is one, too."""
    return next((reason for reason in REASONS if reason == text.lower()), "user")


def to_srdf(said: Semantics) -> str:
    """Return an SRDF as MoveIt's setup assistant writes it."""
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', *_lines(said), ""])


def _lines(said: Semantics) -> Iterator[str]:
    yield f"<robot name={quoted(said.robot)}>"
    for group in said.groups.values():
        yield f"    <group name={quoted(group.name)}>"
        for base, tip in group.chains:
            yield f"        <chain base_link={quoted(base)} tip_link={quoted(tip)}/>"
        for key, names in (("joint", group.joints), ("link", group.links), ("group", group.groups)):
            for name in names:
                yield f"        <{key} name={quoted(name)}/>"
        yield "    </group>"
    for owner, poses in said.poses.items():
        for pose, positions in poses.items():
            yield f"    <group_state name={quoted(pose)} group={quoted(owner)}>"
            for joint, value in positions.items():
                yield f'        <joint name={quoted(joint)} value="{value!r}"/>'
            yield "    </group_state>"
    for one in said.effectors:
        parent = f" parent_group={quoted(one.parent_group)}" if one.parent_group else ""
        words = f"name={quoted(one.name)} parent_link={quoted(one.parent_link)} group={quoted(one.group)}"
        yield f"    <end_effector {words}{parent}/>"
    for each in said.outer:
        words = f"name={quoted(each.name)} type={quoted(each.kind)} parent_frame={quoted(each.frame)}"
        yield f"    <virtual_joint {words} child_link={quoted(each.child)}/>"
    for joint in said.passive:
        yield f"    <passive_joint name={quoted(joint)}/>"
    for first, second in sorted(said.pairs):
        words = f"link1={quoted(first)} link2={quoted(second)}"
        yield f'    <disable_collisions {words} reason="{said.pairs[first, second].capitalize()}"/>'
    yield "</robot>"

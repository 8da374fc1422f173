"""Links and joints that do not form one tree."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.body.model import Body, BodyJoint, BodyLink
from rbxcompose.findings import MOST_COMPARED, Finding, Related, Span, kind
from rbxcompose.printable import plain

NO_LINK = kind("RBX2005")
NO_TREE = kind("RBX2006")
_SHOWN = 60


def tree_mistakes(body: Body, whole: Span) -> Iterator[Finding]:
    """Yield what keeps a body from being one tree; unknown names come first, since the rest would follow from them."""
    if unknown := [*_unknown_links(body), *_wrong_mimics(body)]:
        yield from unknown
    elif not body.links:
        yield NO_TREE.at(whole, "this robot has no links", help="was its xacro expanded without calling its macros?")
    else:
        yield from _shape_mistakes(body)


def _unknown_links(body: Body) -> Iterator[Finding]:
    for joint in body.joints.values():
        spans = joint.link_spans or (joint.span, joint.span)
        for role, link, span in zip(("parent", "child"), (joint.parent, joint.child), spans, strict=True):
            if link not in body.links:
                message = f"the {role} of joint '{plain(joint.name, _SHOWN)}' does not exist: '{plain(link, _SHOWN)}'"
                yield NO_LINK.misspelt(span, message, link, _that_may_be(body, joint, role), "links")


def _that_may_be(body: Body, joint: BodyJoint, role: str) -> dict[str, BodyLink]:
    """Return the links that a joint may name: none of those below it as its parent, none with a parent as its child."""
    if len(body.joints) > MOST_COMPARED:
        return dict(body.links)
    if role == "child":
        taken = {joint.parent, *(one.child for one in body.joints.values() if one is not joint)}
    else:
        taken, below = set(), [joint.child]
        while below:
            taken.add(link := below.pop())
            below += [one.child for one in body.joints.values() if one.parent == link and one.child not in taken]
    return {name: link for name, link in body.links.items() if name not in taken} or dict(body.links)


def _wrong_mimics(body: Body) -> Iterator[Finding]:
    moving = [one.name for one in body.moving]
    for joint in body.joints.values():
        if joint.mimic is None:
            continue
        other = body.joints.get(joint.mimic.joint)
        if other is None:
            words = f"joint '{plain(joint.name, _SHOWN)}' mimics a joint that does not exist"
            message = f"{words}: '{plain(joint.mimic.joint, _SHOWN)}'"
            yield NO_LINK.misspelt(joint.mimic.span, message, joint.mimic.joint, moving, "joints that move")
        elif other.mimic is not None or not other.moves:
            does = "mimics another joint itself" if other.mimic else "does not move"
            message = f"joint '{plain(joint.name, _SHOWN)}' mimics '{plain(other.name, _SHOWN)}', which {does}"
            yield NO_LINK.at(joint.mimic.span, message, related=[Related(other.span, "the joint that is mimicked")])


def _shape_mistakes(body: Body) -> Iterator[Finding]:
    above: dict[str, BodyJoint] = {}
    for joint in body.joints.values():
        if joint.child in above:
            message = f"link '{plain(joint.child, _SHOWN)}' is the child of two joints"
            yield NO_TREE.at(joint.span, message, related=[Related(above[joint.child].span, "the first")])
        above.setdefault(joint.child, joint)
    roots = [link for name, link in body.links.items() if name not in above]
    if not roots:
        first = next(iter(body.joints.values()))
        yield NO_TREE.at(first.span, "each link is the child of a joint: the joints form a circle")
        return
    for other in roots[1:]:
        message = f"link '{plain(other.name, _SHOWN)}' is connected to nothing above it, like '{roots[0].name}'"
        related = [Related(roots[0].span, "the first root")]
        yield NO_TREE.at(other.span, message, help="add a joint that has it as its child", related=related)
    if len(roots) == 1 and len(above) == len(body.joints):
        yield from _circle(body)


def _circle(body: Body) -> Iterator[Finding]:
    reached = {name for name, _ in body.walk()}
    lost = next((link for name, link in body.links.items() if name not in reached), None)
    if lost is not None:
        joint = body.joint_above[lost.name]
        message = f"link '{plain(lost.name, _SHOWN)}' cannot be reached from '{body.root}': its joints form a circle"
        yield NO_TREE.at(joint.span, message)

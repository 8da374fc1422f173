"""Virtual joints of an SRDF: the one that MoveIt takes, and why it takes no other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import get_args

from rbxcompose.body.model import Body
from rbxcompose.body.srdf import OuterJoint
from rbxcompose.body.virtual_joint import VirtualKind
from rbxcompose.findings import Report, Severity, kind
from rbxcompose.printable import plain

UNUSED = kind("RBX2353", Severity.WARNING)
_KINDS: tuple[str, ...] = get_args(VirtualKind)


def virtual_joint(found: Sequence[OuterJoint], body: Body, report: Report) -> OuterJoint | None:
    """Return the virtual joint of a body as a manifest has it, if there is one; the others are told."""
    taken: OuterJoint | None = None
    for one in found:
        message, cure = _mistake(one, body)
        if not message and taken is not None:
            message = f"'{plain(taken.name, 60)}' places the root of the URDF already"
        if message:
            words = f"the virtual joint '{plain(one.name, 60)}' is left out: {message}"
            report.add(UNUSED.at(one.span, words, help=cure or "keep one of them"))
        else:
            taken = _meant(one, report)
    return taken


def _mistake(one: OuterJoint, body: Body) -> tuple[str, str]:
    """Return why a virtual joint cannot be used, and what helps; nothing if it can."""
    frame = one.frame.lstrip("/")
    written = {"name": one.name, "type": one.kind, "parent_frame": frame, "child_link": one.child}
    if missing := [key for key, value in written.items() if not value]:
        return f"it has no '{missing[0]}'", f"write '{missing[0]}'"
    if frame in body.links:
        return f"'{plain(frame, 60)}' is a link of the URDF", "leave it out: a link is a frame"
    if one.name in body.joints:
        return "the URDF has a joint of its name", "give it another name"
    if one.child != body.root:
        return f"the root of the URDF is '{plain(body.root, 60)}'", f'write child_link="{plain(body.root, 60)}"'
    if len(f"{one.name}{frame}".split()) > 1:
        return "there are spaces in its names", "leave them out"
    return "", ""


def _meant(one: OuterJoint, report: Report) -> OuterJoint:
    frame, kind = one.frame.lstrip("/"), one.kind.lower()
    if frame != one.frame:
        words = f"the frame '{plain(one.frame, 60)}' is called '{plain(frame, 60)}': names of frames begin without '/'"
        report.add(UNUSED.at(one.span, words))
    if kind not in _KINDS:
        words = f"there is no type '{plain(one.kind, 60)}', so the virtual joint is taken for fixed"
        report.add(UNUSED.at(one.span, words, help=f"write {', '.join(_KINDS[:-1])} or {_KINDS[-1]}"))
        kind = "fixed"
    return replace(one, kind=kind, frame=frame)

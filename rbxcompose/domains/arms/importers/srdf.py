"""`srdf`: MoveIt's SRDF, with the URDF that it is about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import get_args

from rbxcompose.base.findings import Finding, Report, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.importing.foreign_files import ForeignFile, FreeNames
from rbxcompose.commands.importing.importer import NOT_CARRIED_OVER, OTHER_PROGRAM, ImportedFiles, importer
from rbxcompose.commands.importing.manifest_text import flow, flow_list, header, key
from rbxcompose.compiler.composition.robot_file import is_own_name
from rbxcompose.domains.arms.drafts import ArmDraft, GripperDraft, manifest_of
from rbxcompose.domains.arms.motion.groups import carrying, chain
from rbxcompose.domains.body.description import BodyPart, Description, VirtualKind, describe
from rbxcompose.domains.body.files import BodyFile
from rbxcompose.domains.body.link_pairs import CollisionMatrix, digest_of
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.srdf import EndEffector, OuterJoint, SemanticGroup, Semantics, is_srdf, read_semantics
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf

UNUSED = kind("RBX2353", Severity.WARNING)
_KINDS: tuple[str, ...] = get_args(VirtualKind)


def virtual_joint(found: Sequence[OuterJoint], body: Body, report: Report) -> OuterJoint | None:
    """Return the virtual joint of a body as a manifest has it, if there is one; the others are reported."""
    taken: OuterJoint | None = None
    for joint in found:
        message, cure = _mistake(joint, body)
        if not message and taken is not None:
            message = f"'{plain(taken.name, 60)}' places the root of the URDF already"
        if message:
            words = f"the virtual joint '{plain(joint.name, 60)}' is left out: {message}"
            report.add(UNUSED.at(joint.span, words, help=cure or "keep one of them"))
        else:
            taken = _readable(joint, report)
    return taken


def _mistake(joint: OuterJoint, body: Body) -> tuple[str, str]:
    """Return why a virtual joint cannot be used, and what helps; nothing if it can."""
    frame = joint.frame.lstrip("/")
    written = {"name": joint.name, "type": joint.kind, "parent_frame": frame, "child_link": joint.child}
    if missing := [key for key, value in written.items() if not value]:
        return f"it has no '{missing[0]}'", f"write '{missing[0]}'"
    if frame in body.links:
        return f"'{plain(frame, 60)}' is a link of the URDF", "leave it out: a link is a frame"
    if joint.name in body.joints:
        return "the URDF has a joint of its name", "give it another name"
    if joint.child != body.root:
        return f"the root of the URDF is '{plain(body.root, 60)}'", f'write child_link="{plain(body.root, 60)}"'
    if len(f"{joint.name}{frame}".split()) > 1:
        return "there are spaces in its names", "leave them out"
    return "", ""


def _readable(joint: OuterJoint, report: Report) -> OuterJoint:
    frame, kind = joint.frame.lstrip("/"), joint.kind.lower()
    if frame != joint.frame:
        words = (
            f"the frame '{plain(joint.frame, 60)}' is called '{plain(frame, 60)}': names of frames begin without '/'"
        )
        report.add(UNUSED.at(joint.span, words))
    if kind not in _KINDS:
        words = f"there is no type '{plain(joint.kind, 60)}', so the virtual joint is taken for fixed"
        report.add(UNUSED.at(joint.span, words, help=f"write {', '.join(_KINDS[:-1])} or {_KINDS[-1]}"))
        kind = "fixed"
    return replace(joint, kind=kind, frame=frame)


NO_SUCH = kind("RBX2311", Severity.WARNING)
RENAMED = kind("RBX2313", Severity.WARNING)
WATCHED = kind("RBX2312", Severity.WARNING)


@importer("srdf", "an SRDF of MoveIt and the URDF that it is about, as two files")
def srdf(files: Sequence[ForeignFile], name: str, report: Report) -> ImportedFiles:
    """Return a robot with the groups as arms, and the file of its pairs of links."""
    read = [(file, read_urdf(file.text, file.name)) for file in files]
    report.extend(found for _, found in read if isinstance(found, Finding))
    roots = [(file, found) for file, found in read if isinstance(found, XmlElement)]
    said = next(((file, root) for file, root in roots if is_srdf(root)), None)
    body_file = next((file for file, root in roots if not is_srdf(root)), None)
    if said is None or body_file is None or body_file.path is None:
        if not report.has_errors:
            words = "give an SRDF and its URDF: 'rbxcompose import srdf arm.srdf arm.urdf'"
            report.add(OTHER_PROGRAM.at(None, "an SRDF means nothing without its URDF", help=words))
        return ImportedFiles("")
    description = _described(body_file.path, Span(body_file.name, 1, 1, 1, 1), report)
    if description is None:
        return ImportedFiles("")
    semantics = read_semantics(said[1])
    drafts = list(_Drafts(semantics, description.body, report).drafts())
    report.extend(_lost(semantics, {joint for draft in drafts for joint in draft.passive}))
    report.extend(NOT_CARRIED_OVER.at(span, f"{words} has no counterpart") for words, span in semantics.others)
    matrix = _matrix(semantics, description, report)
    outer = virtual_joint(semantics.outer, description.body, report)
    beside = {f"{name}.collisions.yaml": matrix.text()} if matrix.pairs else {}
    if not drafts and not beside:
        return ImportedFiles("")
    top = header("srdf", [file.name for file in files], "Robot", name)
    return ImportedFiles(
        f"{top}\n{manifest_of(description.body, drafts, body_file.path.name, next(iter(beside), ''), outer)}", beside
    )


def _lost(said: Semantics, passive: Set[str]) -> Iterator[Finding]:
    """Yield what belongs to no arm; `passive` has the joints that do."""
    for joint in said.passive:
        if joint not in passive:
            words = f"the passive joint '{plain(joint, 60)}' has no counterpart: it is on no arm's chain"
            yield NOT_CARRIED_OVER.at(said.places["passive_joint", joint], words)
    for (element, group, *pose), place in said.places.items():
        if element == "group_state" and group not in said.groups:
            words = f"the pose '{plain(pose[0], 60)}' is of a group that is not there: '{plain(group, 60)}'"
            yield NO_SUCH.misspelt(place, words, group, said.groups, "groups")


def _described(path: Path, span: Span, report: Report) -> Description | None:
    part = BodyPart("", BodyFile(path, span, False, {}, {}), None, span, span)
    found, findings = describe("", path.parent, [part], {})
    if found is None:  # else they are reported by `check`
        report.extend(finding for finding in findings if finding.severity is Severity.ERROR)
    return found


def _matrix(said: Semantics, description: Description, report: Report) -> CollisionMatrix:
    """Return the pairs of links that exist."""
    links = description.body.links
    pairs = {pair: reason for pair, reason in said.pairs.items() if set(pair) <= links.keys()}
    if unknown := sorted({link for pair in said.pairs for link in pair} - links.keys()):
        words = ", ".join(f"'{plain(link, 60)}'" for link in unknown[:5])
        span = next(said.places["disable_collisions", *pair] for pair in said.pairs if pair not in pairs)
        report.add(NO_SUCH.at(span, f"pairs of links that the URDF does not have are left out: {words}"))
    if resting := [pair for pair, reason in sorted(pairs.items()) if reason == "default"]:
        shown = ", ".join(f"{first} - {second}" for first, second in resting[:5])
        more = f" and {len(resting) - 5} more" if len(resting) > 5 else ""
        report.add(WATCHED.at(said.places["disable_collisions", *resting[0]], f"these stay watched: {shown}{more}"))
    return CollisionMatrix(pairs, 0, 0, digest_of(description.body, description.meshes))


class _Drafts:
    """The groups of an SRDF as arms."""

    def __init__(self, said: Semantics, body: Body, report: Report) -> None:
        self.said, self.body, self.report = said, body, report
        self.names = FreeNames(is_own_name)
        self.hands = {effector.group: effector for effector in said.effectors if self._is_hand(effector)}
        self.named: dict[str, str] = {}

    def drafts(self) -> Iterator[ArmDraft]:
        """Yield the arms; groups that others are made of come first."""
        for group in sorted(self.said.groups.values(), key=lambda one: bool(one.groups)):
            if group.name in self.hands:
                for pose in self.said.poses.get(group.name, {}):
                    words = f"the pose '{plain(pose, 60)}' of '{plain(group.name, 60)}': a gripper opens by a distance"
                    self.report.add(NOT_CARRIED_OVER.at(self.said.places["group_state", group.name, pose], words))
                continue
            joints = self.joints_of(group)
            moved = tuple(joint for joint in joints if joint not in self.said.passive)
            if not moved:
                words = f"the group '{plain(group.name, 60)}' moves nothing, so it is no arm"
                self.report.add(NOT_CARRIED_OVER.at(group.span, words))
                continue
            self.named[group.name] = name = self._named(self.names, group.span, group.name, "arm")
            where = self._where(group, moved)
            passive = [joint for joint in joints if joint not in moved] if where.startswith("chain:") else []
            draft = ArmDraft(name, where, moved, self._poses(group, moved), tuple(passive))
            yield replace(draft, gripper=self._gripper(group, moved))

    def joints_of(self, group: SemanticGroup, seen: frozenset[str] = frozenset()) -> list[str]:
        """Return the joints of a group that move by themselves, in the order of the body."""
        found: set[str] = set()
        for base, tip in group.chains:
            ends = chain(self.body, base, tip) if {base, tip} <= self.body.links.keys() else None
            if ends is None:
                self._report_unknown(group, f"{base} - {tip}")
            found.update(ends.joints if ends is not None else ())
        for link in group.links:
            if link not in self.body.links:
                self._report_unknown(group, link)
            elif (above := self.body.joint_above.get(link)) is not None:
                found.add(above.name)
        for joint in group.joints:
            if joint not in self.body.joints and all(outer.name != joint for outer in self.said.outer):
                self._report_unknown(group, joint)
            found.add(joint)
        for other in group.groups:
            if other not in self.said.groups:
                self._report_unknown(group, other)
            elif other not in seen:
                found.update(self.joints_of(self.said.groups[other], seen | {group.name}))
        return [
            item.name for item in self.body.joints_downwards if item.name in found and item.moves and item.mimic is None
        ]

    def _report_unknown(self, group: SemanticGroup, what: str) -> None:
        words = f"the group '{plain(group.name, 60)}' names '{plain(what, 60)}', which its URDF does not have"
        self.report.add(NO_SUCH.at(group.span, words))

    def _where(self, group: SemanticGroup, moved: tuple[str, ...]) -> str:
        others = [self.named.get(one) for one in group.groups]
        if len(group.chains) == 1 and not (group.joints or group.links or group.groups):
            base, tip = group.chains[0]
            return f"chain: {flow({'from': key(base), 'to': key(tip)})}"
        if others and all(others) and not (group.chains or group.joints or group.links):
            return f"groups: {flow_list([other for other in others if other])}"
        there = carrying(self.body, group.links) if not (group.chains or group.joints or group.groups) else None
        if there is not None and there.joints == moved:
            return f"links: {flow_list([key(link) for link in group.links])}"
        return f"joints: {flow_list([key(joint) for joint in moved])}"

    def _poses(self, group: SemanticGroup, moved: tuple[str, ...]) -> Mapping[str, Mapping[str, float]]:
        free, found = FreeNames(), {}
        for pose, positions in self.said.poses.get(group.name, {}).items():
            span = self.said.places["group_state", group.name, pose]
            found[self._named(free, span, pose, "pose")] = {name: at for name, at in positions.items() if name in moved}
            if others := ", ".join(f"'{plain(name, 60)}'" for name in positions if name not in moved):
                words = f"in the pose '{plain(pose, 60)}' of '{plain(group.name, 60)}': {others}, not moved by it"
                self.report.add(NOT_CARRIED_OVER.at(span, words))
        return found

    def _named(self, free: FreeNames, span: Span | None, name: str, otherwise: str) -> str:
        """Return the name of a group or one of its poses here, after a finding if it is another one."""
        taken = free.take(name, otherwise)
        if taken != name:
            self.report.add(RENAMED.at(span, f"'{plain(name, 60)}' is called '{taken}'"))
        return taken

    def _is_hand(self, effector: EndEffector) -> bool:
        """Return whether an end effector moves, and is below the link that carries it."""
        group = self.said.groups.get(effector.group)
        if group is None or effector.group == effector.parent_group or effector.parent_link not in self.body.links:
            return False
        joints = self.joints_of(group)
        return bool(joints) and all(
            self._is_below(self.body.joints[joint].parent, effector.parent_link) for joint in joints
        )

    def _is_below(self, link: str, upper: str) -> bool:
        return link == upper or chain(self.body, upper, link) is not None or self._carrier(link) == self._carrier(upper)

    def _gripper(self, group: SemanticGroup, moved: tuple[str, ...]) -> GripperDraft | None:
        """Return the gripper that the last joint of an arm carries."""
        for hand, effector in self.hands.items():
            is_carried = effector.parent_link in self.body.links and self._carrier(effector.parent_link) == moved[-1]
            if effector.parent_group == group.name or (not effector.parent_group and is_carried and not group.groups):
                joints = self.joints_of(self.said.groups[hand])
                if len(joints) == 1:
                    taken = self._named(self.names, self.said.groups[hand].span, hand, "gripper")
                    if effector.name not in ("", hand):
                        words = f"the end effector '{plain(effector.name, 60)}' is called '{taken}', as its group"
                        self.report.add(RENAMED.at(effector.span, words))
                    return GripperDraft(taken, joints[0])
                words = f"the gripper '{plain(hand, 60)}' has {len(joints)} joints: describe it by hand"
                self.report.add(NOT_CARRIED_OVER.at(effector.span, words))
        return None

    def _carrier(self, link: str) -> str:
        return next((joint.name for joint in self.body.joints_above(link) if joint.moves), "")

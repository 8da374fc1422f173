"""The section `body`: the files that describe the robot's body."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import JOINT, LINK, Config, Name
from rbxcompose.base.findings import Finding, Report, Severity, Span, kind, replacement
from rbxcompose.base.printable import plain
from rbxcompose.base.units import Quantity, UnitError, parse_quantity
from rbxcompose.domains.body.description import BodyPart, Description, VirtualJoint, VirtualKind, describe, misfits
from rbxcompose.domains.body.files import BodyFile
from rbxcompose.manifest.fields import FileName, PieceAttachment
from rbxcompose.manifest.files import folder_named, resolve, shown_name
from rbxcompose.manifest.reader import UNREADABLE, read_source
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import AlwaysRun, Contents, Reading, WantedComponent, Wiring
from rbxcompose.manifest.tree import BROKEN, Entry, KeyPath, MappingNode, ScalarNode, TreeNode, at, key_span, value_span
from rbxcompose.manifest.validate import WRONG_TYPE

if TYPE_CHECKING:
    from rbxcompose.domains.body.link_pairs import CollisionMatrix

STALE = kind("RBX2307", Severity.WARNING)

DESCRIPTION = "robot_description"
"""The component that a robot with a body runs."""
PIECE, PIECES = "piece", "pieces"


class BodyFileModel(Config):
    """A URDF file, or a xacro file that expands to one."""

    urdf: FileName | None = None
    """The URDF file, relative to this one."""
    xacro: FileName | None = None
    """The xacro file, relative to this one; its expansion is published."""
    with_: dict[str, Any] = Field({}, alias="with")
    """Values of the xacro's arguments: texts, flags, numbers, and quantities, which it gets in SI units."""
    packages: dict[str, str] = {}
    """Folders by the names of ROS packages, for `$(find NAME)` and `package://NAME`, relative to this file."""

    @model_validator(mode="after")
    def _one_file(self) -> BodyFileModel:
        if self.urdf is not None and self.xacro is not None:
            raise ValueError("a body has either 'urdf' or 'xacro'")
        if self.with_ and self.xacro is None:
            raise ValueError("'with' is for a xacro: a URDF has no arguments")
        if self.urdf is None and self.xacro is None and (missing := self.lacks_file()):
            raise PydanticCustomError("no_file", "{missing}", {"missing": missing, "about": ("urdf", "xacro")})
        return self

    def lacks_file(self) -> str:
        """Return what is wrong if there is no file, or nothing."""
        return "a body needs 'urdf' or 'xacro'"


class PieceModel(BodyFileModel):
    """A piece of the body: its file, and the link that carries it."""

    attach: PieceAttachment | None = None
    """The link that carries it, and where; one piece, the base, has none."""

    def lacks_file(self) -> str:
        """Return what is wrong if there is no file."""
        return "there is no 'urdf' or 'xacro' to attach" if self.attach else "a piece needs 'urdf' or 'xacro'"


class VirtualJointModel(Config):
    """Where the root of the body is."""

    frame: Annotated[str, StringConstraints(pattern=r"^[^\s/]\S*$")]
    """The frame outside of the body, such as `world` or `odom`."""
    type: VirtualKind = "fixed"
    """The root is `fixed` at its origin, and goals and things may be in it as in a link; or moves in it."""
    name: Annotated[str, StringConstraints(pattern=r"^\S+$")] = "virtual_joint"
    """What MoveIt calls the joint."""


class BodyModel(BodyFileModel):
    """What the robot looks like and how it moves: a file, and further pieces, which are attached to it."""

    pieces: dict[Name, PieceModel] = {}
    """Further pieces of the body, by the prefix of their links and joints; parts bring theirs."""
    cover: Literal["collision", "visual"] = "collision"
    """What nothing may be within: collision shapes, or what is seen, too, which then counts as collision shapes."""
    collisions: FileName | None = None
    """Pairs of links that arms need not watch: a file that `arm setup` writes, relative to this one."""
    virtual_joint: VirtualJointModel | None = None
    """The frame outside of the body in which its root stands or moves."""

    def lacks_file(self) -> str:
        """Return what is wrong if there is no file; its pieces may be all."""
        return "" if self.pieces else "a body needs 'urdf' or 'xacro'"


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that publishes the description."""
    if found := contents.of(body):
        keys = [key for key in ("urdf", "xacro") if at(contents.root, (body.name, key)) is not None]
        yield WantedComponent(DESCRIPTION, DESCRIPTION, {"urdf": found.published}, (body.name, *keys))


def _brought(instance: str, own: TreeNode | None, entry: TreeNode) -> TreeNode | None:
    """Return the body of a part as a piece of the body of the file that includes it."""
    attach = entry.entries.get("attach") if isinstance(entry, MappingNode) else None
    if own is None and attach is not None:
        own = MappingNode({}, attach.key.span)  # a piece without a file, which is reported there
    if not isinstance(own, MappingNode):
        return own
    piece = {key: one for key, one in own.entries.items() if key != PIECES} | ({"attach": attach} if attach else {})
    named = Entry(ScalarNode(instance, entry.span), MappingNode(piece, own.span))
    there = own.get(PIECES)
    further = there.entries if isinstance(there, MappingNode) else {}
    pieces = MappingNode({**({instance: named} if piece else {}), **further}, own.span)
    return MappingNode({PIECES: Entry(ScalarNode(PIECES, own.span), pieces)}, own.span, own.tag)


def _names(read: Description | None) -> Mapping[str, Mapping[str, object]]:
    return {LINK: read.body.links, JOINT: read.body.joints} if read else {}


def _transforms(contents: Contents, names: Sequence[str]) -> dict[str, object]:
    """Return the configuration of the component that publishes where links are."""
    found = contents.of(body)
    return {"urdf": found.text if found else ""}


@section(
    "body",
    BodyModel,
    order=60,
    names=PIECE,
    at=(PIECES,),
    entry="piece",
    shared=((), (PIECES,)),
    brings=(DESCRIPTION,),
    always=AlwaysRun("transforms", _transforms),
    wires=True,
    brought=_brought,
    defines=(LINK, JOINT),
    defined=_names,
    components=_components,
)
def body(reading: Reading[BodyModel]) -> Description | None:
    """What the robot looks like and how it moves: links and joints, published for viewers and other programs.

    Example:
        body:
          urdf: robot.urdf                # beside this file, or a path from here
    """
    if (wrong := _xacro_as_urdf(reading.node)) is not None:
        reading.report.add(wrong)
        return None
    read, report = reading.whole(), reading.report
    if read is None or reading.node is None:
        return None
    if any(value is BROKEN for one in (read, *read.pieces.values()) for value in one.with_.values()):
        return None  # what is wrong with an argument is reported where it was given
    parts = [_part(reading, reading.node, (), "", read, None)] if read.urdf or read.xacro else []
    for name, piece in read.pieces.items():
        parts.append(_part(reading, reading.node, (PIECES, name), name, piece, piece.attach))
    if refused := [part for part in parts if isinstance(part, Finding)]:
        report.extend(refused)
        return None
    robot = reading.contents.root.get("name")
    named = robot.text if isinstance(robot, ScalarNode) else ""
    usable = [part for part in parts if not isinstance(part, Finding)]
    sources = reading.contents.documents.sources
    covers_visuals = read.cover == "visual"
    found, findings = describe(named, reading.contents.file.parent, usable, sources, covers_visuals=covers_visuals)
    report.extend(findings)
    if found is None:
        return None
    found = _placed(found, read.virtual_joint, reading.node, report)
    return replace(found, matrix=_matrix(reading, reading.node, read, found))


def _placed(found: Description, wanted: VirtualJointModel | None, node: TreeNode, report: Report) -> Description:
    """Return a body with its virtual joint, without it after findings."""
    if wanted is None:
        return found
    span, frame = (value_span(node, ("virtual_joint", key)) for key in ("name", "frame"))
    joint = VirtualJoint(wanted.name, wanted.type, wanted.frame, span, frame)
    if wrong := [*misfits(joint, found.body)]:
        report.extend(wrong)
        return found
    return found.with_virtual(joint)


def _matrix(reading: Reading[BodyModel], node: TreeNode, read: BodyModel, found: Description) -> CollisionMatrix | None:
    """Return the pairs of the file that the body names; None if there is none for just this body."""
    if read.collisions is None:
        return None
    from rbxcompose.domains.body.link_pairs import digest_of, read_matrix  # which only robots with such a file need

    span, command = value_span(node, ("collisions",)), "run 'rbxcompose arm setup'"
    path = resolve(read.collisions, _writer(reading, span), span)
    if isinstance(path, Finding):
        is_missing = path.code == UNREADABLE.code
        reading.report.add(STALE.at(span, path.message, help=command) if is_missing else path)
        return None
    shown, digest = shown_name(path), digest_of(found.body, found.meshes)
    text, findings = read_source(path, shown, reading.contents.documents.sources, what="a file of pairs of links")
    matrix, more = read_matrix(text, shown, found.body, digest) if text is not None else (None, [])
    reading.report.extend(replace(finding, span=finding.span or span) for finding in (*findings, *more))
    if matrix is None or matrix.digest == digest:
        return matrix
    words = f"'{plain(read.collisions)}' was made for another body, so arms watch all pairs of links"
    reading.report.add(STALE.at(span, words, help=command))
    return None


def _xacro_as_urdf(node: TreeNode | None) -> Finding | None:
    """Return the finding about a xacro file with arguments that is given as a URDF."""
    if not isinstance(node, MappingNode) or "with" not in node or "xacro" in node:
        return None
    entry = node.entries.get("urdf")
    if entry is None or not isinstance(entry.value, ScalarNode) or not entry.value.text.endswith(".xacro"):
        return None
    fix = replacement(entry.key.span, "urdf", "xacro")
    help_text = f"write 'xacro: {plain(entry.value.text)}'"
    return WRONG_TYPE.at(entry.key.span, "a URDF has no arguments, but this is a xacro file", help=help_text, fix=fix)


def _part(
    reading: Reading[BodyModel],
    node: TreeNode,
    path: KeyPath,
    name: str,
    read: BodyFileModel,
    attach: PieceAttachment | None,
) -> BodyPart | Finding:
    """Return a file of the body; relative paths begin at the file that wrote them."""
    key = "xacro" if read.xacro else "urdf"
    span = value_span(node, (*path, key))
    file = resolve(read.xacro or read.urdf or "", _writer(reading, span), span)
    packages = _packages(reading, node, (*path, "packages"), read)
    if isinstance(file, Finding):
        return file
    if isinstance(packages, Finding):
        return packages
    arguments = {name: as_xacro_text(value) for name, value in read.with_.items()}
    to = value_span(node, (*path, "attach", "to"))
    place = key_span(node, path) if path else span
    spans = {argument: key_span(node, (*path, "with", argument)) for argument in arguments}
    return BodyPart(name, BodyFile(file, span, key == "xacro", arguments, packages, spans), attach, place, to)


def _writer(reading: Reading[BodyModel], span: Span) -> Path:
    return reading.contents.documents.writer(span, reading.contents.file)


def _packages(
    reading: Reading[BodyModel], node: TreeNode, path: KeyPath, read: BodyFileModel
) -> Mapping[str, Path] | Finding:
    found = {}
    for name, written in read.packages.items():
        span = value_span(node, (*path, name))
        writer = _writer(reading, span)
        folder = folder_named(written, writer, span)
        if isinstance(folder, Finding):
            message = f"the folder of package '{plain(name, 60)}' is not in the project: '{plain(written)}'"
            return UNREADABLE.at(span, message)
        found[name] = folder
    return found


def as_xacro_text(value: object) -> str:
    """Return a value as xacro takes it: flags in lower case, quantities in SI units."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str) and value[:1] in "+-.0123456789":
        with suppress(UnitError):  # a word that begins like a number is a word
            value = parse_quantity(value)
    return repr(value.value) if isinstance(value, Quantity) else str(value)

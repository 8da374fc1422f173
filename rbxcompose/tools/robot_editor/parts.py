"""The parts of a robot as they are edited: which there are, what carries them, and what the robot then looks like."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import NotRegularError, TooLargeError, read_regular
from rbxcompose.base.requests import Refused
from rbxcompose.base.units import ANGLE, LENGTH, Dimension, UnitError, format_quantity, to_si
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.sections.body import body
from rbxcompose.manifest.files import PARTS, PREFIX, library_root, project_of
from rbxcompose.manifest.tree import Entry, KeyPath, MappingNode, ScalarNode, at, text_at
from rbxcompose.manifest.validate import to_plain
from rbxcompose.tools.mission_editor.yaml_places import placed
from rbxcompose.tools.robot_editor.subjects import Subject, Where, quantity_text, valid_name, written_text

FARTHEST_PIECE = 100.0  # [m] from the link that carries it
MOST_PARTS = 300
_LARGEST = 200_000  # [bytes] of a file that may be a part
_LINK = re.compile(r"[A-Za-z_][\w.-]*")
_VALUE = re.compile(r"[\w.%/ -]{1,60}")


@dataclass(frozen=True, slots=True)
class OfferedPart:
    """A part that can be included: its file as the robot's file writes it, and what must be given to it."""

    name: str
    about: str
    file: str
    has_body: bool
    needs: tuple[str, ...]


def offered_parts(file: Path) -> list[OfferedPart]:
    """Return the parts of the library and of the project of a robot's file."""
    project, root = project_of(file), library_root()
    written: dict[Path, str] = {}
    for path in sorted((root / PARTS).glob("*.yaml")):
        written[path.resolve()] = f"{PREFIX}{path.relative_to(root).as_posix()}"
    for path in sorted([*(project / PARTS).glob("*.yaml"), *file.parent.glob("*.yaml")]):
        written.setdefault(path.resolve(), Path(os.path.relpath(path, file.parent)).as_posix())
    found = (_offered(path, shown) for path, shown in [*written.items()][:MOST_PARTS])
    return sorted((one for one in found if one is not None), key=lambda one: one.name)


def _offered(path: Path, shown: str) -> OfferedPart | None:
    """Return a part; None for another file, or one that cannot be read: the compiler tells why when it is included."""
    try:
        root = placed(read_regular(path, _LARGEST).decode("utf-8"))
    except (OSError, NotRegularError, TooLargeError, UnicodeDecodeError):
        return None
    if root is None or root.form != "map" or (kind := root.get("kind")) is None or kind.text != "Part":
        return None
    name, about, args = root.get("name"), root.get("about"), root.get("args")
    declared = args.pairs if args is not None else ()
    needs = tuple(key.text for key, argument in declared if argument.get("default") is None)
    has_body = root.get("body") is not None or root.get("include") is not None
    return OfferedPart(name.text if name else path.stem, about.text if about else "", shown, has_body, needs)


class IncludedParts(Subject):
    """Instances of parts, and where each one's piece of the body is attached."""

    section, what = "include", "a part"
    operations = ("add", "set", "remove")
    is_alone = False
    fields: Mapping[str, Dimension] = MappingProxyType(
        {"x": LENGTH, "y": LENGTH, "z": LENGTH, "roll": ANGLE, "pitch": ANGLE, "yaw": ANGLE}
    )

    def entries(self, robot: Robot, where: Where) -> list[dict[str, Any]]:
        """Return each instance with its part and its attachment, as they are written."""
        found = []
        for name, entry in instances(robot).items():
            shown, to = text_at(entry.value, ("part",)), text_at(entry.value, ("attach", "to"))
            pose = {key: self._written(robot, name, key) for key in self.fields}
            numbers = {key: _number_of(text, self.fields[key]) for key, text in pose.items()}
            plain = {"name": name, "part": shown, "to": to, "pose": pose, "numbers": numbers}
            found.append({**plain, **where((self.section, name))})
        return found

    def state(self, robot: Robot) -> Mapping[str, Any]:
        """Return what is written of each instance."""
        return {name: to_plain(entry.value) for name, entry in instances(robot).items()}

    def surroundings(self, before: Robot, after: Robot) -> dict[str, Any]:
        """Return the body with the changes: its description, and which of its links are new, elsewhere or gone."""
        old, new = before.manifest.contents.of(body), after.manifest.contents.of(body)
        if new is None:
            return {"links": [], "model": {"urdf": "", "meshes": {}}, "ghosts": [], "gone": []}
        was = old.body if old is not None else Body("")
        return {
            "links": sorted(new.body.links),
            "model": {"urdf": new.published, "meshes": {name: str(path) for name, path in new.meshes.items()}},
            "ghosts": sorted(moved_links(was, new.body)),
            "gone": sorted(was.links.keys() - new.body.links.keys()),
        }

    def new_entry(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> tuple[str, str]:
        """Return an instance of a part within a line."""
        name = valid_name(path[1], self.what, instances(robot))
        values = change.get("values")
        if not isinstance(values, dict) or not isinstance(part := values.get("part"), str):
            raise Refused("which part is it?")
        if part not in {one.file for one in offered_parts(Path(change["file"]))}:
            raise Refused(f"there is no part '{part[:60]}'")
        given = values.get("with") or {}
        pose = {key: value for key, value in values.items() if key not in ("part", "with")}
        pieces = [f"part: {part}"]
        if given:
            pieces.append(f"with: {{{', '.join(argument_text(key, value) for key, value in given.items())}}}")
        if pose:
            pieces.append(f"attach: {self._attachment(pose)}")
        return name, f"{{{', '.join(pieces)}}}" if len(pieces) > 1 else part

    def written(self, robot: Robot, path: KeyPath, change: Mapping[str, Any]) -> dict[tuple[str, ...], str]:
        """Return the texts of an attachment, each where it stands or would stand."""
        entry = instances(robot).get(str(path[1]))
        values = change.get("values")
        if entry is None:
            raise Refused(f"there is no part '{str(path[1])[:60]}'")
        if not isinstance(values, dict) or not values or not values.keys() <= {"to", *self.fields}:
            raise Refused("of a part, the link that carries it and its pose there can be changed")
        part = at(entry.value, ("part",))
        if isinstance(part, ScalarNode) and part.span == entry.value.span:  # the short form
            return {(): f"{{part: {part.text}, attach: {self._attachment(values)}}}"}
        if at(entry.value, ("attach",)) is None:
            return {("attach",): self._attachment(values)}
        found: dict[tuple[str, ...], str] = {}
        numbers = {key: value for key, value in values.items() if key != "to"}
        if "to" in values:
            found["attach", "to"] = link_text(values["to"])
        if numbers and at(entry.value, ("attach", "at")) is None:
            found["attach", "at"] = f"{{{', '.join(self._numbers(numbers))}}}"
        elif numbers:
            for key, value in numbers.items():
                old = written_text(robot, (*path, "attach", "at", key))
                found["attach", "at", key] = self._number(key, value, old)
        return found

    def _attachment(self, values: Mapping[str, Any]) -> str:
        if "to" not in values:
            raise Refused("choose the link that carries it first")
        numbers = self._numbers({key: value for key, value in values.items() if key != "to" and value not in (0, "")})
        pose = f", at: {{{', '.join(numbers)}}}" if numbers else ""
        return f"{{to: {link_text(values['to'])}{pose}}}"

    def _numbers(self, values: Mapping[str, Any]) -> list[str]:
        if not values.keys() <= self.fields.keys():
            raise Refused("a pose has x, y, z, roll, pitch and yaw")
        return [f"{key}: {self._number(key, values[key])}" for key in self.fields if key in values]

    def _number(self, key: str, value: Any, old: str = "") -> str:
        number, text = quantity_text(key, value, self.fields[key], old)
        if self.fields[key] == LENGTH and abs(number) > FARTHEST_PIECE:
            raise Refused(f"'{key}' is farther away than {FARTHEST_PIECE:g} m")
        return text

    def _written(self, robot: Robot, name: str, key: str) -> str:
        written = written_text(robot, (self.section, name, "attach", "at", key))
        return written or format_quantity(0.0, self.fields[key])


def _number_of(text: str, dimension: Dimension) -> float:
    """Return what is written in SI; 0 for what is computed, which a viewer shows without a handle."""
    try:
        return to_si(text, dimension)
    except UnitError:
        return 0.0


def instances(robot: Robot) -> Mapping[str, Entry]:
    """Return the instances of parts that the robot's own files name."""
    found = at(robot.manifest.include, (IncludedParts.section,))
    return found.entries if isinstance(found, MappingNode) else {}


def moved_links(before: Body, after: Body) -> Iterator[str]:
    """Yield the links that are new, or carried by another link or elsewhere on it, and those that they carry."""
    moved: set[str] = set()
    waiting = [name for name in after.links if name not in after.joint_above]
    while waiting:
        link = waiting.pop()
        above, was = after.joint_above.get(link), before.joint_above.get(link)
        is_other = above is not None and (was is None or (was.parent, was.origin) != (above.parent, above.origin))
        if link not in before.links or is_other or (above is not None and above.parent in moved):
            moved.add(link)
            yield link
        waiting += [joint.child for joint in after.joints_below.get(link, [])]


def link_text(link: Any) -> str:
    """Return the name of a link as it is written.

    Raises:
        Refused: if no link can have it.
    """
    if not isinstance(link, str) or not _LINK.fullmatch(link):
        raise Refused("'to' must be the name of a link")
    return link


def argument_text(key: Any, value: Any) -> str:
    """Return an argument of a part as it is written.

    Raises:
        Refused: if it is none that fits into a line.
    """
    is_key = isinstance(key, str) and _LINK.fullmatch(key)
    if not is_key or not isinstance(value, str) or not _VALUE.fullmatch(value):
        raise Refused(f"'{str(key)[:60]}' must be a word, a number or a quantity")
    return f"{key}: {value.strip()}"

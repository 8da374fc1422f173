"""The names that cross files: where in a manifest which kind of name stands, and which names there are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.reader import read_file
from rbxcompose.manifest.tree import Mapping, Scalar, at
from rbxcompose.manifest.tree import Path as TreePath
from rbxcompose.model.robot import Robot

COMPONENT, PORT, PART, MISSION, PLACE, SKILL = "component", "port", "part", "mission", "place", "skill"
INPUT, VALUE, ARGUMENT, OWN_PORT, PART_ARGUMENT = "input", "value", "argument", "own port", "part argument"

_ANY = "*"
_VALUES: tuple[tuple[tuple[str, ...], str], ...] = (
    (("components", _ANY, "starts_after", _ANY), COMPONENT),
    (("muxes", _ANY, "inputs", _ANY, "from"), PORT),
    (("values", _ANY), PORT),
    (("values", _ANY, "port"), PORT),
    (("diagnostics", "analyzers", _ANY, "match", _ANY), PART),
    (("diagnostics", "analyzers", _ANY, "expected", _ANY), PART),
    (("start",), MISSION),
)
_KEYS: tuple[tuple[tuple[str, ...], str], ...] = (
    (("components", _ANY, "connect"), OWN_PORT),
    (("missions", _ANY, "with"), INPUT),
    (("include", _ANY, "with"), PART_ARGUMENT),
)
_CHANGED: dict[str, str] = {"components": COMPONENT, "places": PLACE, "values": VALUE, "missions": MISSION}
"""Sections of an overlay: their keys name what is there already."""

SECTIONS = {COMPONENT: ("components", "muxes"), PART: ("components", "muxes"), PLACE: ("places",)}
SECTIONS |= {MISSION: ("missions",), VALUE: ("values",), ARGUMENT: ("args",)}
"""The sections whose keys are the names of a kind."""


def below_profile(path: TreePath) -> TreePath:
    """Return a path as it is in the robot that a profile changes."""
    return path[2:] if path[:1] == ("profiles",) else path


def named_by_value(path: TreePath) -> str:
    """Return of what the value at `path` is a name, or nothing."""
    return _match(_VALUES, below_profile(path))


def named_by_key(path: TreePath, is_overlay: bool) -> str:
    """Return of what the keys of the map at `path` are names that exist, or nothing."""
    below = below_profile(path)
    if (is_overlay or below != path) and len(below) == 1:
        return _CHANGED.get(str(below[0]), "")
    return _match(_KEYS, below)


def _match(table: tuple[tuple[tuple[str, ...], str], ...], path: TreePath) -> str:
    fits = (kind for pattern, kind in table if len(pattern) == len(path) and all(map(_fits, pattern, path)))
    return next(fits, "")


def _fits(pattern: str, key: str | int) -> bool:
    return pattern in (_ANY, key)


@dataclass(frozen=True, slots=True)
class Known:
    """The names of a robot as it was last read, and those of the file that is being typed, each with a few words."""

    path: Path
    root: Mapping
    robot: Robot | None

    def of(self, kind: str, path: TreePath = ()) -> dict[str, str]:
        """Return the names of a kind with what each is; `path` is where one of them is to stand."""
        match kind:
            case "port":
                return {**self._in_text(COMPONENT), **dict(self._ports())}
            case "own port":
                return dict(self._own_ports(str(below_profile(path)[1])))
            case "part":
                return {**self._in_text(kind), **self._parts()}
            case "skill":
                return self._skills()
            case "input":
                return self._inputs(str(below_profile(path)[1]))
            case "part argument":
                return self._part_arguments(str(below_profile(path)[1]))
        return {**self._in_text(kind), **self._in_robot(kind)}

    @property
    def types(self) -> dict[str, str]:
        """Return the types of the components by name."""
        if self.robot is None:
            return {}
        return {name: entry.type for name, entry in self.robot.manifest.components.items()}

    def _in_text(self, kind: str) -> dict[str, str]:
        found: dict[str, str] = {}
        for section in SECTIONS.get(kind, ()):
            named = self.root.get(section)
            if isinstance(named, Mapping):
                found |= {name: _about(named, name) for name in named.entries if name.isidentifier()}
        return found

    def _in_robot(self, kind: str) -> dict[str, str]:
        if self.robot is None:
            return {}
        manifest = self.robot.manifest
        match kind:
            case "component":
                return self.types | dict.fromkeys(manifest.muxes, "mux")
            case "place":
                return {name: f"({place.x:g} m, {place.y:g} m)" for name, place in manifest.places.items()}
            case "mission":
                return dict.fromkeys(manifest.missions, "mission")
            case "value":
                return {name: source.type.phrase for name, source in self.robot.values.items()}
        return {}

    def _parts(self) -> dict[str, str]:
        return {name: part.type_name for name, part in self.robot.parts.items()} if self.robot else {}

    def _ports(self) -> Iterator[tuple[str, str]]:
        for end in self.robot.ends if self.robot else ():
            if end.port.kind in ("in", "out"):
                yield f"{end.instance}.{end.name}", f"{end.port.kind}: {end.type_name} on {end.topic}"

    def _own_ports(self, component: str) -> Iterator[tuple[str, str]]:
        part = self.robot.parts.get(component) if self.robot else None
        for end in part.ends if part else ():
            yield end.name, f"{end.port.kind}: {end.type_name} on {end.topic}"

    def _skills(self) -> dict[str, str]:
        return {name: f"skill: {one.action}" for name, one in self.robot.skills.items()} if self.robot else {}

    def _inputs(self, mission: str) -> dict[str, str]:
        found = self.robot.missions.get(mission) if self.robot else None
        return {name: one.type.phrase for name, one in found.program.inputs.items()} if found else {}

    def _part_arguments(self, instance: str) -> dict[str, str]:
        """Return the arguments of the part that an instance is of."""
        written = at(self.root, ("include", instance, "part"))
        path = resolve(written.text, self.path, written.span) if isinstance(written, Scalar) else None
        part = read_file(path, str(path), {})[0] if isinstance(path, Path) else None
        named = part.get("args") if isinstance(part, Mapping) else None
        return {name: _about(named, name) for name in named.entries} if isinstance(named, Mapping) else {}


def _about(named: Mapping, name: str) -> str:
    word = at(named, (name, "type"))
    return word.text if isinstance(word, Scalar) else ""

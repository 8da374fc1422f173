"""The names that cross files: the kind of thing that the keys of a map name, and the known names of a kind."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from rbxcompose.base.config import COMPONENT, PORT, PREFIXED, PUBLISHED, RUNNING, SERVICE, VALUE
from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.sections.composition import PART_ARGUMENT, args, include, profiles
from rbxcompose.compiler.sections.missions import INPUT
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.reader import read_file
from rbxcompose.manifest.registry import naming, section_named
from rbxcompose.manifest.section import OWN_PORT
from rbxcompose.manifest.shapes import kind_of_keys
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, at
from rbxcompose.missions.program.program import Skill

SKILL = "skill"


def below_profile(path: KeyPath) -> KeyPath:
    """Return a path as it is in the robot that a profile changes."""
    return path[2:] if path[:1] == (profiles.name,) else path


def named_by_key(path: KeyPath, is_overlay: bool) -> str:
    """Return the kind of existing things that the keys of the map at `path` name, or nothing."""
    below = below_profile(path)
    section = section_named(below[0]) if below else None
    if section is None:
        return ""
    if len(below) == 1:
        is_over = is_overlay or below != path  # its keys name existing entries
        return section.names if is_over and section.is_map else ""
    return kind_of_keys(section.type, below[1:])


@dataclass(frozen=True, slots=True)
class KnownNames:
    """The names of a robot as last read, and those of the file being typed, each with a few words."""

    path: Path
    root: MappingNode
    robot: Robot | None

    def of(self, kind: str, path: KeyPath = ()) -> dict[str, str]:
        """Return the names of a kind, each with a short description; `path` is where one of them is to be written."""
        if kind in PREFIXED:
            prefix, named = PREFIXED[kind]
            return {f"{prefix}{name}": about for name, about in self.of(named).items()}
        special: dict[str, Callable[[], dict[str, str]]] = {
            PORT: lambda: {**self._in_text(COMPONENT), **dict(self._ports())},
            RUNNING: lambda: {**self._in_text(COMPONENT), **self._parts()},
            OWN_PORT: lambda: dict(self._own_ports(str(below_profile(path)[1]))),
            SKILL: self._skills,
            PUBLISHED: lambda: dict(self.robot.names.topics) if self.robot else {},
            SERVICE: lambda: dict(self.robot.services) if self.robot else {},
            INPUT: lambda: self._inputs(str(below_profile(path)[1])),
            PART_ARGUMENT: lambda: self._part_arguments(str(below_profile(path)[1])),
        }
        return special[kind]() if kind in special else {**self._in_text(kind), **self._in_robot(kind)}

    @property
    def types(self) -> dict[str, str]:
        """Return the types of the components by name."""
        if self.robot is None:
            return {}
        return {name: entry.type for name, entry in self.robot.manifest.components.items()}

    @property
    def skills(self) -> Mapping[str, Skill]:
        """Return the skills of the robot."""
        return self.robot.names.skills if self.robot else {}

    def _in_text(self, kind: str) -> dict[str, str]:
        found: dict[str, str] = {}
        for section in naming(kind):
            named = at(self.root, (section.name, *section.at))
            if isinstance(named, MappingNode):
                found |= {name: _about(named, name) for name in named.entries if name.isidentifier()}
        return found

    def _in_robot(self, kind: str) -> dict[str, str]:
        if self.robot is None:
            return {}
        if kind == VALUE:
            return {name: source.type.phrase for name, source in self.robot.values.items()}
        contents = self.robot.manifest.contents
        return {name: words for section in naming(kind) for name, words in section.described(contents).items()}

    def _parts(self) -> dict[str, str]:
        return {name: component.type_name for name, component in self.robot.components.items()} if self.robot else {}

    def _ports(self) -> Iterator[tuple[str, str]]:
        for end in self.robot.ends if self.robot else ():
            if end.port.kind in ("in", "out"):
                yield f"{end.instance}.{end.name}", f"{end.port.kind}: {end.type_name} on {end.topic}"

    def _own_ports(self, component: str) -> Iterator[tuple[str, str]]:
        part = self.robot.components.get(component) if self.robot else None
        for end in part.ends if part else ():
            yield end.name, f"{end.port.kind}: {end.type_name} on {end.topic}"

    def _skills(self) -> dict[str, str]:
        return {name: f"skill: {skill.action}" for name, skill in self.robot.skills.items()} if self.robot else {}

    def _inputs(self, mission: str) -> dict[str, str]:
        found = self.robot.missions.get(mission) if self.robot else None
        return {name: input_.type.phrase for name, input_ in found.program.inputs.items()} if found else {}

    def _part_arguments(self, instance: str) -> dict[str, str]:
        """Return the arguments of the part that an include entry instantiates."""
        written = at(self.root, (include.name, instance, "part"))
        path = resolve(written.text, self.path, written.span) if isinstance(written, ScalarNode) else None
        part = read_file(path, str(path), {})[0] if isinstance(path, Path) else None
        named = part.get(args.name) if isinstance(part, MappingNode) else None
        return {name: _about(named, name) for name in named.entries} if isinstance(named, MappingNode) else {}


def _about(named: MappingNode, name: str) -> str:
    word = at(named, (name, "type"))
    return word.text if isinstance(word, ScalarNode) else ""

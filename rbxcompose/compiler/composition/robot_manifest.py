"""The robot as the front end returns it."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, replace
from enum import StrEnum
from pathlib import Path

from rbxcompose.base.config import Bound, Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Related, Span
from rbxcompose.compiler.sections.bus import BusModel, bus, msgs
from rbxcompose.compiler.sections.components import ComponentEntry, components, process
from rbxcompose.compiler.sections.missions import MissionEntry, missions, start
from rbxcompose.compiler.sections.values import ValueModel, places, values
from rbxcompose.manifest.arguments import DeclaredArgument, at_its_argument, size_of
from rbxcompose.manifest.section import Contents
from rbxcompose.manifest.tree import BROKEN, KeyPath, MappingNode, ScalarNode, TreeNode, at

_MOST_CHAINS = 3  # per finding: a part may have many instances


@dataclass(frozen=True, slots=True)
class Inclusion:
    """One instance of a file: its path (`arm.hand`) and the entries that lead to it, nearest first."""

    instance: str
    chain: tuple[Span, ...]

    @property
    def related(self) -> Iterator[Related]:
        """Yield the chain, from the entry that includes the file up to the one in the robot's own file."""
        names = self.instance.split(".")
        for length, span in zip(range(len(names), 0, -1), self.chain, strict=True):
            yield Related(span, f"included here as '{'.'.join(names[:length])}'")


@dataclass(slots=True)
class Inclusions:
    """All instances, by the name of their file in findings."""

    of_file: dict[str, list[Inclusion]] = field(default_factory=dict)

    def add(self, file: str, inclusion: Inclusion) -> None:
        """Add one instance."""
        self.of_file.setdefault(file, []).append(inclusion)

    def located(self, findings: Iterable[Finding]) -> list[Finding]:
        """Return the findings, with the chain of includes added to each one inside a part.

        A mistake in a part with several instances is reported once; one in a given value, where it was given.
        """
        said: set[tuple[str, Span]] = set()
        out = []
        for finding in map(at_its_argument, findings):
            inclusions = self.of_file.get(finding.span.file, []) if finding.span else []
            if not inclusions or finding.span is None:
                out.append(finding)
            elif (finding.code, finding.span) not in said:
                said.add((finding.code, finding.span))
                out.append(_with_chain(finding, inclusions))
        return out


def _with_chain(finding: Finding, inclusions: list[Inclusion]) -> Finding:
    chain = [related for inclusion in inclusions[:_MOST_CHAINS] for related in inclusion.related]
    fix = finding.fix
    prefixes = {inclusion.instance.replace(".", "_") + "_" for inclusion in inclusions}
    if fix and any(prefix in edit.text for edit in fix.edits for prefix in prefixes):
        fix = None  # the fix would write a name of the robot into the part, which has its own names
    return replace(finding, related=tuple(dict.fromkeys([*finding.related, *chain])), fix=fix)


_ARGUMENT = re.compile(r"\$\{\s*args\.(\w+)\s*\}")  # a value that is nothing else
ScopedBounds = Mapping[str, Mapping[str, tuple[Bound, ...]]]


def bounds_of(written: TreeNode | None, bounds: ScopedBounds) -> tuple[Bound, ...]:
    """Return what bounds a value as written: that of the argument which it names, if it is nothing else."""
    found = argument_of(written) if isinstance(written, ScalarNode) else None
    return bounds.get(written.scope, {}).get(found, ()) if found and isinstance(written, ScalarNode) else ()


def argument_of(written: ScalarNode) -> str | None:
    """Return the argument that a value is taken from, if it is nothing else: `speed` of `${args.speed}`."""
    found = _ARGUMENT.fullmatch(written.text)
    return found[1] if found else None


def own_bounds(name: str, argument: DeclaredArgument | None, whose: str) -> tuple[Bound, ...]:
    """Return what a declared argument allows; `whose` it is, in words."""
    if argument is None:
        return ()
    least, most = (None if one is None or one is BROKEN else size_of(one) for one in (argument.least, argument.most))
    return (Bound(least, most, f"the argument '{name}' of {whose}"),) if (least, most) != (None, None) else ()


ROBOT_LAYER = "the robot"


@dataclass(frozen=True, slots=True)
class HistoryStep:
    """What one layer wrote: a node with its place, or None if it removed the value."""

    layer: str
    node: TreeNode | None
    span: Span


@dataclass(slots=True)
class History:
    """All that the layers wrote, in order; nodes are as written, with `${...}` not filled in.

    It keeps only what a layer added, replaced or removed as a whole, so it costs no more than the changes.
    """

    _steps: dict[KeyPath, list[tuple[int, HistoryStep]]] = field(default_factory=dict)
    _count: int = 0

    def write(self, path: KeyPath, step: HistoryStep) -> None:
        """Record what a layer did at `path`."""
        self._count += 1
        self._steps.setdefault(path, []).append((self._count, step))

    @property
    def paths(self) -> Iterable[KeyPath]:
        """Return every path that a layer wrote."""
        return self._steps.keys()

    def of(self, path: KeyPath) -> tuple[HistoryStep, ...]:
        """Return every layer's value at `path`, the effective one last; empty if no layer ever wrote there.

        A last step without a node means that the value was removed.
        """
        found: list[HistoryStep] = []
        for step in self._all(path):
            if step.node is not None or (found and found[-1].node is not None):
                found.append(step)
        return tuple(found)

    def removed(self, section: str) -> dict[str, Span]:
        """Return the removed entries of a section, each with the place that removed it."""
        names = {path[1] for path in self._steps if len(path) == 2 and path[0] == section}
        names |= {
            name for step in self.of((section,)) if isinstance(step.node, MappingNode) for name in step.node.entries
        }
        last = {str(name): steps[-1] for name in names if (steps := self.of((section, name)))}
        return {name: step.span for name, step in last.items() if step.node is None}

    def layer(self, path: KeyPath) -> str:
        """Return the layer with the effective value at `path`, or at the nearest path above that has one."""
        for length in range(len(path), -1, -1):
            if steps := self.of(path[:length]):
                return steps[-1].layer
        return ""

    def _all(self, path: KeyPath) -> Iterator[HistoryStep]:
        reaching = [
            (order, step, path[length:])
            for length in range(len(path) + 1)
            for order, step in self._steps.get(path[:length], ())
        ]
        for _, step, rest in sorted(reaching, key=lambda row: row[0]):
            node = at(step.node, rest) if step.node is not None else None
            yield step if node is step.node else HistoryStep(step.layer, node, node.span if node else step.span)


class About(StrEnum):
    """The subject of a part's claim."""

    NEED = "a topic that it needs"
    PORT = "a topic that it gives"
    SKILL = "a skill"
    VALUE = "a value"


@dataclass(frozen=True, slots=True)
class Claim:
    """One thing that a part needs or provides, by its name in the robot; `type` is that of a topic."""

    about: About
    name: str
    type: str
    span: Span


@dataclass(frozen=True, slots=True)
class IncludedPart:
    """An instance of a part: what it brought, by its names in the robot.

    `name` is the path of the instance (`arm.hand`); what a part includes belongs to it, too.
    """

    name: str
    file: str  # file name in findings
    span: Span  # span of the entry that includes it
    components: frozenset[str]
    muxes: frozenset[str]  # those to which it adds an input or a lock
    values: frozenset[str]
    claims: tuple[Claim, ...]  # what it needs and provides


@dataclass(frozen=True, slots=True)
class RobotManifest:
    """A robot after composition: everything in its file, in the order of the file."""

    name: str
    about: str
    path: Path
    root: MappingNode  # composed and filled; the places of everything below
    is_simulated: bool
    contents: Contents
    parts: Mapping[str, IncludedPart] = field(default_factory=dict)
    profiles: Mapping[str, Span] = field(default_factory=dict)  # from the name to the end of what it changes
    profile_keys: Mapping[str, frozenset[str]] = field(default_factory=dict)  # the sections that each changes
    include: MappingNode = field(default_factory=MappingNode)  # composed; the parts that it names are already in `root`
    history: History = field(default_factory=History)
    overlays: tuple[str, ...] = ()  # the files of `-f`, by their names in findings
    files: Mapping[str, Path] = field(default_factory=dict)  # every file that was read, by its shown name
    inclusions: Inclusions = field(default_factory=Inclusions)
    bounds: ScopedBounds = field(default_factory=dict)  # of arguments, by scope and name

    @property
    def has_bounds(self) -> bool:
        """Return whether any argument has bounds."""
        return any(bounds for named in self.bounds.values() for bounds in named.values())

    def bounds_at(self, path: KeyPath) -> tuple[Bound, ...]:
        """Return what bounds the value at a path beside its type: those of the argument that it is taken from."""
        steps = self.history.of(path)
        return bounds_of(steps[-1].node, self.bounds) if steps else ()

    @property
    def components(self) -> Mapping[str, ComponentEntry]:
        """Return the components that the user wrote."""
        return self.contents.of(components)

    @property
    def places(self) -> Mapping[str, Place]:
        """Return the places."""
        return self.contents.of(places)

    @property
    def values(self) -> Mapping[str, ValueModel]:
        """Return the values."""
        return self.contents.of(values)

    @property
    def missions(self) -> Mapping[str, MissionEntry]:
        """Return the missions."""
        return self.contents.of(missions)

    @property
    def messages(self) -> Mapping[str, str]:
        """Return the texts of its own message types, by name."""
        return self.contents.of(msgs)

    @property
    def bus(self) -> BusModel:
        """Return the settings of the bus."""
        return self.contents.of(bus)

    @property
    def process(self) -> str | None:
        """Return the process group of components that do not name their own, if the robot has one."""
        return self.contents.of(process)

    @property
    def start(self) -> str | None:
        """Return the mission to start; None also if that mission has mistakes, which are already reported."""
        return self.contents.of(start)

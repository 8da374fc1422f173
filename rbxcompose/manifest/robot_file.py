"""A robot's file from text to `RobotManifest`, and every other manifest up to its checked header."""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rbxcompose.config import Name
from rbxcompose.expressions.types import UNKNOWN, Type
from rbxcompose.findings import Finding, Report, Span, kind, suggest
from rbxcompose.manifest.arguments import read_argument
from rbxcompose.manifest.collection import paused_collection
from rbxcompose.manifest.files import find, shown_name
from rbxcompose.manifest.fill import Names, fill, names_of, with_arguments
from rbxcompose.manifest.models import Header, RobotFile, RobotManifest
from rbxcompose.manifest.overlay import NOTHING_TO_CHANGE, compose, read_sets
from rbxcompose.manifest.reader import read_file
from rbxcompose.manifest.sections import named_entries, read_sections
from rbxcompose.manifest.tree import Mapping, Scalar
from rbxcompose.manifest.validate import BROKEN, validate
from rbxcompose.plain import plain

OTHER_KIND = kind(
    "RBX1304",
    """Another kind of manifest

Every manifest says what it describes: `kind: Robot`, `kind: Mission` and so on. This file is not what is needed here.

Bad:
```yaml
missions:
  patrol: robot.yaml
```
Good:
```yaml
missions:
  patrol: ../../missions/patrol.yaml
```
""",
)

NO_VALUE = kind(
    "RBX1206",
    """An argument without a value

An argument gets its value from `default:`, a profile, or `--set args.NAME=VALUE`.

Bad:
```yaml
args:
  speed:
    type: speed
```
Good:
```yaml
args:
  speed:
    type: speed
    default: 0.3 m/s
```
""",
)

ROBOT, MISSION = "Robot", "Mission"
PROFILE = "--profile"
PROFILES: Any = dict[Name, dict[str, Any]]


@paused_collection()
def load_robot(
    path: str | Path,
    *,
    report: Report,
    sources: dict[str, str],
    profiles: Sequence[str] = (),
    sets: Sequence[str] = (),
    sim: bool = True,
    environment: AnyMapping[str, str] | None = None,
) -> RobotManifest | None:
    """Read a robot's file with its profiles and `--set` changes; every mistake goes into `report`.

    Returns None if there is no robot to speak of; a robot with mistakes is returned as far as it could be read.
    """
    file = find(str(path))
    if isinstance(file, Finding):
        report.add(file)
        return None
    root = _read(file, ROBOT, report, sources)
    if root is None:
        return None
    composed = compose(_without(root, "profiles"), _profiles(root, profiles, report, sources), report)
    if sets:
        composed = compose(composed, read_sets(sets, composed, report, sources), report)
    validate(RobotFile, composed, (), report)
    names = names_of(_name(composed), sim, environment or {})
    filled = _fill(composed, names, report)
    return read_sections(filled, file, sim, report)


@paused_collection()
def read_mission(
    path: Path,
    *,
    robot: str,
    report: Report,
    sources: dict[str, str],
    sim: bool = True,
    environment: AnyMapping[str, str] | None = None,
) -> Mapping | None:
    """Read a mission's file, check its header and fill in `${...}`; what it does is left as nodes."""
    root = _read(path, MISSION, report, sources)
    if root is None:
        return None
    header = {name: entry for name, entry in root.entries.items() if name in Header.model_fields}
    validate(Header, replace(root, entries=header), (), report)
    return fill(root, names_of(robot, sim, environment or {}), report, runs=True)


def _read(file: Path, wanted: str, report: Report, sources: dict[str, str]) -> Mapping | None:
    """Return the tree of a manifest of the kind that is wanted, or None after findings."""
    shown = shown_name(file)
    root, findings = read_file(file, shown, sources)
    report.extend(findings)
    if root is None:
        return None
    if not isinstance(root, Mapping):
        report.add(OTHER_KIND.at(root.span, "a manifest is a map that begins with 'rbx: 1' and 'kind:'"))
        return None
    written = root.get("kind")
    if isinstance(written, Scalar) and written.text != wanted:
        help_text = suggest(written.text, [wanted], "what is needed")
        report.add(OTHER_KIND.at(written.span, f"this is no {wanted}", label=f"kind: {written.text}", help=help_text))
        return None
    return root


def _only(root: Mapping, key: str) -> Mapping:
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name == key})


def _without(root: Mapping, key: str) -> Mapping:
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name != key})


def _name(root: Mapping) -> str:
    name = root.get("name")
    return name.text if isinstance(name, Scalar) else ""


def _profiles(
    root: Mapping, chosen: Sequence[str], report: Report, sources: dict[str, str]
) -> list[tuple[Mapping, str]]:
    """Return the overlays of the chosen profiles, in the order of the command."""
    there = root.get("profiles")
    is_read = there is None or validate(PROFILES, there, ("profiles",), report) is not None
    named = there.entries if isinstance(there, Mapping) and is_read else {}
    if chosen:
        sources[PROFILE] = "\n".join(map(plain, chosen))
    overlays = []
    for line, name in enumerate(chosen, 1):
        overlay = named[name].value if name in named else None
        if isinstance(overlay, Mapping):
            overlays.append((overlay, f"profile '{name}'"))
        elif is_read:
            span = Span(PROFILE, line, 1, line, len(name) + 1)
            message = f"the robot has no profile '{name}'"
            report.add(NOTHING_TO_CHANGE.at(span, message, help=suggest(name, named, "profiles")))
    return overlays


def _fill(root: Mapping, names: Names, report: Report) -> Mapping:
    """Fill in the arguments' own values first, then everything else with them."""
    arguments = fill(_only(root, "args"), names, report)
    values: dict[str, tuple[Type, object]] = {}
    for name, entry in named_entries(arguments, ("args",), report):
        argument = read_argument(name, entry.value, ("args", name), report)
        if argument is None:
            values[name] = (UNKNOWN, BROKEN)
        elif argument.default is None:
            message = f"the argument '{name}' has no value"
            report.add(NO_VALUE.at(entry.key.span, message, help=f"give it a 'default:', or --set args.{name}=VALUE"))
            values[name] = (argument.type, BROKEN)
        else:
            values[name] = (argument.type, argument.read(argument.default, report))
    filled = fill(_without(root, "args"), with_arguments(names, values), report)
    entries = {**arguments.entries, **filled.entries}
    return replace(root, entries={name: entries[name] for name in root.entries})

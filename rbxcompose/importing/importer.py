"""What an importer is, and how it is found: one file in `importing/importers/`, declared by one decorator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Report, Severity, kind
from rbxcompose.importing.foreign_files import ForeignFile
from rbxcompose.plugins import LEFT_OUT, BrokenPluginError, Plugins

NOT_CARRIED_OVER = kind(
    "RBX2230",
    """Something of an imported file has no place in the manifest

It is understood, but a manifest has nothing for it, or what it asks for is decided elsewhere. The message says why. The
rest of the file is imported as if it were not there.

Bad: `hand_joint: {type: hobby_servo, id: 3}` in a file of ArbotiX: its board makes the pulses for that servo.
Good: a Dynamixel servo in its place.
""",
    Severity.WARNING,
)
OTHER_PROGRAM = kind(
    "RBX2231",
    """A file that is not one of the program it is imported from

Nothing in it is what files of that program have. `rbxcompose import --help` lists the programs.

Bad: `rbxcompose import arbotix diagnostics.yaml`
Good: `rbxcompose import arbotix arbotix.yaml`, a file with `joints:`, `controllers:` or a gripper's `model:`.
""",
)
DISAGREES = kind(
    "RBX2232",
    """Two imported files disagree

The files of one import make one robot. They may say the same thing twice, but not two things; the first one counts.

Bad: `head_pan_joint: {id: 1}` in one file, `head_pan_joint: {id: 2}` in the next one.
Good: `head_pan_joint: {id: 1}` in one of them.
""",
)

NOTHING_LEFT = kind(
    "RBX2238",
    """Nothing of the files could be imported

They are files of the program, but nothing in them has a place in a manifest, so none is written.

Bad: a file of ArbotiX with a port, but without joints and controllers.
Good: one with `joints:`
""",
)

PLUGINS = Plugins("importer", "rbxcompose.importing.importers")


@dataclass(frozen=True, slots=True)
class ImportedFiles:
    """The text of a manifest, empty if nothing could be read, and the files beside it by name."""

    text: str
    beside: Mapping[str, str] = field(default_factory=dict)


Import = Callable[[Sequence[ForeignFile], str, Report], str | ImportedFiles]
"""Files, the robot's name, where findings go -> the text of a manifest, or it with files beside it."""


@dataclass(frozen=True, slots=True)
class Importer:
    """How the files of one program are imported; `about` says in half a sentence what they are."""

    name: str
    about: str
    run: Import


_IMPORTERS: dict[str, Importer] = {}  # those that have been imported, by name


def importer(name: str, about: str) -> Callable[[Import], Import]:
    """Declare the function that imports the files of a program, under the name of its module."""

    def declare(run: Import) -> Import:
        _IMPORTERS[name] = Importer(name, about, run)
        return run

    return declare


def importers() -> dict[str, Importer]:
    """Return all importers that work, by name."""
    return {name: _IMPORTERS[name] for name in PLUGINS.names() if not _problem(name) and name in _IMPORTERS}


def imported(program: str, files: Sequence[ForeignFile], name: str, report: Report) -> ImportedFiles:
    """Return a manifest with what files of a program have; empty, after a finding, if it is nothing."""
    run = importers()[program].run(files, name, report) if files else ""
    made = run if isinstance(run, ImportedFiles) else ImportedFiles(run)
    if not made.text and not report.has_errors:
        report.add(NOTHING_LEFT.at(None, "nothing of these files could be imported, so no manifest is written"))
    return made


def broken_importers() -> list[Finding]:
    """Return a finding for each importer of another package that is left out."""
    return [LEFT_OUT.at(None, told) for name in sorted(PLUGINS.third_party) if (told := _problem(name))]


def _problem(name: str) -> str:
    """Load an importer; return why it is left out, or nothing."""
    try:
        PLUGINS.load(name)
    except BrokenPluginError as error:
        return str(error)
    return PLUGINS.overshadowed(name) if name not in PLUGINS.shipped else ""

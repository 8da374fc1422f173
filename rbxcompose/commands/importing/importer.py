"""What an importer is, and how it is found: one file in a folder `importers`, declared by one decorator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Severity, kind
from rbxcompose.base.plugins import LEFT_OUT, BrokenPluginError, Plugins, reported
from rbxcompose.commands.importing.foreign_files import ForeignFile
from rbxcompose.manifest.files import ROBOT_FILE

NOT_CARRIED_OVER = kind("RBX2230", Severity.WARNING)
OTHER_PROGRAM = kind("RBX2231")
DISAGREES = kind("RBX2232")
RENAMED_TOPIC = kind("RBX2294", Severity.WARNING)
LEFT_OPEN = kind("RBX2299", Severity.WARNING)

NOTHING_LEFT = kind("RBX2238")
CLOCK = "'bus: {clock: external}' makes robot time follow '/clock'"  # instead of `use_sim_time`

PLUGINS = Plugins("importer", "importers")
_IMPORTERS: dict[str, Importer] = {}  # those that have been imported, by name


@dataclass(frozen=True, slots=True)
class ImportedFiles:
    """The text of a manifest, empty if nothing could be read, the files beside it by name, and its own name.

    `included` are the texts of further files that were read, by their names in findings.
    """

    text: str
    beside: Mapping[str, str] = field(default_factory=dict)
    included: Mapping[str, str] = field(default_factory=dict)
    file: str = ROBOT_FILE


Import = Callable[[Sequence[ForeignFile], str, Report], str | ImportedFiles]
"""Files, the robot's name, where findings go -> the text of a manifest, or it with files beside it."""


@dataclass(frozen=True, slots=True)
class Importer:
    """How the files of one program are imported; `about` says in half a sentence what they are.

    `has_arguments` means that its files take arguments: words `NAME:=VALUE` of the command line.
    """

    name: str
    about: str
    run: Import
    has_arguments: bool = False


def importer(name: str, about: str, *, has_arguments: bool = False) -> Callable[[Import], Import]:
    """Declare the function that imports the files of a program, under the name of its module."""

    def declare(run: Import) -> Import:
        _IMPORTERS[name] = Importer(name, about, run, has_arguments)
        return run

    return declare


def importers() -> dict[str, Importer]:
    """Return all importers that work, by name."""
    return {name: _IMPORTERS[name] for name in PLUGINS.names() if not _problem(name)}


def imported(program: str, files: Sequence[ForeignFile], name: str, report: Report) -> ImportedFiles:
    """Return a manifest with what files of a program have; empty, after a finding, if it is nothing."""
    run: str | ImportedFiles = ""
    if files:
        with reported(report, None), PLUGINS.guarded(program):
            run = importers()[program].run(files, name, report)
    made = run if isinstance(run, ImportedFiles) else ImportedFiles(run)
    if not made.text and not report.has_errors:
        report.add(NOTHING_LEFT.at(None, "nothing of these files could be imported, so no manifest is written"))
    return made


def broken_importers() -> list[Finding]:
    """Return a finding for each importer that is left out."""
    return [LEFT_OUT.at(None, problem) for name in PLUGINS.names() if (problem := _problem(name))]


def _problem(name: str) -> str:
    """Load an importer; return why it is left out, or nothing."""
    try:
        PLUGINS.find(name, _IMPORTERS, f"function by @importer({name!r}, ...)")
    except BrokenPluginError as error:
        return str(error)
    return ""

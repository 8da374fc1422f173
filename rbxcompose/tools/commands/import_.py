"""Make a manifest from files of another program.

Comments show where each value stood; findings report what was guessed, and what could not be carried over. Several
files make one robot. Without `--out`, the manifest goes to stdout and the findings to stderr; no file is overwritten.
Exit codes: 0 fine, 1 errors found (what was understood is written nevertheless), 2 wrong usage.
"""

import argparse
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.findings import Finding, Report, Sources
from rbxcompose.commands.console import FINDINGS, emit, write_report
from rbxcompose.commands.formats.json_ import as_data
from rbxcompose.commands.importing.foreign_files import read_files
from rbxcompose.commands.importing.importer import ImportedFiles, broken_importers, imported, importers
from rbxcompose.commands.new_files import EXISTS, name_like, read_name, robot_file, write_new
from rbxcompose.commands.options import add_json_option, out_option
from rbxcompose.manifest.files import shown_name

GROUP = "write"
OTHERWISE = "imported"  # the name of a robot if the first file's has no letter
_ARGUMENT = re.compile(r"[A-Za-z_]\w*:=")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    programs = parser.add_subparsers(dest="program", metavar="PROGRAM", required=True)
    for name, importer in importers().items():
        program = programs.add_parser(name, help=f"import {importer.about}", description=f"Import {importer.about}.")
        words = ", and arguments as NAME:=VALUE" if importer.has_arguments else ""
        program.add_argument("files", nargs="+", metavar="FILE", help=f"its files{words}; together they make one robot")
        out_option("write the manifest to this new file, or as robot.yaml to this folder")(program)
        program.add_argument("--name", metavar="NAME", help="the robot's name (default: that of the first file)")
        add_json_option(program)


def run(arguments: argparse.Namespace) -> int:
    """Read the files, write the manifest, and report the findings."""
    report, sources = Report(broken_importers()), dict[str, str]()
    out = robot_file(arguments.out) if arguments.out is not None else None
    has_arguments = importers()[arguments.program].has_arguments
    given = [word.split(":=", 1) for word in arguments.files if has_arguments and _ARGUMENT.match(word)]
    paths = [Path(word) for word in arguments.files if not (has_arguments and _ARGUMENT.match(word))]
    name = _name(arguments.name, paths)
    folder = out.parent.resolve() if out is not None else None
    files = [replace(file, arguments=dict(given), out=folder) for file in read_files(paths, report, sources)]
    made = imported(arguments.program, files, name, report)
    sources.update(made.included)
    if out is not None and out != Path(arguments.out):  # a folder
        out = out.with_name(made.file)
    findings = Report(
        [replace(one, fix=None) for one in report]
    )  # fixes are for manifests, which `check --fix` corrects
    if made.text and out is not None and (finding := _write(out, made)) is not None:
        findings.add(finding)
        made = ImportedFiles("")
    return _answer(made, findings, sources, out, in_json=arguments.json)


def _name(wanted: str | None, paths: Sequence[Path]) -> str:
    if wanted is not None:
        return read_name(wanted, "the robot")
    return name_like(paths[0].stem.removesuffix(".launch") if paths else "") or OTHERWISE


def _write(path: Path, made: ImportedFiles) -> Finding | None:
    finding = write_new(path.parent, {path.name: made.text, **made.beside})
    if finding is not None and finding.code == EXISTS.code:
        return replace(finding, help="choose another file with '--out', or move this one away")
    return finding


def _answer(made: ImportedFiles, report: Report, sources: Sources, out: Path | None, *, in_json: bool) -> int:
    """Write the findings, and the manifest if there is one; return the exit code."""
    text = made.text
    if not text or not in_json:
        write_report(report, sources)
    if not text:
        return FINDINGS
    shown = shown_name(out) if out is not None else None
    if in_json:
        findings = [as_data(finding, sources) for finding in report]
        data = {"manifest": text, "file": shown, "beside": dict(made.beside), "findings": findings}
        emit(json.dumps(data, ensure_ascii=False))
    elif shown is None:
        emit("\n".join([text, *(f"--- # {name}\n{each}" for name, each in made.beside.items())]).rstrip("\n"))
    else:
        folder = Path(shown).parent
        for each in (Path(shown), *(folder / name for name in made.beside)):
            emit(f"wrote {each}")
    return FINDINGS if report.has_errors else 0

"""The section `msgs`: message types of the robot's own."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.config import Config
from rbxcompose.base.findings import Finding, Related, Report, Span
from rbxcompose.compiler.message_texts import (
    LARGEST,
    NO_PACKAGE,
    NOTHING,
    Examination,
    TypeText,
    files_in,
    packages_in,
    wrong_package,
)
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.files import folder_named, resolve, shown_name
from rbxcompose.manifest.reader import read_source
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, Short
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.msgs import registry

FOLDER = "folder of messages"


class MessageFolder(Config):
    """A folder with types of messages, services and actions."""

    folder: FileName
    """A ROS package: its name is that of the package, and its files are below `msg/`, `srv/` and `action/`. Or a folder
    with such packages."""


@section("msgs", MessageFolder, order=25, names=FOLDER, entry="folder", short=Short("folder"))
def msgs(reading: Reading[MessageFolder]) -> Mapping[str, str]:
    """Folders with message types of the robot's own, by any name; their texts are those of ROS 2.

    Example:
        msgs:
          own: msgs                       # a folder beside this file
    """
    report, documents = reading.report, reading.contents.documents
    written: dict[str, TypeText] = {}
    packages: dict[str, tuple[Path, Span]] = {}
    for name, read in reading.entries().items():
        span = reading.value("msgs", name, "folder")
        writer = documents.writer(span, reading.contents.file)
        folder = folder_named(read.folder, writer, span)
        if not isinstance(folder, Path):
            report.add(folder)
            continue
        found = packages_in(folder)
        if not found:
            message = f"'{read.folder}' has no messages, services or actions"
            report.add(NO_PACKAGE.at(span, message, help="they are files such as 'PACKAGE/msg/NAME.msg'"))
        for package in found:
            first, place = packages.setdefault(package.name, (package, span))
            if first != package:
                words = f"there are two packages '{package.name}': '{shown_name(first)}' and '{shown_name(package)}'"
                report.add(NO_PACKAGE.at(span, words, related=[Related(place, "the first one")]))
            elif words := wrong_package(package.name):
                report.add(NO_PACKAGE.at(span, words, help="rename the folder"))
            else:
                written |= _texts(package, writer, span, documents)
    examination = Examination(written)
    report.extend(examination.findings)
    return examination.texts


def _texts(package: Path, writer: Path, span: Span, documents: Documents) -> dict[str, TypeText]:
    found = {}
    for name, path in files_in(package):
        file = resolve(str(path), writer, span)
        if isinstance(file, Finding):  # a link to elsewhere
            documents.report.add(file)
            continue
        shown = shown_name(file)
        text, findings = read_source(file, shown, documents.sources, LARGEST, "a type of messages")
        documents.report.extend(replace(finding, span=finding.span or span) for finding in findings)
        found[name] = TypeText(shown, NOTHING[name.split("/")[1]] if text is None else text)
    return found


def foresee(root: MappingNode, file: Path) -> None:
    """Let names also mean the types of a file that is not composed yet: components that it names may import them."""
    if msgs.name in root:
        own = Contents(root, file, Documents(Report(), {})).of(msgs)
        registry.choose({**registry.chosen().texts, **own})

"""`mux`: files of twist_mux and of yocs_cmd_vel_mux, for ROS 1 and ROS 2."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from rbxcompose.findings import Report, Severity, kind
from rbxcompose.importing.foreign_files import ForeignFile, Given
from rbxcompose.importing.importer import importer
from rbxcompose.importing.manifest_text import Row, flow, header, place, quantity, row, section
from rbxcompose.importing.mux_files import TWIST_MUX, YOCS, ForeignMux, ForeignSource, joined, read_muxes
from rbxcompose.importing.names import FreeNames
from rbxcompose.mux.words import OWN_NAMES
from rbxcompose.printable import plain

RENAMED_TOPIC = kind("RBX2294", Severity.WARNING)
GUESSED_OUTPUT = kind("RBX2295", Severity.WARNING)

_TOPIC = re.compile(r"/?[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)*")
_USUAL, _OTHERWISE = "cmd_vel", "cmd_vel_out"
_LOCK_PORT = "lock_"


@importer("mux", "files of twist_mux and of yocs_cmd_vel_mux, for ROS 1 and ROS 2")
def mux(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the muxes of the files, which follow the rules of their program to the letter."""
    found = {file.name: read_muxes(file, report) for file in files}
    muxes = joined([one for ones in found.values() for one in ones], report)
    if not muxes:
        return ""
    names = FreeNames()
    rows = [line for one in muxes for line in _rows(one, names, report)]
    made_from = [file for file, ones in found.items() if ones]
    return f"{header('mux', made_from, 'Robot', name)}\n{section([row(0, 'muxes:'), *rows])}"


def _rows(one: ForeignMux, names: FreeNames, report: Report) -> Iterator[Row]:
    program = "yocs_cmd_vel_mux" if one.program == YOCS else TWIST_MUX
    node = f", '{plain(one.node, 60)}'" if one.node else ""
    yield row(1, f"{names.take(_output(one, report), _USUAL)}:", f"{place(one.span)}{node}")
    yield row(2, f"profile: {one.program}", f"the rules of {program}, to the letter")
    own = FreeNames()
    yield row(2, "inputs:")
    yield from _sources(one, one.inputs, own, report)
    if one.locks:
        yield row(2, "locks:")
        yield from _sources(one, one.locks, own, report)


def _output(one: ForeignMux, report: Report) -> str:
    """Return the topic of the output, which is the name of the mux."""
    if one.output is not None:
        written = one.output.value.lstrip("/")
        name = _topic(one.output, one, report).lstrip("/").replace("/", "_")
        if name != written and "/" in written:
            words = f"the output '{plain(written, 60)}' becomes '{name}'"
            report.add(RENAMED_TOPIC.at(one.output.span, words, help="the base must listen there"))
        return name
    taken = {source.topic.value.lstrip("/") for source in (*one.inputs.values(), *one.locks.values())}
    name = _OTHERWISE if _USUAL in taken or one.program == YOCS else _USUAL
    words = f"the file does not name the output of the mux; it is taken for '{name}'"
    report.add(GUESSED_OUTPUT.at(one.span, words, help="the mux has the name of the topic to which the base listens"))
    return name


def _topic(given: Given[str], one: ForeignMux, report: Report) -> str:
    """Return a topic as a manifest may have it; private ones are below the name of the node."""
    written = given.value.strip()
    topic = f"{one.node.lstrip('/') or one.program}/{written[1:].lstrip('/')}" if written.startswith("~") else written
    if _TOPIC.fullmatch(topic):
        return topic
    parts = (re.sub(r"^[0-9_]+|[^a-z0-9_]+", "_", part.lower()).strip("_") for part in topic.split("/"))
    slash = "/" if topic.startswith("/") else ""
    name = f"{slash}{'/'.join(part for part in parts if part) or 'topic'}"
    if one.output is None or given is not one.output or "/" not in topic.lstrip("/"):
        words = f"the topic '{plain(written, 60)}' becomes '{name}'"
        report.add(RENAMED_TOPIC.at(given.span, words, help="whoever sends there must use this name"))
    return name


def _sources(one: ForeignMux, sources: Mapping[str, ForeignSource], names: FreeNames, report: Report) -> Iterator[Row]:
    for source in sources.values():
        name = names.take(source.name, "source")
        if name in OWN_NAMES or name.startswith(_LOCK_PORT):
            name = names.take(f"source_{name}", "source")
        about = "; ".join(
            [place(source.span)]
            + ([f"its name was '{plain(source.name, 60)}'"] if name != source.name else [])
            + ([plain(source.about, 80)] if source.about else [])
        )
        entry = {
            "topic": _topic(source.topic, one, report),
            "priority": str(source.priority.value),
            "timeout": quantity(source.timeout.value, "s"),
        }
        yield row(3, f"{name}: {flow(entry)}", about)

"""`mux`: files of twist_mux and of yocs_cmd_vel_mux, for ROS 1 and ROS 2."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Related, Report, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.importing.foreign_files import ForeignFile, ForeignMap, FreeNames, Given
from rbxcompose.commands.importing.importer import (
    CLOCK,
    DISAGREES,
    NOT_CARRIED_OVER,
    OTHER_PROGRAM,
    RENAMED_TOPIC,
    importer,
)
from rbxcompose.commands.importing.manifest_text import Row, flow, header, place, quantity, row, section
from rbxcompose.commands.importing.ros_parameters import NodeParameters, parameters_with, topic_name
from rbxcompose.compiler.composition.robot_file import is_own_name
from rbxcompose.domains.muxes.config import OWN_NAMES
from rbxcompose.manifest.tree import MappingNode, SequenceNode
from rbxcompose.manifest.validate import OUT_OF_RANGE, WRONG_TYPE, label_of

TWIST_MUX, YOCS = "twist_mux", "yocs"
_INPUTS = {TWIST_MUX: "topics", YOCS: "subscribers"}
_LOCKS = "locks"
_MOST = 1 << 31  # of a priority
GUESSED_OUTPUT = kind("RBX2295", Severity.WARNING)
_USUAL, _OTHERWISE = "cmd_vel", "cmd_vel_out"
_LOCK_PORT = "lock_"


@dataclass(frozen=True, slots=True)
class ForeignSource:
    """An input or a lock: its name, topic, timeout [s] and priority."""

    name: str
    span: Span = field(compare=False)
    topic: Given[str]
    timeout: Given[float]
    priority: Given[int]
    about: str = ""


@dataclass(slots=True)
class ForeignMux:
    """A mux of a program: the node it was, where it begins, its inputs and locks in the program's order."""

    program: str
    node: str
    span: Span
    inputs: dict[str, ForeignSource] = field(default_factory=dict)
    locks: dict[str, ForeignSource] = field(default_factory=dict)
    output: Given[str] | None = None


def read_muxes(file: ForeignFile, report: Report) -> list[ForeignMux]:
    """Return the muxes of a file; other nodes in it are reported, and so is a file without any."""
    found, others = parameters_with(file, lambda root: bool(_program(root)))
    if not found:
        words = f"'{plain(file.name)}' is not a file of a mux: it has neither 'topics' nor 'locks' nor 'subscribers'"
        report.add(OTHER_PROGRAM.at(file.root.span, words))
        return []
    for node in others:
        report.add(NOT_CARRIED_OVER.at(node.span, f"'{plain(node.node, 60)}' is not carried over: it is not a mux"))
    named = (replace(node, node="") if node.root.span == file.root.span else node for node in found)
    return [_mux(node, _program(node.root), report) for node in named]


def _program(root: MappingNode) -> str:
    keys = root.entries.keys()
    return next((name for name, key in _INPUTS.items() if key in keys), TWIST_MUX if _LOCKS in keys else "")


def _mux(node: NodeParameters, program: str, report: Report) -> ForeignMux:
    given = ForeignMap(node.root, f"'{plain(node.node, 60)}'" if node.node else "this file", node.span, report)
    mux = ForeignMux(program, node.node, node.span)
    mux.inputs = _sources(given, _INPUTS[program], "input", program)
    if program == TWIST_MUX:
        mux.locks = _sources(given, _LOCKS, "lock", program)
        if (stamped := given.flag("use_stamped")) is not None and stamped.value:
            words = "'use_stamped' is not carried over: the type of a mux follows from who sends and receives"
            report.add(NOT_CARRIED_OVER.at(stamped.span, words))
    else:
        mux.output = given.text("publisher")
    if (time := given.flag("use_sim_time")) is not None and time.value:
        report.add(NOT_CARRIED_OVER.at(time.span, f"'use_sim_time' is not carried over: {CLOCK}"))
    given.report_unknown_keys()
    return mux


def _sources(given: ForeignMap, key: str, what: str, program: str) -> dict[str, ForeignSource]:
    """Return inputs or locks by name, in the order in which the program takes them."""
    found: dict[str, ForeignSource] = {}
    for name, foreign_map in _entries(given, key, what):
        source = _source(name, foreign_map, program)
        if source is None:
            continue
        if (other := found.setdefault(name, source)) is not source:
            words = f"there is another {what} '{plain(name, 60)}'; the first one counts"
            given.add(DISAGREES.at(source.span, words, related=[Related(other.span, "the first one")]))
    ranks = [foreign_source.priority.value for foreign_source in found.values()]
    if isinstance(given.node.get(key), MappingNode) and len(set(ranks)) < len(ranks):
        return dict(sorted(found.items()))  # ROS 2 lists parameters by their names, and the first of equals wins
    return found


def _entries(given: ForeignMap, key: str, what: str) -> Iterator[tuple[str, ForeignMap]]:
    """Yield entries by name, of a map or of a list of maps with a `name`."""
    node = given.node.get(key)
    if not isinstance(node, SequenceNode):
        yield from given.maps(key, what)
        return
    given.places(key)  # it is known
    for item in node.items:
        if not isinstance(item, MappingNode):
            given.add(WRONG_TYPE.at(item.span, f"each {what} must be a map of keys and values", label=label_of(item)))
            continue
        foreign_map = ForeignMap(item, f"this {what}", item.span, given.report)
        name = foreign_map.needs("name", foreign_map.text("name"))
        if name is not None:
            foreign_map.what = f"{what} '{plain(name.value, 60)}'"
            yield name.value, foreign_map


def _source(name: str, foreign_map: ForeignMap, program: str) -> ForeignSource | None:
    """Return an input or a lock; None after the findings that say why it is left out."""
    topic = foreign_map.needs("topic", foreign_map.text("topic"))
    timeout = foreign_map.needs("timeout", foreign_map.number("timeout"))
    priority = foreign_map.needs("priority", foreign_map.whole("priority", -_MOST, _MOST))
    about = foreign_map.text("short_desc") if program == YOCS else None
    foreign_map.report_unknown_keys()
    if timeout is not None and timeout.value < 0:
        if program == YOCS:
            foreign_map.add(OUT_OF_RANGE.at(timeout.span, f"'timeout' of {foreign_map.what} must be 0 or more"))
            return None
        timeout = replace(timeout, value=0.0)  # as 0, it never expires there
    if topic is None or timeout is None or priority is None:
        return None
    return ForeignSource(name, foreign_map.span, topic, timeout, priority, about.value if about else "")


def joined(muxes: list[ForeignMux], report: Report) -> list[ForeignMux]:
    """Return the muxes that several files make together: what has one node and one program is one mux."""
    found: dict[tuple[str, str], ForeignMux] = {}
    for foreign_mux in muxes:
        first = found.setdefault((foreign_mux.program, foreign_mux.node), foreign_mux)
        if first is foreign_mux:
            continue
        first.output = first.output or foreign_mux.output
        for mine, theirs, what in (
            (first.inputs, foreign_mux.inputs, "input"),
            (first.locks, foreign_mux.locks, "lock"),
        ):
            for name, source in theirs.items():
                if (other := mine.setdefault(name, source)) != source:
                    words = f"the {what} '{plain(name, 60)}' was something else before; the first one counts"
                    report.add(DISAGREES.at(source.span, words, related=[Related(other.span, "the first one")]))
    return [one for one in found.values() if one.inputs]


@importer("mux", "files of twist_mux and of yocs_cmd_vel_mux, for ROS 1 and ROS 2")
def mux(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the muxes of the files, which follow the rules of their program to the letter."""
    found = {file.name: read_muxes(file, report) for file in files}
    muxes = joined([foreign_mux for ones in found.values() for foreign_mux in ones], report)
    if not muxes:
        return ""
    names = FreeNames(is_own_name)
    topics = _TopicNames(muxes, report)
    rows = [line for foreign_mux in muxes for line in _rows(foreign_mux, names, topics, report)]
    made_from = [file for file, ones in found.items() if ones]
    return f"{header('mux', made_from, 'Robot', name)}\n{section([row(0, 'muxes:'), *rows])}"


def _rows(foreign_mux: ForeignMux, names: FreeNames, topics: _TopicNames, report: Report) -> Iterator[Row]:
    program = "yocs_cmd_vel_mux" if foreign_mux.program == YOCS else TWIST_MUX
    node = f", '{plain(foreign_mux.node, 60)}'" if foreign_mux.node else ""
    yield row(1, f"{names.take(_output(foreign_mux, topics, report), _USUAL)}:", f"{place(foreign_mux.span)}{node}")
    yield row(2, f"profile: {foreign_mux.program}", f"the rules of {program}, to the letter")
    own = FreeNames()
    yield row(2, "inputs:")
    yield from _mux_sources(foreign_mux, foreign_mux.inputs, own, topics)
    if foreign_mux.locks:
        yield row(2, "locks:")
        yield from _mux_sources(foreign_mux, foreign_mux.locks, own, topics)


def _output(foreign_mux: ForeignMux, topics: _TopicNames, report: Report) -> str:
    """Return the topic of the output, which is the name of the mux."""
    if foreign_mux.output is not None:
        written = foreign_mux.output.value.lstrip("/")
        name = topics.name(foreign_mux.output, foreign_mux).lstrip("/").replace("/", "_")
        if name != written and "/" in written:
            words = f"the output '{plain(written, 60)}' becomes '{name}'"
            report.add(RENAMED_TOPIC.at(foreign_mux.output.span, words, help="the base must listen there"))
        return name
    taken = {source.topic.value.lstrip("/") for source in (*foreign_mux.inputs.values(), *foreign_mux.locks.values())}
    name = _OTHERWISE if _USUAL in taken or foreign_mux.program == YOCS else _USUAL
    words = f"the file does not name the output of the mux; it is taken for '{name}'"
    report.add(
        GUESSED_OUTPUT.at(foreign_mux.span, words, help="the mux has the name of the topic to which the base listens")
    )
    return name


class _TopicNames:
    """Gives topics the names that manifests may have: those that have one keep it, and no two get the same one."""

    def __init__(self, muxes: Sequence[ForeignMux], report: Report) -> None:
        sources = ((each, one) for one in muxes for each in (*one.inputs.values(), *one.locks.values()))
        given = [(each.topic, one) for each, one in sources] + [(one.output, one) for one in muxes if one.output]
        topics = {_whole(topic, one).lstrip("/") for topic, one in given}
        self._names = {topic: topic for topic in topics if topic_name(topic) == topic}
        self._report = report

    def name(self, given: Given[str], one: ForeignMux) -> str:
        """Return the name of a topic, after a finding if it is another one."""
        whole = _whole(given, one)
        topic = whole.lstrip("/")
        if topic not in self._names:
            wanted = topic_name(topic)
            free = (wanted, *(f"{wanted}_{number}" for number in range(2, len(self._names) + 3)))
            self._names[topic] = next(name for name in free if name not in self._names.values())
        name = f"{'/' if whole.startswith('/') else ''}{self._names[topic]}"
        if name != whole and (one.output is None or given is not one.output or "/" not in topic):
            words = f"the topic '{plain(given.value.strip(), 60)}' becomes '{name}'"
            self._report.add(RENAMED_TOPIC.at(given.span, words, help="whoever sends there must use this name"))
        return name


def _whole(given: Given[str], one: ForeignMux) -> str:
    """Return a topic with the name of the node above it if it is a private one."""
    written = given.value.strip()
    return f"{one.node.lstrip('/') or one.program}/{written[1:].lstrip('/')}" if written.startswith("~") else written


def _mux_sources(
    foreign_mux: ForeignMux, sources: Mapping[str, ForeignSource], names: FreeNames, topics: _TopicNames
) -> Iterator[Row]:
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
            "topic": topics.name(source.topic, foreign_mux),
            "priority": str(source.priority.value),
            "timeout": quantity(source.timeout.value, "s"),
        }
        yield row(3, f"{name}: {flow(entry)}", about)

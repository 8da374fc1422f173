"""Files of muxes as they are read: inputs and locks by name, and the rules of the program that they were for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Related, Report, Span
from rbxcompose.importing.foreign_files import ForeignFile, ForeignMap, Given
from rbxcompose.importing.importer import DISAGREES, NOT_CARRIED_OVER, OTHER_PROGRAM
from rbxcompose.importing.ros_parameters import NodeParameters, parameters_with
from rbxcompose.manifest.tree import MappingNode, SequenceNode, TreeNode
from rbxcompose.manifest.validate import OUT_OF_RANGE, WRONG_TYPE, label_of
from rbxcompose.printable import plain

TWIST_MUX, YOCS = "twist_mux", "yocs"
_INPUTS = {TWIST_MUX: "topics", YOCS: "subscribers"}
_LOCKS = "locks"
_MOST = 1 << 31  # of a priority


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
    """Return the muxes of a file; other nodes in it are told, and so is a file without any."""
    found, others = parameters_with(file, lambda root: bool(_program(root)))
    if not found:
        words = f"'{plain(file.name)}' is no file of a mux: it has neither 'topics' nor 'locks' nor 'subscribers'"
        report.add(OTHER_PROGRAM.at(file.root.span, words))
        return []
    for node in others:
        report.add(NOT_CARRIED_OVER.at(node.span, f"'{plain(node.node, 60)}' is not carried over: it is no mux"))
    named = (replace(node, node="") if node.root.span == file.root.span else node for node in found)
    return [_mux(node, _program(node.root), report) for node in named]


def _program(root: MappingNode) -> str:
    keys = root.entries.keys()
    return next((name for name, key in _INPUTS.items() if key in keys), TWIST_MUX if _LOCKS in keys else "")


def _mux(node: NodeParameters, program: str, report: Report) -> ForeignMux:
    told = ForeignMap(node.root, f"'{plain(node.node, 60)}'" if node.node else "this file", node.span, report)
    mux = ForeignMux(program, node.node, node.span)
    mux.inputs = _sources(told, _INPUTS[program], "input", program)
    if program == TWIST_MUX:
        mux.locks = _sources(told, _LOCKS, "lock", program)
        if (stamped := told.flag("use_stamped")) is not None and stamped.value:
            words = "'use_stamped' is not carried over: the type of a mux follows from who sends and receives"
            report.add(NOT_CARRIED_OVER.at(stamped.span, words))
    else:
        mux.output = told.text("publisher")
    if (time := told.flag("use_sim_time")) is not None and time.value:
        words = "'use_sim_time' is not carried over: 'bus: {clock: external}' makes robot time follow '/clock'"
        report.add(NOT_CARRIED_OVER.at(time.span, words))
    told.tell_others()
    return mux


def _sources(told: ForeignMap, key: str, what: str, program: str) -> dict[str, ForeignSource]:
    """Return inputs or locks by name, in the order in which the program takes them."""
    found: dict[str, ForeignSource] = {}
    for name, one in _entries(told, key, what):
        source = _source(name, one, program)
        if source is None:
            continue
        if (other := found.setdefault(name, source)) is not source:
            words = f"there is another {what} '{plain(name, 60)}'; the first one counts"
            told.tell(DISAGREES.at(source.span, words, related=[Related(other.span, "the first one")]))
    ranks = [one.priority.value for one in found.values()]
    if isinstance(told.node.get(key), MappingNode) and len(set(ranks)) < len(ranks):
        return dict(sorted(found.items()))  # ROS 2 lists parameters by their names, and the first of equals wins
    return found


def _entries(told: ForeignMap, key: str, what: str) -> Iterator[tuple[str, ForeignMap]]:
    """Yield entries by name, of a map or of a list of maps with a `name`."""
    node = told.node.get(key)
    if not isinstance(node, SequenceNode):
        yield from told.maps(key, what)
        return
    told.places(key)  # it is known
    for item in node.items:
        if not isinstance(item, MappingNode):
            told.tell(_no_map(item, what))
            continue
        one = ForeignMap(item, f"this {what}", item.span, told.report)
        name = one.needs("name", one.text("name"))
        if name is not None:
            one.what = f"{what} '{plain(name.value, 60)}'"
            yield name.value, one


def _no_map(item: TreeNode, what: str) -> Finding:
    return WRONG_TYPE.at(item.span, f"each {what} must be a map of keys and values", label=label_of(item))


def _source(name: str, one: ForeignMap, program: str) -> ForeignSource | None:
    """Return an input or a lock; None after the findings that say why it is left out."""
    topic = one.needs("topic", one.text("topic"))
    timeout = one.needs("timeout", one.number("timeout"))
    priority = one.needs("priority", one.whole("priority", -_MOST, _MOST))
    about = one.text("short_desc") if program == YOCS else None
    one.tell_others()
    if timeout is not None and timeout.value < 0:
        if program == YOCS:
            one.tell(OUT_OF_RANGE.at(timeout.span, f"'timeout' of {one.what} must be 0 or more"))
            return None
        timeout = replace(timeout, value=0.0)  # as 0, it never expires there
    if topic is None or timeout is None or priority is None:
        return None
    return ForeignSource(name, one.span, topic, timeout, priority, about.value if about else "")


def joined(muxes: list[ForeignMux], report: Report) -> list[ForeignMux]:
    """Return the muxes that several files make together: what has one node and one program is one mux."""
    found: dict[tuple[str, str], ForeignMux] = {}
    for one in muxes:
        first = found.setdefault((one.program, one.node), one)
        if first is one:
            continue
        first.output = first.output or one.output
        for mine, theirs, what in ((first.inputs, one.inputs, "input"), (first.locks, one.locks, "lock")):
            for name, source in theirs.items():
                if (other := mine.setdefault(name, source)) != source:
                    words = f"the {what} '{plain(name, 60)}' was something else before; the first one counts"
                    report.add(DISAGREES.at(source.span, words, related=[Related(other.span, "the first one")]))
    return [one for one in found.values() if one.inputs]

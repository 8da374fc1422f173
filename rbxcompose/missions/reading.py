"""From the located tree of a mission file to its program; every mistake becomes a finding with its place."""

from __future__ import annotations

from rbxcompose.findings import Finding, Related, Report, Span
from rbxcompose.manifest.tree import Entry, Mapping, Node, Scalar, Sequence
from rbxcompose.missions import codes, program
from rbxcompose.missions.header import read_data, read_inputs, read_rate
from rbxcompose.missions.keys import find_key
from rbxcompose.missions.modifiers import MODIFIERS
from rbxcompose.missions.node_reader import NAME, NAME_HELP, NodeReader
from rbxcompose.missions.program import Interrupt, Program
from rbxcompose.missions.registry import Kind, kinds

KEYS = ("rbx", "kind", "name", "about", "inputs", "data", "interrupts", "rate", "do")
INTERRUPT_KEYS = ("when", "do", "afterwards")
AFTERWARDS = ("continue",)
LEVELS = 40  # of nodes within nodes
LIST = "sequence"  # what a list is


def read_program(root: Mapping, report: Report) -> Program | None:
    """Return the program of a mission file, None if it has nothing to do.

    What could not be read is left out of the program, so that the rest can be checked; it may run only if the report
    has no errors.
    """
    for name, entry in root.entries.items():
        if name not in KEYS:
            message = f"unknown key '{name}' in a mission"
            report.add(
                codes.UNKNOWN_KEY.misspelt(entry.key.span, message, name, KEYS, "keys of a mission", taken=root.entries)
            )
    reader = _Reader(report)
    inputs, data = read_inputs(root.get("inputs"), report), read_data(root.get("data"), report)
    task = root.get("do")
    if task is None:
        report.add(codes.MISSING.at(root.span, "a mission needs 'do': what is to be done"))
    else:
        reader.child(task, "do", None)
    interrupts = reader.interrupts(root.get("interrupts"))
    if task is None:
        return None
    return Program(
        _text(root, "name"),
        _text(root, "about"),
        root.span.file,
        tuple(node for node in reader.nodes if node),
        inputs,
        data,
        interrupts,
        read_rate(root.get("rate"), report),
        root,
    )


def _text(root: Mapping, key: str) -> str:
    value = root.get(key)
    return value.text if isinstance(value, Scalar) else ""


def _as_mapping(node: Node) -> Mapping:
    """Return the long form of a node: a list is a sequence, a word is a skill without arguments."""
    match node:
        case Mapping():
            return node
        case Sequence(span=span):
            return Mapping({LIST: Entry(Scalar(LIST, span), node)}, span)
        case Scalar(text=text, span=span):
            return Mapping({text: Entry(node, Scalar("", span))}, span)


class _Reader:
    """Numbers the nodes in the order of the text, and keeps where it is."""

    def __init__(self, report: Report) -> None:
        self.report = report
        self.nodes: list[program.Node | None] = []
        self.names: dict[str, Span] = {}
        self.paths: list[str] = []  # of the nodes that are being read, from the outside in

    def add(self, finding: Finding) -> None:
        """Keep a finding."""
        self.report.add(finding)

    def child(self, node: Node, step: str, parent: int | None) -> int:
        """Read a node and all below it, and return its number."""
        number = len(self.nodes)
        self.nodes.append(None)
        mapping = _as_mapping(node)
        if len(self.paths) == LEVELS:
            self.add(codes.TOO_DEEP.at(node.span, f"more than {LEVELS} levels of nodes"))
            mapping = Mapping(span=node.span)
            key, kind = "", None
        else:
            key, kind = find_key(mapping, self)
        name = self.name_of(mapping)
        self.paths.append(self.path_of(step, name or (kind.name if kind else key), bool(name)))
        self.nodes[number] = self.read(NodeReader(mapping, key, number, self), kind, parent, name)
        self.paths.pop()
        return number

    def path_of(self, step: str, word: str, is_name: bool) -> str:
        """Return the path of a node from the one around it; names stand alone, and `do` only at the beginning."""
        if not self.paths:
            return f"{step}.{word}"
        if step.isdigit():
            return f"{self.paths[-1]}.{word}" if is_name else f"{self.paths[-1]}.{word}.{step}"
        return f"{self.paths[-1]}.{word}" if step == "do" else f"{self.paths[-1]}.{step}.{word}"

    def read(self, reader: NodeReader, kind: Kind | None, parent: int | None, name: str) -> program.Node:
        """Read the value, the options and the modifiers of a node."""
        options = kind.task.read(reader) if kind else reader.arguments()
        modifiers = {key: cls.read(reader, key) for key, cls in MODIFIERS.items() if reader.has(key)}
        return program.Node(
            number=reader.number,
            kind=kind.name if kind else "",
            name=name,
            path=self.paths[-1],
            span=reader.span,
            parent=parent,
            children=tuple(reader.children),
            end=len(self.nodes),
            options=options,
            modifiers=modifiers,
            asked=tuple(reader.asked),
            item=reader.item,
            skill="" if kind else reader.key,
        )

    def name_of(self, mapping: Mapping) -> str:
        """Return the name of a node, if it has one; a name belongs to one node only."""
        value = mapping.get("name")
        if value is None:
            return ""
        if not isinstance(value, Scalar) or not NAME.fullmatch(value.text):
            self.add(codes.WRONG_SHAPE.at(value.span, "this is no name", help=NAME_HELP))
            return ""
        if value.text in kinds():
            self.add(codes.NAME_CLASH.at(value.span, f"a node cannot be named like the kind '{value.text}'"))
        elif value.text in self.names:
            related = [Related(self.names[value.text], "the first one")]
            self.add(codes.NAME_CLASH.at(value.span, f"two nodes are named '{value.text}'", related=related))
        self.names.setdefault(value.text, value.span)
        return value.text

    def interrupts(self, node: Node | None) -> tuple[Interrupt, ...]:
        """Read the interrupts in their order."""
        if node is None:
            return ()
        if not isinstance(node, Mapping):
            self.add(codes.WRONG_SHAPE.at(node.span, "'interrupts' needs a map from names to interrupts"))
            return ()
        read = (self.interrupt(name, entry) for name, entry in node.entries.items())
        return tuple(interrupt for interrupt in read if interrupt)

    def interrupt(self, name: str, entry: Entry) -> Interrupt | None:
        """Read `when`, `do` and `afterwards`."""
        value = entry.value
        if not NAME.fullmatch(name):
            self.add(codes.WRONG_SHAPE.at(entry.key.span, f"'{name}' is no name", help=NAME_HELP))
        if not isinstance(value, Mapping):
            self.add(codes.WRONG_SHAPE.at(value.span, f"the interrupt '{name}' needs 'when' and 'do'"))
            return None
        for key, unknown in value.entries.items():
            if key not in INTERRUPT_KEYS:
                message, what = f"unknown key '{key}' in the interrupt '{name}'", "keys of an interrupt"
                taken = value.entries
                self.add(codes.UNKNOWN_KEY.misspelt(unknown.key.span, message, key, INTERRUPT_KEYS, what, taken=taken))
        reader = NodeReader(value, "when", len(self.nodes), self)
        if "when" not in value:
            self.add(codes.MISSING.at(entry.key.span, f"the interrupt '{name}' needs 'when': a condition"))
        else:
            reader.condition("when")
        afterwards = reader.choice("afterwards", AFTERWARDS)
        reaction = value.get("do")
        root = None if reaction is None else self.child(reaction, f"interrupts.{name}", None)
        return Interrupt(name, reader.asked[0], root, afterwards, entry.key.span) if reader.asked else None

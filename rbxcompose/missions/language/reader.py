"""From the located tree of a mission file to its program; every error becomes a finding with its place."""

from collections import defaultdict
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cached_property

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression, ExpressionError
from rbxcompose.base.expressions.types import STRUCTURED, TYPES, UNKNOWN, Type, choice_of
from rbxcompose.base.findings import Finding, Related, Report, Span
from rbxcompose.manifest.arguments import CHOICE, unknown_type
from rbxcompose.manifest.documents import misspelt_keys, with_keys
from rbxcompose.manifest.tree import (
    Entry,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    all_nodes,
    at,
    count,
    entries_of,
    scalars,
    text_at,
)
from rbxcompose.missions import codes
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.language import literals
from rbxcompose.missions.language.grammar import BODIES, LEVELS, STATE_KEYS, is_reported, long_form
from rbxcompose.missions.language.node_reader import NAME, NAME_HELP, NodeReader, Nodes, invalid_name, unknown_keys
from rbxcompose.missions.program import program
from rbxcompose.missions.program.linker import TOO_MUCH
from rbxcompose.missions.program.parts import STATE, Asked, Datum, Input, expression_of
from rbxcompose.missions.program.program import AFTERWARDS, RATE, RESTART, Interrupt, Program, Target
from rbxcompose.missions.program.registry import SKILL, StepType, all_kinds, anywhere, kinds, modifier_keys, modifiers
from rbxcompose.missions.slips import Repairs

INPUT_KEYS = ("type", "default", "min", "max", "choices", "about")
FASTEST = 1000.0  # [Hz]


def read_inputs(node: TreeNode | None, report: Report) -> dict[str, Input]:
    """Return the inputs under `inputs:`; one whose type cannot be read may have any."""
    return {name: _input(name, entry, report) for name, entry in _named(node, "inputs", report).items()}


def read_rate(node: TreeNode | None, report: Report) -> float:
    """Return how often conditions are evaluated whose changes nothing announces [Hz]."""
    rate = _value(node, TYPES["frequency"], "'rate'", report) if node else None
    if not rate or not isinstance(rate.value, float):
        return RATE
    if not 0 < rate.value <= FASTEST:
        report.add(codes.WRONG_TYPE.at(rate.span, f"'rate' must be above 0 and at most {FASTEST:.0f} Hz"))
        return RATE
    return rate.value


def _named(node: TreeNode | None, section: str, report: Report) -> dict[str, Entry]:
    """Return the entries of a section whose names may be used in expressions."""
    if node is None or (isinstance(node, ScalarNode) and node.plain and not node.text):
        return {}
    if not isinstance(node, MappingNode):
        report.add(codes.WRONG_SHAPE.at(node.span, f"'{section}' needs names with their values below it"))
        return {}
    for name, entry in node.entries.items():
        if not NAME.fullmatch(name):
            report.add(invalid_name(entry.key))
        elif name in kinds():
            report.add(codes.NAME_CLASH.at(entry.key.span, f"'{name}' is a word of the language"))
    return node.entries


def _input(name: str, entry: Entry, report: Report) -> Input:
    value, place = entry.value, entry.key.span
    if not isinstance(value, MappingNode):
        message = f"the input '{name}' needs its 'type' below it"
        report.add(codes.WRONG_SHAPE.at(value.span, message, help="give 'type' and perhaps 'default'"))
        return Input(name, UNKNOWN, place, is_sound=False)
    report.extend(unknown_keys(value, INPUT_KEYS, f"the input '{name}'", "an input"))
    if (wanted := _type(name, value, entry, report)) is None:
        return Input(name, UNKNOWN, place, is_sound=False)
    default, least, most = (_value(value.get(key), wanted, f"'{key}'", report) for key in ("default", "min", "max"))
    if default and wanted.kind in STRUCTURED:
        wanted = default.type
    is_sound = value.entries.keys() <= {*INPUT_KEYS} and (default is not None or "default" not in value)
    read = Input(name, wanted, place, default, _number(least), _number(most), is_sound)
    if least and read.least is not None and read.most is not None and read.least > read.most:
        message = f"'min' of '{name}' is above its 'max' of {show(wanted, read.most)}: no value fits"
        report.add(codes.WRONG_TYPE.at(least.span, message, help="exchange them"))
        return replace(read, least=None, most=None)
    if default and (trouble := literals.range_trouble(read, default)):
        report.add(codes.WRONG_TYPE.at(default.span, f"the default of '{name}' {trouble}"))
    return read


def _type(name: str, value: MappingNode, entry: Entry, report: Report) -> Type | None:
    word = value.get("type")
    if not isinstance(word, ScalarNode):
        report.add(codes.MISSING.at(word.span if word else entry.key.span, f"the input '{name}' needs a 'type'"))
        return None
    if word.text == CHOICE:
        choices = value.get("choices")
        if isinstance(choices, SequenceNode) and choices.items:
            return choice_of(*(item.text for item in choices.items if isinstance(item, ScalarNode)))
        report.add(codes.MISSING.at(entry.key.span, f"the input '{name}' needs 'choices': a list of words"))
        return None
    if word.text not in TYPES:
        report.add(unknown_type(codes.NOT_A_CHOICE, word.span, word.text))
        return None
    return TYPES[word.text]


def _value(node: TreeNode | None, wanted: Type, what: str, report: Report) -> Datum | None:
    if node is None:
        return None
    try:
        return literals.typed(node, wanted)
    except literals.WrongValue as error:
        report.add(error.finding(codes.WRONG_TYPE, node.span, what))
        return None


def _number(datum: Datum | None) -> float | None:
    return datum.value if datum and isinstance(datum.value, float) else None


def _cure(step: MappingNode) -> str:
    """Return what to do with a step that has only settings, or nothing at all."""
    first = next(iter(step.entries), "")
    if not first:
        return "a step is a word such as 'sequence' or 'wait', or the name of a skill"
    value = step.entries[first].value
    shown = f" {value.text}" if isinstance(value, ScalarNode) and value.text else ""
    return f"'{first}' is a setting of a step: write '{first}:{shown}' without a dash, right below the word of its step"


def find_key(step: MappingNode, nodes: Nodes) -> tuple[str, StepType | None]:
    """Return the key of a step and its kind, None for a skill; if there is neither, an empty key, with a finding."""
    if is_reported(step):
        return "", None
    own = [key for key in step.entries if key not in anywhere()]
    key = next((key for key in own if key in kinds()), own[0] if own else "")
    if not own:
        nodes.add(codes.WRONG_SHAPE.at(step.span, "there is no step here", help=_cure(step)))
    elif not key.strip():
        nodes.add(codes.MISSING.at(step.entries[key].key.span, "a step is missing here"))
        return "", None
    return key, kinds().get(key)


MOST_HELD = 5_000  # values, names and operators of nodes in the data, counted for each `run` that may get them
MOST_WRITTEN = 30_000  # names and operators in all texts

_SHORT = 8  # characters of a text that is not worth counting, such as a number
_OPERATORS = ("$", "<", ">", "=", "+", "-", "*", "/", ",", ".", "(", "[", "'", '"', " and ", " or ", " in ", "not ")


@dataclass(slots=True)
class Budget:
    """What may still be read of the missions of one robot; below zero it is used up."""

    held: int = MOST_HELD
    written: int = MOST_WRITTEN

    def affords_held(self, node: TreeNode) -> bool:
        """Return whether a node in the data may be read once more, and count it."""
        if self.held >= 0:
            self.held -= count(node) + sum(map(operators, scalars(node)))
        return self.held >= 0

    def unaffordable(self, root: TreeNode) -> ScalarNode | None:
        """Count the texts of a mission; return the first that is too much."""
        for text in scalars(root):
            self.written -= operators(text)
            if self.written < 0:
                return text
        return None


def operators(scalar: ScalarNode) -> int:
    """Return about how many names and operators a text has: reading it as an expression takes as many steps."""
    text = scalar.text
    return 0 if len(text) <= _SHORT else sum(map(text.count, _OPERATORS))


KEYS = ("rbx", "kind", "name", "about", "inputs", "data", "outputs", "interrupts", "rate", *BODIES)
INTERRUPT_KEYS = ("when", "do", "afterwards")


def read_program(
    root: MappingNode, report: Report, skills: Collection[str] = (), budget: Budget | None = None
) -> Program | None:
    """Return the program of a mission file, None if it has no body; `skills` are the robot's, if known.

    `budget` is shared by the missions of a robot.
    Parts that could not be read are missing from the program, so that the rest can be checked; it may run only if the
    report has no errors.
    """
    budget = budget or Budget()
    if _is_too_much(root, budget, report):
        return None
    repairs = Repairs.of(report, skills)
    whole, root = root, repairs.mission(root)
    report.extend(unknown_keys(root, KEYS, "a mission"))
    is_open = _is_open(root)
    root = with_keys(root, misspelt_keys(root, KEYS))
    inputs, written = read_inputs(root.get("inputs"), report), _named(root.get("data"), "data", report)
    reader = _Reader(report, root, repairs, budget)
    body = _body(root, report)
    if body is None:
        reader.interrupts(root.get("interrupts"))
        return None
    reader.child(body, "do" if "do" in root else "", None)
    interrupts = reader.interrupts(root.get("interrupts"))
    nodes = tuple(node for node in reader.nodes if node)
    data = {
        name: replace(literals.literal(entry.value, reader.found, (name,)), span=entry.key.span)
        for name, entry in written.items()
    }
    return Program(
        _text(root, "name"),
        _text(root, "about"),
        root.span.file,
        nodes,
        inputs,
        data,
        interrupts,
        read_rate(root.get("rate"), report),
        reader.outputs(root.get("outputs")),
        root=whole,
        is_open=is_open or any(node.step.items is not None and not node.item for node in nodes),
    )


def _is_open(root: MappingNode) -> bool:
    """Return whether a mission may have names that could not be read."""
    named = (root.get(key) for key in ("inputs", "data"))
    unread = any(isinstance(node, SequenceNode) or (isinstance(node, ScalarNode) and node.text) for node in named)
    meant = misspelt_keys(root, KEYS)
    others = (entry.value for name, entry in root.entries.items() if name not in KEYS and name not in meant)
    return unread or any(isinstance(node, MappingNode) for node in others)


def _is_too_much(root: MappingNode, budget: Budget, report: Report) -> bool:
    """Return whether a mission has more text than may still be read; the first one is a finding."""
    was_left = budget.written >= 0
    found = budget.unaffordable(root)
    if found and was_left:
        message = f"the texts of this robot's missions have more than {MOST_WRITTEN:,} names and operators together"
        report.add(TOO_MUCH.at(found.span, message))
    return found is not None


def _body(root: MappingNode, report: Report) -> TreeNode | None:
    """Return the body of a mission: the node under `do`, or a machine."""
    bodies = [key for key in BODIES if root.get(key) is not None]
    if not bodies:
        report.add(codes.MISSING.at(root.span, "a mission needs 'do' (or 'machine'): what to do"))
        return None
    if len(bodies) == len(BODIES):
        span = root.entries["machine"].key.span
        report.add(codes.WRONG_SHAPE.at(span, "a mission has 'do' or 'machine', not both"))
    if bodies[0] == "do":
        return root.get("do")
    entry = root.entries["machine"]
    return MappingNode({"machine": entry}, entry.key.span)


def _text(root: MappingNode, key: str) -> str:
    value = root.get(key)
    return value.text if isinstance(value, ScalarNode) else ""


class _Reader:
    """Numbers the nodes in the order of the text, and keeps track of its position."""

    def __init__(self, report: Report, root: MappingNode, repairs: Repairs, budget: Budget) -> None:
        self.report = report
        self.root = root
        self.repairs = repairs
        self.budget = budget
        data = root.get("data")
        self.data = {name: entry.value for name, entry in data.entries.items()} if isinstance(data, MappingNode) else {}
        self.patterns: dict[str, literals.PathPattern] = {}  # where in the data the items of loops are
        self.found: set[literals.NodeKey] = set()  # the nodes in the data
        self.nodes: list[program.MissionNode | None] = []
        self.names: dict[str, Span] = {}
        self.paths: list[str] = []  # of the nodes being read, outermost first

    def add(self, finding: Finding) -> None:
        """Keep a finding."""
        self.report.add(finding)

    def child(self, node: TreeNode, step: str, parent: int | None) -> int:
        """Read a node and all below it, and return its number."""
        number = len(self.nodes)
        self.nodes.append(None)
        mapping = long_form(node)
        if len(self.paths) == LEVELS:
            self.add(codes.TOO_DEEP.at(node.span, f"more than {LEVELS} levels of steps"))
            mapping = MappingNode(span=node.span)
            key, kind = "", None
        else:
            key, kind = find_key(mapping, self)
        name = self.name_of(mapping)
        self.paths.append(self.path_of(step, name or (kind.name if kind else key), bool(name)))
        self.nodes[number] = self.read(NodeReader(mapping, key, number, self), kind, parent, name)
        self.paths.pop()
        return number

    def state(self, name: str, entry: Entry, parent: int) -> int:
        """Read a state of a machine, and return its number."""
        number = len(self.nodes)
        self.nodes.append(None)
        mapping = as_state(entry)
        if mapping is not entry.value:
            self.add(codes.WRONG_SHAPE.at(entry.key.span, f"the state '{name}' needs 'do' and 'next'"))
        self.paths.append(f"{self.paths[-1]}.{name}")
        state = all_kinds()[STATE]
        self.nodes[number] = self.read(NodeReader(mapping, name, number, self), state, parent, name, entry.key.span)
        self.report.extend(unknown_keys(mapping, (*STATE_KEYS, *modifier_keys()), f"the state '{name}'", "a state"))
        self.paths.pop()
        return number

    def loop(self, item: str, expression: Expression) -> None:
        """Note where in the data the item of a loop is."""
        pattern = literals.pattern_of(expression, self.patterns)
        if pattern:
            self.patterns[item] = (*pattern, literals.ITEM)

    def held(self, expression: Expression, parent: int, span: Span) -> list[int]:
        """Read the nodes in the data that an expression may yield."""
        numbers: list[int] = []
        for key, node in self.yielded(expression).items():
            if not self.affords(node, span):
                break
            self.found.add(key)
            number = self.child(self.repairs.step(node, len(self.paths)), ".".join(key), parent)
            read = self.nodes[number]
            if read:
                self.nodes[number] = replace(read, held=key)
            numbers.append(number)
        return numbers

    def yielded(self, expression: Expression) -> dict[literals.NodeKey, TreeNode]:
        """Return what an expression may yield of the data, by key: what is written there, or put there by `set`."""
        pattern = literals.pattern_of(expression, self.patterns)
        patterns, sources = [pattern] if pattern else [], dict(self.sources)
        found: dict[literals.NodeKey, TreeNode] = {}
        for first, *rest in patterns:
            found.update(literals.matching(self.data, (first, *rest)))
            patterns += [(*source, *rest) for source in sources.pop(first or "", ())]
        return found

    @cached_property
    def sources(self) -> Mapping[str, list[literals.PathPattern]]:
        """Return where in the data the values come from that `set` and loops anywhere give to each name."""
        found: defaultdict[str, list[literals.PathPattern]] = defaultdict(list)
        for node in all_nodes(self.root):
            given = [(name, entry.value) for name, entry in entries_of(at(node, ("set",))).items()]
            item, listed = text_at(node, ("for",)), at(node, ("in",))
            given += [(item, each) for each in (listed.items if isinstance(listed, SequenceNode) else [listed]) if each]
            for name, value in given:
                with suppress(ExpressionError):
                    expression = expression_of(value) if isinstance(value, ScalarNode) else None
                    if expression and (pattern := literals.pattern_of(expression, {})):
                        found[name].append((*pattern, literals.ITEM) if value is listed else pattern)
        return found

    def affords(self, node: TreeNode, span: Span) -> bool:
        """Return whether a node in the data may be read once more; the first that may not is a finding."""
        was_left = self.budget.held >= 0
        if self.budget.affords_held(node):
            return True
        if was_left:
            message = f"the nodes that each 'run' may get have more than {MOST_HELD:,} values and operators together"
            self.add(TOO_MUCH.at(span, message, help="write 'run' once, in a mission of its own, or hold fewer nodes"))
        return False

    def outputs(self, node: TreeNode | None) -> dict[str, Asked]:
        """Read the outputs: a map from names to expressions."""
        if node is None:
            return {}
        if not isinstance(node, MappingNode):
            self.add(codes.WRONG_SHAPE.at(node.span, "'outputs' needs names with their values below it"))
            return {}
        reader = NodeReader(node, "outputs", len(self.nodes), self)
        read: dict[str, Asked] = {}
        for name, entry in node.entries.items():
            reader.check_name(entry.key)
            before = len(reader.asked)
            reader.expression(name, UNKNOWN, "a value")
            read.update((name, asked) for asked in reader.asked[before:])
        return read

    def path_of(self, step: str, word: str, is_name: bool) -> str:
        """Return the path of a node below the one around it; named items have no index, and `do` only comes first."""
        if not self.paths:
            return f"{step}.{word}" if step else word
        if step.isdigit():
            return f"{self.paths[-1]}.{word}" if is_name else f"{self.paths[-1]}.{word}.{step}"
        return f"{self.paths[-1]}.{word}" if step in ("do", word) else f"{self.paths[-1]}.{step}.{word}"

    def read(
        self, reader: NodeReader, kind: StepType | None, parent: int | None, name: str, span: Span | None = None
    ) -> program.MissionNode:
        """Read the value, the options and the modifiers of a node."""
        step = (kind or all_kinds()[SKILL]).read(reader)
        own, read = len(reader.asked), {}
        is_state = kind is not None and kind.is_inner
        written = reader.mapping.entries.keys()
        for key, cls in modifiers().items():
            if not written.isdisjoint(cls.fields) and (is_state or not cls.only_states):
                read[key] = cls.read(reader)
        return program.MissionNode(
            number=reader.number,
            step=step,
            name=name,
            path=self.paths[-1],
            span=span or reader.span,
            parent=parent,
            children=tuple(reader.children),
            end=len(self.nodes),
            modifiers=read,
            asked=tuple(reader.asked),
            own=own,
            item=reader.item,
        )

    def name_of(self, mapping: MappingNode) -> str:
        """Return the name of a node, if it has one; a name belongs to one node only."""
        value = mapping.get("name")
        if value is None:
            return ""
        if not isinstance(value, ScalarNode):
            self.add(codes.WRONG_SHAPE.at(value.span, "this is not a name", help=NAME_HELP))
            return ""
        if not NAME.fullmatch(value.text):
            self.add(invalid_name(value))
            return ""
        if value.text in kinds():
            self.add(
                codes.NAME_CLASH.at(
                    value.span, f"a step cannot be named '{value.text}': that is a word of the language"
                )
            )
        elif value.text in self.names:
            related = [Related(self.names[value.text], "the first one")]
            self.add(codes.NAME_CLASH.at(value.span, f"two steps are named '{value.text}'", related=related))
        self.names.setdefault(value.text, value.span)
        return value.text

    def interrupts(self, node: TreeNode | None) -> tuple[Interrupt, ...]:
        """Read the interrupts in their order."""
        if node is None:
            return ()
        if not isinstance(node, MappingNode):
            help_text = "give each a name instead of its dash: 'NAME: {when: ..., do: ...}'"
            message = "'interrupts' needs names below it, each with 'when' and 'do'"
            self.add(codes.WRONG_SHAPE.at(node.span, message, help=help_text))
            return ()
        read = [self.interrupt(name, entry) for name, entry in node.entries.items()]
        # A restart may name a node in the reaction of a later interrupt, which it may cut short: all are read by now.
        targets = self.targets()
        return tuple(
            replace(interrupt, targets=targets.get(interrupt.restarts.text, ()) if interrupt.restarts else ())
            for interrupt in read
            if interrupt
        )

    def interrupt(self, name: str, entry: Entry) -> Interrupt | None:
        """Read `when`, `do` and `afterwards`."""
        value = entry.value
        if not NAME.fullmatch(name):
            self.add(invalid_name(entry.key))
        if not isinstance(value, MappingNode):
            self.add(codes.WRONG_SHAPE.at(value.span, f"the interrupt '{name}' needs 'when' and 'do'"))
            return None
        self.report.extend(unknown_keys(value, INTERRUPT_KEYS, f"the interrupt '{name}'", "an interrupt"))
        reader = NodeReader(value, "when", len(self.nodes), self)
        if "when" not in value:
            self.add(codes.MISSING.at(entry.key.span, f"the interrupt '{name}' needs 'when': a condition"))
        else:
            reader.watched("when")
        afterwards, restarts = self.afterwards(reader)
        reaction = value.get("do")
        root = None if reaction is None else self.child(reaction, f"interrupts.{name}", None)
        if not reader.asked:
            return None
        return Interrupt(name, reader.asked[0], root, afterwards, entry.key.span, restarts)

    def afterwards(self, reader: NodeReader) -> tuple[str, ScalarNode | None]:
        """Read what follows a reaction: a word, or `restart` with the name of what starts again."""
        value = reader.mapping.get("afterwards")
        if not isinstance(value, MappingNode):
            return reader.choice("afterwards", AFTERWARDS), None
        inner = reader.inside(value, (RESTART,), "'afterwards'")
        return RESTART, inner.scalar(RESTART, "the name of a step, a state or a loop's item")

    def targets(self) -> dict[str, tuple[Target, ...]]:
        """Return all nodes, states and loops over an item by their names."""
        found: dict[str, list[Target]] = {}
        for node in (node for node in self.nodes if node):
            for name in dict.fromkeys((node.name, node.item)):
                found.setdefault(name, []).append(Target(node.number, node.item == name))
        return {name: tuple(targets) for name, targets in found.items() if name}


def as_state(entry: Entry) -> MappingNode:
    """Return the mapping of a state, even if it was written wrongly."""
    return entry.value if isinstance(entry.value, MappingNode) else MappingNode({}, entry.key.span)

"""The parts of a mission besides its nodes: its inputs, its data, its rate."""

from dataclasses import replace

from rbxcompose.base.expressions.types import TYPES, UNKNOWN, Type, TypeKind, choice_of
from rbxcompose.base.findings import Report
from rbxcompose.manifest.arguments import CHOICE, unknown_type
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.engine.value_text import show
from rbxcompose.missions.language.literals import WrongValue, literal, typed
from rbxcompose.missions.language.value_reader import NAME, invalid_name
from rbxcompose.missions.program.machines import Datum, Input
from rbxcompose.missions.program.program import RATE
from rbxcompose.missions.program.registry import kinds

INPUT_KEYS = ("type", "default", "min", "max", "choices", "about")
FASTEST = 1000.0  # [Hz]


def read_data(node: TreeNode | None, report: Report) -> dict[str, Datum]:
    """Return the initial values under `data:`."""
    entries = _named(node, "data", report)
    return {name: replace(literal(entry.value), span=entry.key.span) for name, entry in entries.items()}


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
    for key, unknown in value.entries.items():
        if key not in INPUT_KEYS:
            message, taken = f"unknown key '{key}' in the input '{name}'", value.entries
            report.add(
                codes.UNKNOWN_KEY.misspelt(unknown.key.span, message, key, INPUT_KEYS, "keys of an input", taken=taken)
            )
    if (wanted := _type(name, value, entry, report)) is None:
        return Input(name, UNKNOWN, place, is_sound=False)
    default, least, most = (_value(value.get(key), wanted, f"'{key}'", report) for key in ("default", "min", "max"))
    if default and wanted.kind in (TypeKind.LIST, TypeKind.MAP):
        wanted = default.type
    is_sound = value.entries.keys() <= {*INPUT_KEYS} and (default is not None or "default" not in value)
    read = Input(name, wanted, place, default, _number(least), _number(most), is_sound)
    if least and read.least is not None and read.most is not None and read.least > read.most:
        message = f"'min' of '{name}' is above its 'max' of {show(wanted, read.most)}: no value fits"
        report.add(codes.WRONG_TYPE.at(least.span, message, help="exchange them"))
        return replace(read, least=None, most=None)
    if default and (trouble := range_trouble(read, default)):
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
        return typed(node, wanted)
    except WrongValue as error:
        report.add(codes.WRONG_TYPE.at(node.span, f"{what} {error.message}", label=error.label, help=error.help))
        return None


def _number(datum: Datum | None) -> float | None:
    return datum.value if datum and isinstance(datum.value, float) else None


def range_trouble(declared: Input, given: Datum) -> str:
    """Return why a value is out of the range of its input, as words that follow its name; else nothing."""
    value = given.value
    if not isinstance(value, float):
        return ""
    if declared.least is not None and value < declared.least:
        return f"is below its 'min' of {show(declared.type, declared.least)}: {show(declared.type, value)}"
    if declared.most is not None and value > declared.most:
        return f"is above its 'max' of {show(declared.type, declared.most)}: {show(declared.type, value)}"
    return ""

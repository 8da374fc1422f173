"""Reads machines and states."""

from collections.abc import Mapping

from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode
from rbxcompose.missions import codes
from rbxcompose.missions.engine.resume_points import HISTORIES
from rbxcompose.missions.language.grammar import is_reported
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.language.value_reader import WORDS
from rbxcompose.missions.program.machines import ENDS, FINISHED, MACHINE_KEYS, MachineStates, Next
from rbxcompose.missions.program.outcomes import FAILURE, NAMES, SUCCESS

BODIES = ("do", "machine")
STATE_KEYS = (*BODIES, "on_enter", "on_exit", "next")
RESULTS = (NAMES[SUCCESS], NAMES[FAILURE])


def read_machine(reader: NodeReader, key: str) -> MachineStates:
    """Read the map below `machine`: the start state, the states and ends, and the history."""
    value = reader.map_of(key, "'start' and 'states' below it")
    if value is None:
        return MachineStates()
    inner = reader.inside(value, MACHINE_KEYS, "a machine")
    states = value.get("states")
    names: tuple[str, ...] = ()
    if isinstance(states, MappingNode) and states.entries:
        names = tuple(states.entries)
        for name, entry in states.entries.items():
            if name in ENDS:
                message = f"a state cannot be named '{name}': that is an end of every machine"
                reader.add(codes.NAME_CLASH.at(entry.key.span, message, help="give the state another name"))
            reader.state(name, entry)
    else:
        span = inner.key_span("states") if "states" in value else reader.span
        reader.add(
            codes.MISSING.at(
                span, "a machine needs 'states': the names of its states below it, each with 'do' and 'next'"
            )
        )
    ends = _ends(inner, names)
    start = inner.scalar("start", "the name of a state") if "start" in value else None
    if "start" not in value:
        reader.add(codes.MISSING.at(reader.span, "a machine needs 'start': the state in which it starts"))
    history = inner.choice("history", HISTORIES)
    return MachineStates(start.text if start else "", names, ends, start.span if start else None, history)


def _ends(inner: NodeReader, states: tuple[str, ...]) -> Mapping[str, str]:
    """Read the ends and what each counts as; `finished` and `failed` always exist."""
    value = inner.mapping.get("ends")
    if value is None:
        return ENDS
    if not isinstance(value, MappingNode):
        inner.add(codes.WRONG_SHAPE.at(value.span, "'ends' needs names below it, such as 'lost: failure'"))
        return ENDS
    read = dict(ENDS)
    for name, entry in value.entries.items():
        inner.check_name(entry.key)
        if name in ENDS:
            inner.add(codes.NAME_CLASH.at(entry.key.span, f"the end '{name}' already exists"))
        elif name in states or name in RESULTS:
            inner.add(codes.NAME_CLASH.at(entry.key.span, f"an end cannot be named '{name}': that has another meaning"))
        word = entry.value.text if isinstance(entry.value, ScalarNode) else ""
        if word not in RESULTS:
            message = f"the end '{name}' must count as 'success' or 'failure'"
            inner.add(codes.NOT_A_CHOICE.misspelt(entry.value.span, message, word, RESULTS, WORDS))
        read[name] = word if word in RESULTS else RESULTS[1]
    return read


def read_state(reader: NodeReader) -> Next | None:
    """Read the body of a state and return its transitions."""
    bodies = [key for key in BODIES if reader.has(key)]
    if len(bodies) == len(BODIES):
        reader.add(codes.WRONG_SHAPE.at(reader.key_span("machine"), "a state has 'do' or 'machine', not both"))
    if not bodies:
        reader.add(codes.MISSING.at(reader.span, "a state needs 'do' (or 'machine'): what is done in it"))
    elif bodies[0] == "do":
        reader.child("do")
    else:
        entry = reader.mapping.entries["machine"]
        reader.child_node(MappingNode({"machine": entry}, entry.key.span), "machine")
    return _next(reader)


def _next(reader: NodeReader) -> Next | None:
    value = reader.mapping.get("next")
    if value is None:
        return None
    if is_reported(value):
        # So that there are no further findings on its transitions.
        return Next({**dict(zip(RESULTS, ENDS, strict=True)), "": FINISHED})
    if isinstance(value, ScalarNode) and value.text:
        return Next({"": value.text}, {"": value.span})
    if not isinstance(value, MappingNode) or not value.entries:
        reader.add(
            codes.WRONG_SHAPE.at(
                reader.key_span("next"),
                "'next' needs a state, or below it outcomes with states, such as 'success: finished'",
            )
        )
        return Next()
    to: dict[str, str] = {}
    spans: dict[str, Span] = {}
    for outcome, entry in value.entries.items():
        if isinstance(entry.value, ScalarNode) and entry.value.text:
            to[outcome], spans[outcome] = entry.value.text, entry.value.span
        else:
            reader.add(codes.WRONG_SHAPE.at(entry.key.span, f"the outcome '{outcome}' needs the name of a state"))
    return Next(to, spans, {outcome: entry.key.span for outcome, entry in value.entries.items()})


def as_state(entry: Entry) -> MappingNode:
    """Return the mapping of a state, even if it was written wrongly."""
    return entry.value if isinstance(entry.value, MappingNode) else MappingNode({}, entry.key.span)

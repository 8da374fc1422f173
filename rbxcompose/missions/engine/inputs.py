"""What a mission is started with: values for its inputs, and states that it begins in."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.types import PLACED
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Finding, Span
from rbxcompose.manifest.tree import NOWHERE, Entry, ScalarNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.literals import WrongValue, range_trouble, typed
from rbxcompose.missions.program.parts import Datum, Input
from rbxcompose.missions.program.program import MissionNode, Program


class NoSuchState(LookupError):  # noqa: N818 - shown to whoever names the state
    """Raised with the reason and the existing states."""


def start_at(program: Program, path: str) -> dict[int, str]:
    """Return the initial states of machines, by node number, for a path such as `outer.inner`.

    Each step names a state of a machine; the next step one of a machine inside that state. `program` is linked.

    Raises:
        NoSuchState: if a part names no state.
    """
    found: dict[int, str] = {}
    below = program.main
    for name in path.split("."):
        machines = list(_outermost(program, below))
        if not machines:
            raise NoSuchState(f"'{path}': there is no machine in which '{name}' could be a state")
        matching = [node for node in machines if name in _states(node)]
        if not matching:
            states = ", ".join(state for node in machines for state in _states(node))
            raise NoSuchState(f"there is no state '{name}'; states are {states}")
        machine = matching[0]
        found[machine.number] = name
        below = machine.children[_states(machine).index(name)]
    return found


def _states(machine: MissionNode) -> tuple[str, ...]:
    return machine.step.states.names if machine.step.states else ()


def _outermost(program: Program, number: int) -> Iterator[MissionNode]:
    """Yield the machines of a node and below it, except those inside other machines."""
    node = program.nodes[number]
    if node.step.states:
        yield node
        return
    for child in node.children:
        yield from _outermost(program, child)


def bind_texts(
    program: Program, given: Mapping[str, str], known: Mapping[str, Value], places: Mapping[str, Place]
) -> tuple[dict[str, Value], list[Finding]]:
    """Return the values of all inputs, the `known` ones overridden by those given as text, and the findings."""
    entries = {name: Entry(ScalarNode(name, NOWHERE), ScalarNode(text, NOWHERE)) for name, text in given.items()}
    asked = {name: input_ for name, input_ in program.inputs.items() if name in given or name not in known}
    values, findings = bind_inputs(replace(program, inputs=asked), entries, places, NOWHERE)
    return {**known, **values}, findings


def bind_inputs(
    program: Program,
    given: Mapping[str, Entry],
    places: Mapping[str, Place],
    span: Span,
    removed: Mapping[str, Span] = MappingProxyType({}),
    *,
    is_begun: bool = True,
) -> tuple[dict[str, Value], list[Finding]]:
    """Return the values of all inputs by name, and the findings about them.

    `given` are the entries below `with:`, `span` is that of the robot's entry for the mission. `removed` are removed
    places, each with what removed it. Unless `is_begun`, inputs may be missing: they come later, from the `with:` of
    a `use` or from whoever starts the mission.
    """
    findings: list[Finding] = []
    for name, entry in given.items():
        if name not in program.inputs:
            message = f"the mission '{program.name}' has no input '{name}'"
            findings.append(
                codes.WRONG_INPUT.misspelt(entry.key.span, message, name, program.inputs, "its inputs", taken=given)
            )
    values = {}
    for name, declared in program.inputs.items():
        datum = _given(declared, given[name], findings) if name in given else declared.default
        if datum is None and name not in given:
            if not is_begun or not declared.must_be_given or given.keys() - program.inputs.keys():
                continue  # the missing input may be the misspelt one
            message = f"the input '{name}' of the mission '{program.name}' needs a value"
            findings.append(codes.WRONG_INPUT.at(span, message, help=f"write it under 'with': '{name}: ...'"))
        elif datum is not None:
            values[name] = _placed(datum, places, removed, findings)
    return values, findings


def _given(declared: Input, entry: Entry, findings: list[Finding]) -> Datum | None:
    span = entry.value.span
    try:
        datum = typed(entry.value, declared.type)
    except WrongValue as error:
        findings.append(error.finding(codes.WRONG_INPUT, span, f"the input '{declared.name}'"))
        return None
    if trouble := range_trouble(declared, datum):
        findings.append(codes.WRONG_INPUT.at(span, f"the input '{declared.name}' {trouble}"))
    return datum


def _placed(datum: Datum, places: Mapping[str, Place], removed: Mapping[str, Span], findings: list[Finding]) -> Value:
    """Return the value; for the name of a place, return the place itself."""
    if datum.type.kind not in PLACED:
        return datum.value
    name = str(datum.value)
    if name in removed:
        findings.append(codes.removed_place(datum.span, name, removed[name]))
        return name
    if name not in places:
        message = f"there is no place '{name}'"
        findings.append(codes.UNKNOWN_PLACE.misspelt(datum.span, message, name, places, "places of this robot"))
        return name
    return places[name]

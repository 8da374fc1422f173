"""Values for the inputs of a mission, from `with:` or `--set`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from rbxcompose.config import Place
from rbxcompose.expressions.types import TypeKind
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Finding, Span
from rbxcompose.manifest.tree import NOWHERE, Entry, ScalarNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.header import range_trouble
from rbxcompose.missions.language.literals import WrongValue, typed
from rbxcompose.missions.program.data import Datum, Input
from rbxcompose.missions.program.program import Program


def bind_texts(
    program: Program, given: Mapping[str, str], known: Mapping[str, Value], places: Mapping[str, Place]
) -> tuple[dict[str, Value], list[Finding]]:
    """Return the values of all inputs, the `known` ones overridden by those given as text, and the findings."""
    entries = {name: Entry(ScalarNode(name, NOWHERE), ScalarNode(text, NOWHERE)) for name, text in given.items()}
    asked = {name: one for name, one in program.inputs.items() if name in given or name not in known}
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
        message = f"the input '{declared.name}' {error.message}"
        findings.append(codes.WRONG_INPUT.at(span, message, label=error.label, help=error.help))
        return None
    if trouble := range_trouble(declared, datum):
        findings.append(codes.WRONG_INPUT.at(span, f"the input '{declared.name}' {trouble}"))
    return datum


def _placed(datum: Datum, places: Mapping[str, Place], removed: Mapping[str, Span], findings: list[Finding]) -> Value:
    """Return the value; for the name of a place, return the place itself."""
    if datum.type.kind not in (TypeKind.PLACE, TypeKind.POSE):
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

"""What people see and ask for while they debug missions, with the names they use, as interventions in a run."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping

from rbxcompose.base.expressions.types import FLAG, PLACE, TEXT, UNKNOWN, Type
from rbxcompose.base.expressions.values import Value, is_named_pose
from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.requests import Refused
from rbxcompose.base.units import format_number, format_quantity
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import NOWHERE, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions.analysis.examined import Ending
from rbxcompose.missions.analysis.facts import places_taken, texts_in
from rbxcompose.missions.engine.debugger import named
from rbxcompose.missions.engine.interventions import (
    ARROW,
    ChangeData,
    ForceResult,
    JumpToState,
    NodeAddress,
    NotPossible,
    OtherFileError,
    SetBreakpoints,
    find,
    is_line,
    is_number,
)
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.mission_run import MissionRun
from rbxcompose.missions.execution.requests import ListedBreakpoint, ListedDatum, OutcomesByNode, SetBreakpoint
from rbxcompose.missions.language.literals import WrongValue, typed
from rbxcompose.missions.program.counterparts import Pairing
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.program.outcomes import SUCCEEDS
from rbxcompose.missions.program.parts import Form
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames


class Breakpoints:
    """The breakpoints of a robot, by mission and by how they were written; they stay while missions come and go."""

    def __init__(self, equipment: MissionConfig) -> None:
        self._equipment = equipment
        self._set: dict[str, dict[str, tuple[NodeAddress, ...]]] = {}

    def of(self, mission: str) -> SetBreakpoints:
        """Return where a mission stops."""
        spots = [spot for found in self._set.get(mission, {}).values() for spot in found]
        ends = ((spot.node, spot.outcome) for spot in spots if spot.outcome is not None)
        return SetBreakpoints(tuple(spot.node for spot in spots if spot.outcome is None), tuple(ends))

    @property
    def requests(self) -> tuple[SetBreakpoint, ...]:
        """Return the requests that set them again."""
        return tuple(SetBreakpoint(where, mission) for mission, found in self._set.items() for where in found)

    def listed(self) -> tuple[ListedBreakpoint, ...]:
        """Return all of them."""
        return tuple(
            ListedBreakpoint(
                *(mission, where, spots[0].span.place, self._text(mission, spots[0])),
                spots=tuple((spot.node, spot.outcome) for spot in spots),
            )
            for mission, found in self._set.items()
            for where, spots in found.items()
        )

    def add(self, where: str, mission: str, active: list[str]) -> tuple[str, ...]:
        """Set a breakpoint in this mission, else in that which has such a place; return the missions that have it now.

        Raises:
            Refused: if there is no such place, or several missions have one; of these, an `active` one is meant.
        """
        programs = self._equipment.programs
        if mission and mission not in programs:
            raise Refused(clauses(f"the robot has no mission '{mission}'", suggest(mission, programs, "its missions")))
        if is_number(where) and not mission:
            if len(active) != 1:
                raise Refused(f"node {where} of which mission? Add '--mission NAME'")
            mission = active[0]
        found: dict[str, tuple[NodeAddress, ...]] = {}
        reasons: dict[str, NotPossible] = {}
        for name in [mission] if mission else programs:
            try:
                found[name] = find(self.linked(name), where)
            except NotPossible as error:
                reasons[name] = error
        if not found:
            raise Refused(_why([reasons[name] for name in (*active, *reasons) if name in reasons]))
        if len(found) > 1 and not is_line(where):
            found = {name: spots for name, spots in found.items() if name in active} or found
            if len({spots[0].span for spots in found.values()}) > 1:
                raise Refused(f"several missions have '{where}': {', '.join(found)}; add '--mission NAME'")
        for name, spots in found.items():
            self._set.setdefault(name, {})[where] = spots
        return tuple(found)

    def clear(self, where: str, mission: str) -> tuple[str, ...]:
        """Clear a breakpoint, or all; return the missions that had it.

        Raises:
            Refused: if there is none.
        """
        had = [
            (name, written)
            for name, found in self._set.items()
            for written, spots in found.items()
            if mission in ("", name) and where in ("", written, spots[0].span.place)
        ]
        if not had:
            known = [written for found in self._set.values() for written in found]
            at = f" at '{where}'" if where else ""
            raise Refused(clauses(f"there is no breakpoint{at}", suggest(where, known, "breakpoints")))
        for name, written in had:
            del self._set[name][written]
        return tuple(dict.fromkeys(name for name, _ in had))

    def take_over(self, old: Breakpoints) -> tuple[str, ...]:
        """Have those of another executive, which this one replaces; return those that are gone."""
        equipment, self._equipment, self._set = self._equipment, old._equipment, old._set
        return self.follow(equipment)

    def follow(self, equipment: MissionConfig) -> tuple[str, ...]:
        """Stay at the same nodes of changed missions; return those that are gone, as they were written."""
        gone = []
        before, self._equipment = {mission: self.linked(mission) for mission in self._set}, equipment
        for mission, old in before.items():
            found, self._set[mission] = self._set[mission], {}
            new = self.linked(mission) if mission in equipment.programs else None
            after = Pairing(old, new).after if new else {}
            for where, spots in found.items():
                moved = tuple(_moved(spots, new, after)) if new else ()
                if new and moved:
                    self._set[mission][_written(where, new, moved)] = moved
                else:
                    gone.append(f"{mission}: {where}")
        return tuple(gone)

    def linked(self, mission: str) -> Program:
        """Return a mission with those that it uses."""
        return link(self._equipment.programs[mission], self._equipment.names.missions)

    def _text(self, mission: str, spot: NodeAddress) -> str:
        node = self.linked(mission).nodes[spot.node]
        leads = node.step.leads_to
        return named(node) if spot.outcome is None or not leads else f"{node.name}{ARROW}{leads.to[spot.outcome]}"


def _why(reasons: list[NotPossible]) -> str:
    """Return why none of some missions has a place: the first reason of one that has nodes in its file, if one has."""
    others = [reason for reason in reasons if isinstance(reason, OtherFileError)]
    own = [str(reason) for reason in reasons if reason not in others]
    if own or not others:
        return own[0] if own else "no missions"
    return str(OtherFileError(others[0].file, (file for other in others for file in other.files)))


def forced(run: MissionRun, where: str, outcome: str) -> ForceResult:
    """Return the intervention that lets a running node end with an outcome.

    Raises:
        NotPossible: if no such node runs, several do, or it cannot end so.
    """
    program = run.engine.program
    node = _one(run, [program.nodes[spot.node] for spot in find(program, where)], f"'{where}' does not run now")
    words = Ending(program, run.engine.robot).of(node.number).words
    if outcome not in words:
        help_text = suggest(outcome, words, "it may end in")
        raise NotPossible(clauses(f"{named(node)} at {node.span.place} cannot end in '{outcome}'", help_text))
    return ForceResult(node.number, words[outcome] == SUCCEEDS, "" if outcome == words[outcome] else outcome)


def jump(run: MissionRun, where: str) -> JumpToState:
    """Return the intervention that brings a machine that runs into a state.

    Raises:
        NotPossible: if no machine runs, or none that runs has this state, or several have it.
    """
    nodes, live = run.engine.program.nodes, run.engine.debugger.live()
    machines = [nodes[number] for number in sorted(live) if nodes[number].step.states]
    if not machines:
        raise NotPossible("no machine runs now, so there is no state to leave")
    if is_line(where) or is_number(where):
        meant = {spot.node for spot in find(run.engine.program, where)}
    else:
        meant = {child for machine in machines for child in machine.children if nodes[child].name == where}
    states = [nodes[number] for number in meant if nodes[number].step.look.form is Form.STATE]
    if not states:
        names = [nodes[child].name for machine in machines for child in machine.children]
        raise NotPossible(clauses(f"there is no state '{where}'", suggest(where, names, "states")))
    parents = [nodes[state.parent] for state in states if state.parent is not None]
    machine = _one(run, parents, f"the machine of '{where}' does not run now")
    return JumpToState(machine.number, next(state.name for state in states if state.parent == machine.number))


def _moved(spots: Iterable[NodeAddress], program: Program, after: Mapping[int, int]) -> Iterator[NodeAddress]:
    """Yield those spots that are still there in a changed mission."""
    for spot in spots:
        if spot.node not in after:
            continue
        node = program.nodes[after[spot.node]]
        transitions = node.step.leads_to.keys if node.step.leads_to else {}
        if spot.outcome is None:
            yield NodeAddress(node.number, None, node.span)
        elif spot.outcome in transitions:
            yield NodeAddress(node.number, spot.outcome, transitions[spot.outcome])


def _written(where: str, program: Program, spots: tuple[NodeAddress, ...]) -> str:
    """Return how spots are written in a changed mission: as before, if that still means them."""
    if is_number(where):
        return str(spots[0].node)
    try:
        is_meant = find(program, where) == spots
    except NotPossible:
        is_meant = False
    return where if is_meant else spots[0].span.place


def _one(run: MissionRun, nodes: list[MissionNode], otherwise: str) -> MissionNode:
    """Return the one of some nodes that runs."""
    live = run.engine.debugger.live()
    running = [node for node in nodes if node.number in live]
    if not running:
        raise NotPossible(otherwise)
    if len(running) > 1:
        numbers = ", ".join(str(node.number) for node in running)
        raise NotPossible(f"several such nodes run: {numbers}; name one by its number")
    return running[0]


def changed(run: MissionRun, given: Mapping[str, str]) -> list[ChangeData]:
    """Return the interventions that set data, given as text.

    Raises:
        NotPossible: if there is no such data, or a value does not have its type.
    """
    data, places, placed = run.engine.program.data, run.engine.robot.places, _placed(run)
    made = []
    for name, text in given.items():
        if name not in data:
            raise NotPossible(clauses(f"the mission has no data '{name}'", suggest(name, data, "its data")))
        wanted = data[name].type
        try:
            found = typed(_node(name, text), wanted)
        except WrongValue as error:
            raise NotPossible(clauses(f"'{name}' {error.message}", error.label, error.help)) from error
        for word in texts_in(found.value) if name in placed else ():
            if word not in places:
                raise NotPossible(clauses(f"there is no place '{word}'", suggest(word, places, "places of this robot")))
        made.append(ChangeData(name, found.value))
    return made


def _placed(run: MissionRun) -> set[str]:
    """Return the data and inputs whose values skills take as places."""
    return {source for *_, source in places_taken(run.engine.program, run.engine.robot.skills)}


def _node(name: str, text: str) -> TreeNode:
    root, findings = read_text(f"{name}: {text}", "")
    is_read = isinstance(root, MappingNode) and root.entries.keys() == {name} and not findings
    return root.entries[name].value if is_read and isinstance(root, MappingNode) else ScalarNode(text, NOWHERE)


_PLAIN = re.compile(r"[A-Za-z_]\w*", re.ASCII)


def outcomes_of(program: Program, robot: RobotNames) -> OutcomesByNode:
    """Return the outcomes in which each node may end, by its number as text."""
    ending = Ending(program, robot)
    return {str(node.number): tuple(ending.of(node.number).words) for node in program.nodes}


def data_of(run: MissionRun) -> Iterator[ListedDatum]:
    """Yield the data of a mission, as they would be written to set them to what they are."""
    values, placed = run.engine.data, _placed(run)
    for name, datum in run.engine.program.data.items():
        choices = ("false", "true") if datum.type == FLAG else datum.type.choices
        shown = PLACE if datum.type == TEXT and name in placed else datum.type
        yield ListedDatum(name, shown.detail, choices, written(values[name], datum.type))


def written(value: Value, wanted: Type, *, within: bool = False) -> str | None:
    """Return a value as it is written in a manifest, `within` a list or a map; None if it cannot be written."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return format_quantity(value, wanted.dimension) if wanted.dimension else format_number(value)
    if isinstance(value, str):
        return value if not within or _PLAIN.fullmatch(value) else json.dumps(value, ensure_ascii=False)
    if is_named_pose(value):
        return value.name or None
    of = wanted.of or UNKNOWN
    if isinstance(value, list | tuple):
        parts = wanted.parts if len(wanted.parts) == len(value) else {}
        items = [written(item, parts.get(f"{index}", of), within=True) for index, item in enumerate(value)]
        return None if None in items else f"[{', '.join(filter(None, items))}]"
    if isinstance(value, Mapping):
        entries = {name: written(entry, wanted.parts.get(name, of), within=True) for name, entry in value.items()}
        return (
            None if None in entries.values() else f"{{{', '.join(f'{key}: {text}' for key, text in entries.items())}}}"
        )
    return None

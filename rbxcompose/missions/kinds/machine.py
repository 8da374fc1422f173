"""`machine`: states, and transitions between them by outcome."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Self

from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import MappingNode, ScalarNode
from rbxcompose.missions import codes, sdk
from rbxcompose.missions.language.grammar import BODIES, HISTORIES, is_reported
from rbxcompose.missions.language.node_reader import WORDS
from rbxcompose.missions.program.parts import ENDS, FAILED, FINISHED, MACHINE_KEYS, STATE, MachineStates, Next
from rbxcompose.missions.sdk import FAILURE, NAMES, RUNNING, SKIPPED, SUCCESS, Transition  # looked up in every tick

RESULTS = (sdk.SUCCEEDS, sdk.FAILS)


def read_machine(reader: sdk.NodeReader, key: str) -> MachineStates:
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


def _ends(inner: sdk.NodeReader, states: tuple[str, ...]) -> Mapping[str, str]:
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


def read_state(reader: sdk.NodeReader) -> Next | None:
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


def _next(reader: sdk.NodeReader) -> Next | None:
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


class MachineTask(sdk.WithHistory):
    """Runs one of its states at a time."""

    __slots__ = ("index", "is_first", "leads", "machine", "states")
    saved = ("index", "is_first")

    def __init__(self, site: sdk.Site, step: MachineStep) -> None:
        super().__init__(site)
        self.machine = step.states
        self.history = step.history
        self.states = site.children
        self.leads = [site.engine.program.nodes[child].step.leads_to for child in site.node.children]
        self.index = 0
        self.is_first = True  # it has not begun yet: a start state may be given to it

    def begin(self) -> int:
        """Enter the start state, or the one in which it was halted."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            start = self.machine.start
            if self.is_first:
                start = self.engine.settings.start_at.get(self.number, start)
            self.index = self.machine.names.index(start)
        self.is_first = False
        return self.proceed()

    def proceed(self) -> int:
        """Continue with the state; the next one starts in another tick."""
        self.engine.outcome = ""
        status = self.advance(self.states[self.index])
        if status == RUNNING:
            return RUNNING
        return self._go_on(SUCCESS if status == SKIPPED else status)

    def jump(self, state: str) -> None:
        """Leave the state that runs, and enter this one at the next tick."""
        self.halt_below()
        self.index = self.machine.names.index(state)
        self.forget()

    def _go_on(self, status: int) -> int:
        name, counts_as = self.machine.names[self.index], NAMES[status]
        outcome = self.engine.outcome or counts_as
        to = self._next(name, outcome, counts_as)
        self.engine.outcome = ""
        self.engine.say(Transition(self.number, name, outcome, to))
        if to in self.machine.names:
            self.index = self.machine.names.index(to)
            self.forget()
            self.engine.again(self)
            return RUNNING
        self.forget_places()
        ends = self.machine.ends
        self.engine.outcome = to if to not in ENDS else ""
        return SUCCESS if ends[to] == NAMES[SUCCESS] else FAILURE

    def _next(self, state: str, outcome: str, counts_as: str) -> str:
        """Return the target of an outcome: of its own transition, else of the one for the result it counts as."""
        leads = self.leads[self.index]
        key = leads.key_for(outcome, counts_as) if leads else None
        if leads and key is not None:
            return leads.to[key]
        raise sdk.NodeFailed(f"state '{state}' ended with '{outcome}', which leads nowhere")


@sdk.kind("machine", MachineTask)
@sdk.dataclass(frozen=True, slots=True)
class MachineStep(sdk.Loop):
    """Run one state after another; the outcome of a state decides which is next.

    It has `start`, `states`, and perhaps `ends` and `history`. A state has `do` or `machine`, modifiers,
    `on_enter`, `on_exit`, and `next`. `finished` and `failed` are ends that always exist.

    Example:
        machine:
          start: away
          states:
            away:
              do:
                go_to: corner_1
              next:
                success: home
                failure: home
            home:
              do:
                go_to: dock
              next:
                success: finished
                failure: failed
    """

    states: MachineStates = sdk.kept(sdk.Takes.MACHINE, read_machine, "'start' and 'states' below it")

    flow = sdk.NodeFlow.OPEN
    look = sdk.NodeLook("◉", sdk.Form.MACHINE)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the first state."""
        return f"Go through states, from {self.states.start}"

    @property
    def history(self) -> str:
        """Return the history."""
        return self.states.history

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the ends that its states lead to."""
        leads = (endings.program.nodes[child].step.leads_to for child in node.children)
        reached = {to for lead in leads if lead for to in lead.to.values()}
        named = {end: counts for end, counts in self.states.ends.items() if end in reached and end not in ENDS}
        return sdk.Outcomes(FINISHED in reached, FAILED in reached, named)

    def endless(self, ends: sdk.Outcomes) -> sdk.Advice | None:
        """Return advice on a machine without an end."""
        advice = sdk.Advice("this machine never ends and never waits", "put a 'wait' into a state, or lead to an end")
        return None if ends.words else advice

    def possibilities(
        self, node: sdk.MissionNode, nodes: tuple[sdk.MissionNode, ...], robot: sdk.RobotNames
    ) -> Iterator[sdk.Possibility]:
        """Yield the transitions."""
        for state in (nodes[child] for child in node.children):
            following = state.step.leads_to or Next()
            for outcome, to in following.to.items():
                words = f"{outcome}, on to {to}" if outcome else f"on to {to}"
                span = following.keys.get(outcome, state.span)
                yield sdk.Possibility(span, f"{state.path}: {words}", sdk.led(node.number, state.name, to, outcome))


class StateTask(sdk.Task):
    """The body of a state; its modifiers and hooks surround it."""

    __slots__ = ("body",)

    def __init__(self, site: sdk.Site, step: StateStep) -> None:
        super().__init__(site)
        self.body = site.children[0]

    def begin(self) -> int:
        """Start the body."""
        return self.advance(self.body)

    def proceed(self) -> int:
        """Continue with the body."""
        return self.advance(self.body)

    def result(self) -> sdk.Value:
        """Return the result of the body, which `save` keeps."""
        return self.body.result()


@sdk.kind(STATE, StateTask, is_inner=True)
@sdk.dataclass(frozen=True, slots=True)
class StateStep(sdk.Straight):
    """A state of a machine: its body and its transitions (None: its body never ends)."""

    leads_to: Next | None = field()

    skipped = sdk.Skipped.WITH_ALL_INSIDE
    flow = sdk.NodeFlow.IN_TURN
    look = sdk.NodeLook(form=sdk.Form.STATE)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say where it leads to."""
        leads = self.leads_to.to.items() if self.leads_to else ()
        to = "; ".join(f"after {outcome}, to {state}" if outcome else f"then to {state}" for outcome, state in leads)
        return f"State {node.name}{f' ({to})' if to else ''}"

    @classmethod
    def read(cls, reader: sdk.NodeReader) -> Self:
        """Read the body and the transitions."""
        return cls(read_state(reader))

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes of the body."""
        return endings.of(node.children[0]) if node.children else sdk.ANY

"""A robot as boxes and wires: the common basis of all graphs, as DOT and as Mermaid."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.names import TRANSFORMS, ActionNames, data_key, resolve
from rbxcompose.bus.wire import WIRE_PROFILES
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent, RobotMission
from rbxcompose.compiler.model.values import triggers_of
from rbxcompose.compiler.plan.model import BusPlan
from rbxcompose.domains.muxes.sections.muxes import muxes
from rbxcompose.missions.analysis.facts import sent_by
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.sources import SkillWay
from rbxcompose.missions.triggers.trigger import Trigger
from rbxcompose.msgs.action_msgs import CancelGoal, GoalStatusArray
from rbxcompose.msgs.types import Interface
from rbxcompose.sdk.capabilities import Forwards
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Port, Serves, ServesAction, ServesTopic

Keys = tuple[tuple[str, str], ...]  # its purpose, and the key
MISSION = "mission"  # the component that runs missions
STATUSES = "/diagnostics"  # where every component publishes without declaring it
_FOLD = "missions"  # the key of the box of those
MANY = 6  # missions, or open wires of the same box: more of them hide the rest, and are folded
_FEW = 3  # types of folded wires that are named
_MERMAID_STYLES = ("classDef wire fill:none,stroke-dasharray:2 2", "classDef mux stroke-width:2px")


def keys_of(port: Port[Any], topic: str, bus: BusPlan) -> Keys:
    """Return the Zenoh keys of a port with this absolute topic; none for a look-up."""
    interface = port.interface
    if interface is None:
        return ()
    if isinstance(port, ServesAction | CallsAction):
        names = ActionNames.of(topic)
        return (
            ("send_goal", _key(names.send_goal, interface.SendGoal, bus)),
            ("get_result", _key(names.get_result, interface.GetResult, bus)),
            ("cancel_goal", _key(names.cancel_goal, CancelGoal, bus)),
            ("feedback", _key(names.feedback, interface.FeedbackMessage, bus)),
            ("status", _key(names.status, GoalStatusArray, bus)),
        )
    return (("data" if isinstance(port, In | Out) else "request", _key(topic, interface, bus)),)


def _key(name: str, interface: type[Interface], bus: BusPlan) -> str:
    return data_key(bus.domain, name, interface.TYPE, WIRE_PROFILES[bus.wire].hash_of(interface))


def qos_of(port: Port[Any]) -> str:
    """Return the class of a topic's end; nothing for services, actions and look-ups, which have none."""
    return str(port.qos) if isinstance(port, In | Out) else ""


_DOES = {  # the first one that a port is counts
    Out: "sends",
    ServesTopic: "carries out",
    In: "takes",
    Serves: "answers",
    ServesAction: "carries out",
    CallsAction: "asks for",
    Calls: "calls",
}


def does(port: Port[Any]) -> str:
    """Return the verb phrase for what a component does at a port."""
    return next((words for kind, words in _DOES.items() if isinstance(port, kind)), "looks up")


class BoxShape(StrEnum):
    """What a box represents."""

    COMPONENT = "component"
    MUX = "mux"
    PROGRAM = "mission"


class WireContent(StrEnum):
    """What a wire carries."""

    TOPIC = "topic"
    SERVICE = "service"
    ACTION = "action"
    LOOK_UP = "look-up"
    TRIGGER = "trigger"


_CARRIED: dict[WireContent, tuple[type[Port[Any]], ...]] = {  # between these ports
    WireContent.TOPIC: (Out, In),
    WireContent.SERVICE: (Serves, Calls),
    WireContent.ACTION: (ServesAction, CallsAction),
}
# How a mission reaches its skills; those in Python run inside it.
_LINES = {SkillWay.ACTION: WireContent.ACTION, SkillWay.SERVICE: WireContent.SERVICE, SkillWay.TOPIC: WireContent.TOPIC}


@dataclass(frozen=True, slots=True)
class Box:
    """A component, or the program of a mission; `key` is unique, `group` is its process."""

    key: str
    name: str
    type: str
    group: str
    shape: BoxShape
    about: str = ""


@dataclass(frozen=True, slots=True)
class Tip:
    """The end of a wire at a box; `note` is a word beside it, such as a priority."""

    box: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class DiagramWire:
    """A topic, service or action: from those that send or request to those that receive or respond.

    A trigger leads to the mission that it starts, from the one whose end does so, if any; its type is its cause.
    """

    name: str
    kind: WireContent
    type: str
    qos: str
    sources: tuple[Tip, ...]
    targets: tuple[Tip, ...]
    about: str = ""

    @property
    def short_type(self) -> str:
        """Return the type without its package."""
        return self.type if self.kind is WireContent.TRIGGER else self.type.rpartition("/")[2]

    @property
    def note(self) -> str:
        """Return the note at its target if there is only one."""
        return self.targets[0].note if len(self.targets) == 1 else ""

    @property
    def is_pair(self) -> bool:
        """Return whether it connects exactly one box to one other."""
        return len(self.sources) == len(self.targets) == 1


@dataclass(frozen=True, slots=True)
class Diagram:
    """A whole robot. `runs` pairs the executive with each mission's program, first the one that `up` starts."""

    robot: str
    about: str
    groups: tuple[str, ...]
    boxes: tuple[Box, ...]
    wires: tuple[DiagramWire, ...]
    runs: tuple[tuple[str, str], ...] = ()
    start: str = ""

    def of_group(self, group: str) -> tuple[Box, ...]:
        """Return the boxes of a process."""
        return tuple(box for box in self.boxes if box.group == group)


def folded(diagram: Diagram) -> Diagram:
    """Return a diagram whose many missions are one box, all but the one that `up` starts, and many open wires one wire.

    An open wire has nothing at its other end, such as the services of each joint that no mission uses.
    """
    programs = [box for box in diagram.boxes if box.shape is BoxShape.PROGRAM]
    hidden = {box.key: _FOLD for box in programs if box.key != diagram.start} if len(programs) > MANY else {}
    boxes = [box for box in diagram.boxes if box.key not in hidden]
    if hidden:
        names = ", ".join(box.name for box in programs if box.key in hidden)
        boxes.append(Box(_FOLD, f"{len(hidden)} missions", "mission", programs[0].group, BoxShape.PROGRAM, names))
    alike: dict[tuple[object, ...], list[DiagramWire]] = {}
    for wire in diagram.wires:
        sources, targets = (_folded(tips, hidden) for tips in (wire.sources, wire.targets))
        ends = (tuple(tip.box for tip in sources), tuple(tip.box for tip in targets))
        what: object = wire.name if all(ends) or wire.about else ends
        alike.setdefault((wire.kind, what), []).append(replace(wire, sources=sources, targets=targets))
    wires = [wire for many in alike.values() for wire in (many if len(many) <= MANY else [_open(many)])]
    runs = dict.fromkeys((executive, hidden.get(program, program)) for executive, program in diagram.runs)
    return replace(diagram, boxes=tuple(boxes), wires=tuple(wires), runs=tuple(runs))


def _folded(tips: Sequence[Tip], hidden: Mapping[str, str]) -> tuple[Tip, ...]:
    """Return the ends of a wire, those at hidden boxes as one; its note stays if all of them have it."""
    notes: dict[str, list[str]] = {}
    for tip in tips:
        notes.setdefault(hidden.get(tip.box, tip.box), []).append(tip.note)
    return tuple(Tip(box, note[0] if len(set(note)) == 1 else "") for box, note in notes.items())


def _open(wires: Sequence[DiagramWire]) -> DiagramWire:
    """Return open wires of the same box as one."""
    types = dict.fromkeys(wire.short_type for wire in wires)
    shown = ", ".join(types) if len(types) <= _FEW else f"{len(types)} types"
    return replace(wires[0], name=f"{len(wires)} {wires[0].kind}s", type=shown, qos="", about="not used here")


@dataclass(slots=True)
class _Open:
    """A wire under construction."""

    type: str
    qos: str = ""
    sources: list[Tip] = field(default_factory=list)
    targets: list[Tip] = field(default_factory=list)


def diagram_of(robot: Robot) -> Diagram:
    """Return a robot as boxes and wires; if it has mistakes, as far as it could be read."""
    boxes = [*_boxes(robot)]
    runs = tuple((MISSION, key_of(name)) for name in _programs(robot))
    return Diagram(
        robot=robot.manifest.name,
        about=robot.manifest.about,
        groups=tuple(dict.fromkeys(box.group for box in boxes)),
        boxes=tuple(boxes),
        wires=tuple(_wires(robot)),
        runs=runs,
        start=key_of(robot.manifest.start) if robot.manifest.start in robot.missions else "",
    )


def key_of(mission: str | None) -> str:
    """Return the key of a mission's box."""
    return f"mission:{mission}"


def _programs(robot: Robot) -> list[str]:
    """Return the missions, first the one that `up` starts."""
    return sorted(robot.missions, key=lambda name: name != robot.manifest.start) if MISSION in robot.components else []


def _boxes(robot: Robot) -> Iterator[Box]:
    for component in robot.components.values():
        shape = BoxShape.MUX if component.declared(Forwards) else BoxShape.COMPONENT
        about = (component.cls.__doc__ or "").strip().partition("\n")[0]
        yield Box(component.name, component.name, component.type_name, component.process, shape, about)
    for name in _programs(robot):
        program = robot.missions[name].program
        yield Box(key_of(name), name, "mission", robot.components[MISSION].process, BoxShape.PROGRAM, program.about)


def _wires(robot: Robot) -> Iterator[DiagramWire]:
    """Yield the wires sorted by what they carry and by name; unused ones are not drawn."""
    found: dict[tuple[WireContent, str], _Open] = {}
    for component in robot.components.values():
        if component.name != MISSION:  # its missions are drawn instead
            for end in component.ends:
                _add(robot, component, end, found)
    for name in _programs(robot):
        _add_mission(robot, robot.missions[name], key_of(name), found)
    if MISSION in robot.components:
        for trigger in triggers_of(robot).values():
            _add_trigger(robot, trigger, found)
    _add_look_ups(robot, found)
    for (kind, topic), wire in sorted(found.items(), key=lambda item: ([*WireContent].index(item[0][0]), item[0][1])):
        about = "every component reports its status here" if topic == STATUSES else ""
        about = "by itself" if kind is WireContent.TRIGGER else about
        yield DiagramWire(topic, kind, wire.type, wire.qos, tuple(wire.sources), tuple(wire.targets), about)


def _add(robot: Robot, component: RobotComponent, end: PortEnd, found: dict[tuple[WireContent, str], _Open]) -> None:
    kind = next((kind for kind, ends in _CARRIED.items() if isinstance(end.port, ends)), None)
    if kind is None:
        return
    wire = found.setdefault((kind, end.topic), _Open(end.type_name))
    wire.qos = wire.qos or qos_of(end.port)
    tips = wire.sources if isinstance(end.port, Out | Calls | CallsAction) else wire.targets
    tips.append(Tip(component.name, _note(robot, component, end)))


def _note(robot: Robot, component: RobotComponent, end: PortEnd) -> str:
    """Return the priority of an input or a lock of a mux."""
    mux = robot.manifest.contents.of(muxes).get(component.name)
    if mux is None or not isinstance(end.port, In):
        return ""
    entry = mux.inputs.get(end.name) or mux.locks.get(end.name.removeprefix("lock_"))
    what = "priority" if end.name in mux.inputs else "lock"
    return f"{what} {entry.priority}" if entry else ""


def _add_mission(robot: Robot, mission: RobotMission, key: str, found: dict[tuple[WireContent, str], _Open]) -> None:
    """Add the actions, services and topics that a mission uses. A skill in Python runs in the mission itself."""

    def lead(kind: WireContent, topic: str, type_name: str) -> None:
        found.setdefault((kind, topic), _Open(type_name)).sources.append(Tip(key))

    def receive(topic: str, type_name: str, note: str) -> None:
        found.setdefault((WireContent.TOPIC, topic), _Open(type_name)).targets.append(Tip(key, note))

    for skill in sorted({node.skill for node in mission.program.nodes} & robot.skills.keys()):
        source = robot.skills[skill]
        if source.way in _LINES:
            lead(_LINES[source.way], source.topic, source.action)
        if (halts := source.orders.halts) is not None:
            lead(WireContent.TOPIC, halts.topic, halts.message)
        if (ends := source.orders.ends) is not None:
            receive(ends.topic, ends.message, skill)
    published, called = sent_by([mission.program])
    space = robot.manifest.bus.namespace or ""
    for name in sorted(published & robot.topics.keys()):
        lead(WireContent.TOPIC, resolve(name, space), robot.topics[name].message)
    for name in sorted(called & robot.services.keys()):
        lead(WireContent.SERVICE, resolve(name, space), robot.services[name])
    for name in sorted(mission.program.reads & robot.values.keys()):
        value = robot.values[name]
        receive(value.topic, value.message, f"${name}")


def _add_trigger(robot: Robot, trigger: Trigger, found: dict[tuple[WireContent, str], _Open]) -> None:
    """Add a line to the mission that a trigger starts, and let the topics that it needs end there, too."""
    key = key_of(trigger.mission)
    sources = [Tip(key_of(trigger.ends))] if trigger.ends else []
    note = f"priority {trigger.priority}" if trigger.priority else ""
    line = _Open(trigger.cause, sources=sources, targets=[Tip(key, note)])
    found[WireContent.TRIGGER, trigger.name] = line
    needed = [(robot.values[name].topic, robot.values[name].message) for name in sorted(trigger.reads)]
    if trigger.topic:
        needed.append((resolve(trigger.topic, robot.manifest.bus.namespace or ""), trigger.message))
    for topic, message in needed:
        wire = found.setdefault((WireContent.TOPIC, topic), _Open(message))
        if key not in [tip.box for tip in wire.targets]:
            wire.targets.append(Tip(key, f"trigger {trigger.name}"))


def _add_look_ups(robot: Robot, found: dict[tuple[WireContent, str], _Open]) -> None:
    """Draw a line of its own kind from each topic of transforms to those that look something up."""
    boxes = [
        component.name
        for component in robot.components.values()
        if any(isinstance(end.port, Looks) for end in component.ends)
    ]
    boxes = [name for name in boxes if name != MISSION]
    boxes += [key_of(name) for name in _programs(robot) if POSE in robot.missions[name].program.reads]
    for topic in TRANSFORMS:
        if (wire := found.pop((WireContent.TOPIC, topic), None)) is not None:
            wire.targets += [Tip(name) for name in boxes]
            found[WireContent.LOOK_UP, topic] = wire


_DOT_STYLES = {
    WireContent.TOPIC: 'style=solid color="#1f6feb"',
    WireContent.SERVICE: 'style=dashed color="#1a7f37"',
    WireContent.ACTION: 'style=bold penwidth=2.2 color="#8250df"',
    WireContent.LOOK_UP: 'style=dotted color="#6e7781" arrowhead=odot',
    WireContent.TRIGGER: 'style=solid color="#bf3989" arrowhead=dot',
}
_DOT_SHAPES = {BoxShape.COMPONENT: "box", BoxShape.MUX: "hexagon", BoxShape.PROGRAM: "note"}


def dot(diagram: Diagram) -> str:
    """Return a directed graph in DOT, with processes as clusters."""
    return "".join(f"{line}\n" for line in _dot_lines(diagram))


def _dot_lines(diagram: Diagram) -> Iterator[str]:
    yield f"digraph {_quoted(diagram.robot)} {{"
    yield "  // topics solid, services dashed, actions bold, look-ups of transforms dotted, triggers with a dot"
    yield '  graph [rankdir=LR fontname="sans-serif" nodesep=0.35 ranksep=0.7]'
    yield '  node [fontname="sans-serif" fontsize=11 style=rounded]'
    yield '  edge [fontname="sans-serif" fontsize=9]'
    for index, group in enumerate(diagram.groups):
        yield f"  subgraph cluster_{index} {{"
        yield f"    label={_quoted(f'process {group}')} style=rounded"
        yield from (f"    {_dot_box(box, diagram.start)}" for box in diagram.of_group(group))
        yield "  }"
    for executive, program in diagram.runs:
        yield f"  {_quoted(executive)} -> {_quoted(program)} [dir=none]"
    for wire in diagram.wires:
        yield from (f"  {line}" for line in _dot_wire(wire))
    yield "}"


def _dot_box(box: Box, start: str) -> str:
    kind = "start mission" if box.key == start else box.type
    label = _dot_label(*dict.fromkeys((box.name, kind)))
    return f"{_quoted(box.key)} [label={label} shape={_DOT_SHAPES[box.shape]}]"


def _dot_wire(wire: DiagramWire) -> Iterator[str]:
    """Yield an edge with a label; a wire with several ends, or none at one side, has a node of its own."""
    style = _DOT_STYLES[wire.kind]
    if wire.is_pair:
        [source], [target] = wire.sources, wire.targets
        label = _dot_label(wire.name, wire.short_type, target.note)
        yield f"{_quoted(source.box)} -> {_quoted(target.box)} [label={label} {style}]"
        return
    key = _quoted(f"{wire.kind} {wire.name}")
    yield f"{key} [label={_dot_label(wire.name, wire.short_type)} shape=plaintext style=solid fontsize=9]"
    tail = " dir=none" if wire.targets else ""
    for source in wire.sources:
        yield f"{_quoted(source.box)} -> {key} [{style}{tail}]"
    for target in wire.targets:
        yield f"{key} -> {_quoted(target.box)} [label={_dot_label(target.note)} {style}]"


def _dot_label(*lines: str) -> str:
    return _quoted("\n".join(line for line in lines if line))


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


_MERMAID_ARROWS = {
    WireContent.TOPIC: "-->",
    WireContent.SERVICE: "-.->",
    WireContent.ACTION: "==>",
    WireContent.LOOK_UP: "-.-o",
    WireContent.TRIGGER: "--o",
}
_MERMAID_SHAPES = {BoxShape.COMPONENT: ("[", "]"), BoxShape.MUX: ("{{", "}}"), BoxShape.PROGRAM: ("([", "])")}


def mermaid(diagram: Diagram) -> str:
    """Return the text of a flowchart: processes are boxes around their components."""
    return "".join(f"{line}\n" for line in _mermaid_lines(diagram))


def _mermaid_lines(diagram: Diagram) -> Iterator[str]:
    ids = {box.key: f"b{index}" for index, box in enumerate(diagram.boxes)}
    yield "flowchart LR"
    yield "  %% topics -->, services -.->, actions ==>, look-ups of transforms -.-o, triggers --o"
    for index, group in enumerate(diagram.groups):
        yield f'  subgraph p{index}["process {group}"]'
        yield from (f"    {_mermaid_box(box, ids, diagram.start)}" for box in diagram.of_group(group))
        yield "  end"
    yield from (f"  {ids[executive]} --- {ids[program]}" for executive, program in diagram.runs)
    for index, wire in enumerate(diagram.wires):
        yield from (f"  {line}" for line in _mermaid_wire(wire, f"w{index}", ids))
    yield from (f"  {style}" for style in _MERMAID_STYLES)


def _mermaid_box(box: Box, ids: dict[str, str], start: str) -> str:
    begin, end = _MERMAID_SHAPES[box.shape]
    kind = "start mission" if box.key == start else box.type
    style = ":::mux" if box.shape is BoxShape.MUX else ""
    below = f"<br/><i>{kind}</i>" if kind != box.name else ""
    return f'{ids[box.key]}{begin}"{box.name}{below}"{end}{style}'


def _mermaid_wire(wire: DiagramWire, key: str, ids: dict[str, str]) -> Iterator[str]:
    """Yield an arrow with a label; a wire with several ends, or none at one side, has a node of its own."""
    shown = wire.short_type.replace('"', "#quot;").replace("<", "#lt;")  # of a condition
    arrow, label = _MERMAID_ARROWS[wire.kind], f"{wire.name}<br/>{shown}"
    if wire.is_pair:
        [source], [target] = wire.sources, wire.targets
        note = f"<br/>{target.note}" if target.note else ""
        yield f'{ids[source.box]} {arrow}|"{label}{note}"| {ids[target.box]}'
        return
    yield f'{key}(["{label}"]):::wire'
    yield from (f"{ids[source.box]} {arrow} {key}" for source in wire.sources)
    for target in wire.targets:
        note = f'|"{target.note}"|' if target.note else ""
        yield f"{key} {arrow}{note} {ids[target.box]}"

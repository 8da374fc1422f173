"""A robot as boxes and wires: the common basis of all graphs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from enum import StrEnum

from rbxcompose.bus.names import resolve
from rbxcompose.dataclass import dataclass
from rbxcompose.inspection.wire_keys import qos_of
from rbxcompose.missions.analysis.effects import sent_by
from rbxcompose.missions.engine.condition_watches import POSE
from rbxcompose.missions.program.sources import SkillWay
from rbxcompose.model.robot import Robot, RobotComponent, RobotMission
from rbxcompose.model.wires import PortEnd
from rbxcompose.sdk.capabilities import Forwards
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Serves, ServesAction

MISSION = "mission"  # the component that runs missions
TRANSFORMS = ("/tf", "/tf_static")  # what a look-up subscribes to
STATUSES = "/diagnostics"  # where every component publishes without declaring it


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
    """A topic, service or action: from those that send or request to those that receive or respond."""

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
        return self.type.rpartition("/")[2]

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


@dataclass(slots=True)
class _Open:
    """A wire under construction."""

    kind: WireContent
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
    _add_look_ups(robot, found)
    for (kind, topic), wire in sorted(found.items(), key=lambda item: ([*WireContent].index(item[0][0]), item[0][1])):
        about = "every component reports its status here" if topic == STATUSES else ""
        yield DiagramWire(topic, kind, wire.type, wire.qos, tuple(wire.sources), tuple(wire.targets), about)


def _add(robot: Robot, component: RobotComponent, end: PortEnd, found: dict[tuple[WireContent, str], _Open]) -> None:
    kind = _kind(end)
    if kind is None:
        return
    wire = found.setdefault((kind, end.topic), _Open(kind, end.type_name))
    wire.qos = wire.qos or qos_of(end.port)
    tips = wire.sources if isinstance(end.port, Out | Calls | CallsAction) else wire.targets
    tips.append(Tip(component.name, _note(robot, component, end)))


def _kind(end: PortEnd) -> WireContent | None:
    match end.port:
        case Out() | In():
            return WireContent.TOPIC
        case Serves() | Calls():
            return WireContent.SERVICE
        case ServesAction() | CallsAction():
            return WireContent.ACTION
    return None


def _note(robot: Robot, component: RobotComponent, end: PortEnd) -> str:
    """Return the priority of an input or a lock of a mux."""
    mux = robot.manifest.muxes.get(component.name)
    if mux is None or not isinstance(end.port, In):
        return ""
    entry = mux.inputs.get(end.name) or mux.locks.get(end.name.removeprefix("lock_"))
    what = "priority" if end.name in mux.inputs else "lock"
    return f"{what} {entry.priority}" if entry else ""


def _add_mission(robot: Robot, mission: RobotMission, key: str, found: dict[tuple[WireContent, str], _Open]) -> None:
    """Add the actions, services and topics that a mission uses. A skill in Python runs in the mission itself."""

    def lead(kind: WireContent, topic: str, type_name: str) -> None:
        found.setdefault((kind, topic), _Open(kind, type_name)).sources.append(Tip(key))

    def hear(topic: str, type_name: str, note: str) -> None:
        found.setdefault((WireContent.TOPIC, topic), _Open(WireContent.TOPIC, type_name)).targets.append(Tip(key, note))

    for skill in sorted({node.skill for node in mission.program.nodes} & robot.skills.keys()):
        source = robot.skills[skill]
        if source.way in _LINES:
            lead(_LINES[source.way], source.topic, source.action)
        if (halts := source.orders.halts) is not None:
            lead(WireContent.TOPIC, halts.topic, halts.message)
        if (ends := source.orders.ends) is not None:
            hear(ends.topic, ends.message, skill)
    published, called = sent_by([mission.program])
    space = robot.manifest.bus.namespace or ""
    for name in sorted(published & robot.topics.keys()):
        lead(WireContent.TOPIC, resolve(name, space), robot.topics[name].message)
    for name in sorted(called & robot.services.keys()):
        lead(WireContent.SERVICE, resolve(name, space), robot.services[name])
    for name in sorted(mission.program.reads & robot.values.keys()):
        value = robot.values[name]
        hear(value.topic, value.message, f"${name}")


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

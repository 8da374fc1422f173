"""Rules about wires: ports, topics, types, servers, and the order in which components start."""

from collections import Counter
from collections.abc import Iterator, Sequence

from rbxcompose.base.findings import MOST_NAMES, NAMES, WIRING, Finding, Related, Severity, suggest
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.composition.robot_manifest import IncludedPart
from rbxcompose.compiler.model.build import MISSION
from rbxcompose.compiler.model.flow import answers, cycle_of, part_of, setting_span, shared_names
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent
from rbxcompose.manifest.tree import at
from rbxcompose.msgs.definitions import parse_type
from rbxcompose.sdk.capabilities import ConnectedBy, Drives, Forwards, RunsMissions, ServesPage
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Qos, Serves, ServesAction, ServesTopic
from rbxcompose.sdk.registry import types_with


@check("RBX3007", is_fixable=True)
def connected_port(robot: Robot) -> Iterator[Finding]:
    """`connect:` names a port that the component does not have."""
    for name, entry in robot.manifest.components.items():
        if name not in robot.components:
            continue
        ports = [end.name for end in robot.components[name].ends if not isinstance(end.port, Looks)]
        for port in entry.options.connect:
            if port not in ports:
                yield connected_port.misspelt(
                    robot.key("components", name, "connect", port),
                    f"'{name}' has no port '{port}'",
                    port,
                    ports,
                    "its ports",
                    taken=entry.options.connect,
                )


SERVED_BY = {Calls: Serves, CallsAction: ServesAction, In: Out}


@check("RBX3010", Severity.WARNING, closed=(WIRING, NAMES))
def needed_port(robot: Robot) -> Iterator[Finding]:
    """A component needs something that nothing in the robot provides."""
    given = {(type(end.port), end.topic) for end in robot.ends}
    by_people = {page.commands.value for _, page in robot.declared(ServesPage)}
    lost = {end.type_name for ends in robot.writers.values() for end in ends if has_no_subscriber(robot, end)}
    for component in robot.components.values():
        if component.declared(RunsMissions):
            continue  # its values may come from outside, and its skills are those that exist
        needed = [
            end for end in component.ends if type(end.port) in SERVED_BY and not getattr(end.port, "is_open", False)
        ]
        missing = [end for end in needed if (SERVED_BY[type(end.port)], end.topic) not in given]
        missing = [end for end in missing if end.topic not in {*robot.outside.names, *by_people}]
        # A command without a subscriber is reported at its publisher.
        ends = [end for end in missing if not (_is_command(end) and end.type_name in lost)]
        if ends:
            yield _finding(robot, component, ends)


def has_no_subscriber(robot: Robot, end: PortEnd) -> bool:
    """Return whether this end publishes commands that nothing receives."""
    return isinstance(end.port, Out) and end.port.qos is Qos.COMMAND and end.topic not in robot.readers


def _is_command(end: PortEnd) -> bool:
    return isinstance(end.port, In) and end.port.qos is Qos.COMMAND


def _finding(robot: Robot, component: RobotComponent, ends: list[PortEnd]) -> Finding:
    names = " and ".join(f"'{end.topic}'" for end in ends)
    remedy = next(filter(None, (getattr(end.port, "remedy", "") for end in ends)), "")
    near = [(end, other) for end in ends for other in robot.ends if _fits(end, other)]
    near = [(end, other) for end, other in near if not remedy or end.port.topic == other.port.topic]
    topics = [text for end in ends for text in (end.topic, end.topic.strip("/"), end.topic.rpartition("/")[-1])]
    return needed_port.at(
        robot.value_span_of(component.name, *topics) or robot.end_span(ends[0]),
        f"'{component.name}' needs {names}, which nothing in the robot provides",
        help=_connected(robot, near) or remedy or f"add the component that provides it{_such_as(ends)}",
        related=[Related(robot.end_span(other), f"'{other.topic}' is of this type") for _, other in near],
        about=(component.name, *(end.topic for end in ends)),
    )


def _connected(robot: Robot, near: Sequence[tuple[PortEnd, PortEnd]]) -> str:
    """Return how ports get topics of others, else how one that nobody uses gets theirs; nothing if neither can be."""
    choices: dict[str, dict[str, PortEnd]] = {}  # by port: the ends that need the topics
    for end, other in near:
        choices.setdefault(end.name, {})[other.topic] = end
    ways = [[(end, topic) for topic, end in choice.items()] for choice in choices.values()]
    if any(len(way) > 1 for way in ways):  # a map has a key only once
        fixes = [[robot.connection([one]) for one in way[:MOST_NAMES]] for way in ways]
        fix = "; ".join(("one of " if len(each) > 1 else "") + ", ".join(each) for each in fixes if all(each))
    else:
        fix = robot.connection(one for way in ways for one in way)
    users = Counter(end.topic for end in robot.ends)
    idle = ([(other, end.topic)] for end, other in near if users[other.topic] == 1)
    return f"connect it: {fix}" if fix else robot.parted("the topic that is needed", *idle)


def _such_as(ends: list[PortEnd]) -> str:
    """Return the types of components that could provide all of this, as words that follow; empty without any."""
    found = [types_with(SERVED_BY[type(end.port)], end.topic.rpartition("/")[-1], end.type_name) for end in ends]
    both = [name for name in found[0] if all(name in names for names in found)]
    return f", such as one of the type {' or '.join(map(repr, both))}" if both else ""


def _fits(end: PortEnd, other: PortEnd) -> bool:
    is_another = other.instance != end.instance  # a component that subscribes to itself receives nothing
    return is_another and type(other.port) is SERVED_BY[type(end.port)] and other.type_name == end.type_name


_STATES = (Qos.STATE, Qos.LATCHED)


@check("RBX3015", Severity.WARNING, closed=(WIRING, NAMES))
def two_publishers(robot: Robot) -> Iterator[Finding]:
    """Two components write numbers on one topic."""
    for topic, ends in robot.writers.items():
        nameless = [end for end in ends if _is_nameless(end)]
        first = nameless[0].instance if nameless else ""
        for other in nameless:
            if other.instance == first:
                continue
            yield two_publishers.at(
                robot.component_span(other.instance),
                f"'{other.instance}' and '{first}' both publish '{topic}', and its messages do not name their source",
                help=robot.parted(
                    "another topic", *([(end, f"{end.instance}/{end.name}")] for end in (other, nameless[0]))
                ),
                related=[Related(robot.component_span(first), "and this one")],
            )


def _is_nameless(end: PortEnd) -> bool:
    """Return whether messages with a state are bare values: no header, frame or name in them tells whose it is."""
    port = end.port
    if not isinstance(port, Out) or port.qos not in _STATES or end.instance == MISSION or port.interface is None:
        return False
    types = [parse_type(field) for field in port.interface.FIELDS.values()]
    return bool(types) and not any(field.is_message or field.base in ("string", "wstring") for field in types)


@check("RBX3008", closed=(WIRING,))
def two_servers(robot: Robot) -> Iterator[Finding]:
    """Two components serve the same service or action."""
    first: dict[str, str] = {}
    instances: dict[tuple[str, str], tuple[IncludedPart, IncludedPart]] = {}
    for end in robot.ends:
        if not answers(end):
            continue
        other = first.setdefault(end.topic, end.instance)
        parts = (part_of(robot, end.instance), part_of(robot, other))
        if other == end.instance:
            continue
        if parts[0] and parts[1] and parts[0].name != parts[1].name:
            instances.setdefault((parts[0].name, parts[1].name), (parts[0], parts[1]))
        else:
            yield two_servers.at(
                robot.component_span(end.instance),
                f"'{end.instance}' and '{other}' both serve '{end.topic}'",
                label="this one",
                help=robot.parted(
                    "names of its own", _own_names(robot, end.instance, other), _own_names(robot, other, end.instance)
                ),
                related=[Related(robot.component_span(other), "and this one")],
            )
    for part, earlier in instances.values():
        yield _of_instances(robot, part, earlier)


def _of_instances(robot: Robot, part: IncludedPart, earlier: IncludedPart) -> Finding:
    """Return the finding for two instances that serve the same, with names for all that both of them have."""
    shared = shared_names(robot, part, earlier)
    served = sorted({end.topic for end in robot.ends if answers(end)} & shared.keys())
    # A skill is called by the last word of its topic, so that one needs to differ.
    renamed = {
        name: f"{name}_{part.name}" if topic in served else f"{part.name}/{name}" for topic, name in shared.items()
    }
    brought = part.components & robot.components.keys()
    ours = {end.topic for name in brought for end in robot.components[name].ends if robot.is_renamed(end)}
    names = ", ".join(f"{name}: {renamed[name]}" for topic, name in shared.items() if topic in ours)
    return two_servers.at(
        part.span,
        f"the instances '{part.name}' and '{earlier.name}' both serve {' and '.join(map(repr, served))}",
        help=f"give one of them names of its own: 'connect: {{{names}}}'" if ours.issuperset(served) else "",
        related=[Related(earlier.span, f"the instance '{earlier.name}'")],
    )


def _own_names(robot: Robot, instance: str, other: str) -> list[tuple[PortEnd, str]]:
    """Return names of its own for all that an instance writes or serves where another one does, too."""
    theirs = {port.topic for port in robot.components[other].ends if _has_state(port)}
    both = (port for port in robot.components[instance].ends if port.topic in theirs and _has_state(port))
    return [(port, f"{instance}/{port.name}") for port in both]


def _has_state(end: PortEnd) -> bool:
    return isinstance(end.port, Out) or answers(end)


@check("RBX3024", closed=(WIRING,))
def two_skills(robot: Robot) -> Iterator[Finding]:
    """Two actions are the same skill."""
    first: dict[str, PortEnd] = {}
    for end in robot.ends:
        if not isinstance(end.port, ServesAction | ServesTopic) or not (skill := end.skill):
            continue
        other = first.setdefault(skill, end)
        if other.topic != end.topic:
            yield two_skills.at(
                robot.end_span(end),
                f"'{end.topic}' and '{other.topic}' are both the skill '{skill}'",
                help=robot.parted("another last word", *([(one, f"{skill}_{one.instance}")] for one in (end, other))),
                related=[Related(robot.end_span(other), f"that of '{other.instance}'")],
            )


def is_command(end: PortEnd) -> bool:
    """Return whether the messages at this end are commands."""
    return isinstance(end.port, In | Out) and end.port.qos is Qos.COMMAND


@check("RBX3016", Severity.WARNING, closed=())
def own_component(robot: Robot) -> Iterator[Finding]:
    """A component is listed that a section runs by itself."""
    for component in robot.components.values():
        if component.path[:1] == ("components",) and component.cls.made_by:
            yield own_component.at(
                robot.value(*component.path, "type"),
                f"'{component.name}' of the type '{component.type_name}' does not belong under 'components'",
                help="remove it. " + component.cls.made_by.replace("`", "'"),
            )


@check("RBX3006", is_fixable=True, closed=(NAMES,))
def start_order(robot: Robot) -> Iterator[Finding]:
    """`starts_after:` names no component, or forms a circle."""
    after = {name: component.starts_after for name, component in robot.components.items()}
    for name, component in robot.components.items():
        for index, other in enumerate(component.starts_after):
            if other not in robot.components and other not in robot.written:
                yield start_order.misspelt(
                    robot.value(*component.path, "starts_after", index),
                    f"'{name}' starts after a component that the robot does not have: '{other}'",
                    other,
                    robot.components,
                    "components of this robot",
                )
    if cycle := cycle_of(after):
        yield start_order.at(
            robot.value(*robot.components[cycle[0]].path, "starts_after"),
            f"the start order forms a circle: {' after '.join([*cycle, cycle[0]])}",
            help="remove one of them",
        )


WAITING = "topics that wait for such commands"
_MOST_SHOWN = 8  # subscribers that are pointed at


@check("RBX3011", Severity.WARNING, closed=(WIRING, NAMES))
def command_without_subscriber(robot: Robot) -> Iterator[Finding]:
    """Commands are published on a topic without a subscriber."""
    waiting: dict[str, list[PortEnd]] = {}  # by the type of their messages
    for port_end in (one for topic, ends in robot.readers.items() if topic not in robot.writers for one in ends):
        waiting.setdefault(port_end.type_name, []).append(port_end)
    for end in robot.ends:
        if has_no_subscriber(robot, end):
            starving = [other for other in waiting.get(end.type_name, ()) if other.instance != end.instance]
            topics = [one.topic.strip("/") for one in starving]
            yield command_without_subscriber.at(
                robot.end_span(end),
                f"nothing subscribes to the commands of '{end.instance}' on '{end.topic}'",
                help=_unheard_command_cure(robot, end, starving)
                or suggest(end.topic.strip("/"), topics, WAITING)
                or _unheard_command_such_as(end),
                related=[Related(robot.end_span(one), f"listens to '{one.topic}'") for one in starving[:_MOST_SHOWN]],
                about=(end.instance, end.topic),
            )


def _unheard_command_such_as(end: PortEnd) -> str:
    found = types_with(In, end.topic.rpartition("/")[-1], end.type_name)
    return (
        f"add the component that follows them, such as one of the type {' or '.join(map(repr, found))}" if found else ""
    )


def _unheard_command_cure(robot: Robot, end: PortEnd, starving: list[PortEnd]) -> str:
    """Return what to do if the only one that waits was connected to another topic than its own."""
    bases = [base.end(drives.commands) for base, drives in robot.declared(Drives)]
    elsewhere = [base for base in bases if base and base.type_name == end.type_name and base.topic != end.topic]
    if len(starving or elsewhere) != 1:
        return ""
    [one] = starving or elsewhere
    connect = (*robot.components[one.instance].path, "connect", one.name)
    if at(robot.manifest.root, connect) is None:
        return ""
    topic = end.topic.strip("/")
    cure = f"let '{one.instance}' listen to '{topic}': write '{one.name}: {topic}' below its 'connect', or remove that"
    past = [writer.instance for writer in robot.writers.get(one.topic, ()) if writer.instance != end.instance]
    if past and robot.components[end.instance].declared(Forwards):
        cure += f"; and let '{end.instance}' have an input with 'from: {past[0]}', which commands past it now"
    return cure


@check("RBX3120", Severity.WARNING, closed=())
def unlike_classes(robot: Robot) -> Iterator[Finding]:
    """A port reads messages of another QoS class than they are published in."""
    for topic, readers in robot.readers.items():
        writers = robot.writers.get(topic, [])
        for reader in readers:
            if is_command(reader) and len(writers) > 1:
                continue  # that there are two is told, and the worse mistake
            for writer in writers:
                mine, theirs = reader.port, writer.port
                if not isinstance(mine, In) or not isinstance(theirs, Out) or reader.type_name != writer.type_name:
                    continue
                if mine.qos is not theirs.qos:
                    yield unlike_classes.at(
                        robot.end_span(reader),
                        f"'{reader.instance}' reads '{topic}' as {mine.qos.value}, "
                        f"and '{writer.instance}' publishes it as {theirs.qos.value}",
                        label=f"its port '{reader.name}'",
                        help="give both ports the same 'qos'",
                        related=[Related(robot.end_span(writer), f"its port '{writer.name}'")],
                    )


@check("RBX3023", closed=(WIRING,))
def instance_topics(robot: Robot) -> Iterator[Finding]:
    """Two instances of a part publish on the same topic."""
    first: dict[tuple[str, str], str] = {}  # file and topic -> instance
    for part in robot.manifest.parts.values():
        shared_topics = {
            end.topic: end
            for name in part.components & robot.components.keys()
            for end in robot.components[name].ends
            if isinstance(end.port, Out) and not is_command(end)
        }
        for topic, end in sorted(shared_topics.items()):
            short = end.port.topic
            other = robot.manifest.parts[first.setdefault((part.file, topic), part.name)]
            if other is part or short.startswith("/"):
                continue
            shared = shared_names(robot, part, other)
            if not any(end.topic in shared for end in robot.ends if answers(end)):  # else it is told with those
                yield instance_topics.at(
                    part.span,
                    f"the instances '{part.name}' and '{other.name}' of one part both publish on '{topic}'",
                    help=f"give one of them another topic: 'connect: {{{short}: {part.name}/{short}}}'"
                    if robot.is_renamed(end)
                    else "",
                    related=[Related(other.span, f"the instance '{other.name}'")],
                )


@check("RBX2247", closed=())
def shared_port(robot: Robot) -> Iterator[Finding]:
    """Two components use the same serial port."""
    first: dict[str, tuple[str, str]] = {}
    for component, connected in robot.declared(ConnectedBy):
        port, field = connected.port.value, connected.port.field
        other, place = first.setdefault(port, (component.name, field))
        if other != component.name:
            yield shared_port.at(
                setting_span(robot, (component, field)),
                f"'{component.name}' and '{other}' use the same port, {port}",
                help="give each its own port, or put what is on one cable into one of them",
                related=[Related(setting_span(robot, (robot.components[other], place)), f"'{other}'")],
            )

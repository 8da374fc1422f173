"""Publish a recording again on a robot's bus, or show what is in it.

Messages come at the recorded intervals. Velocities, trajectories, topics of the class `command`, and what somebody on
the bus takes as commands make a robot move: they are left out unless `--topics` names them. So are topics that are
being published now, unless `--over` mixes them, or `--namespace` keeps them apart. With --alone, or if no robot is up,
it brings a router of its own.

With --into, nothing is published: it runs one component of a run that `up --rate max --record` has recorded again, with
its recorded inputs, and compares its outputs with the recording. The settings are those of the run, or those of
--robot PATH. Exit codes: 0 the same, 1 a difference or findings.
"""

import argparse
import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path

from rbxcompose.base.config import HIDDEN
from rbxcompose.base.findings import MOST_NAMES, Finding, Severity, suggest
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import to_data
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.graph import GraphName
from rbxcompose.bus.names import Attachment, data_key, dds_type, resolve
from rbxcompose.bus.tokens import EntityKind, NodeToken, gid
from rbxcompose.bus.transport import RemotePublisher
from rbxcompose.bus.wire import WIRE_PROFILES, ros_qos
from rbxcompose.bus.zenoh_session import open_router
from rbxcompose.commands.console import NotDoneError, emit, misused, refuse, write_report
from rbxcompose.commands.guest import NO_ROUTER, Guest
from rbxcompose.commands.lookup import BusPlace, add_bus_options, find_place, robots_up
from rbxcompose.commands.options import seconds, speed_up
from rbxcompose.commands.targets import add_layer_options, compiled
from rbxcompose.compiler.plan.dump import PlanTextError, dump, load
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped
from rbxcompose.msgs.trajectory_msgs import JointTrajectory
from rbxcompose.runtime.recording import topics as codes
from rbxcompose.runtime.recording.files import PART, Recorder, write_problem
from rbxcompose.runtime.recording.reader import RecordingReader, RecordingSummary, playlist, summary_of
from rbxcompose.runtime.recording.tape import PLAN
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic, Selection, matches, why_not_replayable
from rbxcompose.runtime.replay import ReplayResult, RunDifference, missing_topics, replayed
from rbxcompose.sdk.ports import Qos
from rbxcompose.tools.commands.record import add_selection_options, selection_of
from rbxcompose.tools.recordings import count_table, opened, recover_in, sorted_counts, warn, warn_of_unmatched

GROUP = "data"
_MATCHING = 1.0  # [s] maximum wait until subscribers have found a new publisher
_MATCH_PAUSE = 0.01  # [s] between two checks for them
_PAUSE = 0.05  # [s] before a recording restarts
_MOTION = (Twist.TYPE, TwistStamped.TYPE, JointTrajectory.TYPE)  # which move a robot whoever sends them
_PORT, _TRIES = 7447, 20  # the port at which ROS 2 looks for a router, and those behind it
HOW = "'rbxcompose up PATH --rate max --record FILE' records everything that is needed"


class Player:
    """Publishes recorded messages as the node `replay`, below a namespace (`/old`) if there is one."""

    def __init__(self, guest: Guest, topics: Iterable[RecordedTopic], namespace: str = "") -> None:
        self._guest = guest
        self._sequence = count(1)
        transport, domain = guest.transport, guest.domain
        node = NodeToken(domain, transport.session, 0, "replay")
        transport.announce(node.key)
        self._publishers: dict[RecordedTopic, tuple[RemotePublisher, bytes]] = {}
        for number, topic in enumerate(topics, 1):
            qos = WIRE_PROFILES["jazzy"].qos_text(ros_qos(topic.qos))
            name = f"{namespace}{topic.name}"
            place = (EntityKind.PUBLISHER, number, name, dds_type(topic.type), topic.hash, qos)
            token = node.endpoint_key(*place)
            publisher = transport.publisher(data_key(domain, name, topic.type, topic.hash), topic.qos)
            transport.announce(token)
            self._publishers[topic] = publisher, gid(token)

    def wait_for_subscribers(self) -> None:
        """Wait until each topic has a subscriber, but only briefly: many will never have one."""
        publishers = [publisher for publisher, _ in self._publishers.values()]
        deadline = self._guest.clock.now() + _MATCHING
        while not all(publisher.has_match for publisher in publishers) and self._guest.clock.now() < deadline:
            if self._guest.run(lambda: self._guest.is_interrupted, _MATCH_PAUSE):
                return

    def put(self, message: Recorded) -> None:
        """Publish a message again."""
        publisher, sender = self._publishers[message.topic]
        publisher.put(message.payload, Attachment(next(self._sequence), self._guest.clock.stamp(), sender).encode())


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", type=Path, metavar="FILE", help="the recording")
    add_bus_options(parser)
    add_selection_options(parser)
    parser.add_argument("--rate", type=_rate, default=1.0, metavar="2x", help="faster or slower than it was")
    parser.add_argument("--from", type=seconds, default=0.0, dest="start", metavar="10s", help="skip everything before")
    parser.add_argument("--alone", action="store_true", help="on a router of its own, away from robots that are up")
    parser.add_argument("--namespace", type=_namespace, metavar="NAME", help="put it before all topics")
    parser.add_argument("--over", action="store_true", help="also topics that are being published now")
    parser.add_argument("--loop", action="store_true", help="start again at the end, until Ctrl-C")
    words = "run one component of a recorded run again, as it was or as in --robot PATH, and compare"
    parser.add_argument("--into", metavar="COMPONENT", help=words)
    parser.add_argument("--write", type=Path, metavar="FILE", help="with --into: keep what it sends now")
    add_layer_options(parser)
    parser.add_argument("--info", action="store_true", help="only show topics, types, counts and duration")
    parser.add_argument("--json", action="store_true", help="with --info or --into: answer with one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Read the file once to learn its contents, then replay it."""
    if problem := _misused(arguments):
        return misused("replay", problem)
    path = arguments.path
    if path.parent.is_dir():
        recover_in(path.parent)
    if path.name.endswith(PART) and not path.exists():
        path = path.with_name(path.name.removesuffix(PART))
    reader, summary = _look_through(path)
    if arguments.into is not None:
        return run_again(arguments, path, reader)
    if arguments.info:
        emit(json.dumps(_fields(summary, reader.damage)) if arguments.json else _text(path, summary))
        return 0
    return _replay(arguments, path, summary)


def _misused(arguments: argparse.Namespace) -> str:
    """Return what is wrong with incompatible options."""
    layers = arguments.profile or arguments.overlays or arguments.sets or arguments.real
    if layers and not (arguments.into and arguments.robot):
        return "options that change the robot's file need --into and --robot PATH"
    if arguments.json and not (arguments.info or arguments.into):
        return "--json needs --info or --into"
    if arguments.alone and (arguments.router or arguments.robot):
        return "--alone has a bus of its own, so no robot and no router is named"
    return "--write needs --into" if arguments.write and not arguments.into else ""


def _look_through(path: Path) -> tuple[RecordingReader, RecordingSummary]:
    """Read a recording to its end, and warn if it is damaged; the reader knows its topics and attachments."""
    with opened(path) as reader:
        summary = summary_of(reader.messages())
    if reader.damage:
        place = f"after {summary.messages:,} messages"
        warn(codes.DAMAGED.at(None, f"'{plain(str(path))}' is damaged {place}: {reader.damage}"))
    return reader, summary


def _replay(arguments: argparse.Namespace, path: Path, summary: RecordingSummary) -> int:
    wanted = selection_of(arguments)
    topics, namespace = _chosen(summary, wanted), arguments.namespace or ""
    why = f"it lasts {summary.duration:.1f} s" if arguments.start > summary.duration else ""
    if not topics or why:
        return _nothing(path, why)
    with replay_bus(arguments) as place:
        with Guest(place) as looking:  # its router knows all; a guest that stays has to make its own links first
            found = [topic for topic in looking.graph().topics if topic.name.startswith(namespace)]
        there = {topic.name.removeprefix(namespace): topic for topic in found}
        if not wanted.patterns:
            topics = _without_motion(topics, lambda topic: topic.name in there and _is_commanded(there[topic.name]))
        if not arguments.over:
            sent = _names(topic for topic in topics if topic.name in there and there[topic.name].givers)
            topics = [topic for topic in topics if topic.name not in sent]
            if sent:
                finding = _left_out(sent)
                if not topics:
                    return refuse(finding)
                warn(replace(finding, severity=Severity.WARNING))
        if not topics:
            return _nothing(path)
        with Guest(place, stays=True) as guest, guest.interruptible():
            player = Player(guest, topics, namespace)
            player.wait_for_subscribers()
            emit(f"replaying {len(topics)} topics of {plain(str(path))}; Ctrl-C ends it")
            count = _play(path, player, topics, arguments, guest)
            while arguments.loop and _wait(guest.clock.now() + _PAUSE, guest):  # even if the recording has no duration
                count += _play(path, player, topics, arguments, guest)
        emit(f"replayed {count:,} messages")
        return 0


def _nothing(path: Path, why: str = "") -> int:
    words = why or "none of the chosen topics can be replayed"
    return refuse(codes.NOTHING.at(None, f"nothing of '{plain(str(path))}' is replayed: {words}"))


def _names(topics: Iterable[RecordedTopic]) -> list[str]:
    return list(dict.fromkeys(topic.name for topic in topics))


def _is_commanded(topic: GraphName) -> bool:
    """Return whether somebody takes the messages of a topic as commands."""
    return any(end.qos == ros_qos(Qos.COMMAND) for end in topic.takers)


def _without_motion(topics: list[RecordedTopic], moves: Callable[[RecordedTopic], bool]) -> list[RecordedTopic]:
    """Return the topics that make no robot move, and report the others."""
    if names := _names(filter(moves, topics)):
        words = f"topics that make a robot move: {plain(', '.join(names))}"
        warn(codes.NOT_REPLAYED.at(None, words, help="'--topics NAME' replays them"))
    return [topic for topic in topics if topic.name not in names]


def _left_out(names: list[str]) -> Finding:
    rest = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    message = f"these topics are being published now: {plain(', '.join(names[:MOST_NAMES]))}{rest}"
    return codes.SENT_ALREADY.at(None, message, help="'--namespace old' keeps them apart, '--over' mixes them")


def _chosen(summary: RecordingSummary, wanted: Selection) -> list[RecordedTopic]:
    """Return the topics to publish, and report which selected ones are left out, or are not there."""
    known = {topic.name for topic in summary.counts}
    warn_of_unmatched((one for one in wanted.patterns if not any(matches(name, one) for name in known)), known)
    topics = sorted((topic for topic in summary.counts if wanted.takes(topic)), key=lambda topic: topic.name)
    unfit = {topic.name: why for topic in topics if (why := why_not_replayable(topic))}
    for why in dict.fromkeys(unfit.values()):
        names = ", ".join(name for name in unfit if unfit[name] == why)
        warn(codes.NOT_REPLAYED.at(None, f"topics that the bus cannot carry: {plain(names)}: {plain(why)}"))
    topics = [topic for topic in topics if topic.name not in unfit]
    if wanted.patterns:
        return topics
    return _without_motion(topics, lambda topic: topic.qos is Qos.COMMAND or topic.type in _MOTION)


def _play(path: Path, player: Player, topics: list[RecordedTopic], arguments: argparse.Namespace, guest: Guest) -> int:
    """Publish the recording once and return the number of messages."""
    chosen = set(topics)
    count = 0
    start = guest.clock.now()
    with opened(path) as reader:
        for due, message in playlist(reader.messages(), rate=arguments.rate, start=arguments.start):
            if not _wait(start + due, guest):
                break
            if message.topic in chosen:
                player.put(message)
                count += 1
    return count


def _wait(until: float, guest: Guest) -> bool:
    """Wait until a time of the guest's clock; return False if an interrupt came first."""
    return not guest.run(lambda: guest.is_interrupted, until - guest.clock.now())


def _text(path: Path, summary: RecordingSummary) -> str:
    head = f"{plain(str(path))}: {summary.messages:,} messages, {summary.duration:.3f} s"
    return f"{head}\n{count_table(summary.counts)}" if summary.counts else head


def _fields(summary: RecordingSummary, damage: str) -> dict[str, object]:
    topics = [
        {
            "name": topic.name,
            "type": topic.type,
            "class": topic.qos.value,
            "encoding": topic.encoding,
            "messages": number,
        }
        for topic, number in sorted_counts(summary.counts)
    ]
    return {
        "messages": summary.messages,
        "start": summary.start,
        "end": summary.end,
        "duration": summary.duration,
        "damage": damage,
        "topics": topics,
    }


def _namespace(text: str) -> str:
    """Read `old` or `/old/run`, as what stands before the name of a topic."""
    try:
        return resolve(text.strip("/"))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _rate(text: str) -> float:
    """Read `2x`."""
    return speed_up(text, "'2x' or '0.5x'")


@contextmanager
def replay_bus(arguments: argparse.Namespace) -> Iterator[BusPlace]:
    """Yield the bus that the options name; with `--alone`, or if no robot is up, one with a router of its own.

    Raises:
        NotDoneError: if there is none.
    """
    is_named = arguments.router is not None or arguments.robot is not None
    if is_named or (robots_up() and not arguments.alone):
        yield find_place(arguments)
        return
    with _own_router() as endpoint:
        emit(f"a router of its own is at {endpoint}: 'rbxcompose topic echo TOPIC --router {endpoint}'")
        yield BusPlace(endpoint, arguments.domain or 0)


@contextmanager
def _own_router() -> Iterator[str]:
    for port in range(_PORT, _PORT + _TRIES):
        endpoint = tcp_endpoint(port)
        try:
            session = open_router(endpoint)
        except OSError:
            continue
        try:
            yield endpoint
        finally:
            session.close()  # type: ignore[no-untyped-call]
        return
    raise NotDoneError(NO_ROUTER.at(None, f"no port from {_PORT} to {_PORT + _TRIES - 1} is free for a router"))


def run_again(arguments: argparse.Namespace, path: Path, reader: RecordingReader) -> int:
    """Run the component that `--into` names and report the first difference; return 0 if there is none.

    `reader` has read the recording to its end.

    Raises:
        NotDoneError: if the recording lacks something needed, or the outputs cannot be written.
    """
    plan = _plan(arguments, path, reader)
    instance = instance_of(plan, arguments.into)
    if missing := missing_topics(plan, instance, reader.topics):
        names = plain(", ".join(missing))
        raise NotDoneError(
            codes.NOT_ENOUGH.at(None, f"'{plain(str(path))}' lacks inputs of '{instance.name}': {names}")
        )
    with opened(path) as again, _kept(arguments.write) as keep:
        found = replayed(plan, instance, again.messages(), keep)
    return _report(arguments, instance.name, found, reader.damage)


def _plan(arguments: argparse.Namespace, path: Path, reader: RecordingReader) -> Plan:
    if PLAN not in reader.attachments:
        why = (
            "lacks the robot's plan, since it is damaged" if reader.damage else "was not recorded within a stepped run"
        )
        message = f"'{plain(str(path))}' {why}"
        raise NotDoneError(codes.NOT_ENOUGH.at(None, message, help=HOW))
    if arguments.robot is not None:
        compilation = compiled(arguments.robot, arguments)
        write_report(compilation.report, compilation.sources)
        if compilation.plan is None:
            raise NotDoneError(codes.NOT_ENOUGH.at(None, f"'{plain(arguments.robot)}' has errors"))
        return compilation.plan
    try:
        return load(reader.attachments[PLAN].decode())
    except ValueError as error:
        reason = str(error) if isinstance(error, PlanTextError) else "its plan is not text"
        raise NotDoneError(codes.NOT_ENOUGH.at(None, f"'{plain(str(path))}': {plain(reason)}")) from error


def instance_of(plan: Plan, name: str) -> Instance:
    """Return a component of a plan.

    Raises:
        NotDoneError: if there is none, or the plan is that of a recording and it has a secret.
    """
    instance = next((candidate for candidate in plan.instances if candidate.name == name), None)
    if instance is None:
        names = [one.name for one in plan.instances]
        message = f"the robot '{plain(plan.robot)}' has no component '{plain(name, 60)}'"
        raise NotDoneError(codes.NOT_ENOUGH.at(None, message, help=suggest(name, names, "components")))
    if json.dumps(HIDDEN) in dump(Plan(plan.robot, plan.file, (instance,)), reveals_secrets=True):
        message = f"'{name}' has a secret, which a recording does not hold"
        raise NotDoneError(codes.NOT_ENOUGH.at(None, message, help="'--robot PATH' takes it from the robot's file"))
    return instance


@contextmanager
def _kept(path: Path | None) -> Iterator[Callable[[Recorded], None] | None]:
    """Yield a function that takes the outputs, and write them to a file if one is requested."""
    if path is None:
        yield None
        return
    if problem := write_problem(path):
        raise NotDoneError(codes.UNWRITABLE.at(None, problem))
    try:
        recorder = Recorder(path, 0.0)
        yield recorder.add
        recorder.finish()
    except OSError as error:
        reason = plain(error.strerror or str(error))
        raise NotDoneError(codes.UNWRITABLE.at(None, f"'{plain(str(path))}' cannot be written: {reason}")) from error


def _report(arguments: argparse.Namespace, name: str, found: ReplayResult, damage: str) -> int:
    for text in found.errors:
        emit(plain(text))
    if arguments.json:
        told = {"component": name, "equal": found.equal, "difference": to_data(found.difference), "damage": damage}
        emit(json.dumps(told))
    elif found.difference is None:
        emit(f"'{name}' sends the same as recorded: {found.equal:,} messages")
    else:
        return refuse(codes.DIFFERENT.at(None, _difference_text(name, found.difference, found.equal)))
    return 0 if found.difference is None else 1


def _difference_text(name: str, one: RunDifference, equal: int) -> str:
    where = f", field '{plain(one.field)}'" if one.field else ""
    values = f"recorded {plain(one.recorded)}, now {plain(one.now)}"
    return f"'{name}' differs at {one.time:.3f} s on {plain(one.topic)}{where}: {values}; {equal:,} messages were equal"

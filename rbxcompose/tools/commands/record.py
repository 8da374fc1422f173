"""Record the topics of a robot, until Ctrl-C: to an MCAP file, or to a data set to learn from.

Payloads stay as they are on the bus, with the definitions of their types, so Foxglove, Lichtblick and ROS 2 can read
them. A recorder that is killed loses at most half a second: the next one in its folder recovers its file.

With --format lerobot, what was recorded becomes an episode of a data set of LeRobot: `observation.state` of
`joint_states` and `odom`, `action` of `joint_commands` and `cmd_vel`, and a video of each camera. --append adds an
episode to a data set; --from makes episodes of recordings, also of those of ROS 2.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbxcompose.base.findings import clauses
from rbxcompose.base.printable import plain
from rbxcompose.bus.names import data_key, decode_attachment
from rbxcompose.bus.tokens import SPACE, EndpointToken, parse_token
from rbxcompose.bus.transport import Arrival
from rbxcompose.commands.console import NotDoneError, ReportedError, emit, misused, refuse
from rbxcompose.commands.guest import Guest, silence
from rbxcompose.commands.lookup import BusPlace, add_bus_options, find_place, find_robot
from rbxcompose.commands.options import add_json_option, out_option, seconds
from rbxcompose.runtime.recording.files import ENDING, Recorder, Split
from rbxcompose.runtime.recording.topics import (
    LOST,
    UNWRITABLE,
    Recorded,
    RecordedTopic,
    Selection,
    definition_of,
    matches,
    topic_of,
)
from rbxcompose.sdk.ports import Qos
from rbxcompose.tools.recordings import count_table, recover_in, warn, warn_of_unmatched

if TYPE_CHECKING:
    from rbxcompose.tools.datasets import WantedDataset

GROUP = "data"
_PAUSE = 0.02  # [s] between checks for messages
_SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([kMG])B")
MCAP, LEROBOT = "mcap", "lerobot"
MOST_FRAMES = 120  # per second
_TIMES = {"k": 1e3, "M": 1e6, "G": 1e9}
MOST_WAITING = 20_000  # messages that arrived and are not yet written
MOST_TOPICS = 2_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_bus_options(parser)
    add_selection_options(parser)
    add_json_option(parser)
    about = "the file, or the folder of ROBOT-DATE-TIME.mcap (default: this one); or the folder of the data set"
    out_option(about, "--output")(parser)
    parser.add_argument("--for", type=seconds, dest="duration", metavar="30s", help="end after this time")
    parser.add_argument(
        "--split", type=_split, default=Split(), metavar="SIZE|TIME", help="start a new file after 500MB, or 10min"
    )
    parser.add_argument("--format", choices=(MCAP, LEROBOT), default=MCAP, help=f"of what is written (default: {MCAP})")
    for_data = parser.add_argument_group("with --format lerobot")
    for_data.add_argument("--task", metavar="TEXT", help="what the robot does, in words (default: the folder's name)")
    for_data.add_argument("--fps", type=_rate, default=15, metavar="N", help="frames per second (default: 15)")
    for_data.add_argument("--append", action="store_true", help="add the episode to a data set that is there")
    words = "make an episode of each of these recordings, instead of recording one"
    for_data.add_argument("--from", nargs="+", type=Path, default=[], dest="recordings", metavar="FILE", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Record, then report what was recorded."""
    if problem := _problem(arguments):
        return misused("record", problem)
    if arguments.format == LEROBOT:
        return _record_dataset(arguments)
    place = find_place(arguments)
    return _record(arguments, place, _path(arguments), selection_of(arguments))


def _problem(arguments: argparse.Namespace) -> str:
    if arguments.format == LEROBOT:
        is_cut = arguments.split != Split()
        return "an episode cannot be split" if is_cut else "--json is for recordings" if arguments.json else ""
    is_used = arguments.task or arguments.append or arguments.recordings
    return f"--task, --append and --from need --format {LEROBOT}" if is_used else ""


def _record_dataset(arguments: argparse.Namespace) -> int:
    from rbxcompose.tools.datasets import EpisodeTopics, WantedDataset  # imports what few recordings need

    place = None if arguments.recordings else find_place(arguments)
    is_named = place is not None and not arguments.router
    robot = find_robot(arguments.robot).path.name if is_named else arguments.robot
    folder = Path(arguments.out or f"{robot or 'recording'}-{datetime.now():%Y%m%d-%H%M%S}")
    topics = EpisodeTopics(tuple(arguments.topics), tuple(arguments.classes))
    wanted = WantedDataset(folder, arguments.task or folder.name, arguments.fps, robot, topics, arguments.append)
    if (problem := wanted.problem()) is not None:
        return refuse(problem)
    return (
        _record_episode(arguments, place, wanted) if place is not None else _write_dataset(wanted, arguments.recordings)
    )


def _record_episode(arguments: argparse.Namespace, place: BusPlace, wanted: WantedDataset) -> int:
    """Record a file and make an episode of it; if that cannot be, the file stays."""
    path = wanted.folder.with_name(f"{wanted.folder.name}-{datetime.now():%Y%m%d-%H%M%S}{ENDING}")
    if code := _record(arguments, place, path, wanted.topics):
        return code
    if code := _write_dataset(wanted, [path]):
        emit(f"the recording stays: {path}")
        return code
    path.unlink()
    return 0


def _write_dataset(wanted: WantedDataset, recordings: list[Path]) -> int:
    from rbxcompose.tools.datasets import write_dataset

    try:
        write_dataset(wanted, recordings)
    except NotDoneError as error:
        return refuse(error.finding)
    except ReportedError as error:
        return error.exit_code
    emit(f"data set {wanted.folder}")
    return 0


def _record(arguments: argparse.Namespace, place: BusPlace, path: Path, topics: Selection) -> int:
    if path.parent.is_dir():
        recover_in(path.parent)
    with Guest(place, stays=True) as guest, guest.interruptible():
        start = guest.clock.now()
        try:
            recorder = Recorder(path, start, arguments.split)
        except OSError as error:
            return refuse(UNWRITABLE.at(None, f"'{plain(str(path))}' cannot be written: {_reason(error)}"))
        tap = Tap(guest, topics)
        if not arguments.json:
            with suppress(BrokenPipeError):  # who does not want to read it may still want the recording
                emit(f"recording to {recorder.paths[0]}; Ctrl-C ends it")
        end = math.inf if arguments.duration is None else start + arguments.duration
        return _write(recorder, tap, guest, end, is_json=arguments.json)


def _write(recorder: Recorder, tap: Tap, guest: Guest, end: float, *, is_json: bool) -> int:
    try:
        while not guest.is_interrupted and guest.clock.now() < end:
            guest.run(lambda: guest.is_interrupted, _PAUSE)
            for message in tap.take():
                recorder.add(message)
            recorder.keep(guest.clock.now())
        for topic in tap.topics.values():
            recorder.declare(topic)
        recorder.finish()
    except OSError as error:
        recorder.abandon()
        words = f"'{plain(str(recorder.paths[-1]))}' cannot be written: {_reason(error)}"
        return refuse(UNWRITABLE.at(None, words, help=_recovery_help(recorder)))
    if tap.lost:
        warn(LOST.at(None, f"{tap.lost:,} messages came too fast to be recorded", help="choose fewer with '--topics'"))
    warn_of_unmatched(tap.unmatched, tap.others)
    counts = recorder.counts
    for pattern in tap.silent({topic.name for topic in counts}):
        warn(silence(pattern))
    if is_json:
        messages = {topic.name: number for topic, number in counts.items()}
        files = [str(path) for path in recorder.paths]
        emit(json.dumps({"files": files, "messages": messages, "unmatched": tap.unmatched}))
        return 0
    paths = ", ".join(map(str, recorder.paths))
    emit(f"{count_table(counts)}\nrecorded {counts.total():,} messages to {paths}")
    return 0


def _recovery_help(recorder: Recorder) -> str:
    """Return what there is of a recording that cannot be written any further."""
    path = plain(str(recorder.paths[-1]))
    finished = [plain(str(one)) for one in recorder.paths if one.exists()]
    recovers = f"once there is space, 'rbxcompose replay {path} --info' recovers at least {recorder.kept:,} messages"
    whole = f"finished: {' to '.join(dict.fromkeys((finished[0], finished[-1])))}" if finished else ""
    return clauses("" if path in finished else recovers, whole)


def _path(arguments: argparse.Namespace) -> Path:
    wanted: str = arguments.out or ""
    path = Path(wanted)
    if wanted and not wanted.endswith("/") and not path.is_dir():
        return path if path.suffix == ENDING else path.with_name(path.name + ENDING)
    name = "recording" if arguments.router else find_robot(arguments.robot).path.name
    return path / f"{name}-{datetime.now():%Y%m%d-%H%M%S}{ENDING}"


def _reason(error: OSError) -> str:
    return plain(error.strerror or str(error))


def _split(text: str) -> Split:
    """Read `500MB` or `10min`."""
    if (found := _SIZE.fullmatch(text.strip())) and (size := int(float(found[1]) * _TIMES[found[2]])):
        return Split(size=size)
    try:
        return Split(time=seconds(text))
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f"'{text}' is neither a size nor a time above zero; write '500MB' or '10min'"
        ) from None


def _rate(text: str) -> int:
    if text.isdecimal() and 1 <= int(text) <= MOST_FRAMES:
        return int(text)
    raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 to {MOST_FRAMES}")


def add_selection_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--topics` and `--class`."""
    several: dict[str, Any] = {"nargs": "+", "action": "extend", "default": []}
    parser.add_argument("--topics", metavar="PATTERN", help="only these, such as odom '/camera/*'", **several)
    words = f"only these classes: {', '.join(Qos)}"
    parser.add_argument("--class", dest="classes", type=_class, metavar="CLASS", help=words, **several)


def selection_of(arguments: argparse.Namespace) -> Selection:
    """Return the selection of topics."""
    return Selection(tuple(arguments.topics), tuple(arguments.classes))


def _class(text: str) -> Qos:
    try:
        return Qos(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a class; choose from {', '.join(Qos)}") from None


class Tap:
    """Receives the messages of all selected topics, including those that appear while it runs.

    `topics` are those by their keys on the bus, `unmatched` the patterns that no topic has matched so far, and `others`
    the names of topics that none matches.
    """

    def __init__(self, guest: Guest, wanted: Selection) -> None:
        self._guest, self._wanted = guest, wanted
        self._tokens: deque[str] = deque(maxlen=MOST_WAITING)
        self._waiting: deque[Callable[[], Recorded]] = deque(maxlen=MOST_WAITING)
        self._arrivals = count(1)
        self._arrived = self._taken = 0
        self.topics: dict[str, RecordedTopic] = {}
        self.unmatched = list(dict.fromkeys(wanted.patterns))
        self.others: set[str] = set()
        guest.transport.watch(f"{SPACE}/{guest.domain}/**", self._noticed)

    @property
    def lost(self) -> int:
        """Return how many messages had to make room for newer ones."""
        return max(0, self._arrived - self._taken - len(self._waiting))

    def silent(self, heard: Collection[str]) -> list[str]:
        """Return the patterns that topics match, but none of those that were `heard`."""

        def is_in(names: Iterable[str], pattern: str) -> bool:
            return any(matches(name, pattern) for name in names)

        names = {topic.name for topic in self.topics.values()}
        patterns = dict.fromkeys(self._wanted.patterns)
        return [pattern for pattern in patterns if is_in(names, pattern) and not is_in(heard, pattern)]

    def take(self) -> Iterator[Recorded]:
        """Yield the messages that have arrived, and subscribe to new topics."""
        while self._tokens:
            self._subscribe(self._tokens.popleft())
        for _ in range(len(self._waiting)):
            self._taken += 1
            yield self._waiting.popleft()()

    def _noticed(self, token: str, is_there: bool) -> None:
        if is_there:
            self._tokens.append(token)

    def _subscribe(self, key: str) -> None:
        token = parse_token(key)
        topic = topic_of(token) if isinstance(token, EndpointToken) else None
        if topic is None:
            return
        self.unmatched = [pattern for pattern in self.unmatched if not matches(topic.name, pattern)]
        if not self._wanted.names(topic) and len(self.others) < MOST_TOPICS:
            self.others.add(topic.name)
        if not self._wanted.takes(topic) or len(self.topics) >= MOST_TOPICS:
            return
        data = data_key(self._guest.domain, topic.name, topic.type, topic.hash)
        if data in self.topics:
            return
        whole = self.topics[data] = replace(topic, definition=definition_of(topic.type))
        self._guest.transport.subscribe(data, topic.qos, lambda arrival: self._arrive(whole, arrival))

    def _arrive(self, topic: RecordedTopic, arrival: Arrival) -> None:
        stamp = self._guest.clock.stamp()
        self._waiting.append(lambda: _recorded(topic, stamp, arrival))
        self._arrived = next(self._arrivals)


def _recorded(topic: RecordedTopic, stamp: int, arrival: Arrival) -> Recorded:
    try:
        sequence, published, _ = decode_attachment(arrival.attachment)
    except ValueError:
        sequence, published = 0, stamp  # it comes from no ROS participant: only its time of arrival is known
    return Recorded(topic, stamp, max(0, published), max(0, sequence), arrival.payload)

"""List the topics on the bus, show their messages, measure their rate, publish.

It sees ROS 2 nodes as well as components. It needs no robot on this machine: `--router` names another bus.
"""

import argparse
import json
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from itertools import pairwise

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.graph import GraphEnd
from rbxcompose.commands import options
from rbxcompose.commands.console import emit, table
from rbxcompose.commands.guest import Guest, described, visit_for_action, wanted, write_names
from rbxcompose.commands.lookup import add_bus_options

GROUP = "data"
ON_SYSTEM = options.BUS
FOR_ALL = ("ls", "show")
_ENDS = ("publishers", "subscriptions")
_WINDOW = 100  # messages
_LINE_PERIOD = 1.0  # [s] between two lines


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    topic = options.argument("topic", metavar="TOPIC", help="its name, such as /odom")
    window = options.argument(
        "--window", type=options.count, default=_WINDOW, metavar="N", help=f"over so many messages ({_WINDOW})"
    )
    duration = options.argument("--for", dest="duration", type=options.seconds, metavar="T", help="end after this time")
    type_ = options.argument("type", metavar="TYPE", help="such as geometry_msgs/Twist")
    message = options.argument(
        "message", metavar="MESSAGE", nargs="?", default="", help="YAML; missing fields are zero"
    )
    rate = options.argument(
        "--rate", type=options.hertz, metavar="10Hz", help="publish again and again, until interrupted"
    )
    most = options.argument("-n", "--count", type=options.count, metavar="N", help="end after this many")
    timeout = partial(options.add_timeout_option, default="2s")
    sent = (topic, type_, message, rate, most, timeout, options.add_json_option)
    # Only the functions that use messages import what those need: a list takes half the time without it.
    echo, publish = (options.deferred("rbxcompose.commands.messages", name) for name in ("echo", "publish"))
    shown = (options.add_json_option, topic)
    actions = (
        options.Subcommand("ls", "list the topics with their types", _ls, (options.add_ls_options,)),
        options.Subcommand("show", "show publishers and subscribers", _show, shown),
        options.Subcommand("echo", "print the messages", echo, (options.add_count_options, *shown)),
        options.Subcommand("hz", "measure how often messages arrive", measure, (window, duration, *shown)),
        options.Subcommand("pub", "publish a message, by default once", publish, sent),
    )
    options.add_actions(parser, actions, add_bus_options, options.add_system_options)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit_for_action(arguments)


def _ls(guest: Guest, arguments: argparse.Namespace) -> int:
    return write_names(guest.graph().topics, _ENDS, arguments)


def _show(guest: Guest, arguments: argparse.Namespace) -> int:
    topic = wanted(guest.graph().topics, arguments.topic, "topic")
    if arguments.json:
        emit(json.dumps(described(topic, _ENDS)))
        return 0
    emit(f"{topic.name}: {', '.join(topic.types)}")
    if topic.clash:
        emit(f"! {topic.clash}")
    ends = (("publisher", topic.givers), ("subscription", topic.takers))
    emit(table([(what, end.node, end.kind.type, _qos(end)) for what, given in ends for end in given]))
    return 0


def _qos(end: GraphEnd) -> str:
    if end.qos is None:
        return "unknown quality of service"
    reliability = "reliable" if end.qos.is_reliable else "best effort"
    durability = ", kept for late subscribers" if end.qos.is_transient_local else ""
    return f"{reliability}{durability}, {'all' if end.qos.keeps_all else f'newest {end.qos.depth}'}"


@dataclass(frozen=True, slots=True)
class Pace:
    """Figures of the intervals between arrivals; `jitter` is their standard deviation."""

    rate: float  # [Hz]
    shortest: float  # [s]
    longest: float  # [s]
    jitter: float  # [s]
    messages: int


class PaceMeter:
    """Keeps the times of the last `window` arrivals."""

    def __init__(self, window: int) -> None:
        self._times: deque[float] = deque(maxlen=window)
        self._news = 0

    def arrived(self, time: float) -> None:
        """Count an arrival at `time` [s]."""
        self._times.append(time)
        self._news += 1

    def take(self) -> Pace | None:
        """Return the pace; None if nothing has arrived since the last call, or too little to measure."""
        news, self._news = self._news, 0
        return measured(list(self._times)) if news else None


def measured(times: Sequence[float]) -> Pace | None:
    """Return the pace of arrivals at these times [s]; None for fewer than two different times."""
    if len(times) < 2 or times[-1] <= times[0]:
        return None
    intervals = [after - before for before, after in pairwise(times)]
    mean = (times[-1] - times[0]) / len(intervals)
    jitter = math.sqrt(sum((interval - mean) ** 2 for interval in intervals) / len(intervals))
    return Pace(1 / mean, min(intervals), max(intervals), jitter, len(times))


def measure(guest: Guest, arguments: argparse.Namespace) -> int:
    """Print every second how often messages arrive."""
    topic = wanted(guest.graph().topics, arguments.topic, "topic")
    meter = PaceMeter(arguments.window)
    guest.listen(topic, lambda message: meter.arrived(message.time))
    left = math.inf if arguments.duration is None else arguments.duration
    while left > 0:
        guest.run(lambda: False, min(_LINE_PERIOD, left))
        left -= _LINE_PERIOD
        _tell_pace(meter, arguments.json)
    return 0


def _tell_pace(meter: PaceMeter, as_json: bool) -> None:
    pace = meter.take()
    if as_json:
        emit(json.dumps(asdict(pace) if pace else None))
    elif pace is None:
        emit("nothing new")
    else:
        intervals = f"min {pace.shortest:.4f} s, max {pace.longest:.4f} s, jitter {pace.jitter:.4f} s"
        emit(f"{pace.rate:.2f} Hz, {intervals}, {pace.messages} messages")

"""List the topics on the bus, show their messages, measure their rate, publish.

It sees ROS 2 nodes as well as components. It needs no robot on this machine: `--router` names another bus.
"""

from __future__ import annotations

import argparse
import json

from rbxcompose.bus.graph import GraphEnd
from rbxcompose.cli.bus.entities import (
    add_count_options,
    add_json_option,
    add_ls_options,
    add_timeout_option,
    count,
    described,
    hertz,
    seconds,
    table,
    tell_list,
    visit,
    wanted,
)
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.output.console import tell
from rbxcompose.cli.systems.options import BUS, add_system_options

ON_SYSTEM = BUS
_ENDS = ("publishers", "subscriptions")
_WINDOW = 100  # messages


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ls|show|echo|hz|pub", required=True)
    ls = actions.add_parser("ls", help="list the topics with their types")
    add_ls_options(ls)
    ls.set_defaults(do=_ls)
    show = actions.add_parser("show", help="show publishers and subscribers")
    add_json_option(show)
    show.set_defaults(do=_show)
    echo = actions.add_parser("echo", help="print the messages")
    add_count_options(echo)
    add_json_option(echo)
    echo.set_defaults(do=_echo)
    hz = actions.add_parser("hz", help="measure how often messages arrive")
    hz.add_argument("--window", type=count, default=_WINDOW, metavar="N", help=f"over so many messages ({_WINDOW})")
    hz.add_argument("--for", dest="duration", type=seconds, metavar="T", help="end after this time")
    add_json_option(hz)
    hz.set_defaults(do=_hz)
    pub = actions.add_parser("pub", help="publish a message, by default once")
    for one in (show, echo, hz, pub):
        one.add_argument("topic", metavar="TOPIC", help="its name, such as /odom")
    pub.add_argument("type", metavar="TYPE", help="such as geometry_msgs/Twist")
    pub.add_argument("message", metavar="MESSAGE", nargs="?", default="", help="YAML; missing fields are zero")
    pub.add_argument("--rate", type=hertz, metavar="10Hz", help="publish again and again, until interrupted")
    pub.add_argument("-n", "--count", type=count, metavar="N", help="end after this many")
    add_timeout_option(pub, "2s")
    add_json_option(pub)
    pub.set_defaults(do=_pub)
    for one in (ls, show, echo, hz, pub):
        add_bus_options(one)
        add_system_options(one)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


def _ls(guest: Guest, arguments: argparse.Namespace) -> int:
    return tell_list(guest.graph().topics, _ENDS, arguments)


def _show(guest: Guest, arguments: argparse.Namespace) -> int:
    topic = wanted(guest.graph().topics, arguments.topic, "topic")
    if arguments.json:
        tell(json.dumps(described(topic, _ENDS)))
        return 0
    tell(f"{topic.name}: {', '.join(topic.types)}")
    if topic.clash:
        tell(f"! {topic.clash}")
    ends = (("publisher", topic.givers), ("subscription", topic.takers))
    tell(table([(what, end.node, end.kind.type, _qos(end)) for what, given in ends for end in given]))
    return 0


def _qos(end: GraphEnd) -> str:
    if end.qos is None:
        return "unknown quality of service"
    reliability = "reliable" if end.qos.is_reliable else "best effort"
    durability = ", kept for late subscribers" if end.qos.is_transient_local else ""
    return f"{reliability}{durability}, {'all' if end.qos.keeps_all else f'newest {end.qos.depth}'}"


# Only the functions that use messages import what those need: a list takes half the time without it.


def _echo(guest: Guest, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.bus.topic_echo import echo

    return echo(guest, arguments)


def _hz(guest: Guest, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.bus.topic_hz import measure

    return measure(guest, arguments)


def _pub(guest: Guest, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.bus.topic_pub import publish

    return publish(guest, arguments)

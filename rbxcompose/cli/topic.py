"""List the topics on the bus, show their messages, measure their rate, publish.

It sees ROS 2 nodes as well as components. It needs no robot on this machine: `--router` names another bus.
"""

from __future__ import annotations

import argparse
import json
from functools import partial

from rbxcompose.bus.graph import GraphEnd
from rbxcompose.cli.bus.guest import Guest, described, tell_list, visit, wanted
from rbxcompose.cli.output.console import table, tell
from rbxcompose.cli.output.options import (
    BUS,
    Action,
    add_actions,
    add_count_options,
    add_json_option,
    add_ls_options,
    add_system_options,
    add_timeout_option,
    argument,
    count,
    hertz,
    seconds,
)
from rbxcompose.cli.robots.lookup import add_bus_options

ON_SYSTEM = BUS
_ENDS = ("publishers", "subscriptions")
_WINDOW = 100  # messages


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    topic = argument("topic", metavar="TOPIC", help="its name, such as /odom")
    window = argument("--window", type=count, default=_WINDOW, metavar="N", help=f"over so many messages ({_WINDOW})")
    duration = argument("--for", dest="duration", type=seconds, metavar="T", help="end after this time")
    type_ = argument("type", metavar="TYPE", help="such as geometry_msgs/Twist")
    message = argument("message", metavar="MESSAGE", nargs="?", default="", help="YAML; missing fields are zero")
    rate = argument("--rate", type=hertz, metavar="10Hz", help="publish again and again, until interrupted")
    most = argument("-n", "--count", type=count, metavar="N", help="end after this many")
    timeout = partial(add_timeout_option, default="2s")
    sent = (topic, type_, message, rate, most, timeout, add_json_option)
    actions = (
        Action("ls", "list the topics with their types", _ls, (add_ls_options,)),
        Action("show", "show publishers and subscribers", _show, (add_json_option, topic)),
        Action("echo", "print the messages", _echo, (add_count_options, add_json_option, topic)),
        Action("hz", "measure how often messages arrive", _hz, (window, duration, add_json_option, topic)),
        Action("pub", "publish a message, by default once", _pub, sent),
    )
    add_actions(parser, actions, add_bus_options, add_system_options)


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
    from rbxcompose.cli.bus.exchange import echo

    return echo(guest, arguments)


def _hz(guest: Guest, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.bus.exchange import measure

    return measure(guest, arguments)


def _pub(guest: Guest, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.bus.exchange import publish

    return publish(guest, arguments)

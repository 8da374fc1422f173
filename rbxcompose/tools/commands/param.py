"""See and change parameters while the robot runs, also of ROS 2 nodes; keep them in the manifest.

A value is written as in a manifest (`param set battery runtime "30 s"`); a bare number is SI, and so is JSON. What
changes values refuses what `check` would refuse, with the values that all components have now, and changes all of
several values or none. A change lasts until the process ends; `save` writes it into the manifest, at its place.
Exit codes: 0 done, 1 refused (`diff`: there is a difference), 2 wrong usage.
"""

import argparse
from functools import partial
from pathlib import Path

from rbxcompose.commands import options
from rbxcompose.commands.guest import visit
from rbxcompose.commands.hosts import SystemCommand
from rbxcompose.commands.lookup import add_bus_options
from rbxcompose.tools.parameters.nodes import ParameterNodes

GROUP = "data"
ON_SYSTEM = options.BUS
FOR_ALL = ("ls", "get", "describe", "history", "dump")
_WITH_FILES = ("load", "save", "diff", "reset")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    only = options.argument("component", metavar="COMPONENT", nargs="?", help="only those of this component or node")
    component = options.argument("component", metavar="COMPONENT", help="a component or node, such as battery")
    any_name = options.argument("name", metavar="PARAMETER", nargs="?", help="the parameter, such as runtime; else all")
    words = "COMPONENT PARAMETER VALUE, or several COMPONENT.PARAMETER=VALUE; values as in a manifest: '30 s', [1, 2]"
    values = options.argument("words", metavar="COMPONENT|SETTING|PARAMETER", nargs="+", help=words)
    words = "as `dump` writes it, or `ros2 param dump`; - is stdin"
    file = options.argument("file", metavar="FILE", type=Path, help=words)
    names = options.argument(
        "names", metavar="COMPONENT|SETTING", nargs="*", help="only these: battery, battery.runtime"
    )
    words = "this one, as `history` calls it: battery:3"
    change = options.argument("--change", metavar="CHANGE", default="", help=words)
    last = options.argument("-n", "--last", metavar="N", type=options.count, default=0, help="only the last N")
    dry = options.argument("--dry-run", action="store_true", help="only show what would be written")
    words = "only if a dry run told this hash, so that what is written is what was shown"
    seen = options.argument("--only-as", metavar="HASH", default="", help=words)
    table: tuple[tuple[str, str, str, tuple[options.Declare, ...]], ...] = (
        ("ls", "nodes", "list parameters with their values", (only,)),
        ("get", "nodes", "print the value of a parameter, or all of a component", (component, any_name)),
        ("describe", "nodes", "show what a parameter is, its limits, and whether it may change", (component, any_name)),
        ("set", "changes", "change parameters, all or none", (values,)),
        ("load", "changes", "set all parameters of a file, all or none", (file,)),
        ("reset", "files", "set parameters to the values in the manifest", (names,)),
        ("undo", "changes", "take back the last change, or another one", (change,)),
        ("history", "changes", "list the changes: who, when, from what to what", (only, last)),
        ("watch", "changes", "follow the changes", (only, options.add_count_options)),
        ("diff", "files", "show what is not as in the manifest", ()),
        ("dump", "files", "write the live parameters as YAML, for `load`", (only,)),
        ("save", "files", "write changed values into the manifest, each at its place", (names, dry, seen)),
    )
    actions = (
        options.Subcommand(verb, words, options.deferred(f"rbxcompose.tools.parameters.{module}", f"param_{verb}"), own)
        for verb, module, words, own in table  # some modules need the compiler, and others do not
    )
    timeout = partial(options.add_timeout_option, default="5s")
    options.add_actions(parser, actions, timeout, options.add_json_option, add_bus_options, options.add_system_options)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit(arguments, lambda guest: options.run_action(arguments, ParameterNodes(guest, arguments.timeout)))


def run_on_system(command: SystemCommand) -> int | None:
    """Run what works with the files of a robot on another host: its live values, and the files of this one."""
    action = command.arguments.action
    if action not in _WITH_FILES:
        return None
    if len(command.shares) > 1:
        return command.refuse(f"'param {action}' works with the files of one robot")
    ((_, robot), remote), *_ = command.shares.items()
    if remote.is_here:
        return None
    from rbxcompose.tools.parameters.files import RemoteParameters  # the compiler

    parameters = RemoteParameters(command.system, command.system.robots[robot], remote, command.words_for(robot))
    return parameters.run(command.arguments)

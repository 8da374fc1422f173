"""See and change parameters while the robot runs, also of ROS 2 nodes; keep them in the manifest.

A value is written as in a manifest (`param set battery runtime "30 s"`); a bare number is SI, and so is JSON. What
changes values refuses what `check` would refuse, with the values that all components have now, and changes all of
several values or none. A change lasts until the process ends; `save` writes it into the manifest, at its place.
Exit codes: 0 done, 1 refused (`diff`: there is a difference), 2 wrong usage.
"""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

from rbxcompose.cli.bus.entities import add_count_options, add_json_option, add_timeout_option, visit
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.systems.options import BUS, add_system_options

ON_SYSTEM = BUS
_MODULES = {  # where each is carried out; some import the compiler, which others do not need
    "listed_values": ("ls", "get", "describe"),
    "set_verbs": ("set", "load", "reset", "undo"),
    "history_verbs": ("history", "watch"),
    "manifest_verbs": ("diff", "dump", "save"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    verbs = [verb for each in _MODULES.values() for verb in each]
    actions = parser.add_subparsers(dest="action", metavar="|".join(verbs), required=True)

    def add(verb: str, help: str) -> argparse.ArgumentParser:
        return actions.add_parser(verb, help=help)

    ls = add("ls", "list parameters with their values")
    get = add("get", "print the value of a parameter")
    describe = add("describe", "tell what a parameter is, its limits, and whether it may change")
    set_ = add("set", "change parameters, all or none")
    load = add("load", "set all parameters of a file, all or none")
    reset = add("reset", "set parameters to the values in the manifest")
    undo = add("undo", "take back the last change, or another one")
    history = add("history", "list the changes: who, when, from what to what")
    watch = add("watch", "follow the changes")
    add("diff", "show what is not as in the manifest")
    dump = add("dump", "write the live parameters as YAML, for `load`")
    save = add("save", "write changed values into the manifest, each at its place")
    for one in (ls, history, watch, dump):
        one.add_argument("component", metavar="COMPONENT", nargs="?", help="only those of this component or node")
    for one in (get, describe):
        one.add_argument("component", metavar="COMPONENT", help="a component or node, such as battery")
    get.add_argument("name", metavar="PARAMETER", help="the parameter, such as runtime")
    describe.add_argument("name", metavar="PARAMETER", nargs="?", help="the parameter, such as runtime; else all")
    words = "COMPONENT PARAMETER VALUE, or several COMPONENT.PARAMETER=VALUE; values as in a manifest: '30 s', [1, 2]"
    set_.add_argument("words", metavar="COMPONENT|SETTING|PARAMETER", nargs="+", help=words)
    load.add_argument("file", metavar="FILE", type=Path, help="as `dump` writes it, or `ros2 param dump`; - is stdin")
    for one in (reset, save):
        one.add_argument("names", metavar="COMPONENT|SETTING", nargs="*", help="only these: battery, battery.runtime")
    undo.add_argument("--change", metavar="CHANGE", default="", help="this one, as `history` calls it: battery:3")
    history.add_argument("-n", "--last", metavar="N", type=int, default=0, help="only the last N")
    save.add_argument("--dry-run", action="store_true", help="only show what would be written")
    add_count_options(watch)
    for verb in verbs:
        add_timeout_option(actions.choices[verb], "5s")
        add_json_option(actions.choices[verb])
        add_bus_options(actions.choices[verb])
        add_system_options(actions.choices[verb])


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    home = next(module for module, verbs in _MODULES.items() if arguments.action in verbs)
    do = getattr(import_module(f"rbxcompose.cli.parameters.{home}"), f"param_{arguments.action}")
    return visit(arguments, lambda guest: int(do(ParameterNodes(guest, arguments.timeout), arguments)))

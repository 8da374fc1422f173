"""Shared options of verbs that compile a robot: profiles, overlays and values on top of its file."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from typing import TypedDict

from rbxcompose.compiler import Compilation, compile_robot
from rbxcompose.manifest.library import PREFIX
from rbxcompose.runtime.options import ChosenLayers


class Layers(TypedDict):
    """The arguments of `compile_robot` besides the robot's file."""

    profiles: Sequence[str]
    overlays: Sequence[str]
    sets: Sequence[str]
    real: bool
    environment: Mapping[str, str]


def add_layer_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--profile`, `-f`, `--set` and `--real`."""
    parser.add_argument("--profile", action="append", default=[], metavar="P", help="apply this profile")
    parser.add_argument(
        "-f", "--file", action="append", default=[], dest="overlays", metavar="FILE", help="apply this overlay"
    )
    parser.add_argument("--set", action="append", default=[], dest="sets", metavar="K=V", help="change one value")
    parser.add_argument("--real", action="store_true", help="use the real devices; without it, they are simulated")


def layers_of(arguments: argparse.Namespace) -> Layers:
    """Return all layers that a command puts over the robot's file."""
    return {
        "profiles": arguments.profile,
        "overlays": arguments.overlays,
        "sets": arguments.sets,
        "real": arguments.real,
        "environment": os.environ,
    }


def chosen_layers(arguments: argparse.Namespace) -> ChosenLayers:
    """Return the same layers for the robot to remember; from any folder they mean the same files."""
    overlays = tuple(one if one.startswith(PREFIX) else os.path.abspath(one) for one in arguments.overlays)
    return ChosenLayers(tuple(arguments.profile), overlays, tuple(arguments.sets), arguments.real)


def compiled(robot: str, arguments: argparse.Namespace) -> Compilation:
    """Compile a robot with all layers that a command puts over its file."""
    return compile_robot(robot, **layers_of(arguments))

"""Pictures of arms: motions that `arm` tries, and where a tip gets (`arm picture`)."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.config import Config, Length, Time
from rbxcompose.base.files import replace_file
from rbxcompose.commands.console import NotDoneError, misused, refuse, tell
from rbxcompose.domains.arms.arm_config import ArmWorks
from rbxcompose.domains.arms.command_goals import NO_MOTION, read_written
from rbxcompose.domains.arms.motion.groups import moved_links
from rbxcompose.domains.arms.motion.planner import MotionPlan
from rbxcompose.domains.arms.motion.reach import DIRECTIONS, Cut, ReachMap, reached
from rbxcompose.domains.arms.reasons import MotionFailure
from rbxcompose.domains.body.meshes import MissingLibraryError


def draw_motion(
    arguments: argparse.Namespace,
    works: ArmWorks,
    start: NDArray[np.float64],
    goal: NDArray[np.float64],
    found: MotionPlan | MotionFailure | None,
) -> int:
    """Draw a motion, or why there is none; return the exit code."""
    from rbxcompose.domains.arms.motion.picture import ArmPicture, draw_arm  # its libraries take long

    names, failure = works.space.names, found if isinstance(found, MotionFailure) else None
    is_at_start = found is None or (failure is not None and failure.reason.startswith("start"))
    way = works.way(found.waypoints) if isinstance(found, MotionPlan) else ()
    colliding = [] if way else works.planner.checker.colliding(start if is_at_start else goal)
    positions = [dict(zip(names, values.tolist(), strict=True)) for values in (start, goal)]
    shown = ArmPicture(
        works.kinematics.body,
        works.meshes,
        positions[0],
        works.objects,
        {} if is_at_start else positions[1],
        [link for link, joints in moved_links(works.kinematics.body, names).items() if joints],
        way,
        {link for pair in colliding for link in pair},
        f"{arguments.goal}" if found is None else f"{arguments.start or 'at rest'} to {arguments.goal} (green)",
        f"{failure.reason}: {failure.text}" if failure is not None else "",
    )
    return write_picture("arm", Path(arguments.picture), lambda: draw_arm(shown))


REACH, EASE = "reach", "manipulability"
SAMPLES, MOST_TIME = 1_000_000, 3600.0
LEAST_SIDE = 0.002  # [m] of a cell


class _ReachModel(Config):
    """Options with units."""

    cell: Length = 0.04
    """Side of a cell."""
    time: Time = 20.0
    """How long positions are tried, at most."""
    x: Length | None = None
    """Where a layer is."""
    y: Length | None = None
    """Where a layer is."""
    z: Length | None = None
    """Where a layer is."""


def add_reach_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `arm picture`."""
    parser.add_argument("what", choices=(REACH, EASE), help=f"{REACH}: of {DIRECTIONS} directions; {EASE}: Yoshikawa's")
    parser.add_argument("--out", metavar="FILE", required=True, help="the picture, a PNG")
    words = "the layer that is shown, such as 'y: -10 cm' of the root, or 'all' (default: through the arm's base)"
    parser.add_argument("--layer", metavar="AXIS: AT", default="", help=words)
    parser.add_argument("--cell", metavar="LENGTH", default="4 cm", help="side of a cell (default: 4 cm)")
    parser.add_argument(
        "--samples", type=_samples, default=SAMPLES, metavar="N", help=f"positions (default: {SAMPLES})"
    )
    parser.add_argument("--seed", type=_count, default=1, metavar="S", help="the same one tries the same positions")
    parser.add_argument("--time", metavar="T", default="20 s", help="when it ends at the latest (default: 20 s)")
    parser.add_argument(
        "--from", dest="start", metavar="GOAL", default="", help="how the arm is drawn (default: at rest)"
    )


def _count(text: str) -> int:
    if not text.isdecimal() or len(text) > 9:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 0, not '{text}'")
    return int(text)


def _samples(text: str) -> int:
    if (count := _count(text)) == 0:
        raise argparse.ArgumentTypeError("must be at least 1")
    return count


def run_reach(arguments: argparse.Namespace, works: ArmWorks, start: NDArray[np.float64]) -> int:
    """Try positions, draw the picture, tell what is in it; return the exit code."""
    layer = "" if arguments.layer in ("", "all") else f", {arguments.layer}"
    wish = read_written(_ReachModel, f"{{cell: {arguments.cell}, time: {arguments.time}{layer}}}")
    if not (wish.cell >= LEAST_SIDE and 0.0 < wish.time <= MOST_TIME):
        words = f"a cell is at least {LEAST_SIDE * 1000:g} mm, and the time above 0 and at most {MOST_TIME:g} s"
        raise NotDoneError(NO_MOTION.at(None, words))
    cut, began = _cut(arguments, works, wish, start), perf_counter()
    found = _tried(arguments, works, wish, cut)
    text = _told(arguments, found, cut, perf_counter() - began)
    if failed := write_picture(
        "arm", Path(arguments.out), lambda: _drawn(arguments.what, works, start, found, cut, text)
    ):
        return failed
    if arguments.json:
        told = [
            {"cell": list(cell), "directions": len(found_cell.directions), "manipulability": found_cell.manipulability}
            for cell, found_cell in sorted(found.cells.items())
        ]
        data = {"side": found.side, "of": DIRECTIONS, "samples": found.tried, "seed": arguments.seed, "cells": told}
        tell(json.dumps({**data, "colliding": found.colliding, "joints": list(works.space.names)}))
        return 0
    tell(text)
    tell(f"wrote {arguments.out}")
    return 0


def _cut(arguments: argparse.Namespace, works: ArmWorks, wish: _ReachModel, start: NDArray[np.float64]) -> Cut | None:
    """Return the layer to show; None for all cells."""
    given = [(axis, at) for axis, at in enumerate((wish.x, wish.y, wish.z)) if at is not None]
    if arguments.layer == "all":
        return None
    if len(given) > 1:
        raise NotDoneError(NO_MOTION.at(None, "a layer has one of x, y and z"))
    if given:
        return Cut(*given[0])
    kinematics = works.kinematics
    return Cut(1, kinematics.poses(start)[kinematics.group.base].translation[1])


def _tried(arguments: argparse.Namespace, works: ArmWorks, wish: _ReachModel, cut: Cut | None) -> ReachMap:
    began, found = perf_counter(), ReachMap({}, wish.cell, 0, 0)
    work = reached(
        works.kinematics,
        works.space,
        works.planner.checker,
        side=wish.cell,
        samples=arguments.samples,
        seed=arguments.seed,
        cut=cut,
    )
    while perf_counter() - began < wish.time:
        try:
            found = next(work)
        except StopIteration:
            break
    return found


def _told(arguments: argparse.Namespace, found: ReachMap, cut: Cut | None, took: float) -> str:
    where = "" if cut is None else f" at {'xyz'[cut.axis]} {cut.at * 100:.1f} cm"
    tried = f"{found.tried:,} random positions, seed {arguments.seed}, {took:.1f} s"
    if not found.cells:
        return f"the tip gets to no cell{where} ({tried})"
    counts = [len(cell.directions) for cell in found.cells.values()]
    best = max(cell.manipulability for cell in found.cells.values())
    some = f"{sum(counts) / len(counts):.1f} of {DIRECTIONS} directions on average, at most {max(counts)}"
    words = some if arguments.what == REACH else f"manipulability up to {best:.3g} m^3/rad^3"
    return f"the tip gets to {len(counts):,} cells of {found.side * 100:g} cm{where}: {words} ({tried})"


def _drawn(
    what: str, works: ArmWorks, start: NDArray[np.float64], found: ReachMap, cut: Cut | None, text: str
) -> bytes:
    from rbxcompose.domains.arms.motion.picture import ArmPicture
    from rbxcompose.domains.arms.motion.reach import ReachPicture, draw_reach

    positions = dict(zip(works.space.names, start.tolist(), strict=True))
    robot = ArmPicture(works.kinematics.body, works.meshes, positions, works.objects, told=text)
    if what == REACH:
        values = {cell: float(len(found_cell.directions)) for cell, found_cell in found.cells.items()}
        legend = f"directions of the tip's x axis, of {DIRECTIONS}"
    else:
        values = {cell: found_cell.manipulability for cell, found_cell in found.cells.items()}
        legend = "manipulability of the tip's position [m^3/rad^3]"
    most = max(values.values(), default=math.nan)
    return draw_reach(ReachPicture(robot, values, found.side, most, legend, cut is not None))


def write_picture(verb: str, file: Path, draw: Callable[[], bytes]) -> int:
    """Draw a picture into a file; return the exit code."""
    try:
        replace_file(file.resolve(), draw())
    except MissingLibraryError as error:
        return refuse(error.finding)
    except ValueError as error:
        return misused(verb, str(error))
    except OSError as error:
        return misused(verb, f"'{file}' cannot be written: {error.strerror}")
    return 0

"""`arm setup`: pairs of links that need not be watched, poses that collide, and arms that a body seems to have."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.arrays import np
from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Finding, Report, Severity, Sources, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import FINDINGS, emit, refuse, write_report
from rbxcompose.commands.new_files import name_like, robot_file, write_new
from rbxcompose.commands.options import out_option
from rbxcompose.commands.targets import compiled, missing_extras, robot_path
from rbxcompose.compiler.compile import Compilation
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.arms.arm_config import ArmConfig
from rbxcompose.domains.arms.command_line import whole_number, works_of
from rbxcompose.domains.arms.drafts import manifest_of, proposed_arms
from rbxcompose.domains.arms.motion.collisions import MeshChecker, adjacent_pairs, sampled_matrix
from rbxcompose.domains.arms.sections.arms import arms
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import CollisionMatrix, LinkPair, read_matrix
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.body.source import bare_body, is_description
from rbxcompose.manifest.files import PREFIX, find, shown_name
from rbxcompose.manifest.reader import read_source
from rbxcompose.manifest.tree import ScalarNode, at

NO_SETUP = kind("RBX9420")
TOUCH_AT_REST = kind("RBX9421", Severity.WARNING)
SAMPLES, LEAST = 50_000, 100  # with fewer, what collides at rest by chance would be left out for ever
_BAR = 30


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `arm setup`."""
    parser.add_argument(
        "--samples", type=whole_number(LEAST), default=SAMPLES, metavar="N", help=f"positions (default: {SAMPLES})"
    )
    parser.add_argument("--seed", type=whole_number(0), default=1, metavar="S", help="the same one gives the same file")
    words = "the file (default: the one under 'collisions', or ROBOT.collisions.yaml; a profile has its own)"
    out_option(words)(parser)
    words = "examine all poses on the shapes of the body instead, and report what collides"
    parser.add_argument("--check", action="store_true", help=words)
    words = "print a robot with the arms that a .urdf file seems to have, or write it to the file of --out"
    parser.add_argument("--propose", action="store_true", help=words)


def run_setup(arguments: argparse.Namespace) -> int:
    """Try positions and write the file."""
    path = robot_path(arguments.path, may_run=False)
    if arguments.propose or is_description(path):
        return _propose(path, arguments)
    compilation = compiled(path, arguments)
    report = Report([finding for finding in compilation.report if finding.severity is Severity.ERROR])
    write_report(report, compilation.sources)
    description = compilation.robot.manifest.contents.of(body) if compilation.robot is not None else None
    found = find(path)
    if report.has_errors or isinstance(found, Finding) or compilation.robot is None:
        return 1
    if description is None:
        return refuse(NO_SETUP.at(None, "this robot has no body", help="describe it under 'body'"))
    if arguments.check:
        return _checked(compilation.robot, compilation, is_json=arguments.json)
    if path.startswith(PREFIX) and arguments.out is None:
        return refuse(NO_SETUP.at(None, f"'{plain(path)}' is of the library", help="name a file of yours with '--out'"))
    file = _file(found, compilation.robot, arguments)
    made = _sampled(description, arguments)
    if isinstance(made, Finding):
        return refuse(made)
    matrix = _with_users(file, description, made)
    if isinstance(matrix, Finding):
        return refuse(matrix)
    try:
        replace_file(file.resolve(), matrix.text().encode())
    except OSError as error:
        return refuse(NO_SETUP.at(None, f"'{plain(str(file))}' cannot be written: {error.strerror}"))
    _show(file, matrix, compilation.sources, is_json=arguments.json)
    if not arguments.json and shown_name(file) not in compilation.sources:
        if not compilation.robot.manifest.contents.of(arms):
            emit("this robot has no arms: 'rbxcompose arm setup FILE.urdf --propose' proposes some for its body")
        emit(f"for arms to use it, the robot says\nbody:\n  collisions: {os.path.relpath(file, found.parent)}")
    return 0


def _file(robot_file: Path, robot: Robot, arguments: argparse.Namespace) -> Path:
    """Return the file to write: the one that the robot names, unless a profile changes the body."""
    if arguments.out is not None:
        return Path(arguments.out)
    named = at(robot.manifest.root, ("body", "collisions"))
    if isinstance(named, ScalarNode) and not arguments.profile:
        return robot_file.parent / named.text
    return robot_file.with_name(".".join((robot.manifest.name, *arguments.profile, "collisions", "yaml")))


def _propose(path: str, arguments: argparse.Namespace) -> int:

    if not is_description(path):
        words = f"'{plain(path)}' is a robot, and --propose makes one of a .urdf file"
        return refuse(NO_ARM.at(None, words, help="give the file of its body"))
    described = bare_body(path)
    file = find(path)
    report = Report([finding for finding in described.report if finding.severity is Severity.ERROR])
    if described.description is None or isinstance(file, Finding):
        write_report(report, described.sources)
        return 1
    return run_proposal(arguments, described.description, file)


def _checked(robot: Robot, compilation: Compilation, *, is_json: bool) -> int:
    lacking = Report([*missing_extras(robot)])
    if lacking.has_errors:
        write_report(lacking, compilation.sources)
        return 1

    return run_check(robot, compilation, is_json=is_json)


def _sampled(description: Description, arguments: argparse.Namespace) -> CollisionMatrix | Finding:
    try:
        sampling = sampled_matrix(description, arguments.samples, arguments.seed)
        while True:
            _show_progress(next(sampling), arguments.samples)
    except StopIteration as ended:
        found: CollisionMatrix = ended.value
        _show_progress(None, arguments.samples)
        return found
    except ModuleNotFoundError as error:
        return NO_SETUP.at(None, f"it needs the package '{error.name}'", help="pip install 'rbxcompose[arm]'")
    except ValueError as error:
        return NO_SETUP.at(None, str(error))


def _show_progress(count: int | None, samples: int) -> None:
    """Draw a bar on a terminal; without a count, remove it."""
    if not sys.stderr.isatty():
        return
    full = _BAR * (count or 0) // max(1, samples)
    bar = f"{'#' * full}{'.' * (_BAR - full)} {count} of {samples} positions" if count is not None else "\x1b[K"
    sys.stderr.write(f"\r{bar}" + ("" if count is not None else "\r"))
    sys.stderr.flush()


def _with_users(file: Path, description: Description, made: CollisionMatrix) -> CollisionMatrix | Finding:
    """Return the matrix with the pairs that the file has by the word of a person."""
    if not file.is_file():
        return made
    text, _ = read_source(file, shown_name(file), {}, what="a file of pairs of links")
    old, _ = read_matrix(text, shown_name(file), description.body, "") if text is not None else (None, [])
    if old is None:
        words = f"'{plain(shown_name(file))}' is no file of pairs of links, so it is not replaced"
        return NO_SETUP.at(None, words, help="give another one with '--out', or remove it")
    kept = {pair: reason for pair, reason in old.pairs.items() if reason == "user"}
    there = {pair for pair in kept if set(pair) <= description.body.links.keys()}
    return replace(made, pairs={**made.pairs, **{pair: kept[pair] for pair in there}})


def _show(file: Path, matrix: CollisionMatrix, sources: Sources, *, is_json: bool) -> None:
    """Print what was written."""
    if is_json:
        pairs = [{"pair": list(pair), "reason": reason} for pair, reason in sorted(matrix.pairs.items())]
        emit(json.dumps({"file": shown_name(file), "samples": matrix.samples, "seed": matrix.seed, "pairs": pairs}))
        return
    words = ", ".join(f"{count} {reason}" for reason, count in matrix.counts().items())
    emit(f"wrote {shown_name(file)}: {words or 'no pairs'}")
    for reason in ("always", "user"):
        if found := matrix.having(reason):
            emit(f"not watched, {reason}: {pair_list(found)}")
    if resting := matrix.having("default"):
        message = f"these collide at rest and stay watched: {pair_list(resting)}"
        write_report(Report([TOUCH_AT_REST.at(None, message)]), sources)


COLLIDES = kind("RBX9423")
UNWATCHED = kind("RBX9424", Severity.WARNING)


def run_check(robot: Robot, compilation: Compilation, *, is_json: bool) -> int:
    """Examine all poses; print what collides."""
    found = list(_findings(robot))
    report = Report([finding for _, _, _, finding in found])
    if is_json:
        keys = ("arm", "pose", "pairs", "code")
        emit(
            json.dumps(
                [dict(zip(keys, (arm, pose, pairs, finding.code), strict=True)) for arm, pose, pairs, finding in found]
            )
        )
    else:
        write_report(report, compilation.sources)
    if not found and not is_json:
        count = sum(len(arm.model.poses) for arm in robot.manifest.contents.of(arms).values())
        emit(f"{count} poses, none of them in collision")
    return FINDINGS if report.has_errors else 0


def _findings(robot: Robot) -> Iterator[tuple[str, str, list[tuple[str, str]], Finding]]:
    contents, description = robot.manifest.contents, robot.manifest.contents.of(body)
    if description is None:
        return
    matrix = description.matrix.pairs if description.matrix is not None else {}
    for name, arm in contents.of(arms).items():
        config = robot.components[name].config
        if not isinstance(config, ArmConfig):
            continue
        works = works_of(robot, config, description, is_fast=False)
        every = MeshChecker(works.kinematics, description.meshes, adjacent_pairs(description.body))
        rest = [description.body.joints[joint].rest for joint in works.space.names]
        for pose in arm.model.poses:
            at = config.poses[pose]
            values = np.array([at.get(joint, still) for joint, still in zip(works.space.names, rest, strict=True)])
            span = robot.value("arms", name, "poses", pose)
            if pairs := works.planner.checker.colliding(values):
                message = f"the pose '{pose}' of '{name}' is in collision: {pair_list(pairs)}"
                yield name, pose, pairs, COLLIDES.at(span, message)
            if hidden := [pair for pair in every.colliding(values) if matrix.get(pair) in ("never", "user")]:
                reasons = " and ".join(sorted({f"'{matrix[pair]}'" for pair in hidden}))
                message = (
                    f"links collide in the pose '{pose}' of '{name}' that are there as {reasons}: {pair_list(hidden)}"
                )
                yield name, pose, hidden, UNWATCHED.at(span, message)


NO_ARM = kind("RBX9422")


def run_proposal(arguments: argparse.Namespace, description: Description, file: Path) -> int:
    """Write a robot with the arms that a body seems to have, or print it; it is never written over a file."""
    drafts = proposed_arms(description.body)
    if not drafts:
        return refuse(NO_ARM.at(None, f"'{shown_name(file)}' has no row of joints that could be an arm"))
    name = name_like(file.stem) or "robot"
    top = f"# Proposed by `rbxcompose arm setup --propose` for {file.name}: correct what is a guess.\n"
    text = f"{top}rbx: 1\nkind: Robot\nname: {name}\n\n{manifest_of(description.body, drafts, file.name)}"
    if arguments.out is None:
        emit(text.rstrip("\n"))
        return 0
    out = robot_file(arguments.out)
    if (problem := write_new(out.parent, {out.name: text})) is not None:
        return refuse(problem)
    emit(f"wrote {shown_name(out.absolute())}: {', '.join(draft.name for draft in drafts)}")
    return 0


def pair_list(pairs: Sequence[LinkPair], most: int = 10) -> str:
    """Return pairs of links in words."""
    words = ", ".join(f"{text} - {other}" for text, other in pairs[:most])
    return words + (f" and {len(pairs) - most} more" if len(pairs) > most else "")

"""Show and change what arms must not hit, and what they hold, while the robot runs.

Changes last until the robot goes down; write objects in the manifest under `scene:` to keep them, or `save` them in a
file `.scene` that `scene: {file: ...}` names.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Finding, Report, clauses, kind, suggest
from rbxcompose.base.requests import Command, to_data
from rbxcompose.commands.console import NotDoneError, emit, misused, refuse, table, write_report
from rbxcompose.commands.lookup import add_asking_options, answer_of, find_robot, pass_on
from rbxcompose.commands.options import Declare, Subcommand, add_actions, argument, out_option, run_action
from rbxcompose.domains.arms import scene_view
from rbxcompose.domains.arms.command_line import write_picture
from rbxcompose.domains.arms.motion.scene import PairDistance, PlacedObject
from rbxcompose.domains.arms.motion.scene_text import written_scene
from rbxcompose.domains.arms.sections.scene import NO_MESH, ObjectModel, file_mistake, scene_of
from rbxcompose.domains.body.meshes import MissingLibraryError, read_mesh
from rbxcompose.domains.body.model import Body, Geometry
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import read_urdf
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.validate import validate

GROUP = "bodies and arms"
NO_PAIR = kind("RBX9426")
ON_SYSTEM = scene_view.SCENE
FOR_ALL = ("ls", "check", "distance")
_SHOWN = "OBJECT"  # name of the object's text in findings
Do = Callable[[argparse.Namespace], int]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    name = argument("name", metavar="NAME", help="the object")
    words = "as in a manifest: '{box: [60 cm, 40 cm, 2 cm], at: {x: 50 cm}}'"
    written = argument("object", metavar="OBJECT", help=words)
    carrier = argument("link", metavar="LINK", help="a link of the body, such as right_gripper_link")
    words = "a link that it may touch"
    touch = argument("--touch", metavar="LINK", action="append", default=[], help=words)
    file = argument("file", metavar="FILE", help="a scene file of MoveIt, such as table.scene")
    words = "the link in whose frame they are (default: the root)"
    link = argument("--link", metavar="LINK", default="", help=words)
    arm = argument("--arm", metavar="NAME", default="", help="the arm that watches (default: the first one)")
    pair = argument("pair", metavar="NAME", nargs="*", help="one or two links or objects")
    out = out_option("the picture (default: scene.png)", default="scene.png")
    ask = add_asking_options
    hold = "let an object move with a link, as when a gripper holds it"
    stays = "It stays where it is, and may touch the link and all that this carries, or the links of --touch."
    save = "write the objects around the robot into a file, in the frame of the body's root"
    watch = "print the goals and plans of arms, and the scene, as they change, until Ctrl-C"
    check = "report what collides now: links and objects that are nearer than they may be"
    distance = "report which two links or objects are the nearest to each other, or those of A [and B]"
    picture = "draw the robot as it stands now, with what is around it, and the way that is planned"
    table: tuple[tuple[str, str, Do, tuple[Declare, ...]], ...] = (
        ("ls", "list the objects", _ls, (ask,)),
        ("add", "put an object into the scene", _add, (name, written, ask)),
        ("remove", "take an object out of the scene", _passing(scene_view.RemoveFromScene), (name, ask)),
        ("attach", hold, _attach, (name, carrier, ask, touch)),
        ("detach", "let an object stay where it is", _passing(scene_view.DetachInScene), (name, ask)),
        ("load", "put the objects of a file into the scene", _load, (file, ask, link)),
        ("save", save, _save, (file, ask)),
        ("watch", watch, _watch, (ask,)),
        ("check", check, _check, (ask, arm)),
        ("distance", distance, _distance, (ask, arm, pair)),
        ("picture", picture, _picture, (ask, arm, out)),
    )
    add_actions(
        parser, (Subcommand(verb, about, do, own, stays if do is _attach else about) for verb, about, do, own in table)
    )


run = run_action


def _objects(arguments: argparse.Namespace) -> tuple[PlacedObject, ...]:
    return answer_of(find_robot(arguments.robot), scene_view.ListScene())


def _ls(arguments: argparse.Namespace) -> int:
    found = _objects(arguments)
    if arguments.json:
        emit(json.dumps([to_data(thing) for thing in found]))
    elif not found:
        emit("the scene is empty")
    else:
        emit(table([("name", "shape", "size", "link", "position", "may touch"), *map(_row, found)]))
    return 0


def _row(thing: PlacedObject) -> tuple[str, ...]:
    kinds = ", ".join(piece.shape.kind for piece in thing.all_pieces)
    size = "" if thing.shape.kind in ("plane", "mesh") else _lengths(thing.shape.size)
    touches = ", ".join((*thing.touches, *thing.touches_objects))
    return thing.name, kinds, size, thing.link, _lengths(thing.pose.translation), touches


def _lengths(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value * 100:g}" for value in values) + " cm"


def _add(arguments: argparse.Namespace) -> int:
    root, findings = read_text(arguments.object, _SHOWN)
    report = Report()
    report.extend(findings)
    read = validate(ObjectModel, root, (), report) if root is not None and not findings else None
    file = Path(read.file).absolute() if read is not None and read.file else None
    if read is not None and file is not None and (problem := file_mistake(read, file)):
        report.add(NO_MESH.at(None, problem))
        read = None
    if read is None:
        write_report(report, {_SHOWN: arguments.object})
        return 1
    return pass_on(arguments, scene_view.AddToScene(read.placed(arguments.name, "", file)))


def _passing(command: Callable[[str], Command]) -> Do:
    return lambda arguments: pass_on(arguments, command(arguments.name))


def _attach(arguments: argparse.Namespace) -> int:
    return pass_on(arguments, scene_view.AttachInScene(arguments.name, arguments.link, tuple(arguments.touch)))


def _load(arguments: argparse.Namespace) -> int:
    found = scene_of(Path(arguments.file))
    if isinstance(found, Finding):
        return refuse(found)
    return pass_on(
        arguments, scene_view.LoadScene(written_scene(found.name, found.objects), arguments.file, arguments.link)
    )


def _save(arguments: argparse.Namespace) -> int:
    """Write what stands around the robot; what it holds, and octrees, are left out and named."""
    folder = find_robot(arguments.robot)
    stands = answer_of(folder, scene_view.StandingObjects())
    kept = [thing for thing in stands if all(piece.shape.kind != "octree" for piece in thing.all_pieces)]
    names = [item.name for item in kept]
    try:
        text = written_scene(folder.path.name, [_with_triangles(item) for item in kept])
        replace_file(Path(arguments.file).resolve(), text.encode())
    except MissingLibraryError as error:
        return refuse(error.finding)
    except ValueError as error:
        return misused("scene", str(error))
    except OSError as error:
        return misused("scene", f"'{arguments.file}' cannot be written: {error.strerror}")
    left = [thing.name for thing in _objects(arguments) if thing.name not in names]
    words = f"wrote {arguments.file}: {len(kept)} object{'s' if len(kept) != 1 else ''}"
    text_line = f"{words}; left out: {', '.join(left)}" if left else words
    emit(json.dumps({"file": arguments.file, "objects": len(kept), "left_out": left}) if arguments.json else text_line)
    return 0


def _with_triangles(thing: PlacedObject) -> PlacedObject:
    """Return an object whose meshes are no files.

    Raises:
        MissingLibraryError: if a library is missing.
        ValueError: if a mesh cannot be read.
    """
    pieces = tuple(replace(each, shape=_read(each.shape)) for each in thing.pieces)
    return replace(thing, shape=_read(thing.shape), pieces=pieces)


def _read(shape: Geometry) -> Geometry:
    if not shape.file:
        return shape
    solid = read_mesh(Path(shape.file), shape.file)
    points, triangles = solid.vertices.flatten().tolist(), solid.faces.flatten().tolist()
    return replace(shape, file="", points=tuple(points), triangles=tuple(triangles))


def _view(arguments: argparse.Namespace, *between: str) -> scene_view.ArmView:
    return answer_of(find_robot(arguments.robot), scene_view.ViewOfArm(arguments.arm, between))


def _watch(arguments: argparse.Namespace) -> int:
    from rbxcompose.domains.arms.command_watch import watch  # a visitor on the bus, which other actions are not

    return watch(find_robot(arguments.robot), as_json=arguments.json)


def _check(arguments: argparse.Namespace) -> int:
    found = [pair for pair in _view(arguments).pairs if pair.collides]
    if arguments.json:
        emit(json.dumps([to_data(pair) for pair in found]))
    elif not found:
        emit("nothing collides")
    else:
        emit(table([("first", "second", "distance"), *map(_distance_row, found)]))
    return 1 if found else 0


def _distance(arguments: argparse.Namespace) -> int:
    view = _view(arguments, *arguments.pair)
    for name in arguments.pair:
        if name not in view.watched:
            raise NotDoneError(
                NO_PAIR.at(None, clauses(f"no arm watches '{name}'", suggest(name, view.watched, "watched")))
            )
    if not view.pairs:
        words = " and ".join(f"'{name}'" for name in arguments.pair)
        why = f"no arm watches {words}" if len(arguments.pair) > 1 else "there are too many pairs: name one or two"
        raise NotDoneError(NO_PAIR.at(None, why))
    nearest = min(view.pairs, key=lambda pair: pair.distance)
    if arguments.json:
        emit(json.dumps(to_data(nearest)))
    else:
        emit(table([("first", "second", "distance"), _distance_row(nearest)]))
    return 0


def _distance_row(pair: PairDistance) -> tuple[str, str, str]:
    return pair.first, pair.second, f"{round(pair.distance * 1000, 1) + 0.0:.1f} mm"


def _picture(arguments: argparse.Namespace) -> int:
    from rbxcompose.domains.arms.motion.picture import ArmPicture, draw_arm

    view = _view(arguments)
    hit = [pair for pair in view.pairs if pair.collides]
    names = {name for pair in hit for name in (pair.first, pair.second)}
    root = read_urdf(view.urdf, "urdf")
    body = Body("") if isinstance(root, Finding) or root is None else read_body(root)[0]
    meshes = {name: Path(path) for name, path in view.meshes.items()}
    problem = "; ".join(f"{pair.first} and {pair.second} collide" for pair in hit)
    shown = ArmPicture(
        body, meshes, view.positions, view.objects, way=view.way, colliding=names, caption=view.arm, problem=problem
    )
    failed = write_picture("scene", Path(arguments.out), lambda: draw_arm(shown))
    if not failed:
        emit(json.dumps({"file": arguments.out}) if arguments.json else f"wrote {arguments.out}")
    return failed

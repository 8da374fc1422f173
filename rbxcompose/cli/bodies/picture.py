"""`body picture`."""

from __future__ import annotations

import argparse

from rbxcompose.body.description import Description
from rbxcompose.body.extra import MissingLibraryError
from rbxcompose.body.model import Body
from rbxcompose.body.picture import draw
from rbxcompose.cli.bodies.actions import Actions, add_action, file_of, write
from rbxcompose.cli.bodies.sliders import sliders_of
from rbxcompose.cli.output.console import misused, refuse


def add(actions: Actions) -> None:
    """Declare the action."""
    parser = add_action(actions, "picture", "draw it as a PNG", _picture)
    parser.add_argument("--out", metavar="FILE", help="the picture (default: NAME.png)")
    parser.add_argument(
        "--joint",
        action="append",
        default=[],
        metavar="NAME=POSITION",
        help="a joint's position, such as '35 deg'; a bare number is in rad or m",
    )


def _picture(arguments: argparse.Namespace, description: Description) -> int:
    body = description.body
    try:
        positions = dict(_position(body, written) for written in arguments.joint)
        picture = draw(body, positions, description.meshes)
    except ValueError as error:
        return misused("body", str(error))
    except MissingLibraryError as error:
        return refuse(error.finding)
    return write(file_of(arguments, description, ".png"), picture)


def _position(body: Body, written: str) -> tuple[str, float]:
    name, _, value = written.partition("=")
    slider = next((one for one in sliders_of(body) if one.name == name), None)
    if slider is None:
        raise ValueError(f"there is no moving joint '{name}': {', '.join(joint.name for joint in body.moving)}")
    return name, slider.read(value)

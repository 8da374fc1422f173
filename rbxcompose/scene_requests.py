"""What people may ask of the planning scene of a running robot."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Vector3
from rbxcompose.motion.scene import PairDistance, PlacedObject
from rbxcompose.requests import Command, Query

SCENE, ARM = "scene", "arm"


@dataclass(frozen=True, slots=True)
class ArmView:
    """What an arm knows now: its body, positions of joints [rad or m], objects, and pairs, the nearest first.

    `watched` are the links and objects that may belong to pairs, of which there may be more than are told.
    `way` is what was last planned: positions of the tip in the frame of the body's root [m].
    """

    arm: str
    urdf: str
    meshes: Mapping[str, str]
    positions: Mapping[str, float]
    objects: tuple[PlacedObject, ...]
    pairs: tuple[PairDistance, ...]
    watched: tuple[str, ...]
    way: tuple[Vector3, ...] = ()


@dataclass(frozen=True, slots=True)
class ViewOfArm(Query[ArmView]):
    """Return what an arm knows now, with the pairs that have all of `between`, of one or two links or objects.

    `component` is the arm, the first one without it.
    """

    about = ARM
    component: str = ""
    between: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class LookAtArm(Query[Mapping[str, Any]]):
    """Return all that viewers see of an arm, as the window `arms/NAME` tells it."""

    about = ARM


@dataclass(frozen=True, slots=True)
class LookAtScene(Query[Mapping[str, Any]]):
    """Return all that viewers see of the scene, as the window `scene` tells it."""

    about = SCENE


@dataclass(frozen=True, slots=True)
class ListScene(Query[tuple[PlacedObject, ...]]):
    """Return all objects."""

    about = SCENE


@dataclass(frozen=True, slots=True)
class StandingObjects(Query[tuple[PlacedObject, ...]]):
    """Return the objects that no moving link carries, with their poses in the frame of the body's root."""

    about = SCENE


@dataclass(frozen=True, slots=True)
class AddToScene(Command):
    """Put an object into the scene; without a link it stands in the frame of the body's root."""

    about = SCENE
    entry: PlacedObject

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["scene", "add", self.entry.name])


@dataclass(frozen=True, slots=True)
class LoadScene(Command):
    """Put the objects of the text of a scene file into the scene, all or none, in place of those with their names.

    They stand in the frame of `link`, the body's root without one. `file` is the name of the file in messages.
    """

    about = SCENE
    text: str
    file: str
    link: str = ""

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["scene", "load", self.file])


@dataclass(frozen=True, slots=True)
class RemoveFromScene(Command):
    """Take an object out of the scene."""

    about = SCENE
    object: str

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["scene", "remove", self.object])


@dataclass(frozen=True, slots=True)
class AttachInScene(Command):
    """Let an object move with a link; without `touches`, it may touch the link and all that the link carries."""

    about = SCENE
    object: str
    link: str
    touches: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["scene", "attach", self.object, self.link])


@dataclass(frozen=True, slots=True)
class DetachInScene(Command):
    """Let an object stay where it is."""

    about = SCENE
    object: str

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["scene", "detach", self.object])

"""What people may ask of the planning scene of a running robot."""

from __future__ import annotations

import shlex

from rbxcompose.dataclass import dataclass
from rbxcompose.requests import Command, Query

SCENE = "scene"


@dataclass(frozen=True, slots=True)
class SceneEntry:
    """An object: its shape and size [m], and its pose in the frame of a link: [m], and a quaternion x, y, z, w."""

    name: str
    shape: str
    size: tuple[float, ...]
    link: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    touches: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ListScene(Query[tuple[SceneEntry, ...]]):
    """Return all objects."""

    about = SCENE


@dataclass(frozen=True, slots=True)
class AddToScene(Command):
    """Put an object into the scene; without a link it stands in the frame of the body's root."""

    about = SCENE
    entry: SceneEntry

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["scene", "add", self.entry.name])


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

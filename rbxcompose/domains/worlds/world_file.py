"""The file of a world: a manifest of the kind World."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.config import Angle, Config, Length, Mass, Name, Place, Ratio, Time
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Span, kind
from rbxcompose.base.geometry import Pose2, Vector3
from rbxcompose.domains.body.meshes import MissingLibraryError, need, read_mesh
from rbxcompose.domains.worlds.grid_map import GridMap, MapError, read_map
from rbxcompose.domains.worlds.shapes import (
    ShapePath,
    WorldBox,
    WorldCylinder,
    WorldHole,
    WorldHull,
    WorldLight,
    WorldMesh,
    WorldShape,
)
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, TAG_FAMILIES, TagSide, tag_on
from rbxcompose.domains.worlds.world import no_walls
from rbxcompose.manifest.documents import Documents, ManifestHeader
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.tree import MappingNode, value_span
from rbxcompose.manifest.validate import validate

WORLD = "World"
NO_MAP, NO_MESH = kind("RBX3600"), kind("RBX3604")
PERSON = WorldCylinder(0.25, 1.7)  # an adult, seen by a laser: about 50 cm wide with the arms
MOST_PARTS = 100
SIMPLER = "rbxcompose body simplify"
MOST_TRIANGLES = 100_000
FLAT = 1e-3  # a part below this becomes a box of this thickness [m]


class PlanarPose(Config):
    """A pose on the ground, in `map`."""

    x: Length = 0.0
    """Position along x."""
    y: Length = 0.0
    """Position along y."""
    heading: Angle = 0.0
    """Direction, measured from x towards y."""

    @property
    def pose(self) -> Pose2:
        """Return it as a pose."""
        return Pose2(self.x, self.y, self.heading)


class WorldPlace(PlanarPose):
    """A place of the world."""

    colour: str = ""
    """How viewers draw it."""


class WorldCylinderModel(Config):
    """An upright cylinder."""

    radius: Length = Field(gt=0)
    """Its radius."""
    length: Length = Field(gt=0)
    """Its height."""


class WorldTagModel(Config):
    """A tag on a side of something."""

    number: int = Field(ge=0)
    """Its number."""
    family: TAG_FAMILIES = DEFAULT_FAMILY
    """The family that it is of."""
    size: Length | None = Field(None, gt=0)
    """The side of its black square; four fifths of the shorter side of where it is by default."""
    right: Length = 0.0
    """How far its middle is to the right of that of the side, for who looks at it."""
    up: Length = 0.0
    """How far it is above that."""


WorldTags = Annotated[int, Field(ge=0)] | WorldTagModel | list[WorldTagModel]


class WorldObjectModel(Config):
    """Something in the world: one shape, and where it stands or how it moves."""

    box: tuple[Length, Length, Length] | None = None
    """Lengths along x, y and z."""
    cylinder: WorldCylinderModel | None = None
    """Radius and length."""
    shape: Literal["person"] | None = None
    """An adult who stands or walks."""
    mesh: FileName | None = None
    """A file of triangles (.stl, .obj, .dae) in metres, relative to this one; its lowest point is at `z`. Parts that
    are not connected, such as the legs of a table, count as convex bodies of their own."""
    scale: float = Field(1.0, gt=0)
    """By which the lengths of the mesh are multiplied: 0.001 for millimetres."""
    at: PlanarPose = PlanarPose()
    """Where its middle is."""
    z: Length = Field(0.0, ge=0)
    """Height of its base above the ground."""
    path: list[tuple[Time, Length, Length]] = []
    """Points that it moves to, each with the time at which it is there, and x and y."""
    repeats: bool = False
    """Whether it goes along its path again and again."""
    turns: bool = False
    """Whether it faces where it goes."""
    tags: dict[TagSide, WorldTags] = {}
    """Tags on its sides, for cameras: a number, or more about one or several. Its front is where it faces: along x."""
    colour: str = ""
    """How viewers draw it."""
    mass: Mass = Field(0.0, ge=0)
    """Of something that can be pushed and lifted, with `simulator: physics`; without, it stands fast."""

    @model_validator(mode="after")
    def _is_shape(self) -> WorldObjectModel:
        if sum(one is not None for one in (self.box, self.cylinder, self.shape, self.mesh)) != 1:
            raise ValueError("an object has one shape: 'box', 'cylinder', 'mesh' or 'shape: person'")
        if self.box is not None and min(self.box) <= 0:
            raise ValueError("the sides of a box are above zero")
        if self.path and self.mass:
            raise ValueError("something with a 'path' is moved by nobody else, and has no 'mass'")
        if self.turns and not self.path:
            raise ValueError("what 'turns' has a 'path'")
        if self.path:
            ShapePath(tuple(self.path), self.repeats)
        if self.mesh is None:
            self.placed("")
        elif self.tags:
            raise ValueError("a mesh has no flat sides for tags")
        return self

    def placed(self, name: str) -> WorldShape:
        """Return it as a shape of the world."""
        solid: WorldBox | WorldCylinder | WorldMesh = PERSON
        if self.mesh is not None:
            solid = world_mesh(Path(self.mesh), (self.scale,) * 3)
        elif self.box is not None:
            solid = WorldBox(self.box)
        elif self.cylinder is not None:
            solid = WorldCylinder(self.cylinder.radius, self.cylinder.length)
        path = ShapePath(tuple(self.path), self.repeats, self.turns) if self.path else None
        tags = tuple(
            tag_on(solid, side, one.number, one.family, one.size, (one.right, one.up))
            for side, models in self.tags.items()
            for one in tag_models(models)
        )
        return WorldShape(name, solid, self.at.pose, self.z, path, self.mass, tags)


def tag_models(written: WorldTags) -> list[WorldTagModel]:
    """Return what is said about the tags of a side."""
    if isinstance(written, int):
        return [WorldTagModel(number=written)]
    return written if isinstance(written, list) else [written]


class WorldHoleModel(Config):
    """A part of the ground that is not there, such as stairs that lead down."""

    area: list[tuple[Length, Length]]
    """Corners of a polygon, x and y."""

    @model_validator(mode="after")
    def _is_area(self) -> WorldHoleModel:
        self.placed("")
        return self

    def placed(self, name: str) -> WorldHole:
        """Return it as a hole of the world."""
        return WorldHole(name, tuple(self.area))


class WorldLightModel(Config):
    """A lamp, which shines in all directions."""

    x: Length = 0.0
    """Position along x."""
    y: Length = 0.0
    """Position along y."""
    z: Length = Field(2.4, ge=0)
    """Height above the ground."""
    colour: str = "white"
    """Of its light."""
    strength: Ratio = Field(0.6, gt=0, le=1)
    """How bright it is: what faces a lamp of 100 % is as bright as it can be."""

    def placed(self, name: str) -> WorldLight:
        """Return it as a light of the world."""
        return WorldLight(name, (self.x, self.y, self.z), self.colour, self.strength)


class WorldModel(ManifestHeader):
    """The world of simulated robots."""

    map: FileName | None = None
    """The YAML file of a map of map_server, relative to this one; without it there are no walls."""
    objects: dict[Name, WorldObjectModel] = {}
    """What stands or moves there besides walls."""
    holes: dict[Name, WorldHoleModel] = {}
    """Where the ground is missing: cliff sensors see it, and wheels drop."""
    lights: dict[Name, WorldLightModel] = {}
    """Lamps, for cameras and viewers; without any, light comes from where one looks."""
    spawn: dict[Name, PlanarPose] = {}
    """Where robots may be put; the first is the default."""
    places: dict[Name, WorldPlace] = {}
    """Places that robots in it have, as in `places` of a robot."""


@dataclass(frozen=True, slots=True)
class WorldFile:
    """What a file of a world says; the map file is an absolute path, if there is one."""

    name: str
    map: Path | None
    grid: GridMap
    objects: Mapping[str, WorldObjectModel]
    holes: Mapping[str, WorldHoleModel]
    spawn: Mapping[str, Pose2]
    places: Mapping[str, Place]
    lights: Mapping[str, WorldLightModel] = field(default_factory=dict)
    source: str = ""
    """The file, as findings show it."""


def read_world(path: Path, documents: Documents, span: Span) -> WorldFile | None:
    """Return what a file of a world says, None after findings; `span` is the place that names it."""
    root = documents.read(path, WORLD, span)
    read = validate(WorldModel, root, (), documents.report) if root is not None else None
    if read is None or root is None:
        return None
    grid, file = no_walls(), None
    if read.map is not None:
        written = value_span(root, ("map",))
        found = resolve(read.map, path, written)
        if isinstance(found, Finding):
            documents.report.add(found)
            return None
        try:
            grid, file = read_map(found), found
        except MapError as error:
            documents.report.add(NO_MAP.at(written, str(error)))
            return None
    if (objects := _with_meshes(read, root, path, documents.report)) is None:
        return None
    spawn = {name: pose.pose for name, pose in read.spawn.items()}
    places = {name: Place(name, place.x, place.y, place.heading, place.colour) for name, place in read.places.items()}
    return WorldFile(read.name, file, grid, objects, read.holes, spawn, places, read.lights, shown_name(path))


def _with_meshes(read: WorldModel, root: MappingNode, path: Path, report: Report) -> dict[str, WorldObjectModel] | None:
    """Return the objects with the whole paths of their meshes, None after findings."""
    found, is_whole = dict(read.objects), True
    for name, model in read.objects.items():
        if model.mesh is None:
            continue
        written = value_span(root, ("objects", name, "mesh"))
        file = resolve(model.mesh, path, written)
        if isinstance(file, Finding):
            report.add(file)
            is_whole = False
            continue
        found[name] = model.model_copy(update={"mesh": str(file)})
        try:
            found[name].placed(name)
        except MissingLibraryError as error:
            report.add(NO_MESH.at(written, error.finding.message, help=error.finding.help))
            is_whole = False
        except ValueError as error:
            report.add(NO_MESH.at(written, str(error)))
            is_whole = False
    return found if is_whole else None


@lru_cache(maxsize=64)
def world_mesh(path: Path, scale: Vector3) -> WorldMesh:
    """Return a mesh as the convex hulls of its connected parts: a table is its top and its legs.

    Its lowest point is at a height of 0.

    Raises:
        MissingLibraryError: if a library for it is missing.
        ValueError: if it cannot be read, or is too large.
    """
    need("meshes", "trimesh", "scipy", extra="physics")
    import trimesh

    read = read_mesh(path, path.name)
    if len(read.faces) > MOST_TRIANGLES:
        raise ValueError(f"the mesh '{path.name}' has more than {MOST_TRIANGLES} triangles: '{SIMPLER}' makes fewer")
    vertices = read.vertices * scale
    if not np.isfinite(vertices).all():
        raise ValueError(f"the mesh '{path.name}' has corners that are nowhere")
    whole = trimesh.Trimesh(vertices - (0.0, 0.0, vertices[:, 2].min()), read.faces)
    parts = whole.split(only_watertight=False)
    if len(parts) > MOST_PARTS:
        raise ValueError(f"the mesh '{path.name}' has {len(parts)} parts that do not touch, and may have {MOST_PARTS}")
    return WorldMesh(tuple(_hull(np.asarray(part.vertices, float), path.name) for part in parts))


def _hull(points: Array, name: str) -> tuple[float, WorldHull]:
    """Return the height of a part above the ground [m], and its convex hull."""
    import trimesh

    low, high = points.min(0), points.max(0)
    if (high - low).min() < FLAT:
        thick = np.maximum(FLAT - (high - low), 0.0) / 2
        found = trimesh.creation.box(bounds=(low - thick, high + thick))
    elif np.linalg.svd(points - points.mean(0), compute_uv=False)[2] < FLAT:
        raise ValueError(f"a part of the mesh '{name}' is flat and leans: it has no inside")
    else:
        found = trimesh.convex.convex_hull(points)
    bottom = float(found.vertices[:, 2].min())
    corners = (np.asarray(found.vertices, float) - (0.0, 0.0, bottom)).tolist()
    return bottom, WorldHull(
        tuple((float(x), float(y), float(z)) for x, y, z in corners),
        tuple((int(a), int(b), int(c)) for a, b, c in found.faces),
    )

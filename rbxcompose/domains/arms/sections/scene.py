"""The section `scene`: things that arms must not hit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, field, replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import LINK, OBJECT, Config, Length, LinkName, Name, Refers
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import Finding, Span, kind, suggest
from rbxcompose.base.geometry import Transform3
from rbxcompose.base.printable import plain
from rbxcompose.domains.arms.motion.octree_files import read_cells
from rbxcompose.domains.arms.motion.scene import MOST_PADDING, MOST_SHAPES, PlacedObject, mistake_in, settled
from rbxcompose.domains.arms.motion.scene_text import LARGEST, NO_SCENE, SceneFile, read_scene
from rbxcompose.domains.arms.section_models import CloudModel
from rbxcompose.domains.arms.sections.arms import arms
from rbxcompose.domains.body.files import FORMATS, mesh_problem
from rbxcompose.domains.body.model import Body, Geometry
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.worlds.sections.world import world
from rbxcompose.domains.worlds.shapes import WorldBox, WorldCylinder, WorldShape
from rbxcompose.manifest.fields import FileName, FramePose
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring
from rbxcompose.manifest.tree import KeyPath

SCENE = "scene"
"""The component that a robot with arms runs."""
CLOUD_MAPPER = "cloud_mapper"
"""The type of what each entry of `clouds` runs."""
NO_OBJECT = kind("RBX2306")
NO_MESH = kind("RBX2350")
MAP_FRAME = "map"
COLOURS = {
    "black": (0.1, 0.1, 0.1),
    "white": (1.0, 1.0, 1.0),
    "grey": (0.5, 0.5, 0.5),
    "red": (0.8, 0.15, 0.1),
    "green": (0.2, 0.6, 0.25),
    "blue": (0.15, 0.35, 0.75),
    "yellow": (0.95, 0.8, 0.2),
    "orange": (0.95, 0.55, 0.1),
    "brown": (0.55, 0.35, 0.2),
}
"""Names of colours: red, green and blue from 0 to 1."""
ColourName = Literal["black", "white", "grey", "red", "green", "blue", "yellow", "orange", "brown"]
Scale = Annotated[float, Field(gt=0)]
Padding = Annotated[Length, Field(ge=0, le=MOST_PADDING)]
_SHAPES = ("box", "cylinder", "cone", "sphere", "plane", "mesh", "octree")


class CylinderModel(Config):
    """An upright cylinder, or a cone with its tip above; its middle is at its place."""

    radius: Length = Field(gt=0)
    """Its radius."""
    length: Length = Field(gt=0)
    """Its height."""


class MeshModel(Config):
    """A mesh in a file."""

    file: FileName
    """An STL, OBJ, COLLADA, PLY or GLB file, relative to this one."""
    scale: Scale = 1.0
    """Metres of one unit of the file: 0.001 for a mesh in millimetres."""


class OctreeModel(Config):
    """Occupied cells of space."""

    file: FileName
    """A tree of OctoMap (`.bt`), or a text with a point `x y z` [m] in each line; relative to this file."""
    cell: Length = Field(0.02, ge=0.001, le=1)
    """Side of a cell of points; a tree has its own."""


class ObjectModel(Config):
    """A thing: one shape, and where its middle is in the frame of a link."""

    box: tuple[Length, Length, Length] | None = None
    """Lengths along x, y and z."""
    cylinder: CylinderModel | None = None
    """Radius and length, along z."""
    cone: CylinderModel | None = None
    """Radius and length, along z."""
    sphere: Length | None = Field(None, gt=0)
    """Radius."""
    plane: Literal["below"] | None = None
    """All that is below: a floor, or a wall if it is turned."""
    mesh: MeshModel | None = None
    """A file with triangles."""
    octree: OctreeModel | None = None
    """A file with occupied space."""
    link: LinkName | None = None
    """The link that it moves with; without it the root of the body."""
    frame: Name | None = None
    """A frame outside of the body, such as `map`, in which it stays where it is while the robot drives."""
    at: FramePose = FramePose()
    """Where it is in the frame."""
    touches: list[LinkName] = []
    """Links that it may touch."""
    touches_objects: list[Annotated[Name, Refers(OBJECT)]] = []
    """Other things that it may touch, while an arm holds one of both."""

    @field_validator("touches", mode="before")
    @classmethod
    def _are_links(cls, names: object, info: ValidationInfo) -> object:
        known = {} if info.context is None else info.context
        for name in names if isinstance(names, list) else ():
            if isinstance(name, str) and name in known.get(OBJECT, ()) and name not in known.get(LINK, ()):
                context = {"name": name, "help": f"write 'touches_objects: [{name}]'"}
                raise PydanticCustomError(OBJECT, "'{name}' is an object, and no link", context)
        return names

    padding: Padding = 0.0
    """How far arms keep from it."""
    colour: ColourName | None = None
    """How viewers show it."""

    @model_validator(mode="after")
    def _one_shape(self) -> ObjectModel:
        if sum(getattr(self, shape) is not None for shape in _SHAPES) != 1:
            raise ValueError(f"an object has one shape: {', '.join(map(repr, _SHAPES[:-1]))} or '{_SHAPES[-1]}'")
        if self.link is not None and self.frame is not None:
            raise ValueError("an object stands in the frame of a 'link', or in another 'frame'")
        return self

    @property
    def file(self) -> str:
        """Return the file that it names, or nothing."""
        return (self.mesh or self.octree or OctreeModel(file="")).file

    def shape(self, file: Path | None) -> Geometry:
        """Return its shape; `file` is that of its mesh or its octree."""
        if self.box is not None:
            return Geometry("box", self.box)
        if (round_one := self.cylinder or self.cone) is not None:
            return Geometry("cylinder" if self.cylinder else "cone", (round_one.radius, round_one.length))
        if self.plane is not None:
            return Geometry("plane", (0.0, 0.0, 1.0, 0.0))
        if self.mesh is not None:
            return Geometry("mesh", (self.mesh.scale,) * 3, str(file))
        if self.octree is not None:
            return Geometry("octree", (self.octree.cell,), str(file))
        return Geometry("sphere", (self.sphere or 0.0,))

    def placed(self, name: str, root: str, file: Path | None = None) -> PlacedObject:
        """Return it as a thing in the scene of a body with this root."""
        return PlacedObject(
            name,
            self.shape(file),
            self.link or self.frame or root,
            self.at.to_transform(),
            tuple(self.touches),
            tuple(self.touches_objects),
            colour=(*COLOURS[self.colour], 1.0) if self.colour else None,
            padding=self.padding,
        )


class SceneModel(Config):
    """Things around the robot."""

    objects: dict[Name, ObjectModel] = {}
    """Things by name."""
    world: list[Name] = []
    """Objects of the robot's world that arms know, where the file of the world puts them in `map`."""
    clouds: dict[Name, CloudModel] = {}
    """What sensors of distances see, by the name of the thing that it becomes."""
    file: FileName | None = None
    """A `.scene` file of MoveIt with further things, in the frame of the body's root."""
    frames: list[Name] = []
    """Frames outside of the body in which things may stand later; those of `objects` need not be here."""
    padding: Padding = 0.0
    """How far all links keep from things."""
    paddings: dict[LinkName, Padding] = {}
    """How far some links keep from things, in place of `padding`."""


@dataclass(frozen=True, slots=True)
class SceneOfRobot:
    """The things that there are from the start, the frames outside of the body, and the paddings of links [m]."""

    objects: tuple[PlacedObject, ...] = ()
    frames: tuple[str, ...] = ()
    paddings: Mapping[str, float] = field(default_factory=dict)
    clouds: Mapping[str, CloudModel] = field(default_factory=dict)
    of_world: tuple[str, ...] = ()
    """Names of the things that the file of its world has."""

    def on(self, known: Body) -> tuple[PlacedObject, ...]:
        """Return the things as seen by a robot that stands at the origin of all frames."""
        placed = (thing if thing.link in known.links else replace(thing, link=known.root) for thing in self.objects)
        return tuple(settled(thing, known) for thing in placed)


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that publishes the scene to arms; objects may come later, also if there are none now."""
    description, found = contents.of(body), contents.of(scene)
    if description is None or not contents.of(arms):
        return
    config = {
        "urdf": description.text,
        "objects": {object_.name: _config(object_) for object_ in found.objects},
        "frames": found.frames,
        "paddings": found.paddings,
        "clouds": tuple(found.clouds),
    }
    path = (scene.name,) if scene.name in contents.root else (arms.name,)
    yield WantedComponent(SCENE, SCENE, config, path)
    for name, one in found.clouds.items():
        cloud = {
            **one.model_dump(exclude={"frame"}),
            "name": name,
            "urdf": description.text,
            "meshes": {mesh: str(file) for mesh, file in description.meshes.items()},
            "frame": one.frame or "",
            "frames": found.frames,
        }
        yield WantedComponent(f"{SCENE}_{name}", CLOUD_MAPPER, cloud, (scene.name, "clouds", name))


def _config(thing: PlacedObject) -> dict[str, object]:
    return {
        "link": thing.link,
        "position": thing.pose.translation,
        "rotation": thing.pose.rotation,
        "shapes": [
            {**asdict(each.shape), "position": each.pose.translation, "rotation": each.pose.rotation}
            for each in thing.own_pieces
        ],
        "touches": thing.touches,
        "touches_objects": thing.touches_objects,
        "padding": thing.padding,
        "colour": thing.colour,
    }


def _names(read: SceneOfRobot) -> Mapping[str, Mapping[str, object]]:
    return {OBJECT: dict.fromkeys(read.of_world)}


@section(
    "scene",
    SceneModel,
    order=37,
    names=OBJECT,
    at=("objects",),
    entry="object",
    shared=((), ("objects",), ("clouds",)),
    wires=True,
    components=_components,
    defines=(OBJECT,),
    defined=_names,
)
def scene(reading: Reading[SceneModel]) -> SceneOfRobot:
    """Things that arms must not hit, by name; they stand in the frame of a link, and move with it.

    Example:
        body:
          urdf: robot.urdf
        scene:
          objects:
            table:
              box: [60 cm, 40 cm, 2 cm]
              at: {x: 50 cm, z: 40 cm}
            cup:
              cylinder: {radius: 4 cm, length: 10 cm}
              at: {x: 45 cm, z: 46 cm}
    """
    read = reading.whole() or SceneModel()
    description = reading.contents.of(body)
    if description is None:
        return SceneOfRobot()
    known = description.body
    named = (
        *(object_.frame for object_ in read.objects.values()),
        *(cloud.frame for cloud in read.clouds.values() if cloud.frame not in known.links),
    )
    outer = description.virtual.frame if description.virtual else ""
    of_world = tuple(_of_world(reading, read))
    named = (*named, *(thing.link for thing in of_world))
    frames = tuple(frame for frame in dict.fromkeys((outer, *read.frames, *named)) if frame and frame != known.frame)
    found = []
    for name, model in read.objects.items():
        path = ("scene", "objects", name)
        file = _file(reading, model, path)
        wrong = mistake_in(model.placed(name, known.root, file), known, frames)
        if wrong:
            reading.report.add(NO_OBJECT.at(reading.key(*path), f"object '{name}': {wrong}"))
        elif not model.file or file is not None:
            found.append(model.placed(name, known.root, file))
    found += of_world
    found += _of_file(reading, read, known, {item.name for item in found})
    for name in read.clouds:
        if name in known.links or any(item.name == name for item in found):
            what = "a link of the body" if name in known.links else "an object of this scene"
            span = reading.key("scene", "clouds", name)
            reading.report.add(NO_OBJECT.at(span, f"the cloud '{name}' would have the name of {what}"))
    paddings = {link: padding for link in known.links if (padding := read.paddings.get(link, read.padding))}
    return SceneOfRobot(tuple(found), frames, paddings, read.clouds, tuple(thing.name for thing in of_world))


def _of_world(reading: Reading[SceneModel], read: SceneModel) -> Iterator[PlacedObject]:
    """Yield the things that the scene takes from the world of the robot."""
    around = reading.contents.of(world) if read.world else None
    if around is None and "world" in reading.contents.root:
        return  # what is wrong with the world is reported there
    objects = around.file.objects if around else {}
    for index, name in enumerate(read.world):
        help_text = ""
        if around is None:
            wrong, help_text = "the robot has no 'world'", "write 'world: FILE', or put it into 'objects'"
        elif name not in objects:
            wrong, help_text = f"'{around.file.name}' has no such object", suggest(name, objects, "its objects")
        elif objects[name].path:
            wrong = f"it moves in '{around.file.name}', and arms know only what stands"
        elif objects[name].box is None and objects[name].cylinder is None:
            wrong = "arms know only boxes and cylinders of a world"
        elif name in read.objects:
            wrong = "the scene has an object of this name"
        else:
            yield _standing(objects[name].placed(name), objects[name].colour)
            continue
        span = reading.value("scene", "world", index)
        reading.report.add(NO_OBJECT.at(span, f"object '{name}' of the world: {wrong}", help=help_text))


def _standing(shape: WorldShape, colour: str) -> PlacedObject:
    """Return something that stands in the world as a thing of the scene."""
    solid = shape.solid
    if isinstance(solid, WorldCylinder):
        geometry = Geometry("cylinder", (solid.radius, solid.height))
    else:
        geometry = Geometry("box", solid.size if isinstance(solid, WorldBox) else (0.0, 0.0, 0.0))
    x, y, _ = (at := Transform3.from_pose2(shape.pose)).translation
    place = Transform3((x, y, shape.z + solid.height / 2), at.rotation)
    shown = (*COLOURS[colour], 1.0) if colour in COLOURS else None
    return PlacedObject(shape.name, geometry, MAP_FRAME, place, colour=shown)


def _file(reading: Reading[SceneModel], model: ObjectModel, path: KeyPath) -> Path | None:
    """Return the file of an object; None if it needs none, or after a finding."""
    if not model.file:
        return None
    span = reading.value(*path, "mesh" if model.mesh else "octree", "file")
    found = _resolved(reading, model.file, span)
    if found is not None and (problem := file_mistake(model, found)):
        reading.report.add(NO_MESH.at(span, problem))
        return None
    return found


def file_mistake(model: ObjectModel, file: Path) -> str:
    """Return why the file of an object can be no mesh or octree, nothing if it may be one."""
    if model.octree is None:
        problem = mesh_problem(file) if file.suffix.lower() in FORMATS else f"is none of {', '.join(FORMATS)}"
        return problem and f"the mesh '{plain(model.file)}' {problem}"
    try:
        cells, _ = read_cells(file, model.octree.cell)
    except ValueError as error:
        return f"the octree '{plain(model.file)}' cannot be read: {error}"
    return "" if len(cells) else f"the octree '{plain(model.file)}' has no occupied cell"


def _resolved(reading: Reading[SceneModel], written: str, span: Span) -> Path | None:
    found = resolve(written, reading.contents.documents.writer(span, reading.contents.file), span)
    if isinstance(found, Finding):
        reading.report.add(found)
        return None
    return found


def _of_file(reading: Reading[SceneModel], read: SceneModel, known: Body, taken: set[str]) -> list[PlacedObject]:
    """Return the objects of the `.scene` file."""
    if read.file is None:
        return []
    span = reading.value("scene", "file")
    path = _resolved(reading, read.file, span)
    if path is None:
        return []
    scene_file = scene_of(path)
    if isinstance(scene_file, Finding):
        reading.report.add(scene_file)
        return []
    found = [replace(object_, link=known.root) for object_ in scene_file.objects]
    wrong = [f"'{plain(item.name)}' is an object of this manifest, too" for item in found if item.name in taken]
    wrong += [f"object '{plain(item.name)}': {words}" for item in found if (words := mistake_in(item, known))]
    if len(taken) + sum(len(thing.own_pieces) for thing in found) > MOST_SHAPES:
        wrong.append(f"there are more than {MOST_SHAPES:,} shapes")
    reading.report.extend(NO_OBJECT.at(span, words) for words in wrong[:1])
    return [] if wrong else found


def scene_of(path: Path) -> SceneFile | Finding:
    """Return the scene in a `.scene` file, or what is wrong with it."""
    shown = shown_name(path)
    try:
        text = read_regular(path, LARGEST).decode()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror or str(error) if isinstance(error, OSError) else "it is not text"
        return NO_SCENE.at(Span(shown, 1, 1, 1, 1), f"the file cannot be read: {reason}")
    return read_scene(text, shown)

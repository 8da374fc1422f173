"""The section `scene`: things that arms must not hit."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field, model_validator

from rbxcompose.body.attachment import FramePose
from rbxcompose.body.model import Body, Geometry
from rbxcompose.config import Config, Length, LinkName, Name
from rbxcompose.findings import kind
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.manifest.tree import key_span
from rbxcompose.manifest.wanted_components import WantedComponent, Wiring
from rbxcompose.motion.scene import PlacedObject, mistake_in
from rbxcompose.references import OBJECT
from rbxcompose.sections.arms import arms
from rbxcompose.sections.body import body

SCENE = "scene"
"""The component that a robot with arms runs."""
NO_OBJECT = kind(
    "RBX2306",
    """An object of the scene cannot be

Its lengths are above 0, and it does not have the name of a link of the body: findings about collisions name both.

Bad: `table: {box: [60 cm, 40 cm, 0 cm]}`
Good: `table: {box: [60 cm, 40 cm, 2 cm]}`
""",
)


class CylinderModel(Config):
    """An upright cylinder; its middle is at its place."""

    radius: Length = Field(gt=0)
    """Its radius."""
    length: Length = Field(gt=0)
    """Its height."""


class ObjectModel(Config):
    """A thing: one shape, and where its middle is in the frame of a link."""

    box: tuple[Length, Length, Length] | None = None
    """Lengths along x, y and z."""
    cylinder: CylinderModel | None = None
    """Radius and length, along z."""
    sphere: Length | None = Field(None, gt=0)
    """Radius."""
    link: LinkName | None = None
    """The link that it moves with; without it the root of the body."""
    at: FramePose = FramePose()
    """Where it is in the frame of the link."""
    touches: list[LinkName] = []
    """Links that it may touch."""

    @model_validator(mode="after")
    def _one_shape(self) -> ObjectModel:
        if sum(one is not None for one in (self.box, self.cylinder, self.sphere)) != 1:
            raise ValueError("an object has one shape: 'box', 'cylinder' or 'sphere'")
        return self

    @property
    def shape(self) -> Geometry:
        """Return its shape."""
        if self.box is not None:
            return Geometry("box", self.box)
        if self.cylinder is not None:
            return Geometry("cylinder", (self.cylinder.radius, self.cylinder.length))
        return Geometry("sphere", (self.sphere or 0.0,))

    def placed(self, name: str, known: Body) -> PlacedObject:
        """Return it as a thing in the scene of a body."""
        return PlacedObject(name, self.shape, self.link or known.root, self.at.to_transform(), tuple(self.touches))


class SceneModel(Config):
    """Things around the robot."""

    objects: dict[Name, ObjectModel] = {}
    """Things by name."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that tells arms of the scene; objects may come later, also if there are none now."""
    description = contents.of(body)
    if description is None or not contents.of(arms):
        return
    found = (one.placed(name, description.body) for name, one in contents.of(scene).objects.items())
    objects = {
        one.name: {
            "shape": one.shape.kind,
            "size": one.shape.size,
            "link": one.link,
            "position": one.pose.translation,
            "rotation": one.pose.rotation,
            "touches": one.touches,
        }
        for one in found
    }
    path = (scene.name,) if scene.name in contents.root else (arms.name,)
    yield WantedComponent(SCENE, SCENE, {"urdf": description.text, "objects": objects}, path)


@section(
    "scene",
    SceneModel,
    order=37,
    names=OBJECT,
    at=("objects",),
    entry="object",
    shared=((), ("objects",)),
    wires=True,
    components=_components,
)
def scene(reading: Reading[SceneModel]) -> SceneModel:
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
    good = {}
    for name, one in read.objects.items():
        wrong = mistake_in(one.placed(name, description.body), description.body) if description else ""
        if wrong:
            span = key_span(reading.contents.root, ("scene", "objects", name))
            reading.report.add(NO_OBJECT.at(span, f"object '{name}': {wrong}"))
        else:
            good[name] = one
    return SceneModel(objects=good)

"""What cameras see of a robot and its world, drawn by OpenGL without a screen (EGL)."""

from __future__ import annotations

import math
import weakref
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rbxcompose.base.arrays import Bytes, Singles, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.body.meshes import GREY, MissingLibraryError, read_mesh
from rbxcompose.domains.body.model import Shape
from rbxcompose.domains.worlds.physics.rigid import RigidPart
from rbxcompose.domains.worlds.physics.robot import PhysicsRobot
from rbxcompose.domains.worlds.physics.solids import THIN, BodyRepair, BodyRepairs
from rbxcompose.domains.worlds.shapes import WorldLight, WorldTag
from rbxcompose.domains.worlds.tag_pictures import tag_picture, tag_square

LOOKS = 2  # group of shapes that are seen by cameras and touch nothing
NEAREST, FARTHEST = 0.02, 50.0  # that a camera sees [m]
WALLS, TILES = (0.85, 0.83, 0.78), ((0.55, 0.55, 0.55), (0.7, 0.7, 0.7))  # red, green, blue
TILE = 0.5  # side of a tile of the ground [m]
TEXELS = 16  # pixels of a cell in the picture of a tag
COLOURS = {
    "black": "000000", "white": "ffffff", "grey": "808080", "gray": "808080", "silver": "c0c0c0", "red": "d02020",
    "green": "2f8f3f", "blue": "2f5fbf", "yellow": "e8c820", "orange": "e88020", "brown": "8b5a2b", "purple": "803090",
    "pink": "e8a0b0",
}  # fmt: skip

Model = Any  # of MuJoCo, whose stubs are incomplete


@dataclass(frozen=True, slots=True)
class PhysicsCamera:
    """A camera on a link, whose frame points as ROS has it for pictures: x right, y down, z ahead."""

    link: str
    width: int = 320
    """Of its pictures [pixels]."""
    height: int = 240
    field_of_view: float = 1.0
    """From the left to the right edge [rad]."""
    pose: Transform3 = Transform3()
    """Of that frame in the frame of the link."""

    @property
    def focal_length(self) -> float:
        """Return that of both axes [pixels]; the optical axis is in the middle of the picture."""
        return self.width / 2 / math.tan(self.field_of_view / 2)


class DepthPicture(NamedTuple):
    """What a camera sees."""

    colours: Bytes
    """(height, width, 3): red, green, blue; the upper row first."""
    depths: Singles
    """(height, width): distance along the optical axis [m]; inf where nothing is in sight."""


def add_looks(
    spec: Model,
    robot: PhysicsRobot,
    parts: Sequence[tuple[Model, RigidPart]],
    cameras: Mapping[str, PhysicsCamera],
    repairs: BodyRepairs,
) -> None:
    """Add visual shapes of a robot to its bodies, and cameras.

    Raises:
        ValueError: if a camera is in a frame that does not exist.
    """
    spec.stat.extent, spec.visual.map.znear, spec.visual.map.zfar = 1.0, NEAREST, FARTHEST
    spec.visual.global_.offwidth = max(camera.width for camera in cameras.values())
    spec.visual.global_.offheight = max(camera.height for camera in cameras.values())
    spec.visual.quality.offsamples = 0  # of several samples of a pixel, its depth would be that of a corner
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (0.5, 0.5, 0.5), (0.5, 0.5, 0.5)
    owners = {link: (body, part.links[link]) for body, part in parts for link in part.links}
    for name, camera in cameras.items():
        if camera.link not in owners:
            raise ValueError(f"the camera '{name}' is on a link that does not exist: '{camera.link}'")
        body, inner = owners[camera.link]
        pose = inner.compose(camera.pose)
        x, y, z, w = pose.rotation
        made = body.add_camera(name=name, pos=pose.translation)
        made.quat = (-x, w, z, -y)  # half a turn about x: a camera of MuJoCo looks along -z, with y upwards
        made.fovy = math.degrees(2 * math.atan(camera.height / 2 / camera.focal_length))
    for link, (body, pose) in owners.items():
        for shape in robot.body.links[link].visuals:
            _add_look(spec, body, link, pose.compose(shape.origin), shape, robot, repairs)


def add_lights(spec: Model, lights: Sequence[WorldLight]) -> None:
    """Add lamps; with some, less light comes from where a camera is."""
    import mujoco

    if lights:
        spec.visual.headlight.diffuse = (0.0, 0.0, 0.0)
    for lamp in lights:
        colour = [lamp.strength * part for part in colour_of(lamp.colour or "white")[:3]]
        kind = mujoco.mjtLightType.mjLIGHT_SPOT  # of 180 deg: the renderer takes a point for a spot as well
        made = spec.worldbody.add_light(pos=lamp.at, type=kind, diffuse=colour, castshadow=False)
        made.cutoff, made.exponent = 180.0, 0.0


def add_tag(spec: Model, body: Model, tag: WorldTag, above: float, at: Mapping[str, Any]) -> None:
    """Add a tag to a body; a thing that is `at` a pose there has its middle `above` its base [m]."""
    import mujoco

    kinds: Any = mujoco
    name = f"tag {len(spec.meshes)}"
    picture = tag_picture(tag.number, tag.family, TEXELS)
    side = len(picture)
    drawn = spec.add_texture(name=name, type=kinds.mjtTexture.mjTEXTURE_2D, width=side, height=side, nchannel=3)
    drawn.data = np.repeat(picture[..., None], 3, axis=2).tobytes()
    material = spec.add_material(name=name, specular=0.0)
    material.textures[kinds.mjtTextureRole.mjTEXROLE_RGB] = name
    corners = tag_square(tag) - (0.0, 0.0, above)
    made = spec.add_mesh(name=name, uservert=corners.ravel(), userface=[0, 1, 2, 0, 2, 3])
    made.usertexcoord, made.userfacetexcoord = [0, 0, 0, 1, 1, 1, 1, 0], [0, 1, 2, 0, 2, 3]
    made.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    look = {"group": LOOKS, "mass": 0.0, "contype": 0, "conaffinity": 0, "material": name}
    body.add_geom(type=kinds.mjtGeom.mjGEOM_MESH, meshname=name, **look, **at)


def _add_look(
    spec: Model, body: Model, link: str, pose: Any, shape: Shape, robot: PhysicsRobot, repairs: BodyRepairs
) -> None:
    import mujoco

    kinds: Any = mujoco.mjtGeom
    geometry = shape.geometry
    x, y, z, w = pose.rotation
    look: dict[str, Any] = {"pos": pose.translation, "quat": (w, x, y, z), "group": LOOKS, "mass": 0.0}
    look |= {"contype": 0, "conaffinity": 0, "rgba": shape.colour or (*GREY, 1.0)}
    half = [max(length / 2, THIN / 2) for length in geometry.size]
    match geometry.kind:
        case "box":
            body.add_geom(type=kinds.mjGEOM_BOX, size=half, **look)
        case "sphere":
            body.add_geom(type=kinds.mjGEOM_SPHERE, size=(2 * half[0], 0.0, 0.0), **look)
        case "cylinder" | "capsule" as kind:
            form = kinds.mjGEOM_CYLINDER if kind == "cylinder" else kinds.mjGEOM_CAPSULE
            body.add_geom(type=form, size=(2 * half[0], half[1], 0.0), **look)
        case "mesh" if geometry.file in robot.meshes:
            name = f"look {len(spec.meshes)}"
            try:
                solid = read_mesh(robot.meshes[geometry.file], geometry.file)
            except (MissingLibraryError, ValueError) as error:
                repairs.append(BodyRepair(link, f"a mesh is not seen: {error}"))
                return
            corners = (solid.vertices * (geometry.size or 1.0)).ravel()
            made = spec.add_mesh(name=name, uservert=corners, userface=solid.faces.ravel())
            made.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            if shape.colour is None:
                look["rgba"] = (*solid.colours.mean(0).tolist(), 1.0)
            body.add_geom(type=kinds.mjGEOM_MESH, meshname=name, **look)


def colour_ground(spec: Model, floor: Model) -> None:
    """Give the ground tiles, so that one sees it move."""
    import mujoco

    kinds: Any = mujoco
    tiles = spec.add_texture(name="tiles", type=kinds.mjtTexture.mjTEXTURE_2D, width=64, height=64)
    tiles.builtin, (tiles.rgb1, tiles.rgb2) = kinds.mjtBuiltin.mjBUILTIN_CHECKER, TILES
    material = spec.add_material(name="tiles", texrepeat=(0.5 / TILE, 0.5 / TILE), texuniform=True)
    material.textures[kinds.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    floor.material = "tiles"


def colour_of(name: str) -> tuple[float, float, float, float]:
    """Return red, green, blue and opacity of a colour: a name or `#rrggbb`; grey if it is unknown."""
    digits = COLOURS.get(name.lower(), name.removeprefix("#"))
    try:
        red, green, blue = bytes.fromhex(digits)
    except ValueError:
        return (*GREY, 1.0)
    return red / 255, green / 255, blue / 255, 1.0


class Eyes:
    """Draws pictures of a model; it belongs to the thread that made it.

    Raises:
        ImportError: without EGL.
    """

    def __init__(self, model: Model, cameras: Mapping[str, PhysicsCamera]) -> None:
        import mujoco

        sizes = ((camera.width, camera.height) for camera in cameras.values())
        width, height = (max(lengths) for lengths in zip(*sizes, strict=True))
        try:
            from mujoco.egl import GLContext

            self._context: Any = GLContext(width, height)
        except (ImportError, AttributeError, RuntimeError) as error:  # without its library, or without a device
            raise ImportError("cameras need EGL, a part of OpenGL that works without a screen: libegl1") from error
        self._mj: Any = mujoco
        self._model, self._cameras = model, cameras
        self._context.make_current()
        self._drawing: Any = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)
        self._drawing.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._scene: Any = mujoco.MjvScene(model, maxgeom=model.ngeom + 100)
        self._free = weakref.finalize(self, _free, self._context, self._drawing)  # also if nobody closes it
        self._options: Any = mujoco.MjvOption()
        self._options.geomgroup[:] = [group in (0, LOOKS) for group in range(6)]
        self._view: Any = mujoco.MjvCamera()
        self._view.type = mujoco.mjtCamera.mjCAMERA_FIXED

    def picture(self, data: Any, name: str) -> DepthPicture:
        """Return what a camera sees."""
        camera = self._cameras[name]
        self._context.make_current()
        self._view.fixedcamid = self._model.camera(name).id
        everything = self._mj.mjtCatBit.mjCAT_ALL
        self._mj.mjv_updateScene(self._model, data, self._options, None, self._view, everything, self._scene)
        whole = self._mj.MjrRect(0, 0, camera.width, camera.height)
        colours = np.empty((camera.height, camera.width, 3), np.uint8)
        nearness = np.empty((camera.height, camera.width), np.float32)
        self._mj.mjr_render(whole, self._scene, self._drawing)
        self._mj.mjr_readPixels(colours, nearness, whole, self._drawing)
        # A perspective projection maps depths so that 1 / depth is linear in the buffer: 1 is near, 0 is far.
        depths = NEAREST * FARTHEST / (NEAREST + nearness[::-1].astype(np.float64) * (FARTHEST - NEAREST))
        return DepthPicture(colours[::-1].copy(), np.where(nearness[::-1] > 0.0, depths, np.inf).astype(np.float32))

    def close(self) -> None:
        """Free what OpenGL holds."""
        self._free()


def _free(context: Any, drawing: Any) -> None:
    """Free a drawing in its own context: in another one, OpenGL would free what has the same numbers there."""
    context.make_current()
    drawing.free()
    context.free()

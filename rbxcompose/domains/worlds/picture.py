"""A picture of a world from above: its map, what stands and moves in it, where robots start, its places."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator, Sequence
from html import escape

from rbxcompose.base.arrays import Array, Bytes, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.body.meshes import need
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap
from rbxcompose.domains.worlds.shapes import CircleFootprint, Footprint
from rbxcompose.domains.worlds.world import no_walls
from rbxcompose.domains.worlds.world_file import WorldFile

LONGEST = 1000  # [pixels] of the longer side
MARGIN = 0.5  # [m] around everything
LETTERS = 14  # [pixels]
WALL, UNKNOWN_GREY, GROUND, INK, ROBOT, STANDING = "#303030", "#c8c8c8", "#ffffff", "#202020", "#1f6fd6", "#9a8f80"
_COLOUR = re.compile(r"[a-z]{3,30}|#([0-9a-fA-F]{3}){1,2}")
_ROUND = 48  # corners of a circle
_ARROW = np.array([(0.25, 0.0), (-0.15, 0.15), (-0.07, 0.0), (-0.15, -0.15)])  # [m]
_DOT, _POINTER = 0.08, 0.25  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class DrawnLine:
    """A line or, if it is filled, an area: points (n, 2) in `map` [m]."""

    points: Array
    colour: str
    is_filled: bool = False
    is_dashed: bool = False


@dataclass(frozen=True, slots=True)
class DrawnLabel:
    """A word beside a point of `map`; the point is `rows` lines above its middle."""

    point: tuple[float, float]
    text: str
    rows: float


def marks_of(world: WorldFile) -> Iterator[DrawnLine | DrawnLabel]:
    """Yield what is drawn over the map, the lowest first."""
    for name, thing in world.objects.items():
        shape, colour = thing.placed(name), _known(thing.colour, STANDING)
        if shape.path is not None:
            points = np.array(shape.path.points)[:, 1:]
            yield DrawnLine(points, colour, is_dashed=True)
        at = shape.pose_at(0.0)
        for footprint in shape.outlines:
            outline = placed(_corners(footprint), at)
            yield DrawnLine(outline, colour, is_filled=True)
            yield DrawnLine(np.concatenate((outline, outline[:1])), INK)
        yield DrawnLabel((at.x, at.y), name, 0.0)
    for name, pose in world.spawn.items():
        yield DrawnLine(placed(_ARROW, pose), ROBOT, is_filled=True)
        yield DrawnLabel((pose.x, pose.y), name, -1.3)
    for name, place in world.places.items():
        pose = Pose2(place.x, place.y, place.heading)
        yield DrawnLine(placed(np.array([(0.0, 0.0), (_POINTER, 0.0)]), pose), INK)
        dot = placed(_corners(CircleFootprint(_DOT)), pose)
        yield DrawnLine(dot, _known(place.colour, INK), is_filled=True)
        yield DrawnLine(np.concatenate((dot, dot[:1])), INK)
        yield DrawnLabel((pose.x, pose.y), name, 1.3)


def placed(points: Array, pose: Pose2) -> Array:
    """Return points (n, 2) [m] of the frame of a pose in the frame in which the pose is."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return np.asarray(points @ np.array([(cos, sin), (-sin, cos)]) + (pose.x, pose.y))


def _corners(footprint: Footprint) -> Array:
    if isinstance(footprint, CircleFootprint):
        turns = np.linspace(0.0, math.tau, _ROUND, endpoint=False)
        return footprint.radius * np.stack((np.cos(turns), np.sin(turns)), -1)
    return np.array(footprint.points)


def _known(colour: str, otherwise: str) -> str:
    """Return a colour of a manifest if it is a word or #rrggbb, as browsers have them."""
    return colour if _COLOUR.fullmatch(colour) else otherwise


@dataclass(frozen=True, slots=True)
class PictureView:
    """From `map` to pixels: the left upper corner [m], and pixels per metre."""

    left: float
    top: float
    scale: float
    width: int
    height: int

    def pixels(self, points: Array) -> Array:
        """Return points (..., 2) of `map` [m] as pixels, counted from the left upper corner."""
        return (np.asarray(points) - (self.left, self.top)) * (self.scale, -self.scale)


def view_of(world: WorldFile, marks: Sequence[DrawnLine | DrawnLabel]) -> PictureView:
    """Return the view that shows the map and all marks, with a margin."""
    points = [mark.points for mark in marks if isinstance(mark, DrawnLine)]
    if world.grid is not no_walls():
        rows, columns = world.grid.cells.shape
        points.append(world.grid.to_points([(0, 0), (columns, 0), (0, rows), (columns, rows)]))
    whole = np.concatenate(points or [np.zeros((1, 2))])
    low, high = whole.min(0) - MARGIN, whole.max(0) + MARGIN
    scale = LONGEST / float((high - low).max())
    width, height = np.ceil((high - low) * scale).astype(int)
    return PictureView(float(low[0]), float(high[1]), scale, int(width), int(height))


def svg_of(world: WorldFile) -> str:
    """Return the picture as SVG."""
    marks = list(marks_of(world))
    view = view_of(world, marks)
    return "\n".join(
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {view.width} {view.height}"'
            f' font-family="sans-serif" font-size="{LETTERS}" text-anchor="middle">',
            f"<title>{escape(world.name)}</title>",
            f'<rect width="{view.width}" height="{view.height}" fill="{GROUND}"/>',
            *_svg_map(world.grid, view),
            *(_svg_mark(mark, view) for mark in marks),
            "</svg>",
            "",
        )
    )


def _svg_map(grid: GridMap, view: PictureView) -> Iterator[str]:
    """Yield the cells of each kind as one path of rows, in a frame of cells."""
    if grid is no_walls():
        return
    (x, y), (along_x, along_y), (up_x, up_y) = view.pixels(grid.to_points([(0, 0), (1, 0), (0, 1)]))
    frame = f"matrix({along_x - x:.6g} {along_y - y:.6g} {up_x - x:.6g} {up_y - y:.6g} {x:.6g} {y:.6g})"
    for colour, chosen in ((UNKNOWN_GREY, grid.cells < 0), (WALL, grid.cells >= SOLID)):
        edges = np.diff(np.pad(chosen, ((0, 0), (1, 1))).astype(np.int8), axis=1)
        (rows, starts), (_, ends) = np.nonzero(edges == 1), np.nonzero(edges == -1)
        runs = zip(rows.tolist(), starts.tolist(), ends.tolist(), strict=True)
        path = "".join(f"M{start} {row}h{end - start}v1h{start - end}z" for row, start, end in runs)
        yield f'<path transform="{frame}" fill="{colour}" shape-rendering="crispEdges" d="{path}"/>'


def _svg_mark(mark: DrawnLine | DrawnLabel, view: PictureView) -> str:
    if isinstance(mark, DrawnLabel):
        x, y = view.pixels(np.array(mark.point))
        return (
            f'<text x="{x:.1f}" y="{y + (0.35 - mark.rows) * LETTERS:.1f}" stroke="{GROUND}" stroke-width="3"'
            f' paint-order="stroke" fill="{INK}">{escape(mark.text)}</text>'
        )
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in view.pixels(mark.points))
    if mark.is_filled:
        return f'<polygon points="{points}" fill="{mark.colour}"/>'
    dashes = ' stroke-dasharray="6 4"' if mark.is_dashed else ""
    return f'<polyline points="{points}" fill="none" stroke="{mark.colour}" stroke-width="1.5"{dashes}/>'


def png_of(world: WorldFile) -> bytes:
    """Return the picture as PNG.

    Raises:
        MissingLibraryError: if pillow is missing.
    """
    need("pictures", "PIL")
    from PIL import Image, ImageDraw, ImageFont

    marks = list(marks_of(world))
    view = view_of(world, marks)
    picture = Image.fromarray(_ground(world.grid, view))
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(LETTERS)
    for mark in marks:
        if isinstance(mark, DrawnLabel):
            x, y = view.pixels(np.array(mark.point))
            at = (float(x), float(y - mark.rows * LETTERS))
            pen.text(at, mark.text, INK, font, "mm", stroke_width=2, stroke_fill=GROUND)
            continue
        points = [(float(x), float(y)) for x, y in view.pixels(mark.points)]
        try:
            pen.line(points, mark.colour, 2) if not mark.is_filled else pen.polygon(points, mark.colour)
        except ValueError:  # a word that browsers do not have either
            pen.polygon(points, STANDING)
    out = io.BytesIO()
    picture.save(out, "PNG", optimize=True)
    return out.getvalue()


def _ground(grid: GridMap, view: PictureView) -> Bytes:
    """Return the map, (height, width, 3): each pixel has the colour of the cell at its middle."""
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    points = np.stack((x, -y), -1) / view.scale + (view.left, view.top)
    column, row = np.moveaxis(np.floor(grid.to_cells(points)).astype(np.intp), -1, 0)
    rows, columns = grid.cells.shape
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    cells = np.where(inside, grid.cells[row.clip(0, rows - 1), column.clip(0, columns - 1)], 0)
    greys = np.full(cells.shape, 255, np.uint8)
    greys[cells < 0], greys[cells >= SOLID] = int(UNKNOWN_GREY[1:3], 16), int(WALL[1:3], 16)
    return np.repeat(greys[..., None], 3, axis=-1)

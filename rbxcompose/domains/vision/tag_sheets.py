"""Tags on paper: true to size, with marks to cut along and the name of each."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rbxcompose.domains.worlds.tag_pictures import tag_picture, with_margin

if TYPE_CHECKING:
    from PIL.Image import Image

PAPERS = {"a3": (0.297, 0.420), "a4": (0.210, 0.297), "letter": (0.2159, 0.2794)}  # [m]
DPI = 300
MARGIN = 0.005  # that printers leave white [m]
INCH = 0.0254  # [m]
LABEL = 0.006  # height of the line below a tag [m]
MARK = 0.004  # length of a cutting mark [m]


def sheets(numbers: Sequence[int], family: str, size: float, paper: str) -> list[Image]:
    """Return pages with tags whose black squares have a side of `size` [m], row by row.

    Each has a white margin of one cell, without which it is not found, and marks at the corners of that.

    Raises:
        KeyError: if there is no such family or paper.
        ValueError: if the family has no such tag, or one does not fit on the paper.
    """
    from PIL import Image, ImageDraw, ImageFont

    cells = {number: tag_picture(number, family) for number in numbers}
    page_size, side = PAPERS[paper], with_margin(size, family)
    pages = []
    for places in tag_places(numbers, family, size, paper):
        page = Image.new("1", (pixels_of(page_size[0]), pixels_of(page_size[1])), 1)
        pen, font = ImageDraw.Draw(page), ImageFont.load_default(pixels_of(LABEL * 0.6))
        for number, (left, top) in places.items():
            wide = pixels_of(side)
            painted = Image.fromarray(cells[number]).resize((wide, wide), Image.Resampling.NEAREST)
            page.paste(painted, (pixels_of(left), pixels_of(top)))
            for x in (left, left + side):
                for y in (top, top + side):
                    across_x, across_y = (x - MARK / 2, y, x + MARK / 2, y), (x, y - MARK / 2, x, y + MARK / 2)
                    for line in (across_x, across_y):
                        pen.line([pixels_of(each) for each in line], 0, 1)
            words = f"{family}  {number}  {size * 100:g} cm"
            pen.text((pixels_of(left + MARK), pixels_of(top + side + LABEL * 0.2)), words, 0, font)
        pages.append(page)
    return pages


def tag_places(numbers: Sequence[int], family: str, size: float, paper: str) -> list[dict[int, tuple[float, float]]]:
    """Return where the upper left corner of each tag with its margin is, on each page [m].

    Raises:
        KeyError: if there is no such family or paper.
        ValueError: if one does not fit on the paper.
    """
    side = with_margin(size, family)
    columns, rows = (
        int((room - 2 * MARGIN) / (side + below) + 1e-9)
        for room, below in zip(PAPERS[paper], (0.0, LABEL), strict=True)
    )
    if not (columns and rows):
        raise ValueError(f"a tag of {size * 100:g} cm needs a paper of {(side + 2 * MARGIN) * 100:g} cm at least")
    return [
        {
            number: (MARGIN + place % columns * side, MARGIN + place // columns * (side + LABEL))
            for place, number in enumerate(numbers[first : first + columns * rows])
        }
        for first in range(0, len(numbers), columns * rows)
    ]


def pixels_of(length: float) -> int:
    """Return a length [m] in pixels of a page."""
    return round(length / INCH * DPI)


def pdf_of(pages: Sequence[Image]) -> bytes:
    """Return pages as a PDF."""
    written = io.BytesIO()
    pages[0].save(written, "PDF", resolution=DPI, save_all=True, append_images=list(pages[1:]))
    return written.getvalue()


def png_of(page: Image) -> bytes:
    """Return a page as a PNG that knows how large it is."""
    written = io.BytesIO()
    page.save(written, "PNG", dpi=(DPI, DPI), optimize=True)
    return written.getvalue()

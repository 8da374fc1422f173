"""Print tags for cameras to find, true to size.

Exit codes: 0 fine, 1 a library is missing, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import io
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import suggest
from rbxcompose.base.units import LENGTH
from rbxcompose.commands import options
from rbxcompose.commands.console import emit, misused, refuse
from rbxcompose.domains.body.meshes import MissingLibraryError, need
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, FAMILIES, tag_picture, with_margin

if TYPE_CHECKING:
    from PIL.Image import Image

GROUP = "write"
PDF, PNG = ".pdf", ".png"
MOST = 1000  # tags
PAPERS = {"a3": (0.297, 0.420), "a4": (0.210, 0.297), "letter": (0.2159, 0.2794)}  # [m]
DPI = 300
MARGIN = 0.005  # that printers leave white [m]
INCH = 0.0254  # [m]
LABEL = 0.006  # height of the line below a tag [m]
MARK = 0.004  # length of a cutting mark [m]
_RANGE = re.compile(r"(\d{1,6})(?:-(\d{1,6}))?")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    tags = options.argument("tags", nargs="+", type=numbers, metavar="N|N-M", help="numbers of tags, such as 0-5 7")
    words = "the side of the black square, without the white margin (default: 10 cm)"
    size = options.argument("--size", type=options.positive(LENGTH), default=0.1, metavar="S", help=words)
    named = f"the family (default: {DEFAULT_FAMILY})"
    family = options.argument("--family", type=one_of(FAMILIES), default=DEFAULT_FAMILY, metavar="F", help=named)
    paper = options.argument("--paper", choices=tuple(PAPERS), default="a4", help="the paper (default: a4)")
    out = options.out_option("a .pdf, or a .png of what fits on one page (default: tags.pdf)", default="tags.pdf")
    actions = (options.Subcommand("print", "write pages to print", _print, (tags, size, family, paper, out)),)
    options.add_actions(parser, actions)


run = options.run_action


def numbers(text: str) -> list[int]:
    """Read `7` or `0-5`."""
    found = _RANGE.fullmatch(text)
    first, last = (int(found[1]), int(found[2] or found[1])) if found else (0, -1)
    if not 0 <= last - first < MOST:
        raise argparse.ArgumentTypeError(f"'{text}' is no number of a tag, and no range such as 0-5 of up to {MOST}")
    return list(range(first, last + 1))


def one_of(names: object) -> Callable[[str], str]:
    """Return a reader of one of some names."""
    known = list(names)  # type: ignore[call-overload]

    def read(text: str) -> str:
        if text not in known:
            raise argparse.ArgumentTypeError(f"there is no '{text}': {suggest(text, known, 'there are')}")
        return text

    return read


def _print(arguments: argparse.Namespace) -> int:
    if not arguments.out.endswith((PDF, PNG)):
        return misused("tags", f"pages are written as {PDF} or {PNG}, unlike '{arguments.out}'")
    wanted = list(dict.fromkeys(number for found in arguments.tags for number in found))
    try:
        need("tags", "cv2", "PIL", extra="vision")
        pages = sheets(wanted, arguments.family, arguments.size, arguments.paper)
    except MissingLibraryError as error:
        return refuse(error.finding)
    except ValueError as error:
        return misused("tags", str(error))
    out = Path(arguments.out)
    if out.suffix == PNG and len(pages) > 1:
        return misused("tags", f"a {PNG} has one page, and {len(wanted)} tags need {len(pages)}: write a {PDF}")
    try:
        replace_file(out.resolve(), pdf_of(pages) if out.suffix == PDF else png_of(pages[0]))
    except OSError as error:
        return misused("tags", f"'{out}' cannot be written: {error.strerror}")
    many = f"{len(wanted)} tags on {len(pages)} pages" if len(pages) > 1 else "one page"
    emit(f"wrote {out}: {many}; print it at 100 %, and measure a black square")
    return 0


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

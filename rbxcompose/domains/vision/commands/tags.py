"""Print tags for cameras to find, true to size.

Exit codes: 0 fine, 1 a library is missing, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import suggest
from rbxcompose.base.units import LENGTH
from rbxcompose.commands import options
from rbxcompose.commands.console import emit, misused, refuse
from rbxcompose.domains.body.meshes import MissingLibraryError, need
from rbxcompose.domains.vision.tag_sheets import PAPERS, pdf_of, png_of, sheets
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, FAMILIES

GROUP = "write"
PDF, PNG = ".pdf", ".png"
MOST = 1000  # tags
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
